# SPDX-License-Identifier: LGPL-2.1-or-later
"""A detector on faces, evaluated from the stored events: light that arrived there, or that was absorbed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import CriterionError
from raymaps.kinds import KILL_REASONS, OFF_SURFACE, EventKind
from raymaps.on_the_way import light_on_the_way
from raymaps.results.cells import Samples, rows_that_match, sum_samples
from raymaps.results.detector_result import OVER_AREA, AreaResult, cell_rgb_w, common_fields
from raymaps.results.edges import feature_edges_mm
from raymaps.results.face_cells import CELLS, FaceCells, divided
from raymaps.results.figures import Asked, photometric, radiometric
from raymaps.results.incidence import normals
from raymaps.scene import FaceDetector

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["FaceMap", "evaluate_faces", "face_samples"]

Float = NDArray[np.float64]

_NO_HIT = (*OFF_SURFACE, EventKind.EMISSION, EventKind.CROSSING)
_WORDS = {"incident": "light that arrives", "absorbed": "light that is absorbed"}


@dataclass(frozen=True, kw_only=True)
class FaceMap(AreaResult):
    """Light on faces of a body; cells are ``(n_cells,)``.

    The extremes are those of patches: pieces of a face of about the same area. Smaller ones, of faces that are small
    themselves, set no extreme.

    Attributes
    ----------
    body : str
    faces : tuple of str
    measure : str
        ``incident``: all light that arrives, from either side; ``absorbed``: what of it stays.
    n_patches : int
        Number of patches among which the extremes were sought.
    cells : FaceCells
        Where the cells lie.
    cell_face : (n_cells,) tuple of str
        Face that each cell belongs to.
    edges_mm : (n, 6) float64
        Edges of the body, for pictures.
    """

    body: str
    faces: tuple[str, ...]
    measure: str
    n_patches: int
    cells: FaceCells = field(repr=False)
    cell_face: tuple[str, ...] = field(repr=False)
    edges_mm: Float = field(repr=False)

    @property
    def irradiance_w_per_mm2(self) -> Float:
        """Irradiance of each cell, (n_cells,); NaN where it has no area."""
        area = self.cells.area_mm2
        return np.divide(self.cell_flux_w, area, np.full_like(area, np.nan), where=area > 0)

    def to_dict(self) -> dict[str, Any]:
        """The figures, as the command line and the server print them; arrays are left to `write`."""
        return {
            "detector": self.detector,
            "kind": "face",
            "body": self.body,
            "faces": list(self.faces),
            "measure": self.measure,
            "cells": len(self.cell_flux_w),
            "patches": self.n_patches,
            **self.asked_keys(),
            **self.radiant_keys(),
            **self.further_keys(),
        }

    def conditions(self) -> list[str]:
        """What was asked, in words."""
        told = [_WORDS[self.measure]]
        told += [f"up to {self.max_angle_deg:g}°"] if self.max_angle_deg < 90 else []
        return told + super().conditions()

    def to_text(self) -> str:
        """The figures for people, a line each."""
        faces = f"{len(self.faces)} faces" if len(self.faces) > 3 else ", ".join(self.faces)
        return self.as_text(
            [self.detector, *self.conditions()],
            [
                ("region", f"{faces} of {self.body}, {self.area_mm2:.6g} mm² in {len(self.cell_flux_w)} cells"),
                self.flux_row(),
                ("hits", f"{self.crossings} by {self.rays} rays"),
                *self.density_rows(),
                ("extremes", f"of {self.n_patches} patches"),
            ],
        )

    def write(self, path: str | Path) -> Path:
        """Write a picture (``.png``), a table (``.csv``) or arrays (``.npz``); see `raymaps.results.detector_files`."""
        from raymaps.results.detector_files import write_face_map

        return write_face_map(self, path)


def evaluate_faces(
    raymap: RayMap,
    name: str,
    detector: FaceDetector,
    asked: Asked,
    resolution: tuple[int, int] | None = None,
    max_angle_deg: float | None = None,
) -> FaceMap:
    """What arrived on the faces of a detector, or was absorbed there.

    Parameters
    ----------
    resolution : (n, m), optional
        The faces are divided into about n m cells.
    max_angle_deg : float, optional
        Only light up to this angle of incidence.
    """
    body = raymap.names.bodies.index(detector.body)
    mesh = raymap.meshes[body]
    faces = mesh.face_indices(detector.faces, f"Detector '{name}'")
    cells = divided(mesh, faces, CELLS if resolution is None else resolution[0] * resolution[1])
    if not cells.patch_area_mm2.sum() > 0:
        raise CriterionError(f"Detector '{name}': its faces have no area.")

    def cells_of(triangle: NDArray[np.int64], place_mm: Float) -> tuple[NDArray[np.int64], ...]:
        cell = cells.cell_of(mesh, triangle, place_mm)
        return cell, cells.patch[cell]

    n_patches = len(cells.patch_area_mm2)
    samples_of = face_samples(raymap, name, detector, asked, max_angle_deg, cells_of)
    sums = sum_samples(raymap, samples_of, (len(cells.area_mm2), n_patches))
    counting = cells.is_whole
    watts = radiometric(raymap, asked, sums, 1, cells.patch_area_mm2, counting)
    lumens = photometric(raymap, asked, sums, 1, cells.patch_area_mm2, counting)
    sized = cells.area_mm2 > 0
    cell_watts = radiometric(raymap, asked, sums, 0, cells.area_mm2, sized)
    cell_lumens = photometric(raymap, asked, sums, 0, cells.area_mm2, sized)
    seen: dict[str, Any] = common_fields(OVER_AREA, raymap, asked, sums, watts, lumens)
    if cell_lumens is not None:
        seen |= {"cell_flux_lm": cell_lumens.cells, "cell_stderr_lm": cell_lumens.cells_stderr}
    return FaceMap(
        detector=name,
        body=detector.body,
        faces=tuple(mesh.face_names[i] for i in faces),
        measure=detector.measure,
        max_angle_deg=90.0 if max_angle_deg is None else float(max_angle_deg),
        area_mm2=float(cells.area_mm2.sum()),
        uniformity=watts.uniformity,
        n_patches=int(counting.sum()),
        cells=cells,
        cell_face=tuple(mesh.face_names[i] for i in mesh.triangle_face[cells.triangle]),
        edges_mm=feature_edges_mm(mesh),
        cell_flux_w=cell_watts.cells,
        cell_stderr_w=cell_watts.cells_stderr,
        cell_flux_rgb_w=cell_rgb_w(raymap, sums, 0),
        **seen,
    )


def face_samples(
    raymap: RayMap,
    name: str,
    detector: FaceDetector,
    asked: Asked,
    max_angle_deg: float | None = None,
    cells_of: Callable[[NDArray[np.int64], Float], tuple[NDArray[np.int64], ...]] | None = None,
) -> Callable[[Portion], Samples | None]:
    """What of a portion a detector on faces counts, as a function of the portion.

    Parameters
    ----------
    cells_of : function, optional
        Of the triangles of the body that light met, and of where, to the cells of each division.
    """
    body = raymap.names.bodies.index(detector.body)
    faces = raymap.meshes[body].face_indices(detector.faces, f"Detector '{name}'")
    first_face = next(i for i, (owner, _) in enumerate(raymap.names.faces) if owner == body)
    first_triangle = sum(len(other.triangles) for other in raymap.meshes[:body])
    wanted = np.zeros(len(raymap.names.faces) + 1, bool)
    wanted[first_face + np.asarray(faces)] = True
    hit = np.ones(256, bool)
    hit[list(_NO_HIT)] = False
    absorbed = detector.measure == "absorbed"
    if absorbed:
        hit[list(KILL_REASONS)] = False

    def samples_of(portion: Portion) -> Samples | None:
        table = portion.signatures
        rows = np.flatnonzero((hit[table.kind] & wanted[table.face])[portion.event_step])
        ray = np.searchsorted(portion.event_offsets, rows, side="right") - 1
        rows = rows_that_match(portion, asked.bound, rows, ray)
        if max_angle_deg is not None and len(rows):
            rows = rows[_within(raymap, portion, rows, math.radians(max_angle_deg))]
        if not len(rows):
            return None
        ray = np.searchsorted(portion.event_offsets, rows, side="right") - 1
        place_mm = portion.position_mm[rows].astype(np.float64)
        lights, light_row = light_on_the_way(raymap, portion, rows - 1, lambda some: place_mm[some])
        less = portion.event_light[rows].astype(np.int64) if absorbed else np.zeros(0, np.int64)
        triangle = portion.triangle[rows].astype(np.int64) - first_triangle
        return Samples(ray, lights, light_row, less, cells_of(triangle, place_mm) if cells_of else ())

    return samples_of


def _within(raymap: RayMap, portion: Portion, rows: NDArray[np.int64], largest_rad: float) -> NDArray[np.bool_]:
    """Which events took place up to an angle of incidence; those at the very limit, as far as places tell, did."""
    place_mm = portion.position_mm[rows].astype(np.float64)
    way = place_mm - portion.position_mm[rows - 1]
    normal = normals(raymap, portion.triangle[rows], place_mm)
    cosine = np.abs(np.einsum("ij,ij->i", way, normal))
    angle_rad = np.arctan2(np.linalg.norm(np.cross(way, normal), axis=1), cosine)
    length = np.maximum(np.linalg.norm(way, axis=1), 1e-300)
    return np.asarray(angle_rad <= largest_rad + np.minimum(2 * raymap.manifest.grid_mm / length, 0.01))
