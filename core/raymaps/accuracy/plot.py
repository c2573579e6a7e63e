# SPDX-License-Identifier: LGPL-2.1-or-later
"""Time against error on logarithmic axes, a curve for each choice."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.accuracy.outlook import FEWEST_RAYS, Outlooks
from raymaps.errors import MissingPackageError
from raymaps.results.files import check_suffix, new_file
from raymaps.results.picture_parts import FRAME, INK, LOOK
from raymaps.units import format_duration

__all__ = ["check_plot", "plot"]

#: Blue, orange, green, red, violet, grey, brown, teal.
_COLOURS = ("#0b62a4", "#d9730d", "#2d8a4e", "#b3261e", "#7a4fa3", "#5f6670", "#8a5a2b", "#1b8a8f")
_MOST_PERCENT, _LEAST_PERCENT = 20.0, 0.01
_SHORTEST_S, _LONGEST_S = 1e-3, 1e6

Float = NDArray[np.float64]


def check_plot(output: str | Path) -> None:
    """Raise `OutputError` if a plot can't have this name."""
    check_suffix(output, (".png",), "The plot")


def plot(outlooks: Outlooks, output: str | Path) -> Path:
    """Draw to a ``.png`` file.

    Raises
    ------
    MissingPackageError, OutputError
        If matplotlib is not installed, or the file can't be written.
    """
    check_plot(output)
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackageError("matplotlib", "pictures", "The plot") from None
    with rc_context(LOOK):
        figure = Figure(figsize=(8.0, 5.2), facecolor="white", layout="constrained")
        _draw(figure.subplots(), outlooks)
        with new_file(output) as making:
            figure.savefig(making, dpi=120, metadata={"Software": None})
    return Path(output)


def _draw(axes: Any, outlooks: Outlooks) -> None:
    percent = np.geomspace(_MOST_PERCENT, _LEAST_PERCENT, 200)
    times_s: list[Float] = []
    for one, colour in zip(outlooks.of, (_COLOURS * 4)[: len(outlooks.of)], strict=True):
        rays = np.array([one.rays(p / 100) or np.nan for p in percent])
        tracing_s = np.where(rays > 2 * FEWEST_RAYS, rays * one.ray_s, np.nan)
        tracing_s[tracing_s > _LONGEST_S] = np.nan
        if np.isnan(tracing_s).all():
            continue
        times_s.append(tracing_s)
        label = one.words + (" (as the scene says)" if one.is_scene else "")
        dashes = "--" if one.is_even else "-"
        axes.plot(tracing_s, percent, dashes, color=colour, linewidth=2.4 if one.is_scene else 1.5, label=label)
    present = outlooks.present
    if present is not None and present.error is not None:
        axes.plot(present.rays * outlooks.of[0].ray_s, 100 * present.error, "o", color=INK, markersize=7,
                  label=f"this map, {present.rays:,} rays")  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(_LEAST_PERCENT, _MOST_PERCENT)
    drawn = np.concatenate(times_s) if times_s else np.ones(1)
    axes.set_xlim(max(np.nanmin(drawn), _SHORTEST_S), 1.5 * np.nanmax(drawn))
    threads = f"{outlooks.threads} {'thread' if outlooks.threads == 1 else 'threads'}"
    axes.set_xlabel(f"time of tracing, {threads}; to start takes {format_duration(outlooks.of[0].start_s)} besides")
    axes.set_ylabel("standard error and bias, % of the flux")
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_major_formatter(lambda value, _: _words(value))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_formatter("")
    axes.grid(color="#e3e6ea")
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(which="both", color=FRAME, labelcolor=INK)
    axes.set_title(f"What accuracy costs: {outlooks.quantity}", fontsize=11, loc="left")
    axes.legend(frameon=False, fontsize=8.5)


def _words(seconds: float) -> str:
    if seconds < 1:
        return f"{1000 * seconds:g} ms"
    return format_duration(seconds) if seconds >= 60 else f"{seconds:g} s"
