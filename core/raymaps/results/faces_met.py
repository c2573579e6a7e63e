# SPDX-License-Identifier: LGPL-2.1-or-later
"""How the faces of a scene are simulated: by their exact surfaces, or by their triangles and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from raymaps.errors import listed
from raymaps.exact import ExactFaces, exact_faces
from raymaps.geometry import BodyMesh, load_bodies
from raymaps.scene import Scene

if TYPE_CHECKING:
    from raymaps.store import RayMap

__all__ = ["FacesMet", "faces_met", "faces_met_by"]

#: How many bodies or faces a reason names, and how many reasons are told for faces that fell back to their triangles.
MOST_NAMES, MOST_REASONS = 5, 10
#: Sines of angles between the normals of a flat face's triangles are below this.
FLAT_SINE = 1e-6


@dataclass(frozen=True)
class FacesMet:
    """Numbers of faces that light meets as exact surfaces and as triangles; ``because`` tells why not all are exact."""

    exact: int
    faceted: int
    because: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As in ``raymaps explain --json``."""
        return {"exact": self.exact, "faceted": self.faceted, "because": list(self.because)}

    def lines(self) -> list[str]:
        """For people, as `raymaps.results.explanation` tells the effects."""
        told = [f"{kind} ({_faces(n)})" for kind, n in (("exact", self.exact), ("facets", self.faceted)) if n]
        return [
            f"{'surfaces':<12}{', '.join(told) or 'none'}",
            *(f"{'':<14}because {reason}" for reason in self.because),
        ]


def faces_met(scene: Scene) -> FacesMet:
    """How the faces of a scene will be simulated; raises `SceneError` if its geometry can't be read."""
    meshes = load_bodies(scene)
    return _faces_met(scene, meshes, exact_faces(scene, meshes), "settings.surfaces is faceted")


def faces_met_by(raymap: RayMap) -> FacesMet:
    """How the faces of a map's scene were simulated."""
    asked = "surfaces" in raymap.scene.settings.model_fields_set
    whole = "settings.surfaces is faceted" if asked else "the map is of a version that met triangles only"
    return _faces_met(raymap.scene, raymap.meshes, raymap.exact_faces, whole)


def _faces_met(scene: Scene, meshes: Sequence[BodyMesh], found: ExactFaces, whole: str) -> FacesMet:
    n_exact = sum(surface is not None for surface in found.surfaces)
    n_faceted = len(found.surfaces) - n_exact
    if not n_exact and not found.fallbacks and any(_names_surfaces(scene, mesh) for mesh in meshes):
        return FacesMet(0, n_faceted, (whole,))
    return FacesMet(n_exact, n_faceted, (*_nameless(meshes, found), *_fallen_back(found)))


def _names_surfaces(scene: Scene, mesh: BodyMesh) -> bool:
    return any(group.surface is not None for group in scene.bodies[mesh.name].geometry.faces or ())


def _nameless(meshes: Sequence[BodyMesh], found: ExactFaces) -> list[str]:
    """Why faces that name no exact surface are met as triangles."""
    fell_back = {(one.body, one.face) for one in found.fallbacks}
    surfaces = iter(found.surfaces)
    bodies: dict[str, int] = {}
    n_flat = 0
    for mesh in meshes:
        for index, face in enumerate(mesh.face_names):
            if next(surfaces) is None and (mesh.name, face) not in fell_back:
                bodies[mesh.name] = bodies.get(mesh.name, 0) + 1
                n_flat += _is_flat(mesh, index)
    n = sum(bodies.values())
    if not n:
        return []
    flat = "" if not n_flat else ", all of them flat" if n_flat == n else f", {n_flat} of them flat"
    named = "names" if n == 1 else "name"
    return [f"{_faces(n)} of {listed(bodies, MOST_NAMES)} {named} no exact surface{flat}"]


def _is_flat(mesh: BodyMesh, face: int) -> bool:
    """Whether the triangles of a face lie in one plane, so that nothing is lost by them."""
    area = mesh.area_vectors_mm2[(mesh.triangle_face == face) & ~mesh.degenerate]
    if not len(area):
        return True
    normal = area / np.linalg.norm(area, axis=1)[:, None]
    return bool(np.linalg.norm(np.cross(normal, normal[0]), axis=1).max() < FLAT_SINE)


def _fallen_back(found: ExactFaces) -> list[str]:
    """Why faces are met as triangles though they name an exact surface."""
    by_reason: dict[tuple[str, str], list[str]] = {}
    for one in found.fallbacks:
        by_reason.setdefault((one.body, one.reason), []).append(one.face)
    told = [
        f"{listed(faces, MOST_NAMES)} of {body} {'keeps its' if len(faces) == 1 else 'keep their'} facets, as {reason}"
        for (body, reason), faces in by_reason.items()
    ]
    more = len(told) - MOST_REASONS
    return told[:MOST_REASONS] + ([f"of {more} more such reasons"] if more > 0 else [])


def _faces(n: int) -> str:
    return "1 face" if n == 1 else f"{n} faces"
