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
    n_rays: int  # rays that cross
    n_crossings: int


def sum_cells(
    ray_map: RayMap,
    detector_index: int,
    resolution: tuple[int, int],
    max_angle_rad: float | None,
    area: Area | None,
    bound: Bound,
) -> CellSums:
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
    """
    detector = ray_map.scene.detectors[ray_map.names.detectors[detector_index]]
    n_sources, n_cells = len(ray_map.names.sources), resolution[0] * resolution[1]
    total, squares = np.zeros(n_sources), np.zeros(n_sources)
    cell_light = np.zeros((3, n_sources * n_cells))
    cell_squares, cell_products = np.zeros(n_sources * n_cells), np.zeros(n_sources * n_cells)
    n_rays = n_crossings = 0
    for portion in ray_map.portions:
        rows = _counted(portion, detector, detector_index, max_angle_rad, area, bound)
        if not len(rows):
            continue
        ray = portion.crossing_ray[rows]
        light = portion.light[portion.crossing_row[rows]].astype(np.float64)
        power = light.sum(axis=1)
        first = np.flatnonzero(np.concatenate([[True], ray[1:] != ray[:-1]]))  # rows are in the order of the rays
        of_ray = np.add.reduceat(power, first)
        source = portion.signatures.ray_source[portion.ray_signature[ray[first]]].astype(np.int64)
        total += np.bincount(source, of_ray, n_sources)
        squares += np.bincount(source, of_ray**2, n_sources)

        crossings = np.diff(np.append(first, len(ray)))
        cell = _cells(portion.crossing_xy_mm[rows], detector, resolution)
        key = cell if n_sources == 1 else np.repeat(source * n_cells, crossings) + cell
        for band in range(3):
            cell_light[band] += np.bincount(key, light[:, band], len(cell_squares))
        key, in_cell, in_all = _per_ray_and_cell(key, power, of_ray, crossings)
        cell_squares += np.bincount(key, in_cell**2, len(cell_squares))
        cell_products += np.bincount(key, in_cell * in_all, len(cell_squares))
        n_rays += len(first)
        n_crossings += len(rows)
    per_cell = (n_sources, n_cells)
    return CellSums(
        total,
        squares,
        np.moveaxis(cell_light.reshape(3, *per_cell), 0, 2),
        cell_squares.reshape(per_cell),
        cell_products.reshape(per_cell),
        n_rays,
        n_crossings,
    )


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


def _cells(xy_mm: NDArray[np.floating], detector: RectangleDetector, resolution: tuple[int, int]) -> NDArray[np.int64]:
    """Cell that each point lies in; the outer borders belong to the outer cells."""
    index = []
    for axis, (size_mm, n_cells) in enumerate(zip((detector.width_mm, detector.height_mm), resolution, strict=True)):
        place = (xy_mm[:, axis].astype(np.float64) + size_mm / 2) * (n_cells / size_mm)
        index.append(np.clip(place.astype(np.int64), 0, n_cells - 1))
    return index[1] * resolution[0] + index[0]


def _per_ray_and_cell(
    key: NDArray[np.int64], power: Float, of_ray: Float, crossings: NDArray[np.int64]
) -> tuple[NDArray[np.int64], Float, Float]:
    """One entry for each ray and cell: the key, the ray's light in the cell, and all its light."""
    ray = np.repeat(np.arange(len(of_ray)), crossings)
    in_all = of_ray[ray]
    again = crossings[ray] > 1
    if not again.any():
        return key, power, in_all
    # only rays that cross several times may have several rows in one cell: these rows are merged
    rows = np.flatnonzero(again)
    rows = rows[np.lexsort((key[rows], ray[rows]))]
    new = np.concatenate([[True], (ray[rows][1:] != ray[rows][:-1]) | (key[rows][1:] != key[rows][:-1])])
    first = np.flatnonzero(new)
    once = ~again
    return (
        np.concatenate([key[once], key[rows][first]]),
        np.concatenate([power[once], np.add.reduceat(power[rows], first)]),
        np.concatenate([in_all[once], in_all[rows][first]]),
    )
