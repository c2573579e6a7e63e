# SPDX-License-Identifier: LGPL-2.1-or-later
"""A Gaussian beam from its waist: place and direction independent, each with a Gaussian density.

Of the place the irradiance is exp(-2 r² / waist²); of the direction the intensity is
exp(-2 (1 - cos θ) / (1 - cos θ0)), the Gaussian of the sphere: 1/e² at the half angle θ0, and exp(-2 θ² / θ0²) where
the beam is narrow. It ends at right angles to the axis: no light goes backwards.

References
----------
R. Fisher: Dispersion on a sphere, Proc. R. Soc. A 217 (1953), p. 295.
"""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kernels.directions import around
from raymaps.kernels.random import EMIT_PLACE, ON_SURFACE
from raymaps.kernels.sampling import sample

__all__ = ["run"]


@kernel
def run(slots, wave, key, position, axis, waist_radius, opening):
    """From the waist; ``opening`` is 1 - cos(divergence), 0 for a collimated beam."""
    for k in range(len(slots)):
        i = slots[k]
        u, v, _, _ = sample(key, i, 0, EMIT_PLACE)
        px, py, pz = around(axis[0], axis[1], axis[2], 0.0, 1.0, 2.0 * math.pi * v)
        from_center = waist_radius * math.sqrt(-0.5 * math.log1p(-u))
        wave.position[i, 0] = position[0] + from_center * px
        wave.position[i, 1] = position[1] + from_center * py
        wave.position[i, 2] = position[2] + from_center * pz
        below = 0.0  # 1 - cos(theta)
        u, v, _, _ = sample(key, i, 0, ON_SURFACE)
        if opening > 0.0:
            below = min(-0.5 * opening * math.log1p(u * math.expm1(-2.0 / opening)), 1.0)
        sin_theta = math.sqrt(below * (2.0 - below))
        dx, dy, dz = around(axis[0], axis[1], axis[2], 1.0 - below, sin_theta, 2.0 * math.pi * v)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz
