# SPDX-License-Identifier: LGPL-2.1-or-later
"""Exact reflection and transmission of scattering slabs, to compare a simulation with; no random numbers.

Two methods that share nothing: adding and doubling of layers for any phase function and index, and Chandrasekhar's H
function for isotropic scattering in a half space.

References
----------
H. van de Hulst: Multiple Light Scattering, Academic Press (1980). S. Prahl, M. van Gemert, A. Welch:
Determining the optical properties of turbid media by using the adding-doubling method, Appl. Opt. 32 (1993), p. 559.
S. Chandrasekhar: Radiative Transfer, Dover (1960), chapters 4 and 5.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from raymaps.effects.fresnel import fresnel_reflectance

Float = NDArray[np.float64]


class Layer(NamedTuple):
    """Reflection and transmission operators; element (i, j) is the flux into direction i per unit flux from j."""

    r_above: Float  # light from above, back up
    t_down: Float
    r_below: Float
    t_up: Float


class Slab(NamedTuple):
    """What a slab does with a beam that comes from outside; the rest is absorbed."""

    reflectance: float  # with what is reflected specularly
    specular: float
    transmittance: float  # with what gets through unscattered
    upwards: Float  # (n,) share that leaves the front in the directions ``cosine`` inside the slab
    downwards: Float
    cosine: Float
    weight: Float  # (n,) of the quadrature, sum 1


def radau(n: int, low: float, high: float) -> tuple[Float, Float]:
    """Points and weights on [low, high] with the upper end as a point, exact for polynomials up to degree 2 n - 2.

    The free points are the roots of (P_n(x) + P_n-1(x)) / (1 + x), mirrored (Abramowitz & Stegun, eq. 25.4.31).
    """
    p = legendre.legadd(legendre.Legendre.basis(n).coef, legendre.Legendre.basis(n - 1).coef)
    x = np.sort(np.real(legendre.legroots(legendre.legdiv(p, [1.0, 1.0])[0])))
    for _ in range(3):  # polish
        x -= legendre.legval(x, p) / legendre.legval(x, legendre.legder(p))
    inner = (1 - x) / (n * legendre.legval(x, legendre.Legendre.basis(n - 1).coef)) ** 2
    x, w = -np.append(-1.0, x)[::-1], np.append(2.0 / n**2, inner)[::-1]
    return low + (high - low) * (x + 1) / 2, w * (high - low) / 2


def quadrature(n: int, index: float) -> tuple[Float, Float]:
    """Cosines inside the slab: of angles that are totally reflected, then of those that get out, up to 1.

    What gets out has a root at the critical angle: there the points are dense, by the squares of another quadrature.
    """
    if index <= 1:
        return radau(n, 0.0, 1.0)
    critical = np.sqrt(1 - 1 / index**2)
    x, w = np.polynomial.legendre.leggauss(n // 2)
    inner = critical * (1 - ((1 - x) / 2) ** 2), critical * w * (1 - x) / 2
    x, w = radau(n - n // 2, 0.0, 1.0)
    outer = critical + (1 - critical) * x**2, (1 - critical) * 2 * x * w
    return np.concatenate([inner[0], outer[0]]), np.concatenate([inner[1], outer[1]])


def henyey_greenstein_moments(g: float, n: int) -> Float:
    """Legendre moments g^k of the phase function."""
    return g ** np.arange(n)


def thin_layer(cosine: Float, weight: Float, albedo: float, depth: float, moments: Float) -> Layer:
    """A layer so thin that depth³ is nothing, by the diamond rule (W. Wiscombe, J. Quant. Spectrosc. Radiat. Transfer
    16 (1976), p. 637): (1 + A) out = (1 - A) in, with A the generator times half of the depth.
    """
    p = legendre.legvander(cosine, len(moments) - 1)
    factors = (2 * np.arange(len(moments)) + 1) * moments
    sign = (-1.0) ** np.arange(len(moments))
    forward, backward = p * factors @ p.T, p * (factors * sign) @ p.T  # azimuthal means of 4 pi times the density
    share = 0.5 * albedo * weight[None, :]
    # per unit depth, of radiance: losses and gains of direction i from direction j
    alpha = (np.eye(len(cosine)) - share * forward) / cosine[:, None]
    beta = share * backward / cosine[:, None]
    n = len(cosine)
    generator = np.block([[alpha, -beta], [-beta, alpha]]) * depth / 2
    out = np.linalg.solve(np.eye(2 * n) + generator, np.eye(2 * n) - generator)
    # from radiance to flux: flux = 2 pi weight cosine radiance
    scale = weight * cosine
    t, r = (block * scale[:, None] / scale[None, :] for block in (out[:n, :n], out[n:, :n]))
    return Layer(r, t, r, t)


def added(above: Layer, below: Layer) -> Layer:
    """Two layers, one on the other: light goes to and fro between them any number of times."""
    one = np.eye(len(above.r_above))
    down = np.linalg.solve(one - above.r_below @ below.r_above, above.t_down)
    up = np.linalg.solve(one - below.r_above @ above.r_below, below.t_up)
    return Layer(
        above.r_above + above.t_up @ below.r_above @ down,
        below.t_down @ down,
        below.r_below + below.t_down @ above.r_below @ up,
        above.t_up @ up,
    )


def scattering_layer(cosine: Float, weight: Float, albedo: float, depth: float, moments: Float) -> Layer:
    """A layer without surfaces, by doubling."""
    doublings = max(0, int(np.ceil(np.log2(depth / 1e-7))))
    layer = thin_layer(cosine, weight, albedo, depth / 2**doublings, moments)
    for _ in range(doublings):
        layer = added(layer, layer)
    return layer


def slab(
    albedo: float, depth: float, moments: Float, index: float = 1.0, cosine_outside: float = 1.0, n: int = 40
) -> Slab:
    """A slab in vacuum, with a beam at one angle to its normal.

    Parameters
    ----------
    albedo : scattering / (scattering + absorption)
    depth : optical thickness, (scattering + absorption) times thickness
    moments : Legendre moments of the phase function, 1 first
    index : refractive index of the slab
    cosine_outside : of the beam before the slab; 1 unless the index is 1, then a point of ``quadrature(n, 1)``
    n : number of directions
    """
    cosine, weight = quadrature(n, index)
    layer = scattering_layer(cosine, weight, albedo, depth, moments)
    inside = np.array([fresnel_reflectance(c, index, 1.0) for c in cosine])
    zero = np.zeros((n, n))
    # a boundary from inside: what is not reflected leaves
    bottom = Layer(np.diag(inside), np.diag(1 - inside), zero, zero)
    top = Layer(zero, np.eye(n), np.diag(inside), np.diag(1 - inside))
    whole = added(added(top, layer), bottom)
    start = int(np.argmin(np.abs(cosine - (cosine_outside if index == 1 else 1.0))))
    specular = float(fresnel_reflectance(1.0, 1.0, index)) if index != 1 else 0.0
    beam = np.zeros(n)
    beam[start] = 1 - specular
    upwards, downwards = whole.r_above @ beam, whole.t_down @ beam
    return Slab(specular + upwards.sum(), specular, downwards.sum(), upwards, downwards, cosine, weight)


def h_function(albedo: float, cosine: Float, n: int = 200) -> Float:
    """Chandrasekhar's H function of isotropic scattering, by iteration of
    1/H(m) = sqrt(1 - w) + w/2 times the integral of m' H(m') / (m + m') dm' from 0 to 1.
    """
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = ((x + 1) / 2) ** 2, w * (x + 1) / 2  # m = s²: dense at 0, where H has a logarithm
    h = np.ones(n)

    def closer(at: Float) -> Float:
        integral = (w * x * h / (at[:, None] + x)).sum(axis=1)
        return 1 / (np.sqrt(1 - albedo) + albedo / 2 * integral)

    for _ in range(500):
        h = 0.5 * (h + closer(x))
    return closer(np.atleast_1d(np.asarray(cosine, float)))


def half_space_reflectance(albedo: float, cosine: float) -> float:
    """Share that an isotropically scattering half space reflects of a beam (Chandrasekhar, chapter 4)."""
    return float(1 - np.sqrt(1 - albedo) * h_function(albedo, cosine)[0])
