# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reflection and refraction at a smooth interface between two media, unpolarised.

The formulas are those of `raymaps.effects.fresnel`.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.mirror import reflect
from raymaps.kernels.random import ON_SURFACE, uniforms
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

_HERE = int(SurfaceKind.FRESNEL)
_REFLECTION = int(EventKind.FRESNEL_REFLECTION)
_REFRACTION = int(EventKind.FRESNEL_REFRACTION)


@kernel
def reflectance(cos_i, n_i, n_t):
    """Power reflectance and cosine of refraction; (1, 0) under total internal reflection."""
    sin2_t = (n_i / n_t) ** 2 * (1.0 - cos_i * cos_i)
    if sin2_t >= 1.0:
        return 1.0, 0.0
    cos_t = math.sqrt(1.0 - sin2_t)
    r_s = (n_i * cos_i - n_t * cos_t) / (n_i * cos_i + n_t * cos_t)
    r_p = (n_t * cos_i - n_i * cos_t) / (n_t * cos_i + n_i * cos_t)
    return 0.5 * (r_s * r_s + r_p * r_p), cos_t


@kernel
def run(active, wave, tables, data, key, depth):
    """Reflect or refract every ray that meets a smooth interface; its light does not change."""
    for k in range(len(active)):
        i = active[k]
        if wave.state[i] != PENDING or tables.surface_kind[wave.surface[i]] != _HERE:
            continue
        plane = tables.plane[wave.hit[i]]
        side = wave.near_side[i]
        dx, dy, dz = wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2]
        cos_i = min(1.0, -side * (dx * plane[0] + dy * plane[1] + dz * plane[2]))
        n_i, n_t = wave.n_near[i], wave.n_far[i]
        share, cos_t = reflectance(cos_i, n_i, n_t)
        _, u, _, _ = uniforms(key.seed, key.first_ray + np.uint64(i), depth, ON_SURFACE)
        if u < share:
            reflect(wave, i, plane)
            wave.state[i] = _REFLECTION
            wave.side[i] = side
            continue
        eta = n_i / n_t
        along = side * (eta * cos_i - cos_t)
        dx, dy, dz = eta * dx + along * plane[0], eta * dy + along * plane[1], eta * dz + along * plane[2]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx / length, dy / length, dz / length
        wave.state[i] = _REFRACTION
        wave.side[i] = -side
        wave.medium[i] = wave.beyond[i]
