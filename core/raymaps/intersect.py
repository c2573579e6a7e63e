# SPDX-License-Identifier: LGPL-2.1-or-later
"""Embree: which triangle of the bounding mesh a ray meets first, and which others are so close that they may touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.boundary import LoweredBoundary
from raymaps.kinds import CONTACT

__all__ = ["Intersector"]

#: Below this cosine the stretch that is searched for contacts is not made longer any more.
STEEPEST = 1e-3


class Intersector:
    """All triangles of a scene in one Embree scene; may be used by several threads at once.

    Triangles of bodies that may touch stand in scenes of their own besides, one a layer: only so is a triangle found
    that lies on another.

    Parameters
    ----------
    boundary : LoweredBoundary
    """

    def __init__(self, boundary: LoweredBoundary):
        corners = boundary.tables.corners
        self._plane, self._close, self._layer = boundary.plane, boundary.close, boundary.layer
        self._all = _Triangles(corners, None) if len(corners) else None
        self._layers = [
            _Triangles(corners, np.flatnonzero(boundary.close & (boundary.layer == layer)).astype(np.int32))
            for layer in np.unique(boundary.layer[boundary.close])
        ]
        close = boundary.close
        widest = boundary.tables.reach[close].max(initial=0.0) + boundary.tables.slack[close].max(initial=0.0)
        self._stretch = 4.0 * (CONTACT + 2.0 * widest)

    @property
    def n_searches(self) -> int:
        """Triangles that `find` names for each ray at most."""
        return 1 + len(self._layers)

    def find(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32]
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """First triangle along each ray, and where that may be in contact, those near it in the other layers.

        Parameters
        ----------
        origin, direction : (n_rays, 3) float32, contiguous, in frame units

        Returns
        -------
        (n_rays, n_searches) int32, index of each triangle or -1; (n_rays, n_searches) float32, its distance
        """
        triangle = np.full((len(origin), self.n_searches), -1, np.int32)
        distance = np.zeros(triangle.shape, np.float32)
        if self._all is None:
            return triangle, distance
        triangle[:, 0], distance[:, 0] = self._all.find(origin, direction, None)
        if self._layers:
            first = triangle[:, 0]
            rows = np.flatnonzero((first >= 0) & self._close[first])
            self._find_close(rows, origin, direction, triangle, distance)
        return triangle, distance

    def _find_close(
        self,
        rows: NDArray[np.int64],
        origin: NDArray[np.float32],
        direction: NDArray[np.float32],
        triangle: NDArray[np.int32],
        distance: NDArray[np.float32],
    ) -> None:
        way = direction[rows]
        steep = np.abs(np.einsum("ij,ij->i", way, self._plane[triangle[rows, 0], :3]))
        stretch = (self._stretch / np.maximum(steep, STEEPEST)).astype(np.float32)
        begins = np.maximum(distance[rows, 0] - stretch, np.float32(0))
        own = self._layer[triangle[rows, 0]]
        for k, layer in enumerate(self._layers, 1):
            other = own != k - 1
            some = rows[other]
            found, at = layer.find(origin[some] + begins[other, None] * way[other], way[other], 2 * stretch[other])
            triangle[some, k], distance[some, k] = found, begins[other] + at


class _Triangles:
    """Some of a scene's triangles in one Embree scene."""

    def __init__(self, corners: NDArray[np.float64], chosen: NDArray[np.int32] | None):
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._chosen = chosen
        corners = (corners if chosen is None else corners[chosen]).astype(np.float32)
        self._scene = EmbreeScene(robust=True)
        triangles = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
        vertices, shared = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        TriangleMesh(self._scene, np.ascontiguousarray(vertices), shared.reshape(-1)[triangles].astype(np.int32))
        self.find(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32), None)  # commits the scene, once and here

    def find(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32], limit: NDArray[np.float32] | None
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """First triangle along each ray, not beyond a limit if there is one: its index or -1, its distance."""
        hits = self._scene.run(origin, direction, dists=limit, output=True)
        triangle = hits["primID"]
        if self._chosen is not None:
            triangle = np.where(triangle >= 0, self._chosen[triangle], np.int32(-1))
        return triangle, hits["tfar"]
