# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of `docs/accuracy.md`: error against time, from what `make bench` measured."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from docs.drawing.look import COLOURS, LOOK, save, size

__all__ = ["draw"]

RESULTS = Path(__file__).resolve().parents[2] / "benchmarks" / "results.json"

#: Lines and signs of the samplings.
_SAMPLING = {"random": ("-", "o", "independent rays"), "sobol": ("--", "s", "Sobol' points")}
_SLOPES = {-0.5: "−½", -1.0: "−1"}
_GREY = "#9aa1aa"

Point = dict[str, Any]


def draw(results: Path = RESULTS) -> None:
    """Draw and save all of them."""
    work = json.loads(results.read_text(encoding="utf-8"))["work_precision"]
    of_scene: dict[str, list[Point]] = {}
    for point in work["precisions"]:
        of_scene.setdefault(point["scene"], []).append(point)
    with rc_context(LOOK):
        several = {"singlet and pinhole": "surfaces", "dye in daylight": "bands"}
        alone = {scene: points for scene, points in of_scene.items() if scene not in several}
        save(_draw_sampling(alone), "sampling", "accuracy")
        for scene, name in several.items():
            save(_draw_choices(of_scene[scene], scene), name, "accuracy")
        save(_draw_stores(work["stores"]), "store", "accuracy")


def _draw_sampling(of_scene: dict[str, list[Point]]) -> Figure:
    """A panel for each scene in which the sampling alone is to be chosen."""
    figure = size(10.5, 4.6)
    panels = figure.subplots(1, len(of_scene), sharex=True, sharey=True, squeeze=False)[0]
    for axes, (scene, points) in zip(panels, of_scene.items(), strict=True):
        for sampling, colour in zip(_SAMPLING, COLOURS, strict=False):
            _curve(axes, [p for p in points if p["sampling"] == sampling], colour, _SAMPLING[sampling][2])
        _finish(axes, [p for many in of_scene.values() for p in many], scene)
    panels[0].set_ylabel("error, % of the flux")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _draw_choices(points: list[Point], scene: str) -> Figure:
    """All choices of surfaces or bands, each with both samplings."""
    figure = size(8.6, 5.4)
    axes = figure.subplots()
    choices = list(dict.fromkeys(point["choice"] for point in points))
    for choice, colour in zip(choices, COLOURS, strict=False):
        for sampling in _SAMPLING:
            _curve(axes, [p for p in points if (p["choice"], p["sampling"]) == (choice, sampling)], colour)
    _finish(axes, points, scene)
    axes.set_ylabel("error, % of the flux")
    handles = [Line2D([], [], color=colour, label=choice) for choice, colour in zip(choices, COLOURS, strict=False)]
    handles += [
        Line2D([], [], color="#5f6670", linestyle=line, marker=sign, ms=4.5, mfc="white", label=words)
        for line, sign, words in _SAMPLING.values()
    ]
    figure.legend(handles=handles, loc="outside right center")
    return figure


def _curve(axes: Axes, points: list[Point], colour: str, label: str | None = None) -> None:
    line, sign, _ = _SAMPLING[points[0]["sampling"]]
    axes.errorbar(
        [p["run_s"] for p in points], [100 * p["error"] for p in points], [100 * p["error_stderr"] for p in points],
        fmt=line + sign, ms=4.5, color=colour, mfc="white", mew=1.3, elinewidth=1.0, label=label,
    )  # fmt: skip


def _finish(axes: Axes, points: list[Point], scene: str) -> None:
    """Logarithmic axes, and thin lines with the slopes of independent rays and of a good sequence."""
    times, errors = np.array([p["run_s"] for p in points]), 100 * np.array([p["error"] for p in points])
    low, high = errors.min() / 12, errors.max() * 2
    left, right = times.min() / 1.6, times.max() * 1.6
    axes.set(xscale="log", yscale="log", xlabel="time of tracing, s", title=scene, xlim=(left, right), ylim=(low, high))
    # below on the left, where no curve is
    x, top = left * 1.25 * np.array([1.0, 6.0]), low * 9
    for slope, words in _SLOPES.items():
        y = top * (x / x[0]) ** slope
        axes.plot(x, y, color=_GREY, linewidth=0.9, zorder=1)
        axes.annotate(words, (x[1], y[1]), xytext=(3, -4), textcoords="offset points", color=_GREY, fontsize=10)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_formatter("")


def _draw_stores(stores: list[dict[str, Any]]) -> Figure:
    """Time and bytes of the same rays, raw and compressed, in colours and in spectra."""
    figure = size(9.6, 4.2)
    scenes = list(dict.fromkeys(store["scene"] for store in stores))
    panels = figure.subplots(1, len(scenes), sharey=True, squeeze=False)[0]
    for axes, scene in zip(panels, scenes, strict=True):
        of_scene = [store for store in stores if store["scene"] == scene]
        for store, colour in zip(of_scene, COLOURS, strict=False):
            million = 1e6 / store["segments"]
            raw, packed = million * store["raw_write"]["median"], million * store["write"]["median"]
            n_bytes = [store["raw_bytes"] / store["segments"], store["bytes"] / store["segments"]]
            axes.plot([raw, packed], n_bytes, ":", color=colour, linewidth=1.2)
            axes.plot(raw, n_bytes[0], "^", color=colour, ms=8, mfc="white", mew=1.6)
            axes.plot(packed, n_bytes[1], "o", color=colour, ms=8, label=store["light"])
        longest = max(1e6 / s["segments"] * max(s["raw_write"]["median"], s["write"]["median"]) for s in of_scene)
        axes.set(title=scene, xlabel="writing a million segments, s", yscale="log", xlim=(0, 1.2 * longest))
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.yaxis.set_minor_formatter(lambda value, _: f"{value:g}" if value in (5, 20, 50, 200) else "")
    panels[0].set_ylabel("bytes a segment")
    handles, _ = panels[0].get_legend_handles_labels()
    handles += [
        Line2D([], [], color="#5f6670", linestyle="", marker="^", ms=8, mfc="white", mew=1.6, label="raw"),
        Line2D([], [], color="#5f6670", linestyle="", marker="o", ms=8, label="compressed, as maps are"),
    ]
    figure.legend(handles=handles, loc="outside right center")
    return figure


if __name__ == "__main__":
    draw(*map(Path, sys.argv[1:]))
