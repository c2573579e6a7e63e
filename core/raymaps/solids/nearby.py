# SPDX-License-Identifier: LGPL-2.1-or-later
"""Triangles that lie so near to another that a face is crossed in another order than its facets are met."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.solids.sweep import Boxes

__all__ = ["Nearby", "nearby_triangles"]


class Nearby(NamedTuple):
    """``triangle[start[i]:start[i + 1]]``, int32, are the triangles near triangle i; ``start`` (n_triangles + 1,)."""

    start: NDArray[np.int32]
    triangle: NDArray[np.int32]


def nearby_triangles(
    corners: NDArray[np.float64],
    reach: NDArray[np.float64],
    margin: float,
    n_triangles: list[int],
    vertex: NDArray[np.int64],
    surface: NDArray[np.int32],
) -> Nearby:
    """Pairs of triangles, of one body or of two, whose exact surfaces may lie the other way round than their facets.

    Neighbours with a common vertex are left to the rules for edges, faces of one surface have one order.

    Parameters
    ----------
    corners : (n_triangles, 3 corners, 3) float64
        Of the bounding mesh.
    reach : (n_triangles,) float64
        How far the exact surface may lie from each triangle, in the same unit.
    margin : float
        Added to it; what has no reach has no margin either.
    n_triangles : list of int
        Of each body.
    vertex : (n_triangles, 3) int64
        Equal for corners in one place of a body.
    surface : (n_triangles,) int32
        Exact surface of the triangle's face, -1 none.
    """
    from raymaps.solids.mesh_kernel import close_pairs

    boxes = Boxes(corners, reach + margin, n_triangles)
    found = [np.zeros((0, 2), np.int64)]
    bodies = [np.arange(start, end) for start, end in zip(boxes.starts[:-1], boxes.starts[1:], strict=True)]
    searches = [boxes.pairs(rows) for rows in bodies]
    searches += [boxes.pairs(boxes.rows_near(a, b), boxes.rows_near(b, a)) for a, b in boxes.body_pairs()]
    for search in searches:
        for pairs in search:
            a, b = pairs.T
            apart = (vertex[a][:, :, None] != vertex[b][:, None, :]).all(axis=(1, 2))
            apart &= (surface[a] != surface[b]) | (surface[a] < 0)
            chosen = np.ascontiguousarray(pairs[apart & (reach[a] + reach[b] > 0)])
            is_close = np.empty(len(chosen), np.bool_)
            close_pairs(chosen, boxes.corners, boxes.radius, is_close)
            found.append(chosen[is_close])
    one_way = np.concatenate(found)
    both = np.concatenate([one_way, one_way[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    start = np.searchsorted(both[:, 0], np.arange(len(corners) + 1))
    return Nearby(start.astype(np.int32), both[:, 1].astype(np.int32))
