# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sums over the rays that a detector counts: in all, cell by cell, and band by band.

A ray is one sample, however often it is counted: what it brings is added up before anything is squared. The sums in all
are taken ray by ray and know nothing of cells, so that a detector's resolution changes no flux.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import Bound, Everything, matching_rays
from raymaps.effects import scene_without
from raymaps.effects.usage import used_media
from raymaps.store import Lights

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["CellSums", "Samples", "SpectrumSums", "Sums", "light_on_the_way", "rows_that_match", "sum_samples"]

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Samples:
    """Light of a portion that a detector counts, in the order of the rays.

    Attributes
    ----------
    ray : (n,) int64
        Ray within the portion.
    lights : Lights
    light : (n,) int64
        Row in ``lights`` of the light that is counted.
    less : (n,) int64
        Row of the light that is taken off it; empty if none is.
    cells : tuple of (n,) int64
        Cell of each sample, once for each way in which the detector is divided; -1 none.
    """

    ray: NDArray[np.int64]
    lights: Lights
    light: NDArray[np.int64]
    less: NDArray[np.int64]
    cells: tuple[NDArray[np.int64], ...]


class CellSums(NamedTuple):
    """Sums over rays cell by cell; ``X_c`` and ``Y_c`` are what is ``X`` and ``Y`` in `RaySums`, in cell c."""

    cell_light: Float  # (n_sources, n_cells, 5) sum of X_c, Y_c, and of red, green and blue
    cell_squares: Float  # (n_sources, n_cells) sum of X_c²
    cell_products: Float  # (n_sources, n_cells) sum of X_c X
    cell_lumen_squares: Float  # (n_sources, n_cells) sum of Y_c²; of RGB light (n_sources, 0)


class RaySums(NamedTuple):
    """Sums over rays, whatever the cells.

    ``X`` is a ray's light there relative to its emission, ``Y`` its lumens for each W of its emission.
    """

    total: Float  # (n_sources,) sum of X
    squares: Float  # (n_sources,) sum of X²
    lumen: Float  # (n_sources,) sum of Y; 0 of RGB light
    lumen_squares: Float  # (n_sources,) sum of Y²


class SpectrumSums(NamedTuple):
    """Sums over rays; ``X_b`` is a ray's light there in band b."""

    total: Float  # (n_sources, n_bands) sum of X_b
    squares: Float  # (n_sources, n_bands) sum of X_b²


class Sums(NamedTuple):
    """What a detector counted: sums over rays, over cells for each division, and by band where spectra were stored."""

    rays: RaySums
    cells: tuple[CellSums, ...]
    spectrum: SpectrumSums | None
    n_rays: int
    n_samples: int


def sum_samples(raymap: RayMap, samples_of: Callable[[Portion], Samples | None], n_cells: tuple[int, ...]) -> Sums:
    """Add up what a detector counts over all portions of a map.

    Parameters
    ----------
    samples_of : function of a portion to its samples, None if it has none
    n_cells : tuple of int
        Number of cells of each division of the detector.
    """
    from raymaps.results.cells_kernel import add_rays, add_spectra, add_to_cells

    n_sources = len(raymap.names.sources)
    rays = RaySums(*(np.zeros(n_sources) for _ in range(4)))
    divisions = tuple(_empty(n_sources, n, raymap.bands.lumen_per_w is not None) for n in n_cells)
    in_cell = [np.zeros((2, n)) for n in n_cells]
    spectral = raymap.bands.is_spectral and all(portion.lights.has_spectra for portion in raymap.portions)
    spectrum = SpectrumSums(*(np.zeros((n_sources, raymap.bands.n)) for _ in range(2))) if spectral else None
    rounded, rounded_bands = np.zeros((4, n_sources)), np.zeros((2, n_sources, raymap.bands.n))
    n_rays = n_samples = 0
    for portion in raymap.portions:
        samples = samples_of(portion)
        if samples is None or not len(samples.ray):
            continue
        n_samples += len(samples.ray)
        source = portion.signatures.ray_source[portion.ray_signature]
        measured = _measured(samples.lights)
        for cell, division, room in zip(samples.cells, divisions, in_cell, strict=True):
            add_to_cells(samples.ray, samples.light, samples.less, cell, measured, source, division, room)
        n_rays += add_rays(samples.ray, samples.light, samples.less, measured, source, rays, rounded)
        if spectrum is not None:
            values = samples.lights.values
            of_ray = np.zeros(raymap.bands.n)
            add_spectra(samples.ray, samples.light, samples.less, values, source, spectrum, rounded_bands, of_ray)
    return Sums(rays, divisions, spectrum, n_rays, n_samples)


def _empty(n_sources: int, n_cells: int, with_lumens: bool) -> CellSums:
    per_cell = (n_sources, n_cells)
    return CellSums(
        np.zeros((*per_cell, 5)), np.zeros(per_cell), np.zeros(per_cell),
        np.zeros(per_cell if with_lumens else (n_sources, 0)),
    )  # fmt: skip


def rows_that_match(
    portion: Portion, bound: Bound, rows: NDArray[np.int64], ray: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Those of the rows whose rays, (n_rows,), match a criterion."""
    if not len(rows) or isinstance(bound.criterion, Everything):
        return rows
    wanted = np.zeros(portion.n_rays, bool)
    wanted[matching_rays(portion, bound)] = True
    return rows[wanted[ray]]


def light_on_the_way(
    raymap: RayMap, portion: Portion, row: NDArray[np.int64], place_mm: Callable[[NDArray[np.int64]], Float]
) -> tuple[Lights, NDArray[np.int64]]:
    """The light with which segments arrive at places on them.

    Along a segment the light in all is constant, because what media take is drawn. In a medium that takes the bands
    unequally their shares shift on the way: to l_b exp(-a_b t), scaled to the same sum. Where a spectral simulation
    stored colours in place of spectra the light keeps the colour of the segment's start.

    Parameters
    ----------
    row : (n,) int64
        Events that start the segments.
    place_mm : function
        Of some of the segments, (k,) int64 from 0 to n - 1, to the places on them, (k, 3) float64.

    Returns
    -------
    Lights, and (n,) int64 the row in them of each place
    """
    lights = portion.lights
    light_row = portion.event_light[row].astype(np.int64)
    extinction = _extinction_per_mm(raymap)
    tinted = (extinction != extinction[:, :1]).any(axis=1)
    if lights.spectra is None or not tinted.any():
        return lights, light_row
    medium = portion.signatures.medium[portion.event_step[row]]
    here = np.flatnonzero(tinted[medium])
    way_mm = np.linalg.norm(place_mm(here) - portion.position_mm[row[here]], axis=1)
    light = lights.spectra[light_row[here]].astype(np.float64)
    through = _through(light, extinction[medium[here]] * way_mm[:, None])
    light_row[here] = len(lights.values) + np.arange(len(here))
    return Lights(np.concatenate([lights.values, through]), lights.names, lights.bands), light_row


def _measured(lights: Lights) -> Float:
    """Power, lumens, red, green and blue of lights, (n_lights, 5)."""
    lumen = lights.lumen_per_w
    return np.column_stack([lights.power, np.zeros(len(lights.values)) if lumen is None else lumen, lights.rgb])


def _through(light: Float, depth: Float) -> Float:
    """Light of bands behind optical depths, both (n, n_bands), scaled to the sum that it had.

    Only differences of depths count: however little gets through, it keeps its colour.
    """
    least = np.where(light > 0, depth, np.inf).min(axis=1, keepdims=True)
    through = light * np.exp(np.minimum(least - depth, 0.0))
    total = through.sum(axis=1, keepdims=True)
    return through * np.divide(light.sum(axis=1, keepdims=True), total, out=np.zeros_like(total), where=total > 0)


def _extinction_per_mm(raymap: RayMap) -> Float:
    """What media that light can meet take from a segment by absorption and scattering, (n_media, n_bands); else 0."""
    scene = scene_without(raymap.scene)
    result = np.zeros((len(raymap.names.media), raymap.bands.n))
    for name in used_media(scene):
        medium = scene.media[name]
        if not medium.is_conductor:
            values = (medium.absorption_per_mm, *(part.coefficient_per_mm for part in medium.scattering))
            result[raymap.names.media.index(name)] = sum(raymap.bands.average(v, f"Medium '{name}'") for v in values)
    return result
