# SPDX-License-Identifier: LGPL-2.1-or-later
"""Places on triangles, even over their area."""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.random import EMIT_PLACE, uniforms

__all__ = ["start"]


@kernel
def start(i, wave, key, triangles, cumulated_area, corners):
    """Put the ray of slot i on the front of one of the triangles; returns its index.

    Parameters
    ----------
    triangles : (n,) int32, indices of the emitting triangles
    cumulated_area : (n,) float64, ends at 1
    corners : (n, 3 corners, 3) float64
    """
    u, v, w, _ = uniforms(key.seed, key.first_ray + np.uint64(i), 0, EMIT_PLACE)
    t = min(np.searchsorted(cumulated_area, u, side="right"), len(triangles) - 1)
    root = math.sqrt(v)  # uniform over a triangle: barycentric (1 - sqrt v, sqrt v (1 - w), sqrt v w)
    for a in range(3):
        wave.position[i, a] = (
            (1.0 - root) * corners[t, 0, a] + root * (1.0 - w) * corners[t, 1, a] + root * w * corners[t, 2, a]
        )
    wave.triangle[i] = triangles[t]
    wave.side[i] = 1
    return triangles[t]
