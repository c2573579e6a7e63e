# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which faces of a scene have an exact surface that can be used, and why the others do not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.exact.surfaces import Cone, Surface, exact_surface
from raymaps.geometry import BodyMesh
from raymaps.scene import Body, OtherSurface, Scene
from raymaps.scene.exact_surfaces import why_kept

__all__ = ["ExactFaces", "Fallback", "exact_faces", "facet_error_mm"]

Array = NDArray[np.float64]

#: How far vertices may lie off their surface: of the body's size, and in mm (CAD programs work to 1e-7 mm).
OFF_SHARE, OFF_MM = 1e-6, 3e-7
#: Share of a face's area that may look against the rest of it: slivers are folded over by rounding.
FOLDED_SHARE = 0.01


class Fallback(NamedTuple):
    """A face that stays facets though its exact surface was asked for.

    ``error_mm`` estimates how far its facets are from the true surface.
    """

    body: str
    face: str
    reason: str
    error_mm: float


class ExactFaces(NamedTuple):
    """Exact surface of each face of all bodies, None for facets, and the faces that fell back to them."""

    surfaces: tuple[Surface | None, ...]
    fallbacks: tuple[Fallback, ...]


def exact_faces(scene: Scene, meshes: Sequence[BodyMesh]) -> ExactFaces:
    """Find the exact surface of each face that names one which its triangles stand on.

    Parameters
    ----------
    scene : Scene
    meshes : its bodies, in its order
    """
    surfaces: list[Surface | None] = []
    fallbacks: list[Fallback] = []
    for mesh, body in zip(meshes, scene.bodies.values(), strict=True):
        records = _records(body, mesh) if scene.settings.surfaces == "exact" else {}
        for face, name in enumerate(mesh.face_names):
            surface = None
            if records.get(name) is not None:
                surface, reason = _usable(records[name], mesh, face)
                if surface is None:
                    fallbacks.append(Fallback(mesh.name, name, reason, facet_error_mm(mesh, face)))
            surfaces.append(surface)
    return ExactFaces(tuple(surfaces), tuple(fallbacks))


def facet_error_mm(mesh: BodyMesh, face: int) -> float:
    """About how far the facets of a face lie from the smooth surface that they stand for.

    Facets of width w that turn by an angle a from one to the next stand w a / 8 off an arc through their borders.
    """
    corners = mesh.corners_mm[(mesh.triangle_face == face) & ~mesh.degenerate]
    if len(corners) < 2:
        return 0.0
    size = float(np.ptp(mesh.vertices_mm, axis=0).max())
    cells = np.round((corners.reshape(-1, 3) - corners.reshape(-1, 3).min(axis=0)) / (1e-7 * size)).astype(np.int64)
    vertex = np.unique(cells, axis=0, return_inverse=True)[1].reshape(-1, 3)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double_area = np.linalg.norm(normal, axis=1)
    normal /= double_area[:, None]

    ends = np.stack([vertex, np.roll(vertex, -1, axis=1)], axis=2).reshape(-1, 2)
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).reshape(-1)
    key = ends.min(axis=1) * (vertex.max() + 1) + ends.max(axis=1)
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    first, second = order[same], order[same + 1]
    turn = np.arccos(np.clip(np.einsum("ij,ij->i", normal[first // 3], normal[second // 3]), -1, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        width = 0.5 * (double_area[first // 3] + double_area[second // 3]) / length[first]
    return float(np.max(np.nan_to_num(width) * turn, initial=0.0) / 8)


def _records(body: Body, mesh: BodyMesh) -> dict[str, Any]:
    groups = body.geometry.faces or ()
    return dict(zip(mesh.face_names, (group.surface for group in groups), strict=True)) if groups else {}


def _usable(record: Any, mesh: BodyMesh, face: int) -> tuple[Surface | None, str]:
    """The surface, or None and why its facets have to stand for it."""
    if isinstance(record, dict):
        return None, str(why_kept(record))
    if isinstance(record, OtherSurface):
        return None, record.reason or f"the CAD program only names it: {record.name or 'other'}"
    surface = exact_surface(record)
    corners = mesh.corners_mm[(mesh.triangle_face == face) & ~mesh.degenerate]
    if not len(corners):
        return surface, ""
    off = _off_mm(surface, corners)
    if isinstance(surface, Cone):  # a CAD program's face may lie on the nappe before the apex
        other = Cone(surface.apex, -surface.axis, surface.half_angle_rad)
        other_off = _off_mm(other, corners)
        surface, off = (other, other_off) if other_off < off else (surface, off)
    size = float(np.ptp(mesh.vertices_mm, axis=0).max())
    if not off <= max(OFF_SHARE * size, OFF_MM):
        return None, f"its triangles stand up to {off:.3g} mm off the {record.type}"
    if _folded_share(surface, corners) > FOLDED_SHARE:
        return None, f"its triangles look to both sides of the {record.type}"
    return surface, ""


def _off_mm(surface: Surface, corners: Array) -> float:
    points = corners.reshape(-1, 3)
    return float(np.max(np.linalg.norm(points - surface.nearest(points), axis=1)))


def _folded_share(surface: Surface, corners: Array) -> float:
    """Share of the area that looks against the rest of it."""
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    own = np.nan_to_num(surface.normal(corners.reshape(-1, 3))).reshape(-1, 3, 3).mean(axis=1)
    size, along = np.linalg.norm(area, axis=1), np.einsum("ij,ij->i", area, own)
    return float(min(size[along < 0].sum(), size[along > 0].sum()) / size.sum())
