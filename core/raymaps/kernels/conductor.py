# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reflection off the smooth surface of a metal, unpolarised."""

from __future__ import annotations

import numpy as np

from raymaps.jit import allocating_kernel
from raymaps.kernels import reflectance
from raymaps.kernels.at_surface import incidence_cosine, reflect
from raymaps.kernels.outcome import draw_reflection
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

_HERE = int(SurfaceKind.FRESNEL)
_REFLECTION = int(EventKind.FRESNEL_REFLECTION)
_ABSORPTION = int(EventKind.ABSORPTION)


@allocating_kernel
def run(active, wave, tables, data, key, depth):
    """Reflect every ray that meets the smooth surface of a metal, or absorb it there."""
    share = np.empty(wave.light.shape[1])
    for slot in range(len(active)):
        i = active[slot]
        metal = wave.beyond[i]
        if wave.state[i] != PENDING or tables.surface_kind[wave.surface[i]] != _HERE or not data.is_conductor[metal]:
            continue
        normal = wave.normal[i]
        cos_i = incidence_cosine(wave, i, normal)
        for band in range(len(share)):
            share[band] = reflectance.of_metal(cos_i, wave.n_near[i], data.n[metal, band], data.k[metal, band])
        _, u, _, _ = sample(key, i, depth, ON_SURFACE)
        if not draw_reflection(wave.light[i], share, key.roulette_threshold, u):
            wave.state[i] = _ABSORPTION
            continue
        reflect(wave, i, normal)
        wave.state[i] = _REFLECTION
