# SPDX-License-Identifier: LGPL-2.1-or-later
"""Light that scatters about the specular direction, in the projections of directions on the surface.

Directions on one side of a surface are the points (p, q) of the unit disc, p along the plane of incidence; the power
that scatters into an area of the disc is the radiance there times the area (J. E. Harvey: Light-Scattering
Characteristics of Optical Surfaces, 1976). Lobes depend on the distance from the specular direction alone and are cut
off at the disc's edge: points beyond are drawn anew.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.at_surface import (
    go_through,
    head,
    incidence_cosine,
    reflect,
    refract,
    refraction_cosine,
    turn_back,
)
from raymaps.kernels.directions import tangents
from raymaps.kernels.random import REJECTION, uniforms
from raymaps.kinds import EventKind

__all__ = ["SCATTERED_BACK", "abg_point", "gaussian_point", "go_on", "projections", "scatter_to"]

#: Outcomes of surfaces that reflect and transmit both specularly and diffusely, in the order of their shares.
MIRRORED, REFRACTED, SCATTERED_BACK, SCATTERED_ON = range(4)
#: Draws that may be thrown away before a ray goes on specularly: fewer than one in 10^12 get there.
_MOST_DRAWS = 128

_SPECULAR_REFLECTION = int(EventKind.BSDF_SPECULAR_REFLECTION)
_SPECULAR_REFRACTION = int(EventKind.BSDF_SPECULAR_REFRACTION)
_DIFFUSE_REFLECTION = int(EventKind.BSDF_DIFFUSE_REFLECTION)
_DIFFUSE_REFRACTION = int(EventKind.BSDF_DIFFUSE_REFRACTION)


@kernel
def gaussian_point(specular, sigma, seed, ray, depth):
    """A point of the unit disc with density proportional to exp(-r² / (2 sigma²)), r its distance from (specular, 0).

    Parameters
    ----------
    specular : float, 0 to 1
        Projection of the specular direction.
    sigma : float, > 0
    seed, ray, depth : see `raymaps.kernels.random.uniforms`

    Returns
    -------
    p, q : float
    """
    width2 = 2.0 * sigma * sigma
    reach = -math.expm1(-((1.0 + specular) ** 2) / width2)  # share of the lobe that is not certain to miss the disc
    for draw in range(_MOST_DRAWS):
        a, b, c, d = uniforms(seed, ray, depth, REJECTION + draw)
        for u, v in ((a, b), (c, d)):
            r = math.sqrt(-width2 * math.log1p(-u * reach))
            p, q = specular + r * math.cos(2.0 * math.pi * v), r * math.sin(2.0 * math.pi * v)
            if p * p + q * q < 1.0:
                return p, q
    return specular, 0.0


@kernel
def abg_point(specular, b, g, ring_edge, ring_share, seed, ray, depth):
    """A point of the unit disc with density proportional to 1 / (b + r^g), r its distance from (specular, 0).

    A ring is drawn by its area and the lobe's height at its inner edge, then a point in it evenly, which is kept with
    the ratio of the lobe's height there to that at the inner edge: exact whatever the rings.

    Parameters
    ----------
    specular : float, 0 to 1
        Projection of the specular direction.
    b, g : float
    ring_edge : (n_rings + 1,) float64
        Radii of the rings' edges, from 0 to 2.
    ring_share : (n_rings,) float64
        Cumulated share of the rings; ends at 1.
    seed, ray, depth : see `raymaps.kernels.random.uniforms`

    Returns
    -------
    p, q : float
    """
    for draw in range(_MOST_DRAWS):
        t, u, v, w = uniforms(seed, ray, depth, REJECTION + draw)
        ring = min(np.searchsorted(ring_share, t, side="right"), len(ring_share) - 1)
        inner, outer = ring_edge[ring], ring_edge[ring + 1]
        r = math.sqrt(inner * inner + u * (outer * outer - inner * inner))
        if w * (b + r**g) > b + inner**g:
            continue
        p, q = specular + r * math.cos(2.0 * math.pi * v), r * math.sin(2.0 * math.pi * v)
        if p * p + q * q < 1.0:
            return p, q
    return specular, 0.0


@kernel
def projections(wave, i, normal):
    """Cosines of incidence and of refraction of ray i, and projections of its two specular directions.

    Returns
    -------
    cos_i, cos_t, reflected, refracted : float; cos_t is -1 and refracted 1 under total reflection
    """
    cos_i = incidence_cosine(wave, i, normal)
    cos_t = refraction_cosine(cos_i, wave.n_near[i], wave.n_far[i])
    reflected = math.sqrt(1.0 - cos_i * cos_i)
    refracted = min(1.0, wave.n_near[i] / wave.n_far[i] * reflected)
    return cos_i, cos_t, reflected, refracted


@kernel
def scatter_to(wave, i, normal, p, q, outward):
    """Let ray i go on to the point (p, q) of the disc of directions on a side, 1 front or -1 back."""
    dx, dy, dz = wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2]
    nx, ny, nz = normal[0], normal[1], normal[2]
    along = dx * nx + dy * ny + dz * nz
    ax, ay, az = dx - along * nx, dy - along * ny, dz - along * nz
    length = math.sqrt(ax * ax + ay * ay + az * az)
    if length > 1e-9:
        ax, ay, az = ax / length, ay / length, az / length
        bx, by, bz = ny * az - nz * ay, nz * ax - nx * az, nx * ay - ny * ax
    else:
        ax, ay, az, bx, by, bz = tangents(nx, ny, nz)
    z = outward * math.sqrt(max(0.0, 1.0 - p * p - q * q))
    head(wave, i, p * ax + q * bx + z * nx, p * ay + q * by + z * ny, p * az + q * bz + z * nz)


@kernel
def go_on(wave, i, normal, cos_i, cos_t, outcome, p, q):
    """Let ray i go on as was drawn; (p, q) matters where it scatters."""
    side = wave.near_side[i]
    if outcome == MIRRORED:
        reflect(wave, i, normal)
        wave.state[i] = _SPECULAR_REFLECTION
    elif outcome == REFRACTED:
        refract(wave, i, normal, cos_i, cos_t)
        wave.state[i] = _SPECULAR_REFRACTION
    elif outcome == SCATTERED_BACK:
        scatter_to(wave, i, normal, p, q, side)
        wave.state[i] = _DIFFUSE_REFLECTION
        turn_back(wave, i)
    else:
        scatter_to(wave, i, normal, p, q, -side)
        wave.state[i] = _DIFFUSE_REFRACTION
        go_through(wave, i)
