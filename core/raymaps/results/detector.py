# SPDX-License-Identifier: LGPL-2.1-or-later
"""A detector evaluated from what is stored: other resolution, acceptance angle, source, rays or region.

Every crossing of a detector's rectangle is stored with its place and angle, whether or not the detector registered it,
so nothing has to be simulated again. Detectors on faces and of the far field read the stored events
(`raymaps.results.face_detector`, `raymaps.results.far_field`). Every figure has its standard error (see
`raymaps.criterion.estimate`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import Area, Criterion, Ellipse, Rectangle, inside_area
from raymaps.errors import CriterionError, unknown_name
from raymaps.on_the_way import light_on_the_way
from raymaps.results.cells import Samples, Sums, rows_that_match, sum_samples
from raymaps.results.figures import (
    Asked,
    Spectrum,
    Statistic,
    asked_rays,
    named,
    photometric,
    radiometric,
    spectrum_of,
)
from raymaps.results.regions import cell_areas_mm2, cell_centres_mm, cell_edges_mm
from raymaps.scene import FaceDetector, FarFieldDetector, RectangleDetector
from raymaps.units import format_with_error

if TYPE_CHECKING:
    from raymaps.results.face_detector import FaceMap
    from raymaps.results.far_field import FarFieldMap
    from raymaps.store import Portion, RayMap

__all__ = ["MAX_CELLS", "DetectorMap", "Statistic", "evaluate_detector"]

Float = NDArray[np.float64]

#: How many cells a detector may be divided into.
MAX_CELLS = 4_000_000
#: mm² in a m²: lx are lm/m².
MM2_PER_M2 = 1e6


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
    cell_flux_rgb_w : (n_y, n_x, 3) float64
        Red, green and blue; of a spectral simulation linear sRGB, whose luminance is in units of 683 lm.
    cell_area_mm2 : (n_y, n_x) float64
        Area of each cell in the region.
    flux_lm, mean_lx, min_lx, max_lx : Statistic or None
        Luminous flux and illuminance, as of the radiant ones; None of an RGB simulation, which knows no lumens.
    cell_flux_lm, cell_stderr_lm : (n_y, n_x) float64 or None
    spectrum : Spectrum or None
        Registered light by band, where spectra were stored.
    without : tuple of str
        Effects that were switched off.
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
    flux_lm: Statistic | None = None
    mean_lx: Statistic | None = None
    min_lx: Statistic | None = None
    max_lx: Statistic | None = None
    cell_flux_lm: Float | None = field(default=None, repr=False)
    cell_stderr_lm: Float | None = field(default=None, repr=False)
    spectrum: Spectrum | None = field(default=None, repr=False)
    without: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for array in (self.cell_flux_rgb_w, self.cell_area_mm2):
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
        return _over(self.cell_flux_w, self.cell_area_mm2)

    @property
    def illuminance_lx(self) -> Float | None:
        """Illuminance of each cell, (n_y, n_x), NaN outside the region; None of an RGB simulation."""
        return None if self.cell_flux_lm is None else _over(self.cell_flux_lm, self.cell_area_mm2) * MM2_PER_M2

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
            data |= named(getattr(self, f"{name}_w_per_mm2"), name, "w_per_mm2")
        data["uniformity"] = self.uniformity.value if self.uniformity else None
        data["uniformity_stderr"] = self.uniformity.stderr if self.uniformity else None
        if self.flux_lm is not None:
            data |= named(self.flux_lm, "flux", "lm")
            for name in ("mean", "min", "max"):
                data |= named(getattr(self, f"{name}_lx"), name, "lx")
        if self.spectrum is not None:
            data["spectrum"] = self.spectrum.to_dict()
        if self.without:
            data["without"] = list(self.without)
        return data

    def to_text(self) -> str:
        """The figures for people, a line each."""
        rows = [
            ("flux", with_lumens(self.flux_w, "W", "", self.flux_lm, "lm")),
            ("crossings", f"{self.crossings} by {self.rays} rays"),
        ]
        for name in ("mean", "min", "max"):
            figure: Statistic = getattr(self, f"{name}_w_per_mm2")
            rows.append((name, with_lumens(figure, "W", " per mm²", getattr(self, f"{name}_lx"), "lx")))
        if self.uniformity:
            rows.append(("uniformity", f"{self.uniformity.value:.4g} ± {self.uniformity.stderr:.2g} (min / mean)"))
        rows += without_rows(self.without)
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


def _over(values: Float, areas_mm2: Float) -> Float:
    return np.divide(values, areas_mm2, np.full_like(values, np.nan), where=areas_mm2 > 0)


def with_lumens(figure: Statistic, unit: str, per: str, other: Statistic | None, other_unit: str) -> str:
    """A radiometric figure for people, and behind it the photometric one if there is one."""
    text = f"{format_with_error(figure.value, figure.stderr, unit)}{per}"
    return text if other is None else f"{text}, {format_with_error(other.value, other.stderr, other_unit)}"


def without_rows(without: tuple[str, ...]) -> list[tuple[str, str]]:
    """A row of a text that tells which effects were switched off."""
    return [("without", ", ".join(without))] if without else []


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
) -> DetectorMap | FaceMap | FarFieldMap:
    """What a detector registered, under other conditions if wanted.

    Parameters
    ----------
    raymap : RayMap
    name : str
    resolution : (n_x, n_y), optional
        Cells in place of the detector's own; it changes no flux. Of a far field half planes C and steps in gamma; faces
        are divided into about n_x n_y cells.
    max_angle_deg : float, optional
        Acceptance angle in place of the detector's own, up to 90; it may be larger. On faces the angle of incidence, of
        a far field the angle gamma to its axis.
    source : str, optional
        Only rays of this source.
    where : Criterion or str, optional
        Only rays that match.
    rect, ellipse : four float, optional
        Only light that arrives in this region of a rectangle, in mm from its centre: corners ``(x0, y0, x1, y1)``, or
        centre and radii ``(cx, cy, rx, ry)``.

    Raises
    ------
    CriterionError
        If there is no such detector or source, or a condition makes no sense.
    """
    if name not in raymap.names.detectors:
        raise CriterionError(unknown_name("detector", name, raymap.names.detectors))
    detector = raymap.scene.detectors[name]
    if resolution is not None:
        resolution = _checked_resolution(resolution)
    largest_deg = 180 if isinstance(detector, FarFieldDetector) else 90
    if max_angle_deg is not None and not 0 < max_angle_deg <= largest_deg:
        raise CriterionError(
            f"The acceptance angle must be above 0 and at most {largest_deg} degrees, got {max_angle_deg:g}."
        )
    area = _region(rect, ellipse)
    if area is not None and not isinstance(detector, RectangleDetector):
        what = "the far field" if isinstance(detector, FarFieldDetector) else "faces"
        raise CriterionError(
            f"Detector '{name}' is one of {what}: a rect or ellipse can only be cut out of a rectangle; leave it out."
        )
    asked = asked_rays(raymap, source, where)
    if isinstance(detector, FaceDetector):
        from raymaps.results.face_detector import evaluate_faces

        return evaluate_faces(raymap, name, detector, asked, resolution, max_angle_deg)
    if isinstance(detector, FarFieldDetector):
        from raymaps.results.far_field import evaluate_far_field

        return evaluate_far_field(raymap, name, detector, asked, resolution, max_angle_deg)
    return _evaluate_rectangle(raymap, name, detector, asked, resolution or detector.resolution, max_angle_deg, area)


def _evaluate_rectangle(
    raymap: RayMap,
    name: str,
    detector: RectangleDetector,
    asked: Asked,
    resolution: tuple[int, int],
    max_angle_deg: float | None,
    area: Area | None,
) -> DetectorMap:
    n_x, n_y = resolution
    x_edges_mm, y_edges_mm = cell_edges_mm(detector.width_mm, n_x), cell_edges_mm(detector.height_mm, n_y)
    cell_area_mm2 = cell_areas_mm2(x_edges_mm, y_edges_mm, area)
    area_mm2 = float(cell_area_mm2.sum())
    if not area_mm2 > 0:
        raise CriterionError(
            f"The region lies outside detector '{name}', which reaches {detector.width_mm / 2:g} mm along x and "
            f"{detector.height_mm / 2:g} mm along y from its centre."
        )
    sums = _sum_crossings(raymap, name, detector, asked, resolution, max_angle_deg, area)
    counting = cell_area_mm2 > 0
    centres = np.stack(np.meshgrid(cell_centres_mm(x_edges_mm), cell_centres_mm(y_edges_mm)), axis=-1).reshape(-1, 2)
    if area is not None:
        inside = inside_area(area, centres).reshape(n_y, n_x) & counting
        counting = inside if inside.any() else counting
    watts = radiometric(raymap, asked, sums, 0, cell_area_mm2.ravel(), counting.ravel())
    lumens = photometric(raymap, asked, sums, 0, cell_area_mm2.ravel(), counting.ravel())
    shape = cell_area_mm2.shape
    seen: dict[str, Any] = {} if lumens is None else {
        "flux_lm": lumens.flux,
        "mean_lx": lumens.mean.scaled(MM2_PER_M2),
        "min_lx": lumens.least.scaled(MM2_PER_M2),
        "max_lx": lumens.most.scaled(MM2_PER_M2),
        "cell_flux_lm": lumens.cells.reshape(shape),
        "cell_stderr_lm": lumens.cells_stderr.reshape(shape),
    }  # fmt: skip
    return DetectorMap(
        detector=name,
        side=detector.side,
        width_mm=detector.width_mm,
        height_mm=detector.height_mm,
        resolution=resolution,
        max_angle_deg=detector.max_angle_deg if max_angle_deg is None else float(max_angle_deg),
        source=asked.source,
        criterion=asked.criterion,
        area=area,
        area_mm2=area_mm2,
        rays=sums.n_rays,
        crossings=sums.n_samples,
        flux_w=watts.flux,
        mean_w_per_mm2=watts.mean,
        min_w_per_mm2=watts.least,
        max_w_per_mm2=watts.most,
        uniformity=watts.uniformity,
        cell_flux_w=watts.cells.reshape(shape),
        cell_stderr_w=watts.cells_stderr.reshape(shape),
        cell_flux_rgb_w=cell_rgb_w(raymap, sums, 0).reshape(*shape, 3),
        cell_area_mm2=cell_area_mm2,
        spectrum=spectrum_of(raymap, asked, sums),
        without=raymap.scene.settings.without,
        **seen,
    )


def cell_rgb_w(raymap: RayMap, sums: Sums, division: int) -> Float:
    """Red, green and blue in each cell, (n_cells, 3)."""
    ray_flux_w = raymap.source_flux_w / np.maximum(raymap.rays_of_source, 1)
    return np.asarray(np.einsum("s,scb->cb", ray_flux_w, sums.cells[division].cell_light[:, :, 2:]))


def _sum_crossings(
    raymap: RayMap,
    name: str,
    detector: RectangleDetector,
    asked: Asked,
    resolution: tuple[int, int],
    max_angle_deg: float | None,
    area: Area | None,
) -> Sums:
    """Sums over the crossings that count."""
    from raymaps.results.cells_kernel import rectangle_cells

    index = raymap.names.detectors.index(name)
    center_mm, axes = np.array(detector.center_mm), detector.axes[:2]

    def samples_of(portion: Portion) -> Samples | None:
        rows = _counted(portion, detector, index, max_angle_deg, area)
        rows = rows_that_match(portion, asked.bound, rows, portion.crossing_ray[rows]) if len(rows) else rows
        if not len(rows):
            return None
        xy_mm = portion.crossing_xy_mm
        lights, light_row = light_on_the_way(
            raymap, portion, portion.crossing_row[rows], lambda some: center_mm + xy_mm[rows[some]] @ axes
        )
        cell = np.empty(len(rows), np.int64)
        rectangle_cells(rows, xy_mm, (detector.width_mm, detector.height_mm), resolution, cell)
        return Samples(portion.crossing_ray[rows], lights, light_row, np.zeros(0, np.int64), (cell,))

    return sum_samples(raymap, samples_of, (resolution[0] * resolution[1],))


def _counted(
    portion: Portion, detector: RectangleDetector, index: int, max_angle_deg: float | None, area: Area | None
) -> NDArray[np.int64]:
    """Rows of the crossings that count, whatever their rays."""
    if not portion.n_crossings:
        return np.zeros(0, np.int64)
    counted = portion.crossing_detector == index
    if max_angle_deg is None:
        counted &= portion.crossing_registered
    else:
        counted &= detector.accepts(portion.crossing_angle_rad, math.radians(max_angle_deg))
    rows = np.flatnonzero(counted)
    return rows if area is None else rows[inside_area(area, portion.crossing_xy_mm[rows])]


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
