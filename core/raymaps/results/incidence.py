# SPDX-License-Identifier: LGPL-2.1-or-later
"""Angles of incidence, derived from what is stored.

Two positions give the direction; triangle and position give the normal, with the exact surfaces of the map's scene.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from raymaps.exact.smooth import smooth_normals
from raymaps.exact.surfaces import Surface
from raymaps.geometry import BodyMesh
from raymaps.results.face_cells import barycentric

if TYPE_CHECKING:
    from raymaps.store import RayMap

__all__ = ["incidence_angles_rad", "normals"]

Float = NDArray[np.float64]

#: Steps of the map's grid that a segment must be long for its direction to be told.
SHORTEST_IN_GRIDS = 500


def incidence_angles_rad(
    raymap: RayMap, positions_mm: NDArray[np.float64], triangles: NDArray[np.int32]
) -> NDArray[np.float64]:
    """Angle between the arriving segment and the normal at each event of one ray.

    Parameters
    ----------
    positions_mm : (n_events, 3)
        The ray's events in their order.
    triangles : (n_events,)

    Returns
    -------
    (n_events,) float64, 0 to pi/2; NaN at the emission, off a triangle, and where a segment is so short against the
    map's grid that its direction is uncertain by more than about 0.1 degrees.
    """
    angles_rad = np.full(len(positions_mm), np.nan)
    way = np.diff(positions_mm, axis=0)
    length = np.linalg.norm(way, axis=1)
    events = np.flatnonzero((triangles[1:] >= 0) & (length > SHORTEST_IN_GRIDS * raymap.manifest.grid_mm)) + 1
    if len(events):
        direction = way[events - 1] / length[events - 1, None]
        normal = normals(raymap, triangles[events], positions_mm[events])
        cosine = np.abs(np.einsum("ij,ij->i", direction, normal))
        sine = np.linalg.norm(np.cross(direction, normal), axis=1)
        angles_rad[events] = np.arctan2(sine, cosine)  # exact also near 0, where the cosine alone is flat
    return angles_rad


def normals(raymap: RayMap, triangles: NDArray[np.int32], positions_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Outward unit normals of the surfaces that light met, as the tracer had them.

    Those of a face's exact surface at the event; of a face that was simulated as facets those of its triangle, or
    interpolated between the corners where the scene calls its facets smooth.

    Parameters
    ----------
    triangles : (n,)
        Of each event, counted through all bodies.
    positions_mm : (n, 3)

    Returns
    -------
    (n, 3) float64
    """
    ends = np.cumsum([len(mesh.triangles) for mesh in raymap.meshes])
    of_face = iter(raymap.exact_faces.surfaces)
    surfaces = [[next(of_face) for _ in mesh.face_names] for mesh in raymap.meshes]
    body = np.searchsorted(ends, triangles, side="right")
    found = np.empty((len(triangles), 3))
    for index in np.unique(body):
        mesh, chosen = raymap.meshes[index], body == index
        own = triangles[chosen] - (ends[index] - len(mesh.triangles))
        smooth = raymap.scene.bodies[mesh.name].geometry.smooth_faces
        found[chosen] = _of_body(mesh, surfaces[index], smooth, own, positions_mm[chosen])
    return found


def _of_body(
    mesh: BodyMesh, surfaces: list[Surface | None], smooth: tuple[str, ...], triangles: NDArray[np.int64], places: Float
) -> Float:
    """Normals at the triangles of a body, (n, 3)."""
    found = mesh.area_vectors_mm2[triangles]
    found /= np.linalg.norm(found, axis=1)[:, None]
    face = mesh.triangle_face[triangles]
    for index in np.unique(face):
        here, surface = face == index, surfaces[index]
        if surface is not None:
            exact = surface.normal(places[here])
            against = np.einsum("ij,ij->i", exact, found[here]) < 0
            found[here] = np.where(against[:, None], -exact, exact)
        elif mesh.face_names[index] in smooth:
            found[here] = _interpolated(mesh, index, triangles[here], places[here])
    return found


def _interpolated(mesh: BodyMesh, face: int, triangles: NDArray[np.int64], places: Float) -> Float:
    """Normals of a smooth face of which only triangles are known."""
    v, w = barycentric(mesh.corners_mm[triangles], places)
    v = np.clip(v, 0.0, 1.0)
    w = np.clip(w, 0.0, 1.0 - v)
    corners = smooth_normals(mesh, np.array([face]))[triangles]
    found = np.einsum("nc,ncx->nx", np.stack([1.0 - v - w, v, w], axis=1), corners)
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])
