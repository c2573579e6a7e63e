# SPDX-License-Identifier: LGPL-2.1-or-later
"""A detector evaluated from the stored crossings: other resolution, acceptance angle, source, rays or region.

Every crossing of a detector's rectangle is stored with its place and angle, whether or not the detector registered it,
so nothing has to be simulated again. Every figure has its standard error (see `raymaps.criterion.estimate`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import (
    Area,
    Criterion,
    Ellipse,
    Everything,
    From,
    Rectangle,
    all_of,
    bind,
    covariance_w2,
    estimate_flux,
    format_criterion,
    inside_area,
    parse_criterion,
)
from raymaps.errors import CriterionError, unknown_name
from raymaps.results.cells import CellSums, sum_cells
from raymaps.results.regions import cell_areas_mm2, cell_centres_mm, cell_edges_mm
from raymaps.units import format_flux

if TYPE_CHECKING:
    from raymaps.store import RayMap

__all__ = ["MAX_CELLS", "DetectorMap", "Statistic", "evaluate_detector"]

Float = NDArray[np.float64]

#: How many cells a detector may be divided into.
MAX_CELLS = 4_000_000


@dataclass(frozen=True)
class Statistic:
    """A figure with its standard error."""

    value: float
    stderr: float


@dataclass(frozen=True)
class DetectorMap:
    """What a detector registered.

    Attributes
    ----------
    detector, side : str
    width_mm, height_mm : float
        Of the whole detector.
    resolution : (n_x, n_y)
    max_angle_deg : float
        Acceptance angle: 0 is head-on.
    source, criterion : str or None
        Which rays count.
    area : Rectangle, Ellipse or None
        Region of the detector that counts, in mm from its centre.
    area_mm2 : float
        Of the region.
    rays, crossings : int
        Rays that were registered, and how often.
    flux_w : Statistic
    mean_w_per_mm2, min_w_per_mm2, max_w_per_mm2 : Statistic
        Irradiance: flux over the region's area, and of the darkest and brightest cell. Cells count whose centre lies in
        the region (all that overlap it if it holds no centre), and of each the part in the region. The extremes of many
        noisy cells lie below and above the true ones; a coarser resolution shows how much.
    uniformity : Statistic or None
        Minimum over mean; None where no light arrived.
    cell_flux_w, cell_stderr_w : (n_y, n_x) float64
        Flux in each cell (its part in the region) and its standard error; the first row is the lowest y.
    cell_flux_rgb_w : (n_y, n_x, 3 bands) float64
    cell_area_mm2 : (n_y, n_x) float64
        Area of each cell in the region.
    """

    detector: str
    side: str
    width_mm: float
    height_mm: float
    resolution: tuple[int, int]
    max_angle_deg: float
    source: str | None
    criterion: str | None
    area: Area | None
    area_mm2: float
    rays: int
    crossings: int
    flux_w: Statistic
    mean_w_per_mm2: Statistic
    min_w_per_mm2: Statistic
    max_w_per_mm2: Statistic
    uniformity: Statistic | None
    cell_flux_w: Float = field(repr=False)
    cell_stderr_w: Float = field(repr=False)
    cell_flux_rgb_w: Float = field(repr=False)
    cell_area_mm2: Float = field(repr=False)

    def __post_init__(self) -> None:
        for array in (self.cell_flux_w, self.cell_stderr_w, self.cell_flux_rgb_w, self.cell_area_mm2):
            array.setflags(write=False)

    @property
    def x_edges_mm(self) -> Float:
        """Borders of the cells along x, (n_x + 1,)."""
        return cell_edges_mm(self.width_mm, self.resolution[0])

    @property
    def y_edges_mm(self) -> Float:
        """Borders of the cells along y, (n_y + 1,)."""
        return cell_edges_mm(self.height_mm, self.resolution[1])

    @property
    def irradiance_w_per_mm2(self) -> Float:
        """Irradiance of each cell, (n_y, n_x); NaN outside the region."""
        return np.divide(
            self.cell_flux_w, self.cell_area_mm2, np.full_like(self.cell_flux_w, np.nan), where=self.cell_area_mm2 > 0
        )

    def to_dict(self) -> dict[str, Any]:
        """The figures, as the command line and the server print them; arrays are left to `write`."""
        data: dict[str, Any] = {
            "detector": self.detector,
            "side": self.side,
            "resolution": list(self.resolution),
            "max_angle_deg": self.max_angle_deg,
            "source": self.source,
            "criterion": self.criterion,
            "area": None if self.area is None else {self.area.word: list(self.area.numbers)},
            "area_mm2": self.area_mm2,
            "rays": self.rays,
            "crossings": self.crossings,
            "flux_w": self.flux_w.value,
            "flux_stderr_w": self.flux_w.stderr,
        }
        for name in ("mean", "min", "max"):
            figure: Statistic = getattr(self, f"{name}_w_per_mm2")
            data[f"{name}_w_per_mm2"] = figure.value
            data[f"{name}_stderr_w_per_mm2"] = figure.stderr
        data["uniformity"] = self.uniformity.value if self.uniformity else None
        data["uniformity_stderr"] = self.uniformity.stderr if self.uniformity else None
        return data

    def to_text(self) -> str:
        """The figures for people, a line each."""
        rows = [
            ("flux", format_flux(self.flux_w.value, self.flux_w.stderr)),
            ("crossings", f"{self.crossings} by {self.rays} rays"),
        ]
        for name in ("mean", "min", "max"):
            figure: Statistic = getattr(self, f"{name}_w_per_mm2")
            rows.append((name, f"{format_flux(figure.value, figure.stderr)} per mm²"))
        if self.uniformity:
            rows.append(("uniformity", f"{self.uniformity.value:.4g} ± {self.uniformity.stderr:.2g} (min / mean)"))
        title = f"{self.detector}, {self.side} side up to {self.max_angle_deg:g}°"
        title += f", from {self.source}" if self.source is not None else ""
        title += f", where {self.criterion}" if self.criterion is not None else ""
        region = (
            "all of it"
            if self.area is None
            else f"{self.area.word} {', '.join(f'{n:g}' for n in self.area.numbers)} mm"
        )
        rows.insert(
            0, ("region", f"{region}, {self.area_mm2:.6g} mm² in {self.resolution[0]} x {self.resolution[1]} cells")
        )
        return "\n".join([title, *(f"  {name:<12}{text}" for name, text in rows)])

    def write(self, path: str | Path) -> Path:
        """Write a picture (``.png``), a table (``.csv``) or arrays (``.npz``); see `raymaps.results.detector_files`."""
        from raymaps.results.detector_files import write_detector_map

        return write_detector_map(self, path)


def evaluate_detector(
    raymap: RayMap,
    name: str,
    *,
    resolution: tuple[int, int] | None = None,
    max_angle_deg: float | None = None,
    source: str | None = None,
    where: Criterion | str | None = None,
    rect: Sequence[float] | None = None,
    ellipse: Sequence[float] | None = None,
) -> DetectorMap:
    """What a detector registered, under other conditions if wanted.

    Parameters
    ----------
    raymap : RayMap
    name : str
    resolution : (n_x, n_y), optional
        Cells in place of the detector's own; it changes no flux.
    max_angle_deg : float, optional
        Acceptance angle in place of the detector's own, up to 90; it may be larger.
    source : str, optional
        Only rays of this source.
    where : Criterion or str, optional
        Only rays that match.
    rect, ellipse : four float, optional
        Only light that arrives in this region, in mm from the detector's centre: corners ``(x0, y0, x1, y1)``, or
        centre and radii ``(cx, cy, rx, ry)``.

    Raises
    ------
    CriterionError
        If there is no such detector or source, or a condition makes no sense.
    """
    names = raymap.names
    if name not in names.detectors:
        raise CriterionError(unknown_name("detector", name, names.detectors))
    detector = raymap.scene.detectors[name]
    n_x, n_y = resolution = _checked_resolution(resolution or detector.resolution)
    if max_angle_deg is not None and not 0 < max_angle_deg <= 90:
        raise CriterionError(f"The acceptance angle must be above 0 and at most 90 degrees, got {max_angle_deg:g}.")
    area = _region(rect, ellipse)
    criterion = parse_criterion(where) if isinstance(where, str) else where
    conditions = [*([From(source)] if source is not None else []), *([criterion] if criterion is not None else [])]
    bound = bind(all_of(conditions), names)
    x_edges_mm, y_edges_mm = cell_edges_mm(detector.width_mm, n_x), cell_edges_mm(detector.height_mm, n_y)
    cell_area_mm2 = cell_areas_mm2(x_edges_mm, y_edges_mm, area)
    area_mm2 = float(cell_area_mm2.sum())
    if not area_mm2 > 0:
        raise CriterionError(
            f"The region lies outside detector '{name}', which reaches {detector.width_mm / 2:g} mm along x and "
            f"{detector.height_mm / 2:g} mm along y from its centre."
        )
    sums, n_rays, n_crossings = sum_cells(
        raymap,
        names.detectors.index(name),
        resolution,
        None if max_angle_deg is None else math.radians(max_angle_deg),
        area,
        bound,
    )
    counting = cell_area_mm2 > 0
    centres = np.stack(np.meshgrid(cell_centres_mm(x_edges_mm), cell_centres_mm(y_edges_mm)), axis=-1).reshape(-1, 2)
    if area is not None:
        inside = inside_area(area, centres).reshape(n_y, n_x) & counting
        counting = inside if inside.any() else counting
    figures = _statistics(
        sums,
        raymap.source_flux_w,
        raymap.rays_of_source,
        ~bound.on_sources(len(names.sources)).maybe,
        cell_area_mm2,
        counting,
    )
    return DetectorMap(
        detector=name,
        side=detector.side,
        width_mm=detector.width_mm,
        height_mm=detector.height_mm,
        resolution=resolution,
        max_angle_deg=detector.max_angle_deg if max_angle_deg is None else float(max_angle_deg),
        source=source,
        criterion=None if criterion is None or isinstance(criterion, Everything) else format_criterion(criterion),
        area=area,
        area_mm2=area_mm2,
        rays=n_rays,
        crossings=n_crossings,
        cell_area_mm2=cell_area_mm2,
        **figures,
    )


def _region(rect: Sequence[float] | None, ellipse: Sequence[float] | None) -> Area | None:
    if rect is not None and ellipse is not None:
        raise CriterionError("The region of a detector is a rectangle or an ellipse, not both.")
    numbers = rect if rect is not None else ellipse
    if numbers is None:
        return None
    if len(numbers) != 4:
        raise CriterionError(f"The region of a detector takes four numbers in mm, got {len(numbers)}.")
    return Rectangle(*numbers) if rect is not None else Ellipse(*numbers)


def _checked_resolution(resolution: tuple[int, int]) -> tuple[int, int]:
    n_x, n_y = (int(n) for n in resolution)
    if n_x < 1 or n_y < 1 or n_x * n_y > MAX_CELLS:
        raise CriterionError(
            f"The resolution of a detector must be 1x1 or more and at most {MAX_CELLS} cells, got {n_x}x{n_y}."
        )
    return n_x, n_y


def _statistics(
    sums: CellSums,
    source_flux_w: Float,
    n_rays: NDArray[np.int64],
    impossible: NDArray[np.bool_],
    cell_area_mm2: Float,
    counting: NDArray[np.bool_],
) -> dict[str, Any]:
    """The figures of a `DetectorMap` from sums over rays; sources that can't match have no error."""
    shape = cell_area_mm2.shape
    flux_w, stderr_w = estimate_flux(source_flux_w, n_rays, sums.total, sums.squares, impossible)
    # An empty cell is as uncertain as one ray there: a typical one of those that arrived, or one with all its light.
    typical = np.divide(sums.squares, sums.total, np.ones_like(sums.total), where=sums.total > 0)
    cell_total = sums.cell_light[:, :, 0]
    cell_w, cell_stderr_w = estimate_flux(
        source_flux_w, n_rays, cell_total, sums.cell_squares, impossible, typical[:, None]
    )
    ray_flux_w = source_flux_w / np.maximum(n_rays, 1)
    area_mm2 = cell_area_mm2.sum()
    mean = Statistic(float(flux_w / area_mm2), float(stderr_w / area_mm2))

    cells = np.flatnonzero(counting)
    area_of = cell_area_mm2.ravel()
    irradiance = cell_w[cells] / area_of[cells]
    darkest, brightest = cells[np.argmin(irradiance)], cells[np.argmax(irradiance)]

    def of_cell(cell: np.intp) -> Statistic:
        return Statistic(float(cell_w[cell] / area_of[cell]), float(cell_stderr_w[cell] / area_of[cell]))

    least = of_cell(darkest)
    uniformity = None
    if mean.value > 0:
        # u = min / mean: var u = (var min + u² var mean - 2 u cov(min, mean)) / mean²
        covariance = covariance_w2(
            source_flux_w, n_rays, cell_total[:, darkest], sums.total, sums.cell_products[:, darkest]
        ) / (area_of[darkest] * area_mm2)
        u = least.value / mean.value
        variance = least.stderr**2 + u**2 * mean.stderr**2 - 2 * u * float(covariance)
        uniformity = Statistic(u, math.sqrt(max(variance, 0.0)) / mean.value)
    return {
        "flux_w": Statistic(float(flux_w), float(stderr_w)),
        "mean_w_per_mm2": mean,
        "min_w_per_mm2": least,
        "max_w_per_mm2": of_cell(brightest),
        "uniformity": uniformity,
        "cell_flux_w": cell_w.reshape(shape),
        "cell_stderr_w": cell_stderr_w.reshape(shape),
        "cell_flux_rgb_w": np.einsum("s,scb->cb", ray_flux_w, sums.cell_light[:, :, 2:]).reshape(*shape, 3),
    }
