# SPDX-License-Identifier: LGPL-2.1-or-later
"""Absorption inside media by Beer-Lambert's law, drawn as an event."""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kernels.outcome import total
from raymaps.kernels.random import IN_MEDIUM
from raymaps.kernels.sampling import sample
from raymaps.kinds import EventKind

_MEDIUM_ABSORPTION = int(EventKind.MEDIUM_ABSORPTION)


@kernel
def run(active, wave, tables, data, key, depth):
    """Absorb rays on their way through absorbing media; the others keep all their light, recoloured.

    With light l_b, and e_b = exp(-a_b d) the share of band b that would get through, a ray gets through with
    probability s = sum(l_b e_b) / sum(l_b) and then carries l_b e_b / s: the expectation of band b is l_b e_b.
    """
    n_bands = data.absorption.shape[1]
    for k in range(len(active)):
        i = active[k]
        absorption = data.absorption[wave.medium[i]]
        largest = smallest = absorption[0]
        for band in range(1, n_bands):
            largest, smallest = max(largest, absorption[band]), min(smallest, absorption[band])
        if largest == 0.0:
            continue
        light = wave.light[i]
        distance = wave.distance[i]
        arriving = total(light)
        if largest == smallest:
            lost = arriving * -math.expm1(-largest * distance)
        else:
            lost = 0.0
            for band in range(n_bands):
                lost += light[band] * -math.expm1(-absorption[band] * distance)
        u, v, _, _ = sample(key, i, depth, IN_MEDIUM)
        u *= arriving
        if u >= lost:
            if largest != smallest:
                scale = arriving / (arriving - lost)
                for band in range(n_bands):
                    light[band] = (light[band] - light[band] * -math.expm1(-absorption[band] * distance)) * scale
            continue
        # where: drawn in the band that u fell into, from the exponential cut off at the segment's end
        band = 0
        if largest != smallest:
            below = light[0] * -math.expm1(-absorption[0] * distance)
            while u >= below and band < n_bands - 1:
                band += 1
                below += light[band] * -math.expm1(-absorption[band] * distance)
        depth_in = -math.log1p(v * math.expm1(-absorption[band] * distance)) / absorption[band]
        depth_in = min(depth_in, distance)
        for axis in range(3):
            wave.end[i, axis] = wave.position[i, axis] + depth_in * wave.direction[i, axis]
        wave.distance[i] = depth_in
        wave.hit[i] = -1
        wave.state[i] = _MEDIUM_ABSORPTION
        light[:] = 0.0
