# SPDX-License-Identifier: LGPL-2.1-or-later
"""Normals of curved faces of which only triangles are known, estimated from the triangles around each vertex."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.exact.borders import join, places, sum_at, unit
from raymaps.geometry import BodyMesh

__all__ = ["smooth_normals"]


def smooth_normals(mesh: BodyMesh, faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Outward unit normal of the triangles of some faces at each of their corners.

    The triangles of the same face around a vertex count with the sine of their angle there, over the lengths of the two
    edges: exact where the vertices lie on a sphere. Borders between faces stay sharp.

    Parameters
    ----------
    mesh : the triangles of a body
    faces : (n,) int64, indices of faces

    Returns
    -------
    (n_triangles, 3 corners, 3) float64; the triangle's own normal in other faces, 0 where it has none.

    References
    ----------
    N. Max: Weights for computing vertex normals from facet normals, J. Graphics Tools 4 (1999), eq. 2.
    """
    joined = join((mesh,))
    at = places(joined)
    to_next = np.roll(joined.corners, -1, axis=1) - joined.corners
    to_last = np.roll(joined.corners, 1, axis=1) - joined.corners
    lengths = np.einsum("tcj,tcj->tc", to_next, to_next) * np.einsum("tcj,tcj->tc", to_last, to_last)
    has_area: NDArray[np.bool_] = np.any(joined.normal != 0, axis=1)
    weight = np.divide(1.0, lengths, out=np.zeros_like(lengths), where=has_area[:, None] & (lengths > 0))
    turn = weight[..., None] * np.cross(to_next, to_last)
    estimate, ok = unit(sum_at(at, turn))
    flat = np.repeat(joined.normal[:, None], 3, axis=1)
    chosen = np.isin(mesh.triangle_face, faces)[:, None] & has_area[:, None] & ok[at.of_corner]
    return np.where(chosen[..., None], estimate[at.of_corner], flat)
