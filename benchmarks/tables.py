# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was measured as tables for people, and as plain data."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass
from typing import Any

from benchmarks.accuracy import ERROR, ROUGH_RAYS, WorkPrecision
from benchmarks.asking import CONTESTANTS
from benchmarks.targets import Measured, further_event_s, judge
from benchmarks.timing import Timing, number, summary

__all__ = ["Section", "plain", "sections", "work_sections"]


@dataclass(frozen=True)
class Section:
    """A table under a heading, with a sentence about how to read it."""

    title: str
    note: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def to_markdown(self) -> str:
        """Heading, note and a table whose columns line up also as plain text."""
        cells = [self.header, *self.rows]
        width = [max(len(row[i]) for row in cells) for i in range(len(self.header))]
        lines = ["| " + " | ".join(c.ljust(w) for c, w in zip(row, width, strict=True)) + " |" for row in cells]
        lines.insert(1, "|" + "|".join("-" * (w + 2) for w in width) + "|")
        return "\n".join([f"## {self.title}", "", *([self.note, ""] if self.note else []), *lines])


def sections(measured: Measured) -> list[Section]:
    """All tables, the figures to reach first."""
    return [
        Section(
            "Figures to reach", "Medians. A figure is met only if every scene meets it.",
            ("what", "target", "measured", "met"),
            tuple((j.what, j.target, j.measured, j.met) for j in judge(measured)),
        ),
        _speeds(measured),
        _ratios(measured),
        _sizes(measured),
        _columns(measured),
        _openings(measured),
        _answers(measured),
        _results(measured),
        _unused(measured),
        _effects(measured),
        _exact(measured),
        *work_sections(measured.work_precision),
    ]  # fmt: skip


def _speeds(m: Measured) -> Section:
    rows = []
    for s in m.speeds:
        for what, timing in (("trace", s.trace), ("trace and store", s.store)):
            rows.append(
                (
                    s.scene, str(s.threads), what, number(s.rays), number(s.segments),
                    summary(timing), summary(timing.rate(s.rays), 1e-3), summary(timing.rate(s.segments), 1e-6),
                )
            )  # fmt: skip
    note = (
        "Median (least to most), in eight portions. A segment starts at every event that is no end. Trace: simulated "
        "and thrown away. Trace and store: every ray on disk, compressed; without compiling the scene, which takes "
        + "; ".join(f"{summary(s.prepare, 1e3)} ms for {s.scene}" for s in m.speeds if s.threads == m.speeds[0].threads)
        + "."
    )
    header = ("scene", "threads", "what", "rays", "segments", "s", "1000 rays/s", "million segments/s")
    return Section("Simulating", note, header, tuple(rows))


def _ratios(m: Measured) -> Section:
    rows = [
        (
            s.scene, str(s.threads), number(s.searches), summary(s.embree), summary(s.trace.over(s.embree)),
            summary(s.store.over(s.embree)), summary(s.store.over(s.trace)),
        )
        for s in m.speeds
    ]  # fmt: skip
    note = (
        "The bare loop hands to Embree, portion by portion on as many threads, the very batches of float32 rays that "
        "the tracer handed to it. All three take turns; ratios are taken round by round."
    )
    header = (
        "scene", "threads", "searches", "bare Embree, s", "trace / Embree", "trace and store / Embree", "store / trace",
    )  # fmt: skip
    return Section("Against a bare Embree loop over the same rays", note, header, tuple(rows))


def _sizes(m: Measured) -> Section:
    rows = [
        (
            s.scene, str(s.bands), str(s.detectors), number(s.rays), number(s.segments), number(s.crossings),
            number(s.bytes),
            number(s.per_segment(s.bytes)), number(s.bytes / max(s.events, 1)),
        )
        for s in m.sizes
    ]  # fmt: skip
    header = ("scene", "bands", "detectors", "rays", "segments", "crossings", "bytes", "B a segment", "B an event")
    return Section("Size on disk", "All files of all portions.", header, tuple(rows))


def _columns(m: Measured) -> Section:
    keys = list(dict.fromkeys(key for size in m.sizes for key in size.columns))
    rows = [
        (*key, *(number(s.per_segment(s.columns[key])) if key in s.columns else "" for s in m.sizes)) for key in keys
    ]
    header = ("file", "column", *(f"{s.scene}, {s.bands} bands, {s.detectors} detectors" for s in m.sizes))
    return Section("Bytes a segment by column", "Compressed.", header, tuple(rows))


def _openings(m: Measured) -> Section:
    rows = [(o.scene, number(o.rays), summary(o.open, 1e3), summary(o.info_process, 1e3)) for o in m.openings]
    header = ("scene", "rays", "RayMap.open, ms", "process `raymaps info`, ms")
    return Section("Opening a map", "Files in the system's cache.", header, tuple(rows))


def _answers(m: Measured) -> Section:
    rows = [
        (a.criterion.replace("|", "\\|"), a.scene, number(a.rays), number(a.found))
        + tuple(summary(a.timings[who], 1e3) for who in CONTESTANTS)
        for a in m.answers
    ]
    further = {a.scene: further_event_s(m.answers, a.scene) for a in m.answers}
    note = (
        "ms. Files: from the files as they lie there, opening included; memory: columns or tables loaded. All count "
        "the same rays, or the run fails; Ray Maps also gives their numbers and their flux with its error. Ray Maps "
        "answers on one thread; DuckDB and Polars may use all processors, and each question was given to them in "
        "several forms of which the fastest is timed. Each event after the first costs Ray Maps "
        + "; ".join(f"{number(1e3 * s)} ms ({scene})" for scene, s in further.items())
        + "."
    )
    return Section("Asking", note, ("criterion", "scene", "rays", "found", *CONTESTANTS), tuple(rows))


def _results(m: Measured) -> Section:
    rows = [
        (r.name, r.scene, r.amount, summary(r.first, 1e3) if r.first else "", summary(r.again, 1e3)) for r in m.results
    ]
    header = ("what", "scene", "amount", "first, with opening, ms", "columns loaded, ms")
    return Section("Results", "", header, tuple(rows))


def _unused(m: Measured) -> Section:
    rows = [
        (
            u.what, f"{100 * (u.ratio.median - 1):+.1f} ± {100 * u.ratio.standard_error:.1f}",
            "the same" if u.same_content else "another",
        )
        for u in m.unused
    ]  # fmt: skip
    note = (
        "The glass ball in a white box, with a black safe in a corner: how much more CPU time tracing takes on one "
        "thread than in the plain scene, median of rounds in which each takes its turn twice between two of the plain "
        "one, with the standard error. The stage of an effect runs only where a ray meets what it acts on."
    )
    return Section(
        "What a scene pays for effects that it does not use", note, ("what", "more time, %", "rays"), tuple(rows)
    )


def _effects(m: Measured) -> Section:
    rows = [
        (
            c.effect, summary(c.rays_per_s, 1e-3), number(c.segments_per_ray), summary(c.ns_per_segment),
            summary(c.over_plain), f"{100 * c.share:.1f} %",
        )
        for c in m.effects
    ]  # fmt: skip
    note = (
        "The same scene with the effect on the ball, traced on one thread. The rays differ, so compare the time of a "
        "segment. The share is that of the effect's own stages; spectral light makes all stages longer."
    )
    header = ("effect", "1000 rays/s", "segments a ray", "ns a segment", "over none", "own share")
    return Section("What each effect costs", note, header, tuple(rows))


def _exact(m: Measured) -> Section:
    cost = {(c.lens, c.tolerance_mm): c.ratio for c in m.exact_costs}
    rows = []
    for e in m.focus_errors:
        ratio = cost.get((e.lens, e.tolerance_mm)) if e.surfaces == "exact" else None
        rows.append(
            (
                e.lens, e.surfaces, f"{e.tolerance_mm:g}", number(e.triangles), f"{e.error_mm:.1e}",
                summary(e.s_per_million_rays), number(e.prepare_s),
                f"{100 * (ratio.median - 1):+.0f} ± {100 * ratio.standard_error:.0f}" if ratio else "",
            )
        )  # fmt: skip
    note = (
        "A lens of 30 mm in a parallel beam. The error is the root mean square, over rays, of how far a ray meets the "
        "plane of best focus from where a sequential trace in float64 says. The tolerance is how far triangles lie "
        "from the surface. Traced on one thread; preparing is compiling the scene and building Embree's tree. The last "
        "column is the CPU time over that on the same triangles alone, median of rounds in which both take turns, with "
        "the standard error."
    )
    header = (
        "lens", "surfaces", "tolerance, mm", "triangles", "error, mm", "s a million rays", "preparing, s",
        "over the same triangles, %",
    )  # fmt: skip
    return Section("Exact surfaces", note, header, tuple(rows))


def work_sections(work: WorkPrecision) -> list[Section]:
    """Tables of what errors cost."""
    return [_precisions(work), _gains(work), _foretold(work), _stores(work)]


def _precisions(work: WorkPrecision) -> Section:
    rows = [
        (
            p.scene, p.choice, p.sampling, number(p.rays), str(p.seeds),
            f"{_percent(p.error)} ± {_percent(p.error_stderr, 1)}", number(1e3 * p.run_s),
        )
        for p in work.precisions
    ]  # fmt: skip
    note = (
        "Error: the root mean square over runs with seeds of their own, against the known flux; chance is told by the "
        "16 independent parts of each run, and what is wrong with a choice (facets, few bands) is in it. Traced on one "
        "thread. A tolerance is how far triangles lie from the surface."
    )
    header = ("scene", "surfaces or bands", "sampling", "rays", "runs", "error, %", "median, ms")
    return Section("Error against time", note, header, tuple(rows))


def _gains(work: WorkPrecision) -> Section:
    rows = [
        (
            g.scene, "smooth" if g.is_smooth else "rough", number(g.random_s), number(g.sobol_s),
            f"{number(g.ratio)} ± {number(g.ratio_stderr, 2)}",
        )
        for g in work.gains
    ]  # fmt: skip
    note = (
        f"Seconds on one thread to an error of {100 * ERROR:g} %, and their ratio with its standard error; exact "
        "surfaces, the most bands. Smooth: by powers of the number of rays that are fitted to the errors above. Rough: "
        f"by the variances of runs of {ROUGH_RAYS} rays that take turns, of independent rays by their spread, of "
        "Sobol' points by their replicates."
    )
    header = ("scene", "", "random, s", "sobol, s", "sobol / random")
    return Section("What Sobol' points gain", note, header, tuple(rows))


def _foretold(work: WorkPrecision) -> Section:
    rows = [
        (
            f.scene, f.choice, f"{_percent(f.error)}", number(f.foretold_rays), number(f.rays),
            number(f.rays / f.foretold_rays), number(f.foretold_s), number(f.tracing_s),
            number(f.tracing_s / f.foretold_s),
        )
        for f in work.foretold
    ]  # fmt: skip
    note = (
        "What `raymaps accuracy` foretells for an error by a pilot of some seconds, and what runs of so many rays (of "
        "Sobol' points six) show that it takes; on all threads, stored."
    )
    header = (
        "scene", "choice", "error, %", "rays, foretold", "needed", "factor", "s, foretold", "needed", "factor",
    )  # fmt: skip
    return Section("Forecasts", note, header, tuple(rows))


def _stores(work: WorkPrecision) -> Section:
    rows = [
        (
            s.scene, s.light, str(s.bands), summary(s.trace, 1e3), summary(s.store, 1e3), summary(s.raw_write, 1e3),
            number(s.raw_bytes / s.segments), summary(s.write, 1e3), number(s.bytes / s.segments),
        )
        for s in work.stores
    ]  # fmt: skip
    note = (
        f"{number(work.stores[0].rays)} rays on one thread; ms, and bytes a segment. Maps are always compressed. For "
        "comparison their columns are written a second time: raw as numbers of full width, and as maps are written. "
        "Light that several events have alike is stored once, in raw files too."
    )
    header = (
        "scene", "light", "bands", "trace", "trace and store", "write raw", "raw, B", "write compressed",
        "compressed, B",
    )  # fmt: skip
    return Section("Ways to store light", note, header, tuple(rows))


def _percent(error: float, digits: int = 2) -> str:
    return number(100 * error, digits)


def plain(value: Any) -> Any:
    """Measurements as JSON has them."""
    if isinstance(value, Timing):
        return value.to_dict()
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, dict):
        return {".".join(key) if isinstance(key, tuple) else key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value
