# SPDX-License-Identifier: LGPL-2.1-or-later
"""From faces with an intensity that falls as a power of the cosine.

The density of directions is (n + 1) / (2 π) cosⁿ θ; so cosⁿ⁺¹ θ is even from 0 to 1.
"""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kernels.directions import around
from raymaps.kernels.emission.triangles import start
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample

__all__ = ["run"]


@kernel
def run(slots, wave, key, tables, exact, triangles, cumulated_area, corners, exponent):
    """From triangles with constant exitance, outwards; see `raymaps.kernels.emission.triangles`."""
    for k in range(len(slots)):
        i = slots[k]
        start(i, wave, key, tables, exact, triangles, cumulated_area, corners)
        normal = wave.normal[i]
        u, v, _, _ = sample(key, i, 0, ON_SURFACE)
        below = -math.expm1(math.log1p(-u) / (exponent + 1.0))  # 1 - cos(theta); so narrow lobes keep their sines
        sin_theta = math.sqrt(below * (2.0 - below))
        dx, dy, dz = around(normal[0], normal[1], normal[2], 1.0 - below, sin_theta, 2.0 * math.pi * v)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz
