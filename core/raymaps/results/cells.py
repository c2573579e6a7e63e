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

from raymaps.store import Lights

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["CellSums", "sum_cells"]

Float = NDArray[np.float64]


class CellSums(NamedTuple):
    """Sums over rays; ``X`` is a ray's light on the detector relative to its emission, ``X_c`` that in cell c."""

    total: Float  # (n_sources,) sum of X
    squares: Float  # (n_sources,) sum of X²
    lumen: Float  # (n_sources,) sum of Y, the ray's lumens there for each W of its emission; 0 of RGB light
    lumen_squares: Float  # (n_sources,) sum of Y²
    cell_light: Float  # (n_sources, n_cells, 5) sum of X_c, Y_c, and of red, green and blue
    cell_squares: Float  # (n_sources, n_cells) sum of X_c²
    cell_products: Float  # (n_sources, n_cells) sum of X_c X


def sum_cells(
    raymap: RayMap,
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

    detector = raymap.scene.detectors[raymap.names.detectors[detector_index]]
    n_sources, n_cells = len(raymap.names.sources), resolution[0] * resolution[1]
    per_cell = (n_sources, n_cells)
    sums = CellSums(
        *(np.zeros(n_sources) for _ in range(4)), np.zeros((*per_cell, 5)), np.zeros(per_cell), np.zeros(per_cell)
    )
    in_cell = np.zeros(n_cells)
    n_rays = n_crossings = 0
    for portion in raymap.portions:
        rows = _counted(portion, detector, detector_index, max_angle_rad, area, bound)
        if len(rows):
            n_crossings += len(rows)
            light, light_row = _light_at_crossings(raymap, portion, detector, detector_index)
            n_rays += add_crossings(
                rows,
                portion.crossing_ray,
                light_row,
                portion.crossing_xy_mm,
                light,
                portion.signatures.ray_source[portion.ray_signature],
                (detector.width_mm, detector.height_mm),
                resolution,
                sums,
                in_cell,
            )
    return sums, n_rays, n_crossings


def _light_at_crossings(
    raymap: RayMap, portion: Portion, detector: RectangleDetector, detector_index: int
) -> tuple[Float, NDArray[np.int64]]:
    """Power, lumens, red, green and blue, (n, 5), and for each crossing its row there.

    Along a segment the light in all is constant, because what media take is drawn. In a medium that takes the bands
    unequally their shares shift on the way to the crossing: to l_b exp(-a_b t), scaled to the same sum. Where a spectral
    simulation stored colours in place of spectra the crossing has the colour of its segment's start.
    """
    lights = portion.lights
    row = portion.crossing_row
    extinction = _extinction_per_mm(raymap)
    tinted = (extinction != extinction[:, :1]).any(axis=1)
    if lights.spectra is None or not tinted.any():
        return _measured(lights), portion.event_light[row].astype(np.int64)
    medium = portion.signatures.medium[portion.event_step[row]]
    mine = portion.crossing_detector == detector_index
    here = np.flatnonzero(tinted[medium] & mine)
    place = np.array(detector.center_mm) + portion.crossing_xy_mm[here] @ detector.axes[:2]
    way_mm = np.linalg.norm(place - portion.position_mm[row[here]], axis=1)
    light = lights.spectra[portion.event_light[row[here]]].astype(np.float64)
    through = light * np.exp(-extinction[medium[here]] * way_mm[:, None])
    through *= (light.sum(axis=1) / through.sum(axis=1))[:, None]
    recoloured = Lights(through, lights.names, lights.bands)
    light_row = portion.event_light[row].astype(np.int64)
    light_row[here] = len(lights.values) + np.arange(len(here))
    return np.concatenate([_measured(lights), _measured(recoloured)]), light_row


def _measured(lights: Lights) -> Float:
    """Power, lumens, red, green and blue of lights, (n_lights, 5)."""
    lumen = lights.lumen_per_w
    return np.column_stack([lights.power, np.zeros(len(lights.values)) if lumen is None else lumen, lights.rgb])


def _extinction_per_mm(raymap: RayMap) -> Float:
    """What each medium takes from a segment by absorption and scattering, (n_media, n_bands)."""
    media = raymap.scene.media
    result = np.zeros((len(raymap.names.media), raymap.bands.n))
    for i, name in enumerate(raymap.names.media):
        if name in media:
            values = (media[name].absorption_per_mm, *(s.coefficient_per_mm for s in media[name].scattering))
            result[i] = sum(raymap.bands.average(value, f"Medium '{name}'") for value in values)
    return result


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
