# SPDX-License-Identifier: LGPL-2.1-or-later
"""A detector's map in false colours, drawn with matplotlib."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from raymaps.criterion import Ellipse, Rectangle
from raymaps.errors import MissingPackageError
from raymaps.results.colours import FALSE_COLOURS
from raymaps.results.detector import DetectorMap, Statistic

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_detector_map"]

_INK, _PALE = "#30343b", "#6b7280"
_LONG_SIDE_INCH = 5.6
#: Colours are logarithmic, over so many decades, where the brightest cell exceeds the middle one so many times.
_LOGARITHMIC_FROM, _DECADES = 300.0, 4


def draw_detector_map(detector_map: DetectorMap) -> Figure:
    """A figure of the irradiance on a detector: axes in mm, colour bar in W/mm², the flux and its error on top.

    Raises
    ------
    MissingPackageError
        If matplotlib is not installed.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackageError("matplotlib", "pictures", "The picture of a detector") from None

    scale = _LONG_SIDE_INCH / max(detector_map.width_mm, detector_map.height_mm)
    width = max(detector_map.width_mm * scale, 2.2)
    height = max(detector_map.height_mm * scale, 1.6)
    with rc_context({"font.family": "DejaVu Sans", "font.size": 9, "text.color": _INK, "axes.edgecolor": "#9aa0a8"}):
        figure = Figure(figsize=(width + 2.1, height + 1.75), facecolor="white")
        left, bottom = 0.85 / (width + 2.1), 0.62 / (height + 1.75)
        axes = figure.add_axes((left, bottom, width / (width + 2.1), height / (height + 1.75)))
        _draw_cells(figure, axes, detector_map)
        _draw_region(axes, detector_map)
        _write_title(figure, detector_map, left)
    return figure


def _draw_cells(figure: Figure, axes: Axes, detector_map: DetectorMap) -> None:
    from matplotlib import colormaps
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.ticker import FuncFormatter

    irradiance = np.ma.masked_invalid(detector_map.irradiance_w_per_mm2)
    half_width, half_height = detector_map.width_mm / 2, detector_map.height_mm / 2
    colours = colormaps[FALSE_COLOURS].with_extremes(bad="#e4e6e9", under=colormaps[FALSE_COLOURS](0.0))
    brightest = float(irradiance.max()) if irradiance.count() else 0.0
    lit = irradiance.compressed()[irradiance.compressed() > 0]
    logarithmic = len(lit) > 0 and brightest > _LOGARITHMIC_FROM * float(np.median(lit))
    darkest = brightest * 10.0**-_DECADES if logarithmic else 0.0
    norm = LogNorm(darkest, brightest) if logarithmic else Normalize(0.0, brightest or 1.0)
    image = axes.imshow(
        np.ma.maximum(irradiance, 0.5 * darkest),  # a logarithm of 0 would look like no cell at all
        origin="lower",
        extent=(-half_width, half_width, -half_height, half_height),
        cmap=colours,
        norm=norm,
        interpolation="nearest",
        aspect="auto",
    )
    axes.set_xlabel("x in mm", color=_INK)
    axes.set_ylabel("y in mm", color=_INK)
    axes.tick_params(colors=_INK, labelsize=8)
    place = axes.get_position()
    gap = 0.16 / figure.get_figwidth()
    bar_axes = figure.add_axes((place.x1 + gap, place.y0, 0.17 / figure.get_figwidth(), place.height))
    scale, prefix = _prefix(brightest)
    bar = figure.colorbar(image, cax=bar_axes, format=FuncFormatter(lambda value, _: f"{value / scale:.4g}"))
    bar.ax.minorticks_off()
    bar.set_label(f"irradiance in {prefix}W/mm²{', logarithmic' if logarithmic else ''}", color=_INK)
    bar.ax.tick_params(colors=_INK, labelsize=8)
    bar.outline.set_edgecolor("#9aa0a8")


def _draw_region(axes: Axes, detector_map: DetectorMap) -> None:
    from matplotlib import patches

    area = detector_map.area
    style: dict[str, Any] = {"fill": False, "edgecolor": "white", "linewidth": 1.6, "clip_on": True}
    dashes = {**style, "edgecolor": "#1f77d0", "linestyle": (0, (4, 3))}
    for look in (style, dashes):  # visible on bright and on dark cells
        if isinstance(area, Rectangle):
            size = (area.x1_mm - area.x0_mm, area.y1_mm - area.y0_mm)
            axes.add_patch(patches.Rectangle((area.x0_mm, area.y0_mm), *size, **look))
        elif isinstance(area, Ellipse):
            axes.add_patch(patches.Ellipse((area.cx_mm, area.cy_mm), 2 * area.rx_mm, 2 * area.ry_mm, **look))


def _write_title(figure: Figure, detector_map: DetectorMap, left: float) -> None:
    top, inch = 1.0, 1.0 / figure.get_figheight()
    figure.text(left, top - 0.33 * inch, detector_map.detector, fontsize=13, fontweight="bold")
    flux = detector_map.flux_w
    line = f"{_with_error(flux, 'W')}   {detector_map.crossings:,} crossings"
    figure.text(left, top - 0.56 * inch, line.replace(",", "\u2009"), fontsize=9.5)
    conditions = [f"{detector_map.resolution[0]} × {detector_map.resolution[1]} cells"]
    conditions.append(f"{detector_map.side} side" if detector_map.side != "both" else "both sides")
    conditions.append(f"up to {detector_map.max_angle_deg:g}°")
    conditions += [f"from {detector_map.source}"] if detector_map.source else []
    conditions += [f"where {detector_map.criterion}"] if detector_map.criterion else []
    letters = int(13.5 * figure.get_figwidth() * (1 - left))
    figure.text(left, top - 0.76 * inch, _cut(",  ".join(conditions), letters), fontsize=8, color=_PALE)
    line = f"mean {_with_error(detector_map.mean_w_per_mm2, 'W/mm²')}"
    if detector_map.uniformity:
        line += f",  min/mean {detector_map.uniformity.value:.2f} ± {detector_map.uniformity.stderr:.2f}"
    figure.text(left, top - 0.93 * inch, _cut(line, letters), fontsize=8, color=_PALE)


def _with_error(figure: Statistic, unit: str) -> str:
    """A figure and its error in the same unit, the error with two digits: ``27.15 ± 0.16 mW``."""
    scale, prefix = _prefix(max(abs(figure.value), figure.stderr))
    error = figure.stderr / scale
    decimals = max(0, 1 - math.floor(math.log10(error))) if error > 0 else 3
    return f"{figure.value / scale:.{decimals}f} ± {error:.{decimals}f} {prefix}{unit}"


def _prefix(largest: float) -> tuple[float, str]:
    """Scale and letter of the SI prefix that suits a value."""
    for scale, letter in ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n")):
        if largest >= scale:
            return scale, letter
    return (1e-12, "p") if largest > 0 else (1.0, "")


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"
