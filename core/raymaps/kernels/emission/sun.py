# SPDX-License-Identifier: LGPL-2.1-or-later
"""Light of a far disc of constant radiance L that passes through a disc across its mean direction.

Flux through an element dA of the disc from a cone dω at the angle θ to the disc's normal is L cos θ dA dω (Boyd:
Radiometry and the Detection of Optical Radiation, 1983, section 2.3). The far disc is the same from all over the near
one: so places are even, directions independent of them and, within the cap θ < α, of density cos θ / (π sin² α); sin² θ
is even from 0 to sin² α.
"""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kernels.directions import around
from raymaps.kernels.random import EMIT_PLACE, ON_SURFACE
from raymaps.kernels.sampling import sample

__all__ = ["run"]


@kernel
def run(slots, wave, key, position, axis, radius, sin_of_radius):
    """Through a disc; ``sin_of_radius`` is the sine of the far disc's angular radius."""
    for k in range(len(slots)):
        i = slots[k]
        u, v, _, _ = sample(key, i, 0, EMIT_PLACE)
        px, py, pz = around(axis[0], axis[1], axis[2], 0.0, 1.0, 2.0 * math.pi * v)
        from_center = radius * math.sqrt(u)
        wave.position[i, 0] = position[0] + from_center * px
        wave.position[i, 1] = position[1] + from_center * py
        wave.position[i, 2] = position[2] + from_center * pz
        u, v, _, _ = sample(key, i, 0, ON_SURFACE)
        sin_theta = sin_of_radius * math.sqrt(u)
        cos_theta = math.sqrt(1.0 - sin_theta * sin_theta)
        dx, dy, dz = around(axis[0], axis[1], axis[2], cos_theta, sin_theta, 2.0 * math.pi * v)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz
