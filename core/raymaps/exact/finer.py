# SPDX-License-Identifier: LGPL-2.1-or-later
"""A finer mesh of the same exact surfaces: each triangle is split in four."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from raymaps.exact.surfaces import Surface
from raymaps.geometry import BodyMesh

__all__ = ["finer"]

#: A corner on a border is moved to the faces there by turns, until it moves by less of the body's size or so often.
SETTLED, MOST_TURNS = 1e-12, 50


def finer(mesh: BodyMesh, surfaces: Sequence[Surface | None]) -> BodyMesh:
    """Split each triangle at the middles of its edges, moved to the exact surfaces of the faces that meet there.

    Where faces meet at an angle, the middle comes to lie on both; a closed mesh stays closed. Triangles are four times
    as many, about four times nearer to the surface.

    Parameters
    ----------
    mesh : BodyMesh
    surfaces : of each of its faces, None where there is none
    """
    place = mesh.corner_places
    corners = np.zeros((int(place.max()) + 1, 3))
    corners[place.reshape(-1)] = mesh.vertices_mm[mesh.triangles.reshape(-1)]
    ends = np.sort(np.stack([place, np.roll(place, -1, axis=1)], axis=2), axis=2)
    pairs, edge = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)  # of each triangle, from its corner i to the corner i + 1
    middle = _settled(corners[pairs].mean(axis=1), mesh, edge, surfaces)
    a, b, c = place.T
    ab, bc, ca = edge.T + len(corners)
    return BodyMesh(
        mesh.name,
        np.concatenate([corners, middle]),
        np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3),
        mesh.face_names,
        np.repeat(mesh.triangle_face, 4),
    )


def _settled(
    middle: NDArray[np.float64], mesh: BodyMesh, edge: NDArray[np.int64], surfaces: Sequence[Surface | None]
) -> NDArray[np.float64]:
    """Middles of edges, moved to the surfaces of the faces at them."""
    of_face = [np.unique(edge[mesh.triangle_face == face]) for face in range(len(surfaces))]
    n_faces = np.bincount(np.concatenate(of_face), minlength=len(middle))
    size = float(np.ptp(mesh.vertices_mm, axis=0).max())
    moving = np.ones(len(middle), bool)
    for _ in range(MOST_TURNS):
        before = middle.copy()
        for surface, edges in zip(surfaces, of_face, strict=True):
            at = edges[moving[edges]]
            if surface is not None and len(at):
                middle[at] = surface.nearest(middle[at])
        moving &= (n_faces > 1) & (np.abs(middle - before).max(axis=1) > SETTLED * size)
        if not moving.any():
            break
    return middle
