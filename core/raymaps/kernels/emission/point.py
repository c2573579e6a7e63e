# SPDX-License-Identifier: LGPL-2.1-or-later
"""From a point with constant intensity: into all directions, or a cone of them."""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kernels.directions import around
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample

__all__ = ["run"]


@kernel
def run(slots, wave, key, position, axis, opening):
    """From a point with constant intensity inside a cone; ``opening`` is 1 - cos(half angle), 2 for a sphere."""
    for k in range(len(slots)):
        i = slots[k]
        u, v, _, _ = sample(key, i, 0, ON_SURFACE)
        below = u * opening  # 1 - cos(theta); so narrow cones keep their sines
        sin_theta = math.sqrt(below * (2.0 - below))
        dx, dy, dz = around(axis[0], axis[1], axis[2], 1.0 - below, sin_theta, 2.0 * math.pi * v)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz
        for a in range(3):
            wave.position[i, a] = position[a]
