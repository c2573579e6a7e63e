# SPDX-License-Identifier: LGPL-2.1-or-later
"""A walk over a rough surface of microfacets: GGX slopes, Smith's model of shadowing, every bounce followed.

Directions are local: z is the mean surface's normal on the side where the ray is, x and y lie in the surface. A ray's
height is kept as the logarithm of the share of the surface that lies below it (`log_below`, 0 above all of it); the
distribution of heights itself does not matter. The formulas are those of `raymaps.effects.rough`.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels import reflectance
from raymaps.kernels.random import REJECTION, uniforms

__all__ = ["MOST_BOUNCES", "next_height", "visible_normal", "walk_between_media", "walk_on_metal"]

#: A ray that is still among the microfacets then goes on as it does: fewer than one in 10^12 at alpha = 1, but all at
#: grazing incidence between media of one index. Off a metal it is absorbed.
MOST_BOUNCES = 128


@kernel
def next_height(log_below, x, y, z, alpha, u):
    """Height at which a ray meets the next microfacet; 0 or more if it leaves the surface.

    Parameters
    ----------
    log_below : float, <= 0
        Where the ray is.
    x, y, z : float
        Direction in which it goes.
    alpha : float, > 0
    u : float, uniform in (0, 1)
    """
    slope2 = alpha * alpha * (x * x + y * y)
    stretched = math.sqrt(z * z + slope2)
    if z > 0.0:  # 1 / Lambda
        if slope2 == 0.0:
            return np.inf
        return log_below - math.log(u) * 2.0 * z * (stretched + z) / slope2
    return log_below + math.log(u) * 2.0 * -z / (stretched - z)  # 1 / (1 + Lambda)


@kernel
def visible_normal(x, y, z, alpha, u, v):
    """Normal of a microfacet drawn among those that are seen from a direction, by the area that is seen.

    Parameters
    ----------
    x, y, z : float
        Unit vector to where the microfacets are seen from; below the horizon too.
    """
    slope2 = alpha * alpha * (x * x + y * y)
    stretched = math.sqrt(z * z + slope2)
    if z >= 0.0:
        cap = 1.0 + z / stretched
    else:
        cap = slope2 / (stretched * (stretched - z))
    # reflected off the upper half of a unit sphere, parallel light is uniform over a cap of the sphere of directions
    sin_cap = math.sqrt(u * cap * (2.0 - u * cap))
    azimuth = 2.0 * math.pi * v
    mx = alpha * (sin_cap * math.cos(azimuth) + alpha * x / stretched)
    my = alpha * (sin_cap * math.sin(azimuth) + alpha * y / stretched)
    mz = (1.0 - u) * cap
    length = math.sqrt(mx * mx + my * my + mz * mz)
    return mx / length, my / length, mz / length


@kernel
def walk_between_media(x, y, z, alpha, n_i, n_t, seed, ray, depth):
    """Follow a ray over a rough interface of two clear media until it leaves it.

    Parameters
    ----------
    x, y, z : float
        Unit vector in which the ray arrives, z < 0.
    alpha : float, > 0
    n_i, n_t : float, > 0
        Refractive index before and beyond.
    seed, ray, depth : see `raymaps.kernels.random.uniforms`

    Returns
    -------
    (x, y, z), bounces : the direction in which it leaves, z above 0 on the side that it came from, and the number of
    microfacets met
    """
    log_below = 0.0
    mirrored = 1.0  # -1: on the far side, where all is seen with z turned round
    for bounce in range(MOST_BOUNCES):
        u, v, w, chosen = uniforms(seed, ray, depth, REJECTION + bounce)
        log_below = next_height(log_below, x, y, z, alpha, u)
        if log_below >= 0.0:
            return x, y, mirrored * z, bounce
        mx, my, mz = visible_normal(-x, -y, -z, alpha, v, w)
        cosine = min(1.0, max(0.0, -(x * mx + y * my + z * mz)))
        reflected, cos_t = reflectance.of_clear_medium(cosine, n_i, n_t)
        if chosen < reflected:
            x, y, z = x + 2.0 * cosine * mx, y + 2.0 * cosine * my, z + 2.0 * cosine * mz
        else:
            eta = n_i / n_t
            along = eta * cosine - cos_t
            x, y, z = eta * x + along * mx, eta * y + along * my, -(eta * z + along * mz)
            mirrored = -mirrored
            n_i, n_t = n_t, n_i
            log_below = math.log(-math.expm1(log_below)) if log_below < -1e-300 else -700.0
        length = math.sqrt(x * x + y * y + z * z)
        x, y, z = x / length, y / length, z / length
    return x, y, mirrored * z, MOST_BOUNCES


@kernel
def walk_on_metal(x, y, z, alpha, n_i, n, k, share, seed, ray, depth):
    """Follow a ray over the rough surface of a metal until it leaves it.

    Parameters
    ----------
    x, y, z, alpha, n_i, seed, ray, depth : see `walk_between_media`
    n, k : (n_bands,) float64
        Index n + ik of the metal.
    share : (n_bands,) float64
        Filled with the share of the light that is reflected on the way.

    Returns
    -------
    (x, y, z), bounces : see `walk_between_media`; bounces is -1 if it did not leave
    """
    share[:] = 1.0
    log_below = 0.0
    for bounce in range(MOST_BOUNCES):
        u, v, w, _ = uniforms(seed, ray, depth, REJECTION + bounce)
        log_below = next_height(log_below, x, y, z, alpha, u)
        if log_below >= 0.0:
            return x, y, z, bounce
        mx, my, mz = visible_normal(-x, -y, -z, alpha, v, w)
        cosine = min(1.0, max(0.0, -(x * mx + y * my + z * mz)))
        for band in range(len(share)):
            share[band] *= reflectance.of_metal(cosine, n_i, n[band], k[band])
        x, y, z = x + 2.0 * cosine * mx, y + 2.0 * cosine * my, z + 2.0 * cosine * mz
        length = math.sqrt(x * x + y * y + z * z)
        x, y, z = x / length, y / length, z / length
    return x, y, z, -1
