# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of the focus of a lens on triangles and on exact surfaces."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.exact import Bench, Surfaces
from benchmarks.timing import Timing, alternate
from docs.drawing.look import COLOURS, size
from tests.physics.lenses import Lens
from tests.physics.sequential import LensFace

__all__ = ["draw_exact"]

#: A cemented achromat of 100 mm in green light, and a beam 1.5° off its axis.
_LENSES = (
    Lens(LensFace(0, 1 / 62.8), LensFace(6, -1 / 45.7), 14, "crown"),
    Lens(LensFace(6, -1 / 45.7), LensFace(8.5, -1 / 128.2), 14, "flint"),
)
_MEDIA = {"crown": 1.5187, "flint": 1.6776}
_SPOTS: tuple[tuple[Surfaces, float], ...] = (("faceted", 1e-1), ("faceted", 1e-4), ("exact", 1e-1))
_TOLERANCES_MM = (1e-1, 1e-2, 1e-3, 1e-4)
_N_SPOT, _N_TIMED, _ROUNDS = 4000, 50_000, 5
#: Where the words of each point stand, in points from it, and which of their ends; the first two are close together.
_LABELS = (((-8, -4), "right"), ((0, -17), "center"), ((0, 9), "center"), ((0, 9), "center"))


def draw_exact(folder: Path) -> Figure:
    """Spot diagrams on coarse triangles, on fine ones and on exact surfaces; error against time."""
    benches = {
        (surfaces, tolerance): Bench(folder, _LENSES, tolerance, surfaces, media=_MEDIA, beam_mm=12.5, field_deg=1.5)
        for surfaces, tolerances in (("faceted", _TOLERANCES_MM), ("exact", (1e-1,)))
        for tolerance in tolerances
    }  # fmt: skip
    timings, _ = alternate(
        {f"{s} {t}": partial(b.trace, _N_TIMED) for (s, t), b in benches.items()},
        _ROUNDS, budget_s=60.0,
    )  # fmt: skip
    seconds = {key: timings[f"{key[0]} {key[1]}"].scaled(1e6 / _N_TIMED) for key in benches}
    figure = size(9.6, 7.6)
    above, below = figure.subfigures(2, 1, height_ratios=(1, 0.95))
    for axes, key, colour in zip(above.subplots(1, 3), _SPOTS, (*COLOURS[1:2] * 2, COLOURS[0]), strict=True):
        _draw_spot(axes, benches[key], seconds[key], colour)
    _draw_errors(below.subplots(), benches, seconds)
    return figure


def _draw_spot(axes: Axes, bench: Bench, seconds: Timing, colour: str) -> None:
    found, true = bench.spot_mm(_N_SPOT)
    found, true = 1e3 * (found - true.mean(axis=0)), 1e3 * (true - true.mean(axis=0))
    reach = 1.15 * max(np.quantile(np.abs(found), 0.98), np.abs(true).max())
    axes.plot(*found.T, ".", ms=1.6, color=colour)
    what = "exact surfaces" if bench.surfaces == "exact" else "facets"
    axes.set(
        title=f"{what}\n{_words(bench)}, {seconds.median:.1f} s", xlabel="µm", xlim=(-reach, reach),
        ylim=(-reach, reach), aspect="equal",
    )  # fmt: skip


def _words(bench: Bench) -> str:
    return f"{bench.n_triangles:,} triangles".replace(",", " ")


def _draw_errors(
    axes: Axes, benches: dict[tuple[Surfaces, float], Bench], seconds: dict[tuple[Surfaces, float], Timing]
) -> None:
    for surfaces, words, colour in (("faceted", "facets", COLOURS[1]), ("exact", "exact surfaces", COLOURS[0])):
        keys = [key for key in benches if key[0] == surfaces]
        error = [1e3 * benches[key].error_mm() for key in keys]
        axes.plot([seconds[key].median for key in keys], error, "o-", color=colour, label=words)
        for i, (key, mine) in enumerate(zip(keys, error, strict=True)):
            offset, side = _LABELS[i] if len(keys) > 1 else _LABELS[-1]
            axes.annotate(
                _words(benches[key]), (seconds[key].median, mine), xytext=offset, textcoords="offset points", ha=side,
                fontsize=10.5,
            )  # fmt: skip
    longest = max(timing.median for timing in seconds.values())
    axes.set(
        title="What a small error costs", yscale="log", xlabel="seconds for a million rays on one thread",
        ylabel="error of the focus in µm", xlim=(0, 1.15 * longest), ylim=(None, 1e6),
    )  # fmt: skip
    axes.legend(loc="center left")
