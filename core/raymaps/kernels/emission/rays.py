# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays of a set, each drawn by its flux with replacement: so all that are traced carry the same."""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.emission.tabulated import choose
from raymaps.kernels.random import EMIT_PLACE
from raymaps.kernels.sampling import sample

__all__ = ["run"]


@kernel
def run(slots, wave, key, position_mm, direction, cumulated, light_index, light, wavelength_nm, axes, origin, unit_mm):
    """Rays of a set.

    Parameters
    ----------
    position_mm, direction : (n, 3) float32 or float64
        In the set's own axes; directions of about length 1.
    cumulated : (n,) float64
        Share of the flux up to each ray.
    light_index : (n,) int32
        Which row of ``light`` each ray has.
    light : (n_lights, n_bands) float32
    wavelength_nm : (n,) float64, or empty
        Wavelengths that rays are narrowed to.
    axes : (3, 3) float64
        Directions of the set's x, y and z.
    origin : (3,) float64
        Place of the set's origin in frame units.
    unit_mm : float
    """
    for k in range(len(slots)):
        i = slots[k]
        u, v, _, _ = sample(key, i, 0, EMIT_PLACE)
        r = choose(cumulated, u, v)
        px, py, pz = np.float64(position_mm[r, 0]), np.float64(position_mm[r, 1]), np.float64(position_mm[r, 2])
        dx, dy, dz = np.float64(direction[r, 0]), np.float64(direction[r, 1]), np.float64(direction[r, 2])
        scale = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
        for a in range(3):
            wave.position[i, a] = origin[a] + (px * axes[0, a] + py * axes[1, a] + pz * axes[2, a]) / unit_mm
            wave.direction[i, a] = (dx * axes[0, a] + dy * axes[1, a] + dz * axes[2, a]) * scale
        row = light_index[r]
        for b in range(light.shape[1]):
            wave.light[i, b] = light[row, b]
        if len(wavelength_nm):
            wave.wavelength_nm[i] = wavelength_nm[r]
