# SPDX-License-Identifier: LGPL-2.1-or-later
"""Figures of a detector from its sums over rays: flux, mean, extremes and uniformity, each with its standard error."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import (
    Bound,
    Criterion,
    Everything,
    From,
    all_of,
    bind,
    by_source,
    confidence_interval,
    covariance_w2,
    estimate_flux,
    format_criterion,
    parse_criterion,
)
from raymaps.results.cells import CellSums, Sums
from raymaps.store import Lights

if TYPE_CHECKING:
    from raymaps.store import RayMap

__all__ = [
    "Asked",
    "Figures",
    "Spectrum",
    "Statistic",
    "asked_rays",
    "named",
    "photometric",
    "radiometric",
    "spectrum_of",
]

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Statistic:
    """A figure with its standard error."""

    value: float
    stderr: float

    def scaled(self, factor: float) -> Statistic:
        """In another unit."""
        return Statistic(self.value * factor, self.stderr * factor)


@dataclass(frozen=True)
class Figures:
    """Figures of a detector in one kind of unit: radiometric or photometric.

    Attributes
    ----------
    flux : Statistic
    interval : (low, high)
        Limits that contain the true flux with 95 % confidence.
    mean, least, most : Statistic
        Flux over what the cells measure (area, solid angle), of all cells that count and of the extreme ones.
    uniformity : Statistic or None
        Least over mean; None where nothing arrived.
    cells, cells_stderr : (n_cells,) float64
        Flux in each cell and its standard error.
    """

    flux: Statistic
    interval: tuple[float, float]
    mean: Statistic
    least: Statistic
    most: Statistic
    uniformity: Statistic | None
    cells: Float = field(repr=False)
    cells_stderr: Float = field(repr=False)

    def __post_init__(self) -> None:
        for array in (self.cells, self.cells_stderr):
            array.setflags(write=False)


@dataclass(frozen=True)
class Spectrum:
    """Light by band.

    Attributes
    ----------
    low_nm, high_nm : (n_bands,) float64
        Borders of each band, equal for a single wavelength.
    flux_w, stderr_w : (n_bands,) float64
    """

    low_nm: Float = field(repr=False)
    high_nm: Float = field(repr=False)
    flux_w: Float = field(repr=False)
    stderr_w: Float = field(repr=False)

    def __post_init__(self) -> None:
        for array in (self.flux_w, self.stderr_w):
            array.setflags(write=False)

    @property
    def density_w_per_nm(self) -> Float:
        """Spectral flux, (n_bands,); NaN for single wavelengths, which have no width."""
        width = self.high_nm - self.low_nm
        return np.divide(self.flux_w, width, np.full_like(self.flux_w, np.nan), where=width > 0)

    def to_dict(self) -> dict[str, list[float]]:
        """As the command line and the server print it."""
        return {
            "low_nm": self.low_nm.tolist(),
            "high_nm": self.high_nm.tolist(),
            "flux_w": self.flux_w.tolist(),
            "flux_stderr_w": self.stderr_w.tolist(),
        }


@dataclass(frozen=True)
class Asked:
    """Which rays count: those of a source, and that match a criterion.

    Attributes
    ----------
    source : str or None
    criterion : str or None
    bound : Bound
    impossible : (n_sources,) bool
        Sources that the conditions rule out, of which there is no error.
    """

    source: str | None
    criterion: str | None
    bound: Bound
    impossible: NDArray[np.bool_]


def asked_rays(raymap: RayMap, source: str | None, where: Criterion | str | None) -> Asked:
    """Conditions on rays, looked up in a map; raises `CriterionError`."""
    criterion = parse_criterion(where) if isinstance(where, str) else where
    conditions = [*([From(source)] if source is not None else []), *([criterion] if criterion is not None else [])]
    bound = bind(all_of(conditions), raymap.names, raymap.scene.detectors)
    text = None if criterion is None or isinstance(criterion, Everything) else format_criterion(criterion)
    return Asked(source, text, bound, ~bound.on_sources(len(raymap.names.sources)).maybe)


def radiometric(
    raymap: RayMap, asked: Asked, sums: Sums, division: int, measure: Float, counting: NDArray[np.bool_]
) -> Figures:
    """Figures in W.

    Parameters
    ----------
    division : int
        Which of the divisions into cells.
    measure : (n_cells,) float64
        Area or solid angle of each cell.
    counting : (n_cells,) bool
        Cells among which the extremes are sought.
    """
    cells = sums.cells[division]
    return _figures(
        raymap, asked, (sums.rays.total, sums.rays.squares, sums.groups.squares, sums.rays.most),
        (cells.cell_light[:, :, 0], cells.cell_squares), cells,
        np.ones(len(raymap.names.sources)), measure, counting,
    )  # fmt: skip


def photometric(
    raymap: RayMap, asked: Asked, sums: Sums, division: int, measure: Float, counting: NDArray[np.bool_]
) -> Figures | None:
    """Figures in lm, without a uniformity; None of RGB light. Parameters as of `radiometric`."""
    lumen_per_w = raymap.bands.lumen_per_w
    if lumen_per_w is None:
        return None
    emitted = _at_emission(raymap, lambda lights: lights.lumen_per_w, float(lumen_per_w.max()))
    cells = sums.cells[division]
    return _figures(
        raymap, asked, (sums.rays.lumen, sums.rays.lumen_squares, sums.groups.lumen_squares, sums.rays.most_lumen),
        (cells.cell_light[:, :, 1], cells.cell_lumen_squares), None, emitted, measure, counting,
    )  # fmt: skip


def _figures(
    raymap: RayMap,
    asked: Asked,
    in_all: tuple[Float, Float, Float, Float],
    of_cells: tuple[Float, Float],
    products: CellSums | None,
    light_of_one: Float,
    measure: Float,
    counting: NDArray[np.bool_],
) -> Figures:
    flux_w, n_rays = raymap.source_flux_w, raymap.rays_of_source
    total, squares, of_groups, most = in_all
    cell_total, cell_squares = of_cells
    of_rays = (flux_w, n_rays, total, squares, asked.impossible, light_of_one)
    flux, stderr = estimate_flux(*of_rays)
    low, high = confidence_interval(*of_rays, most=np.maximum(most, light_of_one))
    # An empty cell is as uncertain as one ray there: a typical one of those that arrived, or one with all its light.
    typical = np.divide(by_source(of_groups, len(total)), total, light_of_one.copy(), where=total > 0)
    cells, cells_stderr = estimate_flux(flux_w, n_rays, cell_total, cell_squares, asked.impossible, typical[:, None])
    whole = float(measure.sum())
    mean = Statistic(float(flux / whole), float(stderr / whole))
    chosen = np.flatnonzero(counting)
    density = cells[chosen] / measure[chosen]

    def of_cell(cell: np.intp) -> Statistic:
        return Statistic(float(cells[cell] / measure[cell]), float(cells_stderr[cell] / measure[cell]))

    darkest, brightest = chosen[np.argmin(density)], chosen[np.argmax(density)]
    least = of_cell(darkest)
    uniformity = None
    if products is not None and mean.value > 0:
        # u = min / mean: var u = (var min + u² var mean - 2 u cov(min, mean)) / mean²
        covariance = covariance_w2(
            flux_w, n_rays, cell_total[:, darkest], total, products.cell_products[:, darkest]
        ) / (measure[darkest] * whole)
        u = least.value / mean.value
        variance = least.stderr**2 + u**2 * mean.stderr**2 - 2 * u * float(covariance)
        uniformity = Statistic(u, math.sqrt(max(variance, 0.0)) / mean.value)
    return Figures(
        Statistic(float(flux), float(stderr)), (float(low), float(high)), mean, least, of_cell(brightest), uniformity,
        cells, cells_stderr,
    )  # fmt: skip


def spectrum_of(raymap: RayMap, asked: Asked, sums: Sums) -> Spectrum | None:
    """Light by band; None where no spectra were stored."""
    if sums.spectrum is None:
        return None
    total, squares = sums.spectrum
    emitted = _at_emission(raymap, lambda lights: lights.spectra, np.ones(raymap.bands.n))
    flux, stderr = estimate_flux(raymap.source_flux_w, raymap.rays_of_source, total, squares, asked.impossible, emitted)
    return Spectrum(raymap.bands.low_nm, raymap.bands.high_nm, flux, stderr)


def _at_emission(raymap: RayMap, value: Callable[[Lights], Any], unknown: Any) -> Float:
    """A value of the light that the first ray of each source was emitted with, (n_sources, ...)."""
    found: dict[int, Any] = {}
    sources = range(len(raymap.names.sources))
    for portion in raymap.portions:
        of_ray = portion.signatures.ray_source[portion.ray_signature]
        for source in set(sources) - found.keys():
            rays = np.flatnonzero(of_ray == source)
            if len(rays):
                light = portion.event_light[portion.event_offsets[rays[0]]]
                found[source] = value(portion.lights)[light]
        if len(found) == len(sources):
            break
    return np.array([found.get(source, unknown) for source in sources], np.float64)


def named(figure: Statistic, name: str, unit: str) -> dict[str, Any]:
    """A figure and its error under the keys of JSON: ``mean_w_per_mm2``, ``mean_stderr_w_per_mm2``."""
    return {f"{name}_{unit}": figure.value, f"{name}_stderr_{unit}": figure.stderr}
