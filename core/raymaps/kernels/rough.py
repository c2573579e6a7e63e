# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rough interfaces between two media and rough metals."""

from __future__ import annotations

import numpy as np

from raymaps.jit import allocating_kernel
from raymaps.kernels.at_surface import go_through, head, turn_back
from raymaps.kernels.directions import tangents
from raymaps.kernels.microsurface import walk_between_media, walk_on_metal
from raymaps.kernels.outcome import draw_reflection
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

_HERE = int(SurfaceKind.ROUGH)
_REFLECTION = int(EventKind.FRESNEL_REFLECTION)
_REFRACTION = int(EventKind.FRESNEL_REFRACTION)
_ABSORPTION = int(EventKind.ABSORPTION)


@allocating_kernel
def run(active, wave, tables, data, key, depth):
    """Send every ray that meets a rough interface over its microfacets."""
    share = np.empty(wave.light.shape[1])
    for slot in range(len(active)):
        i = active[slot]
        surface = wave.surface[i]
        if wave.state[i] != PENDING or tables.surface_kind[surface] != _HERE:
            continue
        normal = wave.normal[i]
        side = wave.near_side[i]
        nx, ny, nz = side * normal[0], side * normal[1], side * normal[2]
        ax, ay, az, bx, by, bz = tangents(nx, ny, nz)
        dx, dy, dz = wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2]
        x, y = dx * ax + dy * ay + dz * az, dx * bx + dy * by + dz * bz
        z = min(dx * nx + dy * ny + dz * nz, -1e-12)
        alpha = data.alpha[surface]
        ray = key.first_ray + np.uint64(i)
        beyond = wave.beyond[i]
        if data.is_conductor[beyond]:
            x, y, z, bounces = walk_on_metal(
                x, y, z, alpha, wave.n_near[i], data.n[beyond], data.k[beyond], share, key.seed, ray, depth
            )
            _, u, _, _ = sample(key, i, depth, ON_SURFACE)
            goes_on = bounces > 0 and draw_reflection(wave.light[i], share, key.roulette_threshold, u)
        else:
            x, y, z, bounces = walk_between_media(x, y, z, alpha, wave.n_near[i], wave.n_far[i], key.seed, ray, depth)
            goes_on = bounces > 0
        if not goes_on:
            wave.light[i, :] = 0.0
            wave.state[i] = _ABSORPTION
            continue
        head(wave, i, x * ax + y * bx + z * nx, x * ay + y * by + z * ny, x * az + y * bz + z * nz)
        if z > 0.0:
            wave.state[i] = _REFLECTION
            turn_back(wave, i)
        else:
            wave.state[i] = _REFRACTION
            go_through(wave, i)
