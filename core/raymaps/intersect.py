# SPDX-License-Identifier: LGPL-2.1-or-later
"""Embree: which triangle a ray meets first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.compile import CompiledScene

__all__ = ["Intersector"]


class Intersector:
    """All triangles of a scene in one Embree scene; may be used by several threads at once.

    Parameters
    ----------
    compiled : CompiledScene
    """

    def __init__(self, compiled: CompiledScene):
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        corners = compiled.corners.astype(np.float32)
        self._scene = EmbreeScene(robust=True) if len(corners) else None
        if self._scene is not None:
            triangles = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
            vertices, shared = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
            TriangleMesh(self._scene, np.ascontiguousarray(vertices), shared.reshape(-1)[triangles].astype(np.int32))
            self.find(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))  # commits the scene, once and here

    def find(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32]
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """First triangle along each ray.

        Parameters
        ----------
        origin, direction : (n_rays, 3) float32, contiguous, in frame units

        Returns
        -------
        (n_rays,) int32, index of the triangle or -1; (n_rays,) float32, distance
        """
        if self._scene is None:
            return np.full(len(origin), -1, np.int32), np.zeros(len(origin), np.float32)
        hits = self._scene.run(origin, direction, output=True)
        return hits["primID"], hits["tfar"]
