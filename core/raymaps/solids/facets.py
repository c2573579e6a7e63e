# SPDX-License-Identifier: LGPL-2.1-or-later
"""How far facets stand off the curved surface that they stand for, told from the facets alone."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raymaps.geometry import BodyMesh

__all__ = ["CREASE_RAD", "facet_slack", "shared_edges"]

#: Facets that meet at a larger angle meet at an edge of the model: its faces may not be told apart in the file.
CREASE_RAD = math.radians(40)
#: Over the sagitta of evenly spaced facets: real tessellations are uneven.
UNEVEN = 1.5


def shared_edges(corner: NDArray[np.int64]) -> NDArray[np.int64]:
    """Pairs of triangles that share an edge, where no third one does.

    Parameters
    ----------
    corner : (n_triangles, 3) int64, as of `BodyMesh.corner_places`

    Returns
    -------
    (n_edges, 2) int64: 3 * triangle + k for both, the edge going from corner k to the next
    """
    start, end = corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1)
    real = np.flatnonzero(start != end)
    key = np.minimum(start, end) * (int(corner.max(initial=0)) + 1) + np.maximum(start, end)
    order = real[np.argsort(key[real], kind="stable")]
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    first = first[count == 2]
    return np.stack([order[first], order[first + 1]], axis=1)


def facet_slack(mesh: BodyMesh) -> NDArray[np.float64]:
    """Estimate how far a smooth surface bulges over each triangle, in mm; 0 on flat faces.

    A strip of width w between two edges at which the surface turns by an angle a is a chord of an arc; the arc rises
    w tan(a/4) / 2 above it. The rises over all three edges are added: on a sphere that is 1.1 times the true one.

    Returns
    -------
    (n_triangles,) float64
    """
    edges = shared_edges(mesh.corner_places)
    one, other = edges[:, 0] // 3, edges[:, 1] // 3
    area = 2 * mesh.area_vectors_mm2
    smooth = (mesh.triangle_face[one] == mesh.triangle_face[other]) & ~mesh.degenerate[one] & ~mesh.degenerate[other]
    one, other, edges = one[smooth], other[smooth], edges[smooth]
    cross = np.linalg.norm(np.cross(area[one], area[other]), axis=1)
    angle = np.arctan2(cross, np.einsum("ij,ij->i", area[one], area[other]))

    side = np.roll(mesh.corners_mm, -1, axis=1) - mesh.corners_mm
    length = np.linalg.norm(side.reshape(-1, 3)[edges[:, 0]], axis=1)
    width = np.minimum(np.linalg.norm(area[one], axis=1), np.linalg.norm(area[other], axis=1)) / length
    turns = (angle < CREASE_RAD) & (angle > 1e-7)  # below: rounding
    rise = np.where(turns, UNEVEN * width * np.tan(angle / 4) / 2, 0.0)
    slack = np.zeros(len(mesh.triangles))
    np.add.at(slack, one, rise)
    np.add.at(slack, other, rise)
    return slack
