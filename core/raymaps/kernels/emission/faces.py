# SPDX-License-Identifier: LGPL-2.1-or-later
"""From faces by Lambert's law."""

from __future__ import annotations

from raymaps.jit import kernel
from raymaps.kernels.directions import lambertian
from raymaps.kernels.emission.triangles import start
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample

__all__ = ["run"]


@kernel
def run(slots, wave, key, tables, exact, triangles, cumulated_area, corners):
    """Lambertian from triangles with constant exitance, outwards; see `raymaps.kernels.emission.triangles`."""
    for k in range(len(slots)):
        i = slots[k]
        start(i, wave, key, tables, exact, triangles, cumulated_area, corners)
        normal = wave.normal[i]
        u, v, _, _ = sample(key, i, 0, ON_SURFACE)
        dx, dy, dz = lambertian(normal[0], normal[1], normal[2], u, v)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz
