# SPDX-License-Identifier: LGPL-2.1-or-later
"""Emission: where rays start and where they go, one function a kind of source.

Each fills position and direction of the slots whose source it is; lengths in frame units.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.directions import around, lambertian
from raymaps.kernels.random import EMIT_PLACE, ON_SURFACE, uniforms

__all__ = ["emit_disc", "emit_faces", "emit_point"]


@kernel
def emit_point(slots, wave, key, position, axis, opening):
    """From a point with constant intensity inside a cone; ``opening`` is 1 - cos(half angle), 2 for a sphere."""
    for k in range(len(slots)):
        i = slots[k]
        u, v, _, _ = uniforms(key.seed, key.first_ray + np.uint64(i), 0, ON_SURFACE)
        below = u * opening  # 1 - cos(theta); so narrow cones keep their sines
        sin_theta = math.sqrt(below * (2.0 - below))
        dx, dy, dz = around(axis[0], axis[1], axis[2], 1.0 - below, sin_theta, 2.0 * math.pi * v)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz
        for a in range(3):
            wave.position[i, a] = position[a]


@kernel
def emit_disc(slots, wave, key, position, axis, radius):
    """Collimated from a disc with constant irradiance."""
    for k in range(len(slots)):
        i = slots[k]
        u, v, _, _ = uniforms(key.seed, key.first_ray + np.uint64(i), 0, ON_SURFACE)
        px, py, pz = around(axis[0], axis[1], axis[2], 0.0, 1.0, 2.0 * math.pi * v)
        from_center = radius * math.sqrt(u)
        wave.position[i, 0] = position[0] + from_center * px
        wave.position[i, 1] = position[1] + from_center * py
        wave.position[i, 2] = position[2] + from_center * pz
        for a in range(3):
            wave.direction[i, a] = axis[a]


@kernel
def emit_faces(slots, wave, key, tables, triangles, cumulated_area, corners):
    """Lambertian from triangles with constant exitance, outwards.

    Parameters
    ----------
    triangles : (n,) int32, indices of the emitting triangles
    cumulated_area : (n,) float64, ends at 1
    corners : (n, 3 corners, 3) float64
    """
    for k in range(len(slots)):
        i = slots[k]
        ray = key.first_ray + np.uint64(i)
        u, v, w, _ = uniforms(key.seed, ray, 0, EMIT_PLACE)
        t = min(np.searchsorted(cumulated_area, u, side="right"), len(triangles) - 1)
        root = math.sqrt(v)  # uniform over a triangle: barycentric (1 - sqrt v, sqrt v (1 - w), sqrt v w)
        for a in range(3):
            wave.position[i, a] = (
                (1.0 - root) * corners[t, 0, a] + root * (1.0 - w) * corners[t, 1, a] + root * w * corners[t, 2, a]
            )
        plane = tables.plane[triangles[t]]
        u, v, _, _ = uniforms(key.seed, ray, 0, ON_SURFACE)
        dx, dy, dz = lambertian(plane[0], plane[1], plane[2], u, v)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz
        wave.triangle[i] = triangles[t]
        wave.side[i] = 1
