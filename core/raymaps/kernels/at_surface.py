# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a ray meets a surface: its angle of incidence, and how it goes on by reflection, Snell's or Lambert's law."""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kernels.directions import lambertian
from raymaps.kernels.reflectance import cos2_of_refraction

__all__ = [
    "go_through",
    "head",
    "incidence_cosine",
    "reflect",
    "refract",
    "refraction_cosine",
    "scatter_lambertian",
    "turn_back",
]


@kernel
def incidence_cosine(wave, i, normal):
    """Cosine of the angle of incidence of ray i on a surface of a normal, 0 to 1."""
    along = wave.direction[i, 0] * normal[0] + wave.direction[i, 1] * normal[1] + wave.direction[i, 2] * normal[2]
    return min(1.0, abs(along))


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
    cos2_t = cos2_of_refraction(cos_i, n_i, n_t)
    return -1.0 if cos2_t <= 0.0 else math.sqrt(cos2_t)


@kernel
def head(wave, i, x, y, z):
    """Let ray i go on along (x, y, z), brought to length one."""
    length = math.sqrt(x * x + y * y + z * z)
    wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = x / length, y / length, z / length


@kernel
def turn_back(wave, i):
    """Let ray i stay on the side from which it arrived."""
    wave.side[i] = wave.near_side[i]


@kernel
def go_through(wave, i):
    """Let ray i go to the other side, into the medium beyond and the solids there."""
    wave.side[i] = -wave.near_side[i]
    wave.medium[i] = wave.beyond[i]
    for word in range(wave.inside.shape[1]):
        wave.inside[i, word] ^= wave.across[i, word]


@kernel
def reflect(wave, i, normal):
    """Turn the direction of ray i around a normal; it stays on its side."""
    dx, dy, dz = wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2]
    twice = 2.0 * (dx * normal[0] + dy * normal[1] + dz * normal[2])
    head(wave, i, dx - twice * normal[0], dy - twice * normal[1], dz - twice * normal[2])
    turn_back(wave, i)


@kernel
def scatter_lambertian(wave, i, normal, u, v):
    """Let ray i go on in any direction of the side that it is on, by Lambert's law; u and v are uniform in (0, 1)."""
    side = wave.side[i]
    dx, dy, dz = lambertian(side * normal[0], side * normal[1], side * normal[2], u, v)
    wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz


@kernel
def refract(wave, i, normal, cos_i, cos_t):
    """Bend the direction of ray i on its way through a surface, to the other side and into the medium beyond.

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
        eta * wave.direction[i, 0] + along * normal[0],
        eta * wave.direction[i, 1] + along * normal[1],
        eta * wave.direction[i, 2] + along * normal[2],
    )
    go_through(wave, i)
