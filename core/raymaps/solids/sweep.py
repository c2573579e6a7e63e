# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pairs of triangles whose boxes overlap, found by sorting them along an axis."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

__all__ = ["Boxes"]

Rows = NDArray[np.int64]

#: Pairs of triangles that are looked at together.
BATCH = 1 << 18


class Boxes:
    """Boxes around triangles of several bodies, each inflated by the radius of its triangle.

    Parameters
    ----------
    corners : (n_triangles, 3 corners, 3) float64
    radius : (n_triangles,) float64, in the same unit
        Triangles are close if their distance is at most the sum of their radii.
    n_triangles : list of int
        Of each body.
    """

    def __init__(self, corners: NDArray[np.float64], radius: NDArray[np.float64], n_triangles: list[int]):
        self.corners = np.ascontiguousarray(corners, np.float64)
        self.radius = np.ascontiguousarray(radius, np.float64)
        self.low = self.corners.min(axis=1) - self.radius[:, None]
        self.high = self.corners.max(axis=1) + self.radius[:, None]
        self.starts = np.cumsum([0, *n_triangles])
        parts = [slice(start, end) for start, end in zip(self.starts[:-1], self.starts[1:], strict=True)]
        self.body_low = np.array([self.low[part].min(axis=0) for part in parts]).reshape(-1, 3)
        self.body_high = np.array([self.high[part].max(axis=0) for part in parts]).reshape(-1, 3)

    def body_pairs(self) -> Iterator[tuple[int, int]]:
        """Pairs of bodies whose boxes overlap, the earlier one first."""
        for a in range(len(self.body_low)):
            low, high = self.body_low[a + 1 :], self.body_high[a + 1 :]
            overlap = ((low <= self.body_high[a]) & (high >= self.body_low[a])).all(axis=1)
            yield from ((a, a + 1 + int(b)) for b in np.flatnonzero(overlap))

    def rows_near(self, body: int, other: int) -> Rows:
        """Triangles of a body whose boxes overlap the box of another body."""
        start, end = self.starts[body], self.starts[body + 1]
        inside = self.low[start:end] <= self.body_high[other]
        inside &= self.high[start:end] >= self.body_low[other]
        return start + np.flatnonzero(inside.all(axis=1))

    def pairs(self, first: Rows, second: Rows | None = None) -> Iterator[Rows]:
        """Pairs of triangles with overlapping boxes, (n, 2) in portions: one of each list, or both of one list."""
        from raymaps.solids.mesh_kernel import overlapping_boxes

        itself = second is None
        second = first if second is None else second
        if not len(first) or not len(second):
            return
        work = [self._work(first, second, axis) for axis in range(3)]
        axis = work.index(min(work))
        first = first[np.argsort(self.low[first, axis], kind="stable")]
        second = second[np.argsort(self.low[second, axis], kind="stable")]
        found = np.empty((BATCH, 2), np.int64)
        place = np.zeros(2, np.int64)
        while True:
            n = overlapping_boxes(first, second, itself, axis, self.low, self.high, place, found)
            if n:
                yield found[:n]
            if n < BATCH:
                return

    def _work(self, first: Rows, second: Rows, axis: int) -> int:
        """Number of pairs that overlap along an axis."""
        below = np.searchsorted(np.sort(self.high[second, axis]), self.low[first, axis]).sum()
        above = np.searchsorted(np.sort(self.high[first, axis]), self.low[second, axis]).sum()
        return len(first) * len(second) - int(below) - int(above)

    def mark_close(self, a: int, b: int, close: NDArray[np.bool_]) -> bool:
        """Mark the triangles of two bodies that are close to one of the other body; tells whether there are any."""
        from raymaps.solids.mesh_kernel import mark_close

        first, second = self.rows_near(a, b), self.rows_near(b, a)
        found = False
        for pairs in self.pairs(first, second):
            found = bool(mark_close(pairs, self.corners, self.radius, found, close))
        return found
