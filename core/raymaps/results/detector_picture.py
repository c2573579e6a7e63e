# SPDX-License-Identifier: LGPL-2.1-or-later
"""A detector's map in false colours, drawn with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from raymaps.criterion import Ellipse, Rectangle
from raymaps.errors import MissingPackageError, shortened
from raymaps.results.detector_map import DetectorMap
from raymaps.results.picture_parts import INK, LOOK, PALE, colour_bar, false_colour_scale, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_detector_map"]

_LONG_SIDE_INCH = 5.6


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
    with rc_context(LOOK):
        figure = Figure(figsize=(width + 2.1, height + 1.75), facecolor="white")
        left, bottom = 0.85 / (width + 2.1), 0.62 / (height + 1.75)
        axes = figure.add_axes((left, bottom, width / (width + 2.1), height / (height + 1.75)))
        _draw_cells(figure, axes, detector_map)
        _draw_region(axes, detector_map)
        _write_title(figure, detector_map, left)
    return figure


def _draw_cells(figure: Figure, axes: Axes, detector_map: DetectorMap) -> None:
    irradiance = np.ma.masked_invalid(detector_map.irradiance_w_per_mm2)
    half_width, half_height = detector_map.width_mm / 2, detector_map.height_mm / 2
    colours, norm, darkest, _ = false_colour_scale(detector_map.irradiance_w_per_mm2)
    image = axes.imshow(
        np.ma.maximum(irradiance, 0.5 * darkest),  # a logarithm of 0 would look like no cell at all
        origin="lower",
        extent=(-half_width, half_width, -half_height, half_height),
        cmap=colours,
        norm=norm,
        interpolation="nearest",
        aspect="auto",
    )
    axes.set_xlabel("x in mm", color=INK)
    axes.set_ylabel("y in mm", color=INK)
    axes.tick_params(colors=INK, labelsize=8)
    place = axes.get_position()
    width = figure.get_figwidth()
    colour_bar(figure, image, (place.x1 + 0.16 / width, place.y0, 0.17 / width, place.height), "irradiance", "W/mm²")


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
    letters = int(13.5 * figure.get_figwidth() * (1 - left))
    figure.text(left, top - 0.33 * inch, detector_map.detector, fontsize=13, fontweight="bold")
    line = with_error(detector_map.flux_w, "W")
    line += f"   {with_error(detector_map.flux_lm, 'lm')}" if detector_map.flux_lm is not None else ""
    line += f"   {detector_map.crossings:,} crossings".replace(",", "\u2009")
    figure.text(left, top - 0.56 * inch, shortened(line, letters), fontsize=9.5)
    conditions = [f"without {', '.join(detector_map.without)}"] if detector_map.without else []
    conditions.append(f"{detector_map.resolution[0]} × {detector_map.resolution[1]} cells")
    conditions.append(f"{detector_map.side} side" if detector_map.side != "both" else "both sides")
    conditions.append(f"up to {detector_map.max_angle_deg:g}°")
    conditions += [f"from {detector_map.source}"] if detector_map.source else []
    conditions += [f"where {detector_map.criterion}"] if detector_map.criterion else []
    figure.text(left, top - 0.76 * inch, shortened(",  ".join(conditions), letters), fontsize=8, color=PALE)
    line = f"mean {with_error(detector_map.mean_w_per_mm2, 'W/mm²')}"
    line += f" or {with_error(detector_map.mean_lx, 'lx')}" if detector_map.mean_lx is not None else ""
    if detector_map.uniformity:
        line += f",  min/mean {detector_map.uniformity.value:.2f} ± {detector_map.uniformity.stderr:.2f}"
    figure.text(left, top - 0.93 * inch, shortened(line, letters), fontsize=8, color=PALE)
