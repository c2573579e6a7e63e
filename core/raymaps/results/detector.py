# SPDX-License-Identifier: LGPL-2.1-or-later
"""A detector evaluated from what is stored: other resolution, acceptance angle, source, rays or region.

Every crossing of a detector's rectangle is stored with its place and angle, whether or not the detector registered it,
so nothing has to be simulated again. Detectors on faces and of the far field read the stored events
(`raymaps.results.face_detector`, `raymaps.results.far_field`). Every figure has its standard error (see
`raymaps.criterion.estimate`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import Area, Criterion, Ellipse, Rectangle, inside_area
from raymaps.errors import CriterionError, unknown_name
from raymaps.on_the_way import light_on_the_way
from raymaps.results.cells import Samples, rows_that_match, sum_samples
from raymaps.results.detector_map import DetectorMap
from raymaps.results.detector_result import OVER_AREA, cell_rgb_w, common_fields
from raymaps.results.figures import Asked, Statistic, asked_rays, photometric, radiometric
from raymaps.results.regions import cell_areas_mm2, cell_centres_mm, cell_edges_mm
from raymaps.scene import FaceDetector, FarFieldDetector, RectangleDetector

if TYPE_CHECKING:
    from raymaps.results.face_detector import FaceMap
    from raymaps.results.far_field import FarFieldMap
    from raymaps.store import Portion, RayMap

__all__ = ["MAX_CELLS", "DetectorMap", "Statistic", "checked_region", "crossing_samples", "evaluate_detector"]

#: How many cells a detector may be divided into.
MAX_CELLS = 4_000_000


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
    area = checked_region(name, detector, rect, ellipse)
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
    samples_of = crossing_samples(raymap, name, detector, asked, resolution, max_angle_deg, area)
    sums = sum_samples(raymap, samples_of, (n_x * n_y,))
    counting = cell_area_mm2 > 0
    centres = np.stack(np.meshgrid(cell_centres_mm(x_edges_mm), cell_centres_mm(y_edges_mm)), axis=-1).reshape(-1, 2)
    if area is not None:
        inside = inside_area(area, centres).reshape(n_y, n_x) & counting
        counting = inside if inside.any() else counting
    watts = radiometric(raymap, asked, sums, 0, cell_area_mm2.ravel(), counting.ravel())
    lumens = photometric(raymap, asked, sums, 0, cell_area_mm2.ravel(), counting.ravel())
    shape = cell_area_mm2.shape
    seen: dict[str, Any] = common_fields(OVER_AREA, raymap, asked, sums, watts, lumens)
    if lumens is not None:
        seen["cell_flux_lm"] = lumens.cells.reshape(shape)
        seen["cell_stderr_lm"] = lumens.cells_stderr.reshape(shape)
    return DetectorMap(
        detector=name,
        side=detector.side,
        width_mm=detector.width_mm,
        height_mm=detector.height_mm,
        resolution=resolution,
        max_angle_deg=detector.max_angle_deg if max_angle_deg is None else float(max_angle_deg),
        area=area,
        area_mm2=area_mm2,
        uniformity=watts.uniformity,
        cell_flux_w=watts.cells.reshape(shape),
        cell_stderr_w=watts.cells_stderr.reshape(shape),
        cell_flux_rgb_w=cell_rgb_w(raymap, sums, 0).reshape(*shape, 3),
        cell_area_mm2=cell_area_mm2,
        **seen,
    )


def crossing_samples(
    raymap: RayMap,
    name: str,
    detector: RectangleDetector,
    asked: Asked,
    resolution: tuple[int, int] = (1, 1),
    max_angle_deg: float | None = None,
    area: Area | None = None,
) -> Callable[[Portion], Samples | None]:
    """What of a portion a rectangle counts, as a function of the portion; parameters as of `evaluate_detector`."""
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

    return samples_of


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


def checked_region(
    name: str,
    detector: RectangleDetector | FaceDetector | FarFieldDetector,
    rect: Sequence[float] | None,
    ellipse: Sequence[float] | None,
) -> Area | None:
    """Region of a detector, None for all of it; raises `CriterionError` where it can't have that one."""
    if rect is not None and ellipse is not None:
        raise CriterionError("The region of a detector is a rectangle or an ellipse, not both.")
    numbers = rect if rect is not None else ellipse
    if numbers is None:
        return None
    if len(numbers) != 4:
        raise CriterionError(f"The region of a detector takes four numbers in mm, got {len(numbers)}.")
    area = Rectangle(*numbers) if rect is not None else Ellipse(*numbers)
    if not isinstance(detector, RectangleDetector):
        what = "the far field" if isinstance(detector, FarFieldDetector) else "faces"
        raise CriterionError(
            f"Detector '{name}' is one of {what}: a rect or ellipse can only be cut out of a rectangle; leave it out."
        )
    x_edges_mm, y_edges_mm = cell_edges_mm(detector.width_mm, 1), cell_edges_mm(detector.height_mm, 1)
    if not cell_areas_mm2(x_edges_mm, y_edges_mm, area).sum() > 0:
        raise CriterionError(
            f"The region lies outside detector '{name}', which reaches {detector.width_mm / 2:g} mm along x and "
            f"{detector.height_mm / 2:g} mm along y from its centre."
        )
    return area


def _checked_resolution(resolution: tuple[int, int]) -> tuple[int, int]:
    n_x, n_y = (int(n) for n in resolution)
    if n_x < 1 or n_y < 1 or n_x * n_y > MAX_CELLS:
        raise CriterionError(
            f"The resolution of a detector must be 1x1 or more and at most {MAX_CELLS} cells, got {n_x}x{n_y}."
        )
    return n_x, n_y
