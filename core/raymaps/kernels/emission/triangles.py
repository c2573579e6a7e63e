# SPDX-License-Identifier: LGPL-2.1-or-later
"""Places on triangles, even over their area."""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.exact import normal, settle
from raymaps.kernels.random import EMIT_PLACE
from raymaps.kernels.sampling import sample

__all__ = ["start"]


@kernel
def start(i, wave, key, tables, exact, triangles, cumulated_area, corners):
    """Put the ray of slot i on the front of one of the triangles, or the exact surface behind it, and set its normal.

    Parameters
    ----------
    triangles : (n,) int32, indices of the emitting triangles
    cumulated_area : (n,) float64, ends at 1
    corners : (n, 3 corners, 3) float64
    """
    u, v, w, _ = sample(key, i, 0, EMIT_PLACE)
    t = min(np.searchsorted(cumulated_area, u, side="right"), len(triangles) - 1)
    root = math.sqrt(v)  # uniform over a triangle: barycentric (1 - sqrt v, sqrt v (1 - w), sqrt v w)
    for a in range(3):
        wave.position[i, a] = (
            (1.0 - root) * corners[t, 0, a] + root * (1.0 - w) * corners[t, 1, a] + root * w * corners[t, 2, a]
        )
    wave.triangle[i] = triangles[t]
    wave.side[i] = 1
    face = tables.triangle_face[triangles[t]]
    surface = exact.face[face]
    if surface < 0:
        for a in range(3):
            wave.normal[i, a] = tables.plane[triangles[t], a]
        return
    x, y, z = settle(exact, surface, triangles[t], wave.position[i, 0], wave.position[i, 1], wave.position[i, 2])
    nx, ny, nz = normal(exact, surface, x, y, z)
    wave.position[i, 0], wave.position[i, 1], wave.position[i, 2] = x, y, z
    outward = exact.outward[face]
    wave.normal[i, 0], wave.normal[i, 1], wave.normal[i, 2] = outward * nx, outward * ny, outward * nz
