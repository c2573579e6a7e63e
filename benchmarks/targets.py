# SPDX-License-Identifier: LGPL-2.1-or-later
"""The figures that the project set itself, against what was measured: a figure is met only if every scene meets it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from benchmarks.accuracy import WorkPrecision
from benchmarks.asking import Answer, Opening
from benchmarks.effects import EffectCost, UnusedEffect
from benchmarks.exact import ExactCost, FocusError
from benchmarks.files import Size
from benchmarks.results import ResultTime
from benchmarks.scenes import SPECTRAL_BANDS
from benchmarks.simulating import Speed
from benchmarks.timing import number

__all__ = ["Judgement", "Measured", "judge"]

MILLION = 1_000_000


@dataclass(frozen=True)
class Measured:
    """Everything that was measured."""

    speeds: tuple[Speed, ...]
    sizes: tuple[Size, ...]
    openings: tuple[Opening, ...]
    answers: tuple[Answer, ...]
    results: tuple[ResultTime, ...]
    unused: tuple[UnusedEffect, ...]
    effects: tuple[EffectCost, ...]
    focus_errors: tuple[FocusError, ...]
    exact_costs: tuple[ExactCost, ...]
    work_precision: WorkPrecision


@dataclass(frozen=True)
class Judgement:
    """A figure to reach, what was measured, and whether it is met."""

    what: str
    target: str
    measured: str
    met: str


def judge(m: Measured) -> list[Judgement]:
    """A row a figure; none is judged on maps of fewer rays than the figures speak of."""
    rows = _rows(m)
    if min(opening.rays for opening in m.openings) < MILLION:
        return [row if row.met.startswith("not ") else replace(row, met="not judged: too few rays") for row in rows]
    return rows


def _rows(m: Measured) -> list[Judgement]:
    most_threads = max(speed.threads for speed in m.speeds)
    fast = [speed for speed in m.speeds if speed.threads == most_threads]
    one_event = [answer for answer in m.answers if answer.n_events == 1 and not answer.is_area]
    binned = [result for result in m.results if result.name == "detector re-binned"]
    served = [result for result in m.results if "serve" in result.name]
    return [
        _row(
            f"simulate and store against a bare Embree loop over the same rays, {most_threads} threads", "1.5 times",
            [(s.scene, s.store.over(s.embree).median) for s in fast], 1.5, " times",
        ),
        _row(
            "file, RGB", "8 B a segment",
            [(f"{s.scene}, {s.detectors} detectors", s.per_segment(s.bytes)) for s in m.sizes if s.bands == 3],
            8.0, " B",
        ),
        _row(
            f"file, {SPECTRAL_BANDS} wavelengths", "8.2 B a segment",
            [(s.scene, s.per_segment(s.bytes)) for s in m.sizes if s.bands == SPECTRAL_BANDS], 8.2, " B",
        ),
        _row(
            "an effect that a scene does not use, against the scene without it", "2 % more time at most",
            [(u.what, 100 * (u.ratio.median - 1)) for u in m.unused], 2.0, " %",
        ),
        Judgement(
            "the same, its rays", "the same content hash",
            "the same" if all(u.same_content for u in m.unused) else "another",
            "yes" if all(u.same_content for u in m.unused) else "no",
        ),
        _row(
            "focus of a lens on exact surfaces and the coarsest triangles, its error over that on the finest triangles",
            "less than 1", [(lens, _error_over_finest(m, lens)) for lens in _lenses(m)], 1.0, " times",
        ),
        _row(
            "the same, its time over that on the coarsest triangles whose error is within ten times of the finest's",
            "less than 1", [(lens, _time_over_triangles(m, lens)) for lens in _lenses(m)], 1.0, " times",
        ),
        _row(
            "exact surfaces against the same triangles without them", "25 % more time at most",
            [(f"{c.lens}, {c.tolerance_mm:g} mm", 100 * (c.ratio.median - 1)) for c in m.exact_costs], 25.0, " %",
        ),
        *_accuracy_rows(m.work_precision),
        _row(
            f"open a map of {_many(o.rays for o in m.openings)} rays, in process", "50 ms",
            [(o.scene, 1e3 * o.open.median) for o in m.openings], 50.0, " ms",
        ),
        _row(
            f"criterion of one event, {_many(a.rays for a in one_event)} rays, in memory", "10 ms",
            [(a.scene, 1e3 * a.timings["Ray Maps, memory"].median) for a in one_event], 10.0, " ms",
        ),
        *(
            _row(
                f"the same, {ours} against the faster of DuckDB and Polars {theirs}", "20 times faster",
                [(a.scene, _lead(a, ours_key, where)) for a in one_event], 20.0, " times", at_least=True,
            )
            for ours, ours_key, theirs, where in (
                ("in memory", "memory", "over the files", "files"),
                ("over the files", "files", "over the files", "files"),
                ("in memory", "memory", "in memory", "memory"),
            )
        ),
        _row(
            "each further event", "1 ms",
            [(scene, 1e3 * further_event_s(m.answers, scene)) for scene in _scenes(m)], 1.0, " ms",
        ),
        _row(
            "detector re-binned, a million crossings", "20 ms",
            [
                (f"{r.scene}, {r.amount}", 1e3 * r.again.median * MILLION / max(r.amount_number, 1))
                for r in binned
            ],
            20.0, " ms a million",
        ),
        Judgement(
            "from pressing Apply to 10 000 rays drawn in FreeCAD", "500 ms",
            "without FreeCAD's part: " + _list([(r.scene, 1e3 * r.again.median) for r in served], " ms"),
            "not measured here",
        ),
    ]  # fmt: skip


def _accuracy_rows(work: WorkPrecision) -> list[Judgement]:
    by_choice = [(f"{f.scene}, {f.choice}", f) for f in work.foretold]
    return [
        _row(
            "rays to an error, foretold and needed: the larger over the smaller", "1.5 times",
            [(what, _factor(f.rays, f.foretold_rays)) for what, f in by_choice], 1.5, " times",
        ),
        _row(
            "the same, time of tracing", "1.5 times",
            [(what, _factor(f.tracing_s, f.foretold_s)) for what, f in by_choice], 1.5, " times",
        ),
        _row(
            "time to 0.1 % with Sobol' points over that with independent rays, smooth scenes", "a tenth at most",
            [(g.scene, g.ratio) for g in work.gains if g.is_smooth], 0.1, " times",
        ),
        _row(
            "the same to any error, rough scenes", "1.1 at most",
            [(f"{g.scene}, ± {number(g.ratio_stderr, 2)}", g.ratio) for g in work.gains if not g.is_smooth], 1.1,
            " times",
        ),
    ]  # fmt: skip


def _factor(a: float, b: float) -> float:
    return max(a / b, b / a)


def _lenses(m: Measured) -> list[str]:
    return list(dict.fromkeys(error.lens for error in m.focus_errors))


def _coarsest_exact(m: Measured, lens: str) -> FocusError:
    of_lens = [e for e in m.focus_errors if e.lens == lens and e.surfaces == "exact"]
    return min(of_lens, key=lambda e: e.triangles)


def _faceted(m: Measured, lens: str) -> list[FocusError]:
    """From the coarsest to the finest."""
    return sorted((e for e in m.focus_errors if e.lens == lens and e.surfaces == "faceted"), key=lambda e: e.triangles)


def _error_over_finest(m: Measured, lens: str) -> float:
    return _coarsest_exact(m, lens).error_mm / _faceted(m, lens)[-1].error_mm


def _time_over_triangles(m: Measured, lens: str) -> float:
    faceted = _faceted(m, lens)
    rival = next(e for e in faceted if e.error_mm <= 10 * faceted[-1].error_mm)
    exact = _coarsest_exact(m, lens)
    return exact.s_per_million_rays.over(rival.s_per_million_rays).median


def further_event_s(answers: Iterable[Answer], scene: str) -> float:
    """Mean time that each event after the first adds, in memory."""
    of_scene = [answer for answer in answers if answer.scene == scene and not answer.is_area]
    first, last = of_scene[0], of_scene[-1]
    more = last.timings["Ray Maps, memory"].median - first.timings["Ray Maps, memory"].median
    return more / (last.n_events - first.n_events)


def _lead(answer: Answer, ours: str, theirs: str) -> float:
    """How many times faster than the faster rival."""
    mine = answer.timings[f"Ray Maps, {ours}"]
    return min(answer.timings[f"{rival}, {theirs}"].over(mine).median for rival in ("DuckDB", "Polars"))


def _row(
    what: str, target: str, figures: list[tuple[str, float]], limit: float, unit: str, *, at_least: bool = False
) -> Judgement:
    good = [figure >= limit if at_least else figure <= limit for _, figure in figures]
    met = "yes" if all(good) else "no" if not any(good) else f"in {sum(good)} of {len(good)}"
    return Judgement(what, target, _list(figures, unit), met)


def _list(figures: list[tuple[str, float]], unit: str) -> str:
    return "; ".join(f"{number(figure)}{unit} ({label})" for label, figure in figures)


def _scenes(m: Measured) -> list[str]:
    return list(dict.fromkeys(answer.scene for answer in m.answers))


def _many(rays: Iterable[int]) -> str:
    return " or ".join(f"{n:,}".replace(",", " ") for n in dict.fromkeys(rays))
