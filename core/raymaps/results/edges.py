# SPDX-License-Identifier: LGPL-2.1-or-later
"""The lines that a draughtsman would draw of a body: borders of CAD faces, sharp edges and open borders."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raymaps.geometry import BodyMesh

__all__ = ["feature_edges_mm"]

#: Triangles of one face that meet at a larger angle make an edge, as in files that know no faces.
SHARP_RAD = math.radians(30)
#: Vertices closer than this share of the body's size are one.
_SAME_VERTEX = 1e-7


def feature_edges_mm(mesh: BodyMesh) -> NDArray[np.float64]:
    """Segments to draw, (n, 6) float64: start and end in mm."""
    low = mesh.vertices_mm.min(axis=0)
    size_mm = float(np.ptp(mesh.vertices_mm, axis=0).max())
    grid = np.round((mesh.vertices_mm - low) / (size_mm * _SAME_VERTEX)).astype(np.int64)
    _, representative, merged = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    corner = merged.reshape(-1)[mesh.triangles]

    # every edge of every triangle, its ends in order, and the triangles on both sides next to each other
    ends = np.sort(np.stack([corner, np.roll(corner, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    triangle = np.repeat(np.arange(len(corner)), 3)
    real = (ends[:, 0] != ends[:, 1]) & ~mesh.degenerate[triangle]
    ends, triangle = ends[real], triangle[real]
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, triangle = ends[order], triangle[order]
    same = (ends[1:] == ends[:-1]).all(axis=1)  # row i and row i + 1 are one edge

    normal = mesh.area_vectors_mm2 / np.maximum(np.linalg.norm(mesh.area_vectors_mm2, axis=1), 1e-300)[:, None]
    one, other = triangle[:-1], triangle[1:]
    bends = np.einsum("ij,ij->i", normal[one], normal[other]) < math.cos(SHARP_RAD)
    parts = mesh.triangle_face[one] != mesh.triangle_face[other]
    shown = np.zeros(len(ends), bool)
    shown[:-1] |= same & (bends | parts)
    has_partner = np.zeros(len(ends), bool)
    has_partner[:-1] |= same
    has_partner[1:] |= same
    shown |= ~has_partner
    points_mm = mesh.vertices_mm[representative]
    return np.hstack([points_mm[ends[shown, 0]], points_mm[ends[shown, 1]]])
