# SPDX-License-Identifier: LGPL-2.1-or-later
"""The far field, evaluated from the stored events: radiant intensity of the light that left the scene.

Directions are sorted by `raymaps.results.goniometer`. The direction in which a ray left is that of its last segment,
from the stored places of its ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.kinds import EventKind
from raymaps.results.beam import beam_angle_deg
from raymaps.results.cells import Samples, rows_that_match, sum_samples
from raymaps.results.detector_result import OVER_SOLID_ANGLE, DetectorResult, common_fields
from raymaps.results.figures import Asked, Figures, Statistic, photometric, radiometric
from raymaps.results.goniometer import Goniometer
from raymaps.scene import FarFieldDetector

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["BEAM_LEVELS", "FarFieldMap", "evaluate_far_field", "far_field_samples"]

Float = NDArray[np.float64]

#: Shares of the largest intensity at which widths of the beam are told.
BEAM_LEVELS = (0.5, 0.1)
#: Root mean square of the angle between a segment and what is stored of it, in steps of the grid over its length: each
#: end is rounded evenly within half a step along two axes across.
_ROUNDING = math.sqrt(2 * 2 / 12)
#: What light that left has not: an area.
_OVER_AREA_ONLY = ("mean_w_per_mm2", "min_w_per_mm2", "max_w_per_mm2", "uniformity")


@dataclass(frozen=True, kw_only=True)
class FarFieldMap(DetectorResult):
    """Light that left the scene, by direction; each ray counts once.

    Attributes
    ----------
    axes : (3 axes, 3) float64
        Unit vectors of C = 0 and C = 90 at gamma = 90 degrees, and of gamma = 0.
    resolution : (n_c, n_gamma)
        Half planes, and steps in gamma from 0 to 180 degrees.
    mean_w_per_sr, min_w_per_sr, max_w_per_sr : Statistic
        Radiant intensity over all directions up to the largest gamma, and in the extreme cells.
    beam_deg : dict of (level, plane) to float or None
        Full width of the beam where the intensity is 50 and 10 % of the largest, in planes C 0 - 180 and C 90 - 270.
    direction_error_deg : float
        Root mean square of the error of directions, which follow from stored places.
    rays_without_direction : int
        Rays that left where they were; they count to the flux, but in no direction.
    emitted_w : float
        Flux of the sources that count.
    solid_angle_sr, flux_of_cell_w, stderr_of_cell_w : (n_c, n_gamma + 1) float64
        Of the cells around the directions ``c_deg``, ``gamma_deg``; of cells that several half planes share, near the
        axis, each has the same part.
    intensity_w_per_sr, intensity_stderr_w_per_sr : (n_c, n_gamma + 1) float64
    mean_cd, min_cd, max_cd : Statistic or None
        Luminous intensity; None of an RGB simulation.
    intensity_cd, intensity_stderr_cd : (n_c, n_gamma + 1) float64 or None
    """

    units = OVER_SOLID_ANGLE

    axes: Float = field(repr=False)
    resolution: tuple[int, int]
    mean_w_per_sr: Statistic
    min_w_per_sr: Statistic
    max_w_per_sr: Statistic
    beam_deg: dict[tuple[float, str], float | None]
    direction_error_deg: float
    rays_without_direction: int
    emitted_w: float
    solid_angle_sr: Float = field(repr=False)
    flux_of_cell_w: Float = field(repr=False)
    stderr_of_cell_w: Float = field(repr=False)
    intensity_w_per_sr: Float = field(repr=False)
    intensity_stderr_w_per_sr: Float = field(repr=False)
    mean_cd: Statistic | None = None
    min_cd: Statistic | None = None
    max_cd: Statistic | None = None
    intensity_cd: Float | None = field(default=None, repr=False)
    intensity_stderr_cd: Float | None = field(default=None, repr=False)

    @property
    def c_deg(self) -> Float:
        """Angles C of the half planes, (n_c,)."""
        return np.arange(self.resolution[0], dtype=np.float64) * (360.0 / self.resolution[0])

    @property
    def gamma_deg(self) -> Float:
        """Angles gamma, (n_gamma + 1,), from 0 to 180."""
        return np.arange(self.resolution[1] + 1, dtype=np.float64) * (180.0 / self.resolution[1])

    def to_dict(self) -> dict[str, Any]:
        """The figures, as the command line and the server print them; arrays are left to `write`."""
        beams = {f"beam_{level * 100:.0f}_{plane}_deg": width for (level, plane), width in self.beam_deg.items()}
        return {
            "detector": self.detector,
            "kind": "far_field",
            "axis": self.axes[2].tolist(),
            "x_axis": self.axes[0].tolist(),
            "resolution": list(self.resolution),
            **self.asked_keys(),
            **self.radiant_keys(),
            **beams,
            "direction_error_deg": self.direction_error_deg,
            "rays_without_direction": self.rays_without_direction,
            **dict.fromkeys(_OVER_AREA_ONLY),
            **self.further_keys(),
        }

    def conditions(self) -> list[str]:
        """What was asked, in words."""
        told = [f"gamma up to {self.max_angle_deg:g}°"] if self.max_angle_deg < 180 else []
        return told + super().conditions()

    def to_text(self) -> str:
        """The figures for people, a line each."""
        n_c, n_gamma = self.resolution
        axis = ", ".join(f"{x + 0.0:.4g}" for x in self.axes[2])
        rows = [
            ("directions", f"{n_c} half planes C, gamma in steps of {180 / n_gamma:.4g}° from the axis ({axis})"),
            self.flux_row(),
            ("rays", f"{self.rays}"),
            *self.density_rows(),
        ]
        for level in BEAM_LEVELS:
            widths = ((words, self.beam_deg[level, plane]) for plane, words in _PLANES.items())
            told = (f"{'none' if width is None else f'{width:.4g}°'} in {words}" for words, width in widths)
            rows.append((f"beam {level * 100:.0f} %", ", ".join(told)))
        rows.append(("precision", f"{self.direction_error_deg:.2g}° of directions"))
        if self.rays_without_direction:
            rows.append(("undirected", f"{self.rays_without_direction} rays left where they were, in no direction"))
        return self.as_text([self.detector, "light that left the scene", *self.conditions()], rows)

    def write(self, path: str | Path) -> Path:
        """Write a picture (``.png``), table (``.csv``), arrays (``.npz``), LM-63 (``.ies``) or EULUMDAT (``.ldt``)."""
        from raymaps.results.detector_files import write_far_field

        return write_far_field(self, path)


#: Planes in which widths are told: their first half plane, and in words.
_PLANES = {"c0": "C 0 - 180", "c90": "C 90 - 270"}


def evaluate_far_field(
    raymap: RayMap,
    name: str,
    detector: FarFieldDetector,
    asked: Asked,
    resolution: tuple[int, int] | None = None,
    max_angle_deg: float | None = None,
) -> FarFieldMap:
    """Intensity of what left a scene.

    Parameters
    ----------
    resolution : (n_c, n_gamma), optional
        In place of the detector's own.
    max_angle_deg : float, optional
        Only directions up to this angle gamma to the axis.
    """
    resolution = resolution or detector.resolution
    largest_rad = math.pi if max_angle_deg is None else math.radians(max_angle_deg)
    goniometer = Goniometer(*resolution, largest_rad)
    axes = detector.axes
    doubts: list[tuple[float, float, int]] = []  # of each portion: light, its squared errors, rays without direction

    def samples_of(portion: Portion) -> Samples | None:
        ray, row = _left(portion, asked)
        way = portion.position_mm[row].astype(np.float64) - portion.position_mm[row - 1]
        length = np.linalg.norm(way, axis=1)
        x, y, z = (way @ axes.T).T
        gamma = np.arctan2(np.hypot(x, y), z)
        if max_angle_deg is not None:
            slack = np.minimum(2 * raymap.manifest.grid_mm / np.maximum(length, 1e-300), 0.01)
            inside = gamma <= largest_rad + slack
            ray, row, length, x, y, gamma = (a[inside] for a in (ray, row, length, x, y, gamma))
        if not len(ray):
            return None
        power = portion.power[row]
        error = _ROUNDING * raymap.manifest.grid_mm / np.where(length > 0, length, np.inf)
        doubts.append((float(power.sum()), float((power * error**2).sum()), int((length == 0).sum())))
        cell = goniometer.cell_of(gamma, np.arctan2(y, x))
        cell[length == 0] = -1
        return Samples(ray, portion.lights, portion.event_light[row].astype(np.int64), np.zeros(0, np.int64), (cell,))

    measure = goniometer.solid_angle_sr
    sums = sum_samples(raymap, samples_of, (len(measure),))
    watts = radiometric(raymap, asked, sums, 0, measure, measure > 0)
    lumens = photometric(raymap, asked, sums, 0, measure, measure > 0)
    light, squares, undirected = (sum(column) for column in zip(*doubts, strict=True)) if doubts else (0.0, 0.0, 0)
    solid_angle_sr = goniometer.on_grid(measure, shared=True)
    intensity, intensity_stderr = _intensities(watts, measure, goniometer)
    seen: dict[str, Any] = common_fields(OVER_SOLID_ANGLE, raymap, asked, sums, watts, lumens)
    if lumens is not None:
        seen["intensity_cd"], seen["intensity_stderr_cd"] = _intensities(lumens, measure, goniometer)
    return FarFieldMap(
        detector=name,
        axes=axes,
        resolution=resolution,
        max_angle_deg=180.0 if max_angle_deg is None else float(max_angle_deg),
        beam_deg={
            (level, plane): beam_angle_deg(np.nan_to_num(intensity), level, c_deg)
            for level in BEAM_LEVELS
            for plane, c_deg in (("c0", 0.0), ("c90", 90.0))
        },
        direction_error_deg=math.degrees(math.sqrt(squares / light)) if light > 0 else 0.0,
        rays_without_direction=int(undirected),
        emitted_w=float(
            sum(s.flux_w for key, s in raymap.scene.sources.items() if asked.source is None or key == asked.source)
        ),
        solid_angle_sr=solid_angle_sr,
        flux_of_cell_w=goniometer.on_grid(watts.cells, shared=True),
        stderr_of_cell_w=goniometer.on_grid(watts.cells_stderr, shared=True),
        intensity_w_per_sr=intensity,
        intensity_stderr_w_per_sr=intensity_stderr,
        **seen,
    )


def far_field_samples(asked: Asked) -> Callable[[Portion], Samples | None]:
    """Light of a portion that left the scene, in whatever direction, as a function of the portion."""

    def samples_of(portion: Portion) -> Samples | None:
        ray, row = _left(portion, asked)
        light = portion.event_light[row].astype(np.int64)
        return Samples(ray, portion.lights, light, np.zeros(0, np.int64), ())

    return samples_of


def _left(portion: Portion, asked: Asked) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rays of a portion that left the scene and match, and their last events."""
    ray = np.flatnonzero((portion.signatures.ending == EventKind.LEFT)[portion.ray_signature])
    ray = rows_that_match(portion, asked.bound, ray, ray)
    return ray, portion.event_offsets[ray + 1] - 1


def _intensities(figures: Figures, measure: Float, goniometer: Goniometer) -> tuple[Float, Float]:
    """Intensity in each direction and its error; NaN where no direction counts."""
    over = [
        np.divide(values, measure, np.full_like(values, np.nan), where=measure > 0)
        for values in (figures.cells, figures.cells_stderr)
    ]
    intensity, stderr = (goniometer.on_grid(values, shared=False) for values in over)
    return intensity, stderr
