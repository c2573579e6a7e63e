# SPDX-License-Identifier: LGPL-2.1-or-later
"""From faces with an intensity that a table gives over the angle to the normal."""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.directions import around
from raymaps.kernels.emission.tabulated import angle_between, choose
from raymaps.kernels.emission.triangles import start
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample

__all__ = ["run"]


@kernel
def run(slots, wave, key, tables, exact, triangles, cumulated_area, corners, angle_rad, intensity, cumulated):
    """From triangles with constant exitance, outwards; see `raymaps.kernels.emission.triangles`.

    Parameters
    ----------
    angle_rad, intensity : (n_angles,) float64
    cumulated : (n_angles - 1,) float64
        Share of the light below the end of each cell.
    """
    for k in range(len(slots)):
        i = slots[k]
        ray = key.first_ray + np.uint64(i)
        start(i, wave, key, tables, exact, triangles, cumulated_area, corners)
        normal = wave.normal[i]
        u, v, w, _ = sample(key, i, 0, ON_SURFACE)
        c = choose(cumulated, u, w)
        theta = angle_between(angle_rad[c], angle_rad[c + 1], intensity[c], intensity[c + 1], key.seed, ray)
        dx, dy, dz = around(normal[0], normal[1], normal[2], math.cos(theta), math.sin(theta), 2.0 * math.pi * v)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz
