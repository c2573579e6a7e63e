# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mixtures: draw which part of the property a ray meets."""

from __future__ import annotations

from raymaps.jit import kernel
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample
from raymaps.kernels.transport import PENDING
from raymaps.kinds import SurfaceKind

_HERE = int(SurfaceKind.MIXTURE)


@kernel
def run(active, wave, tables, data, key, depth):
    """Replace a mixture by one of its parts for every ray that meets one."""
    for k in range(len(active)):
        i = active[k]
        surface = wave.surface[i]
        if wave.state[i] != PENDING or tables.surface_kind[surface] != _HERE:
            continue
        u, _, _, _ = sample(key, i, depth, ON_SURFACE)
        part, last = data.start[surface], data.start[surface + 1] - 1
        while part < last and u >= data.edge[part]:
            part += 1
        wave.surface[i] = data.part[part]
