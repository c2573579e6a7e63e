# SPDX-License-Identifier: LGPL-2.1-or-later
"""Diffuse reflection and transmission by Lambert's law."""

from __future__ import annotations

from raymaps.jit import kernel
from raymaps.kernels.at_surface import go_through, scatter_lambertian, turn_back
from raymaps.kernels.outcome import draw_outcome
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample
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
        _, u, v, w = sample(key, i, depth, ON_SURFACE)
        outcome = draw_outcome(
            wave.light[i], data.reflectance[surface], data.transmittance[surface], key.roulette_threshold, u
        )
        if outcome < 0:
            wave.state[i] = _ABSORPTION
            continue
        if outcome == 0:
            wave.state[i] = _REFLECTION
            turn_back(wave, i)
        else:
            wave.state[i] = _REFRACTION
            go_through(wave, i)
        scatter_lambertian(wave, i, wave.normal[i], v, w)
