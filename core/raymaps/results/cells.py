# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sums over the rays that cross a detector: in all, and cell by cell.

A ray is one sample, however often it crosses: its crossings are added up before anything is squared. The sums in all
are taken ray by ray and know nothing of cells, so that a detector's resolution changes no flux.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import Area, Bound, Everything, inside_area, matching_rays
from raymaps.scene import RectangleDetector

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["CellSums", "sum_cells"]

Float = NDArray[np.float64]


class CellSums(NamedTuple):
    """Sums over rays; ``X`` is a ray's light on the detector relative to its emission, ``X_c`` that in cell c."""

    total: Float  # (n_sources,) sum of X
    squares: Float  # (n_sources,) sum of X²
    cell_light: Float  # (n_sources, n_cells, 3 bands) sum of X_c by band
    cell_squares: Float  # (n_sources, n_cells) sum of X_c²
    cell_products: Float  # (n_sources, n_cells) sum of X_c X


def sum_cells(
    ray_map: RayMap,
    detector_index: int,
    resolution: tuple[int, int],
    max_angle_rad: float | None,
    area: Area | None,
    bound: Bound,
) -> tuple[CellSums, int, int]:
    """Sum over all rays of a map that match a criterion and that a detector registers.

    Parameters
    ----------
    detector_index : int
    resolution : (n_x, n_y)
        Cells are counted row by row from the lower left.
    max_angle_rad : float or None
        Acceptance angle in place of the detector's own.
    area : Rectangle, Ellipse or None
        Part of the detector that counts.
    bound : Bound
        Criterion that the rays must match.

    Returns
    -------
    CellSums, number of rays, number of crossings
    """
    from raymaps.results.cells_kernel import add_crossings

    detector = ray_map.scene.detectors[ray_map.names.detectors[detector_index]]
    n_sources, n_cells = len(ray_map.names.sources), resolution[0] * resolution[1]
    per_cell = (n_sources, n_cells)
    sums = CellSums(
        np.zeros(n_sources), np.zeros(n_sources), np.zeros((*per_cell, 3)), np.zeros(per_cell), np.zeros(per_cell)
    )
    in_cell = np.zeros(n_cells)
    n_rays = n_crossings = 0
    for portion in ray_map.portions:
        rows = _counted(portion, detector, detector_index, max_angle_rad, area, bound)
        if len(rows):
            n_crossings += len(rows)
            n_rays += add_crossings(
                rows,
                portion.crossing_ray,
                portion.crossing_row,
                portion.crossing_xy_mm,
                portion.light,
                portion.signatures.ray_source[portion.ray_signature],
                (detector.width_mm, detector.height_mm),
                resolution,
                sums,
                in_cell,
            )
    return sums, n_rays, n_crossings


def _counted(
    portion: Portion,
    detector: RectangleDetector,
    detector_index: int,
    max_angle_rad: float | None,
    area: Area | None,
    bound: Bound,
) -> NDArray[np.int64]:
    """Rows of the crossings that count."""
    if not portion.n_crossings:
        return np.zeros(0, np.int64)
    counted = portion.crossing_detector == detector_index
    if max_angle_rad is None:
        counted &= portion.crossing_registered
    else:
        counted &= detector.accepts(portion.crossing_angle_rad, max_angle_rad)
    rows = np.flatnonzero(counted)
    if area is not None:
        rows = rows[inside_area(area, portion.crossing_xy_mm[rows])]
    if len(rows) and not isinstance(bound.criterion, Everything):
        wanted = np.zeros(portion.n_rays, bool)
        wanted[matching_rays(portion, bound)] = True
        rows = rows[wanted[portion.crossing_ray[rows]]]
    return rows
