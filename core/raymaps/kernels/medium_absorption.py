# SPDX-License-Identifier: LGPL-2.1-or-later
"""Absorption inside media by Beer-Lambert's law, drawn as an event."""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.random import IN_MEDIUM, uniforms
from raymaps.kinds import EventKind

_MEDIUM_ABSORPTION = int(EventKind.MEDIUM_ABSORPTION)


@kernel
def run(active, wave, tables, key, depth):
    """Absorb rays on their way through absorbing media; the others keep all their light, recoloured.

    With light l_b, and e_b = exp(-a_b d) the share of band b that would get through, a ray gets through with
    probability s = sum(l_b e_b) / sum(l_b) and then carries l_b e_b / s: the expectation of band b is l_b e_b.
    """
    for k in range(len(active)):
        i = active[k]
        absorption = tables.medium_absorption[wave.medium[i]]
        if absorption[0] == 0.0 and absorption[1] == 0.0 and absorption[2] == 0.0:
            continue
        light = wave.light[i]
        distance = wave.distance[i]
        total = np.float64(light[0]) + np.float64(light[1]) + np.float64(light[2])
        lost_0 = light[0] * -math.expm1(-absorption[0] * distance)
        lost_1 = light[1] * -math.expm1(-absorption[1] * distance)
        lost_2 = light[2] * -math.expm1(-absorption[2] * distance)
        lost = lost_0 + lost_1 + lost_2
        u, v, _, _ = uniforms(key.seed, key.first_ray + np.uint64(i), depth, IN_MEDIUM)
        u *= total
        if u >= lost:
            if absorption[0] != absorption[1] or absorption[1] != absorption[2]:
                scale = total / (total - lost)
                light[0] = (light[0] - lost_0) * scale
                light[1] = (light[1] - lost_1) * scale
                light[2] = (light[2] - lost_2) * scale
            continue
        # where: drawn in the band that u fell into, from the exponential cut off at the segment's end
        band = 0 if u < lost_0 else (1 if u < lost_0 + lost_1 else 2)
        depth_in = -math.log1p(v * math.expm1(-absorption[band] * distance)) / absorption[band]
        depth_in = min(depth_in, distance)
        for axis in range(3):
            wave.end[i, axis] = wave.position[i, axis] + depth_in * wave.direction[i, axis]
        wave.distance[i] = depth_in
        wave.hit[i] = -1
        wave.state[i] = _MEDIUM_ABSORPTION
        light[0] = light[1] = light[2] = 0.0
