# SPDX-License-Identifier: LGPL-2.1-or-later
"""Axes around a direction, and directions drawn around it."""

from __future__ import annotations

import math

from raymaps.jit import kernel

__all__ = ["around", "lambertian", "tangents"]


@kernel
def tangents(x, y, z):
    """Two unit vectors that stand on the unit vector (x, y, z) and on each other, six numbers.

    References
    ----------
    T. Duff et al.: Building an Orthonormal Basis, Revisited, JCGT 6 (2017), listing 3.
    """
    sign = math.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    return 1.0 + sign * x * x * a, sign * b, -sign * x, b, sign + y * y * a, -y


@kernel
def around(x, y, z, cos_theta, sin_theta, azimuth):
    """Unit vector at a polar angle and an azimuth around the unit vector (x, y, z)."""
    ax, ay, az, bx, by, bz = tangents(x, y, z)
    p, q = sin_theta * math.cos(azimuth), sin_theta * math.sin(azimuth)
    return p * ax + q * bx + cos_theta * x, p * ay + q * by + cos_theta * y, p * az + q * bz + cos_theta * z


@kernel
def lambertian(x, y, z, u, v):
    """Unit vector with density cos(theta) / pi around the unit vector (x, y, z): sin²(theta) = u, azimuth = 2 pi v."""
    return around(x, y, z, math.sqrt(1.0 - u), math.sqrt(u), 2.0 * math.pi * v)
