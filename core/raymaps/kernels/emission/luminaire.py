# SPDX-License-Identifier: LGPL-2.1-or-later
"""From a point with an intensity that a table gives over half planes C and angles gamma.

The density of directions is that of the bilinear table times sin(gamma), exactly: a cell by its light, gamma by the sum
of its two half planes, then C, in which the intensity is linear, by inversion.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.emission.tabulated import angle_between, choose
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample

__all__ = ["run"]


@kernel
def run(slots, wave, key, position, axes, c_rad, gamma_rad, intensity, cumulated):
    """From a point.

    Parameters
    ----------
    axes : (3, 3) float64
        Directions of C = 0 and C = 90 degrees at gamma = 90 degrees, and of gamma = 0.
    c_rad : (n_c,) float64
    gamma_rad : (n_gamma,) float64
    intensity : (n_c, n_gamma) float64
    cumulated : ((n_c - 1) * (n_gamma - 1),) float64
        Share of the light up to each cell, gamma running first.
    """
    n = len(gamma_rad) - 1
    for k in range(len(slots)):
        i = slots[k]
        ray = key.first_ray + np.uint64(i)
        u, v, w, _ = sample(key, i, 0, ON_SURFACE)
        cell = choose(cumulated, u, v)
        c, g = cell // n, cell % n
        low, high = intensity[c, g] + intensity[c + 1, g], intensity[c, g + 1] + intensity[c + 1, g + 1]
        gamma = angle_between(gamma_rad[g], gamma_rad[g + 1], low, high, key.seed, ray)
        t = (gamma - gamma_rad[g]) / (gamma_rad[g + 1] - gamma_rad[g])
        first = (1.0 - t) * intensity[c, g] + t * intensity[c, g + 1]
        second = (1.0 - t) * intensity[c + 1, g] + t * intensity[c + 1, g + 1]
        root = first + math.sqrt(first * first + w * (second * second - first * first))
        share = min(w * (first + second) / root, 1.0) if root > 0.0 else w
        angle = c_rad[c] + share * (c_rad[c + 1] - c_rad[c])
        x, y, z = math.sin(gamma) * math.cos(angle), math.sin(gamma) * math.sin(angle), math.cos(gamma)
        for a in range(3):
            wave.position[i, a] = position[a]
            wave.direction[i, a] = x * axes[0, a] + y * axes[1, a] + z * axes[2, a]
