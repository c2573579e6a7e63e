# SPDX-License-Identifier: LGPL-2.1-or-later
"""Angles of incidence, derived from what is stored: two positions give the direction, the triangle gives the normal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from raymaps.store import RayMap

__all__ = ["incidence_angles_rad", "triangle_normals"]

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
        normals = triangle_normals(raymap, triangles[events])
        cosine = np.abs(np.einsum("ij,ij->i", direction, normals))
        sine = np.linalg.norm(np.cross(direction, normals), axis=1)
        angles_rad[events] = np.arctan2(sine, cosine)  # exact also near 0, where the cosine alone is flat
    return angles_rad


def triangle_normals(raymap: RayMap, triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Outward unit normals of triangles counted through all bodies, (n, 3) float64."""
    ends = np.cumsum([len(mesh.triangles) for mesh in raymap.meshes])
    body = np.searchsorted(ends, triangles, side="right")
    normals = np.empty((len(triangles), 3))
    for index in np.unique(body):
        mesh = raymap.meshes[index]
        chosen = body == index
        vectors = mesh.area_vectors_mm2[triangles[chosen] - (ends[index] - len(mesh.triangles))]
        normals[chosen] = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    return normals
