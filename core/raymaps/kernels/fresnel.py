# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reflection and refraction at a smooth interface between two media, unpolarised."""

from __future__ import annotations

from raymaps.jit import kernel
from raymaps.kernels import reflectance
from raymaps.kernels.at_surface import incidence_cosine, reflect, refract
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

_HERE = int(SurfaceKind.FRESNEL)
_REFLECTION = int(EventKind.FRESNEL_REFLECTION)
_REFRACTION = int(EventKind.FRESNEL_REFRACTION)


@kernel
def run(active, wave, tables, data, key, depth):
    """Reflect or refract every ray that meets a smooth interface; its light does not change."""
    for k in range(len(active)):
        i = active[k]
        if wave.state[i] != PENDING or tables.surface_kind[wave.surface[i]] != _HERE:
            continue
        normal = wave.normal[i]
        cos_i = incidence_cosine(wave, i, normal)
        share, cos_t = reflectance.of_clear_medium(cos_i, wave.n_near[i], wave.n_far[i])
        _, u, _, _ = sample(key, i, depth, ON_SURFACE)
        if u < share:
            reflect(wave, i, normal)
            wave.state[i] = _REFLECTION
        else:
            refract(wave, i, normal, cos_i, cos_t)
            wave.state[i] = _REFRACTION
