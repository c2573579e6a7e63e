# SPDX-License-Identifier: LGPL-2.1-or-later
"""What results need of a map to tell normals: bodies in memory, with or without exact surfaces."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.exact.faces import exact_faces
from raymaps.geometry import BodyMesh
from raymaps.scene import Scene

LAMP = {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 0]}


def map_of(*meshes: BodyMesh, surfaces: dict[str, Any] | None = None, **geometry: Any) -> SimpleNamespace:
    """A map without rays of bodies; their faces have exact surfaces by name, ``geometry`` is that of all bodies."""
    bodies = {}
    for mesh in meshes:
        counts = np.bincount(mesh.triangle_face, minlength=len(mesh.face_names))
        faces = [
            {"name": name, "triangles": int(n), "surface": (surfaces or {}).get(name)}
            for name, n in zip(mesh.face_names, counts, strict=True)
        ]
        bodies[mesh.name] = {"geometry": {"file": "none.ply", "faces": faces, **geometry}, "surface": "black"}
    scene = Scene.model_validate(
        {"surfaces": {"black": {"kind": "absorber"}}, "bodies": bodies, "sources": {"Lamp": LAMP}}
    )
    return SimpleNamespace(
        manifest=SimpleNamespace(grid_mm=0.0), meshes=meshes, scene=scene, exact_faces=exact_faces(scene, meshes)
    )


def corner_mesh(name: str, normal_axis: int) -> BodyMesh:
    """One triangle whose normal is an axis."""
    corners = np.roll(np.array([[0.0, 0, 0], [0, 1, 0], [0, 0, 1]]), normal_axis, axis=1)
    return BodyMesh(name, corners, np.array([[0, 1, 2]]), ("Face1",), np.zeros(1, np.int32))


def ball(name: str, radius_mm: float, n: int, hollow: bool = False) -> BodyMesh:
    """A sphere of 2 n strips along n parallels around the origin with one face ``Skin``; hollow, it looks inwards."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, n + 1), np.linspace(0, 2 * np.pi, 2 * n + 1), indexing="ij")
    points = radius_mm * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    a, b, c, d = (points[i : n + i, j : 2 * n + j].reshape(-1, 3) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return _of_quads(name, "Skin", (a, b, c, d) if not hollow else (a, d, c, b))


def tube(name: str, radius_mm: float, height_mm: float, n: int, rings: int = 1) -> BodyMesh:
    """The mantle of a cylinder around the z axis, from z = 0, with one face ``Mantle`` that looks outwards."""
    z, phi = np.meshgrid(np.linspace(0, height_mm, rings + 1), np.linspace(0, 2 * np.pi, n + 1), indexing="ij")
    points = np.stack([radius_mm * np.cos(phi), radius_mm * np.sin(phi), z], axis=-1)
    a, b, c, d = (points[i : rings + i, j : n + j].reshape(-1, 3) for i, j in ((0, 0), (0, 1), (1, 1), (1, 0)))
    return _of_quads(name, "Mantle", (a, b, c, d))


def _of_quads(name: str, face: str, quads: tuple[NDArray[np.float64], ...]) -> BodyMesh:
    a, b, c, d = quads
    corners = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    corners = corners[area > 1e-9 * area.max()]  # none at the poles
    triangles = np.arange(3 * len(corners)).reshape(-1, 3)
    return BodyMesh(name, corners.reshape(-1, 3), triangles, (face,), np.zeros(len(corners), np.int32))
