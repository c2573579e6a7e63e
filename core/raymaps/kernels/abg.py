# SPDX-License-Identifier: LGPL-2.1-or-later
"""Specular reflection and transmission of which a part scatters by the ABg model."""

from __future__ import annotations

import numpy as np

from raymaps.jit import allocating_kernel, kernel
from raymaps.kernels.lobes import SCATTERED_BACK, abg_point, go_on, projections
from raymaps.kernels.outcome import draw_among
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

__all__ = ["run", "scattered_share"]

_HERE = int(SurfaceKind.ABG)
_ABSORPTION = int(EventKind.ABSORPTION)


@kernel
def scattered_share(specular, nodes, values):
    """Total integrated scatter over the projection of the specular direction, linear between nodes."""
    after = min(max(np.searchsorted(nodes, specular, side="right"), 1), len(nodes) - 1)
    place = (specular - nodes[after - 1]) / (nodes[after] - nodes[after - 1])
    return values[after - 1] + min(1.0, max(0.0, place)) * (values[after] - values[after - 1])


@allocating_kernel
def run(active, wave, tables, data, key, depth):
    """Send every ray that meets such a surface on, specularly or scattered, or absorb it."""
    n_bands = wave.light.shape[1]
    shares = np.empty((4, n_bands))
    for slot in range(len(active)):
        i = active[slot]
        surface = wave.surface[i]
        if wave.state[i] != PENDING or tables.surface_kind[surface] != _HERE:
            continue
        normal = wave.normal[i]
        cos_i, cos_t, reflected, refracted = projections(wave, i, normal)
        row = data.row[surface]
        nodes = slice(data.start[row], data.start[row + 1])
        back_scatter = scattered_share(reflected, data.specular[nodes], data.scattered[nodes])
        on_scatter = scattered_share(refracted, data.specular[nodes], data.scattered[nodes])
        for band in range(n_bands):
            back, on = data.reflectance[surface, band], data.transmittance[surface, band]
            if data.is_conductor[wave.beyond[i]]:
                on = 0.0
            elif cos_t < 0.0:
                back, on = back + on, 0.0
            shares[2, band], shares[3, band] = min(back, back_scatter), min(on, on_scatter)
            shares[0, band], shares[1, band] = back - shares[2, band], on - shares[3, band]
        ray = key.first_ray + np.uint64(i)
        _, u, _, _ = sample(key, i, depth, ON_SURFACE)
        outcome = draw_among(wave.light[i], shares, key.roulette_threshold, u)
        if outcome < 0:
            wave.state[i] = _ABSORPTION
            continue
        p = q = 0.0
        if outcome >= SCATTERED_BACK:
            specular = reflected if outcome == SCATTERED_BACK else refracted
            p, q = abg_point(
                specular, data.b[row], data.g[row], data.ring_edge[row], data.ring_share[row], key.seed, ray, depth
            )
        go_on(wave, i, normal, cos_i, cos_t, outcome, p, q)
