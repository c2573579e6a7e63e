# SPDX-License-Identifier: LGPL-2.1-or-later
"""Geometry where a ray meets a surface: its angle of incidence, axes in the surface, Snell's law."""

from __future__ import annotations

import math

from raymaps.jit import kernel

__all__ = ["head", "incidence_cosine", "refract", "refraction_cosine", "tangents"]


@kernel
def incidence_cosine(wave, i, plane):
    """Cosine of the angle of incidence of ray i on a plane, 0 to 1."""
    along = wave.direction[i, 0] * plane[0] + wave.direction[i, 1] * plane[1] + wave.direction[i, 2] * plane[2]
    return min(1.0, abs(along))


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
def refraction_cosine(cos_i, n_i, n_t):
    """Cosine of the angle of refraction by Snell's law; -1 under total reflection.

    Parameters
    ----------
    cos_i : float, 0 to 1
    n_i, n_t : float, > 0
        Refractive index before and beyond the surface.
    """
    if n_i == n_t:
        return cos_i
    sin2_t = (n_i / n_t) ** 2 * (1.0 - cos_i * cos_i)
    return -1.0 if sin2_t >= 1.0 else math.sqrt(1.0 - sin2_t)


@kernel
def head(wave, i, x, y, z):
    """Let ray i go on along (x, y, z), brought to length one."""
    length = math.sqrt(x * x + y * y + z * z)
    wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = x / length, y / length, z / length


@kernel
def refract(wave, i, plane, cos_i, cos_t):
    """Bend the direction of ray i on its way through a plane, and tell its new side and medium.

    Parameters
    ----------
    cos_i, cos_t : float
        See `incidence_cosine` and `refraction_cosine`.
    """
    side = wave.near_side[i]
    eta = wave.n_near[i] / wave.n_far[i]
    along = side * (eta * cos_i - cos_t)
    head(
        wave,
        i,
        eta * wave.direction[i, 0] + along * plane[0],
        eta * wave.direction[i, 1] + along * plane[1],
        eta * wave.direction[i, 2] + along * plane[2],
    )
    wave.side[i] = -side
    wave.medium[i] = wave.beyond[i]
