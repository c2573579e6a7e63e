# SPDX-License-Identifier: LGPL-2.1-or-later
"""Absorption of all light on a surface."""

from __future__ import annotations

from raymaps.jit import kernel
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

_HERE = int(SurfaceKind.ABSORBER)
_ABSORPTION = int(EventKind.ABSORPTION)


@kernel
def run(active, wave, tables, data, key, depth):
    """End every ray that meets an absorber."""
    for k in range(len(active)):
        i = active[k]
        if wave.state[i] == PENDING and tables.surface_kind[wave.surface[i]] == _HERE:
            wave.state[i] = _ABSORPTION
            wave.light[i] = 0.0
