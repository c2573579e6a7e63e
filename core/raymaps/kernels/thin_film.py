# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reflection and refraction at a surface with a stack of thin layers, from tables over the angle.

The tables and what they are over: `raymaps.effects.thin_film`.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import allocating_kernel, kernel
from raymaps.kernels.at_surface import incidence_cosine, reflect, refract, refraction_cosine
from raymaps.kernels.outcome import draw_among
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

__all__ = ["place_in_table", "run"]

_HERE = int(SurfaceKind.THIN_FILM)
_REFLECTION = int(EventKind.FRESNEL_REFLECTION)
_REFRACTION = int(EventKind.FRESNEL_REFRACTION)
_ABSORPTION = int(EventKind.ABSORPTION)
_NUMERICAL = int(EventKind.KILLED_NUMERICAL)


@kernel
def place_in_table(cos_i, cos_t, n_i, n_t):
    """Where an angle of incidence stands in a table, 0 to 1; see `raymaps.effects.thin_film.angles_of`.

    Parameters
    ----------
    cos_i : float
    cos_t : float
        Cosine of refraction, -1 under total reflection.
    n_i, n_t : float
        Refractive index before and beyond.
    """
    if cos_t >= 0.0:
        return cos_i if n_i <= n_t else cos_t
    beyond_critical = (1.0 - cos_i * cos_i) - (n_t / n_i) ** 2
    return 2.0 / math.pi * math.atan2(math.sqrt(max(0.0, beyond_critical)), cos_i)


@allocating_kernel
def run(active, wave, tables, data, key, depth):
    """Reflect or refract every ray that meets a coated surface, or absorb it in the layers."""
    n_bands = wave.light.shape[1]
    shares = np.empty((2, n_bands))
    for slot in range(len(active)):
        i = active[slot]
        surface = wave.surface[i]
        if wave.state[i] != PENDING or tables.surface_kind[surface] != _HERE:
            continue
        normal = wave.normal[i]
        n_i, n_t = wave.n_near[i], wave.n_far[i]
        from_back = 1 if wave.near_side[i] < 0 else 0
        row = data.row[surface, from_back, wave.medium[i], wave.beyond[i]]
        if row < 0:  # the ray is lost among overlapping bodies
            wave.state[i] = _NUMERICAL
            continue
        cos_i = incidence_cosine(wave, i, normal)
        if data.is_conductor[wave.beyond[i]]:
            cos_t = -1.0
            place, zone = cos_i, 0
        else:
            cos_t = refraction_cosine(cos_i, n_i, n_t)
            place = place_in_table(cos_i, cos_t, n_i, n_t)
            zone = 1 if cos_t < 0.0 else 0
        place *= data.share.shape[2] - 1
        step = min(int(place), data.share.shape[2] - 2)
        place -= step
        for outcome in range(2):
            for band in range(n_bands):
                low, high = data.share[row, zone, step, outcome, band], data.share[row, zone, step + 1, outcome, band]
                shares[outcome, band] = low + place * (high - low)
        _, u, _, _ = sample(key, i, depth, ON_SURFACE)
        outcome = draw_among(wave.light[i], shares, key.roulette_threshold, u)
        if outcome < 0:
            wave.state[i] = _ABSORPTION
        elif outcome == 0:
            reflect(wave, i, normal)
            wave.state[i] = _REFLECTION
        else:
            refract(wave, i, normal, cos_i, cos_t)
            wave.state[i] = _REFRACTION
