# SPDX-License-Identifier: LGPL-2.1-or-later
"""Diffuse reflection and transmission by Lambert's law."""

from __future__ import annotations

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.directions import lambertian
from raymaps.kernels.outcome import draw_outcome
from raymaps.kernels.random import ON_SURFACE, uniforms
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

_HERE = int(SurfaceKind.LAMBERTIAN)
_REFLECTION = int(EventKind.DIFFUSE_REFLECTION)
_REFRACTION = int(EventKind.DIFFUSE_REFRACTION)
_ABSORPTION = int(EventKind.ABSORPTION)


@kernel
def run(active, wave, tables, data, key, depth):
    """Scatter every ray that meets a Lambertian surface to its near or far side, or absorb it."""
    for k in range(len(active)):
        i = active[k]
        surface = wave.surface[i]
        if wave.state[i] != PENDING or tables.surface_kind[surface] != _HERE:
            continue
        _, u, v, w = uniforms(key.seed, key.first_ray + np.uint64(i), depth, ON_SURFACE)
        outcome = draw_outcome(
            wave.light[i], data.reflectance[surface], data.transmittance[surface], key.roulette_threshold, u
        )
        if outcome < 0:
            wave.state[i] = _ABSORPTION
            continue
        side = wave.near_side[i]
        if outcome == 1:
            side = -side
            wave.medium[i] = wave.beyond[i]
        wave.state[i] = _REFLECTION if outcome == 0 else _REFRACTION
        wave.side[i] = side
        plane = tables.plane[wave.hit[i]]
        dx, dy, dz = lambertian(side * plane[0], side * plane[1], side * plane[2], v, w)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz
