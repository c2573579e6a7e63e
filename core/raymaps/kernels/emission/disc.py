# SPDX-License-Identifier: LGPL-2.1-or-later
"""Collimated from a disc."""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kernels.directions import around
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample

__all__ = ["run"]


@kernel
def run(slots, wave, key, position, axis, radius):
    """Collimated from a disc with constant irradiance."""
    for k in range(len(slots)):
        i = slots[k]
        u, v, _, _ = sample(key, i, 0, ON_SURFACE)
        px, py, pz = around(axis[0], axis[1], axis[2], 0.0, 1.0, 2.0 * math.pi * v)
        from_center = radius * math.sqrt(u)
        wave.position[i, 0] = position[0] + from_center * px
        wave.position[i, 1] = position[1] + from_center * py
        wave.position[i, 2] = position[2] + from_center * pz
        for a in range(3):
            wave.direction[i, a] = axis[a]
