# SPDX-License-Identifier: LGPL-2.1-or-later
"""Specular reflection."""

from __future__ import annotations

from raymaps.jit import kernel
from raymaps.kernels.at_surface import reflect
from raymaps.kernels.outcome import draw_reflection
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

_HERE = int(SurfaceKind.MIRROR)
_REFLECTION = int(EventKind.SPECULAR_REFLECTION)
_ABSORPTION = int(EventKind.ABSORPTION)


@kernel
def run(active, wave, tables, data, key, depth):
    """Reflect every ray that meets a mirror, or absorb it."""
    for k in range(len(active)):
        i = active[k]
        surface = wave.surface[i]
        if wave.state[i] != PENDING or tables.surface_kind[surface] != _HERE:
            continue
        _, u, _, _ = sample(key, i, depth, ON_SURFACE)
        kept = draw_reflection(wave.light[i], data.reflectance[surface], key.roulette_threshold, u)
        if not kept:
            wave.state[i] = _ABSORPTION
            continue
        wave.state[i] = _REFLECTION
        reflect(wave, i, wave.normal[i])
