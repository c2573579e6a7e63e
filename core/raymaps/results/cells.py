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

from raymaps.criterion import (
    Bound,
    Everything,
    by_source,
    effective_products,
    effective_squares,
    matching_rays,
)
from raymaps.store import Lights

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["CellSums", "Samples", "SpectrumSums", "Sums", "rows_that_match", "sum_samples"]

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
    """Sums over rays cell by cell; ``X_c`` and ``Y_c`` are what is ``X`` and ``Y`` in `RaySums`, in cell c.

    Squares and products are as those of `RaySums`.
    """

    cell_light: Float  # (n_sources, n_cells, 5) sum of X_c, Y_c, and of red, green and blue
    cell_squares: Float  # (n_sources, n_cells) sum of X_c²
    cell_products: Float  # (n_sources, n_cells) sum of X_c X
    cell_lumen_squares: Float  # (n_sources, n_cells) sum of Y_c²; of RGB light (n_sources, 0)


class RaySums(NamedTuple):
    """Sums over rays, whatever the cells.

    ``X`` is a ray's light there relative to its emission, ``Y`` its lumens for each W of its emission. By source,
    squares are those of independent rays that would have the error; see `raymaps.criterion.replicates`.
    """

    total: Float  # (n_sources,) sum of X
    squares: Float  # (n_sources,) sum of X²
    lumen: Float  # (n_sources,) sum of Y; 0 of RGB light
    lumen_squares: Float  # (n_sources,) sum of Y²
    most: Float  # (n_sources,) largest X
    most_lumen: Float  # (n_sources,) largest Y


class SpectrumSums(NamedTuple):
    """Sums over rays; ``X_b`` is a ray's light there in band b."""

    total: Float  # (n_sources, n_bands) sum of X_b
    squares: Float  # (n_sources, n_bands) sum of X_b²


class Sums(NamedTuple):
    """What a detector counted: sums over rays, over cells for each division, and by band where spectra were stored."""

    rays: RaySums
    groups: RaySums  # the same by source and replicate, (n_sources * R,), and squares as they are
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
    from raymaps.results.cells_kernel import add_rays, add_spectra, add_to_cells, add_to_replicates

    n_sources, n_bands = len(raymap.names.sources), raymap.bands.n
    n_groups = n_sources * raymap.n_replicates
    with_lumens = raymap.bands.lumen_per_w is not None
    groups = RaySums(*(np.zeros(n_groups) for _ in range(6)))
    divisions = tuple(_empty(n_sources, n, with_lumens) for n in n_cells)
    in_cell = [np.zeros((2, n)) for n in n_cells]
    n_kept = n_groups if raymap.n_replicates > 1 else 0
    replicates = [np.zeros((2 if with_lumens else 1, n_kept, n)) for n in n_cells]
    spectral = raymap.bands.is_spectral and all(portion.lights.has_spectra for portion in raymap.portions)
    spectrum = SpectrumSums(*(np.zeros((n_groups, n_bands)) for _ in range(2))) if spectral else None
    rounded, rounded_bands = np.zeros((4, n_groups)), np.zeros((2, n_groups, n_bands))
    n_rays = n_samples = 0
    for portion in raymap.portions:
        samples = samples_of(portion)
        if samples is None or not len(samples.ray):
            continue
        n_samples += len(samples.ray)
        source = portion.signatures.ray_source[portion.ray_signature]
        group = raymap.group_of_rays(portion)
        measured = _measured(samples.lights)
        for cell, division, room, kept in zip(samples.cells, divisions, in_cell, replicates, strict=True):
            add_to_cells(samples.ray, samples.light, samples.less, cell, measured, source, division, room)
            if n_kept:
                add_to_replicates(samples.ray, samples.light, samples.less, cell, measured, group, kept)
        n_rays += add_rays(samples.ray, samples.light, samples.less, measured, group, groups, rounded)
        if spectrum is not None:
            values = samples.lights.values
            of_ray = np.zeros(n_bands)
            add_spectra(samples.ray, samples.light, samples.less, values, group, spectrum, rounded_bands, of_ray)
    rays = groups
    if n_kept:
        rays = _rays_by_source(raymap, groups)
        divisions = tuple(_with_errors(raymap, *of, groups.total) for of in zip(divisions, replicates, strict=True))
        spectrum = None if spectrum is None else SpectrumSums(*_folded(raymap, spectrum.total, spectrum.squares))
    return Sums(rays, groups, divisions, spectrum, n_rays, n_samples)


def _folded(raymap: RayMap, total: Float, squares: Float) -> tuple[Float, Float]:
    """Sums and effective squares by source of those by source and replicate."""
    rays = raymap.rays_of_replicate
    in_all = by_source(squares, len(rays))
    return by_source(total, len(rays)), effective_squares(rays, total.reshape(*rays.shape, *total.shape[1:]), in_all)


def _rays_by_source(raymap: RayMap, groups: RaySums) -> RaySums:
    """`RaySums` by source."""
    shape = raymap.rays_of_replicate.shape
    return RaySums(
        *_folded(raymap, groups.total, groups.squares), *_folded(raymap, groups.lumen, groups.lumen_squares),
        groups.most.reshape(shape).max(axis=1), groups.most_lumen.reshape(shape).max(axis=1),
    )  # fmt: skip


def _with_errors(raymap: RayMap, cells: CellSums, replicates: Float, total: Float) -> CellSums:
    """Sums of cells with effective squares and products.

    Parameters
    ----------
    replicates : (1 or 2, n_sources * R, n_cells) float64
        Power, and lumens if there are any, by source and replicate.
    total : (n_sources * R,) float64
        Power in all.
    """
    rays = raymap.rays_of_replicate
    power, *lumen = replicates.reshape(len(replicates), *rays.shape, -1)
    in_all = total.reshape(*rays.shape, 1)
    return CellSums(
        cells.cell_light, effective_squares(rays, power, cells.cell_squares),
        effective_products(rays, power, in_all, cells.cell_products),
        effective_squares(rays, lumen[0], cells.cell_lumen_squares) if lumen else cells.cell_lumen_squares,
    )  # fmt: skip


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


def _measured(lights: Lights) -> Float:
    """Power, lumens, red, green and blue of lights, (n_lights, 5)."""
    lumen = lights.lumen_per_w
    return np.column_stack([lights.power, np.zeros(len(lights.values)) if lumen is None else lumen, lights.rgb])
