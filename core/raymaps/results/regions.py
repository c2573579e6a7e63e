# SPDX-License-Identifier: LGPL-2.1-or-later
"""Cells of a detector and how much of each lies inside a rectangle or an ellipse, exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import Area, Ellipse, Rectangle

__all__ = ["cell_areas_mm2", "cell_centres_mm", "cell_edges_mm"]

Float = NDArray[np.float64]

#: Less than this share of a cell is no overlap but rounding.
_ROUNDING = 1e-9


def cell_edges_mm(size_mm: float, n_cells: int) -> Float:
    """Borders of a detector's cells along one of its axes, (n_cells + 1,), 0 at its centre."""
    return np.arange(-n_cells, n_cells + 1, 2, dtype=np.float64) * (size_mm / (2 * n_cells))


def cell_centres_mm(edges_mm: Float) -> Float:
    """Centres between borders, (n_cells,)."""
    return (edges_mm[1:] + edges_mm[:-1]) / 2


def cell_areas_mm2(x_edges_mm: Float, y_edges_mm: Float, area: Area | None) -> Float:
    """Area of each cell, or of the part of it that lies inside an area of the detector.

    Parameters
    ----------
    x_edges_mm, y_edges_mm : (n_x + 1,), (n_y + 1,) float64, ascending
    area : Rectangle, Ellipse or None for all of the detector

    Returns
    -------
    (n_y, n_x) float64
    """
    if isinstance(area, Ellipse):
        corners = _disc_below(
            ((x_edges_mm - area.cx_mm) / area.rx_mm)[None, :], ((y_edges_mm - area.cy_mm) / area.ry_mm)[:, None]
        )
        inside = np.diff(np.diff(corners, axis=0), axis=1) * (area.rx_mm * area.ry_mm)
        whole = np.outer(np.diff(y_edges_mm), np.diff(x_edges_mm))
        return np.where(inside > _ROUNDING * whole, np.minimum(inside, whole), 0.0)
    if isinstance(area, Rectangle):
        x_edges_mm = np.clip(x_edges_mm, area.x0_mm, area.x1_mm)
        y_edges_mm = np.clip(y_edges_mm, area.y0_mm, area.y1_mm)
    return np.outer(np.diff(y_edges_mm), np.diff(x_edges_mm))


def _disc_below(x: Float, y: Float) -> Float:
    """Area of the unit disc's part left of x and below y.

    With h(t) = sqrt(1 - t²), the part is the integral over t from -1 to x of the overlap of (-h, h) with (-inf, y):
    h + y where the horizontal line at y cuts the disc (|t| < c = h(y)), and else 2 h above the centre or 0 below it.
    """
    x, y = np.broadcast_arrays(np.clip(x, -1.0, 1.0), np.clip(y, -1.0, 1.0))
    c = np.sqrt(1.0 - y**2)
    middle = np.clip(x, -c, c)
    cut = _half_disc(middle) - _half_disc(-c) + y * (middle + c)
    beside = 2.0 * (_half_disc(np.minimum(x, -c)) - _half_disc(-1.0))
    beside = beside + 2.0 * (_half_disc(np.maximum(x, c)) - _half_disc(c))
    return cut + np.where(y > 0.0, beside, 0.0)


def _half_disc(t: Float | float) -> Float:
    """Integral of sqrt(1 - t²) from 0."""
    return 0.5 * (t * np.sqrt(1.0 - np.square(t)) + np.arcsin(t))
