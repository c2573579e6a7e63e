# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rough interfaces and rough metals: microfacets, each of which reflects and refracts by Fresnel's equations.

The slopes of the microfacets follow the GGX (Trowbridge-Reitz) distribution, and Smith's model tells which of them a
ray sees. A ray is followed from microfacet to microfacet until it leaves the surface on one side or the other, so no
light is lost where microfacets stand in each other's way, as it is where only one bounce is counted: a rough interface
of clear media sends on all light, at any roughness, and is reciprocal. At a microfacet of a clear medium a ray is
reflected with the probability of Fresnel's reflectance, otherwise refracted; at one of a metal its light is scaled by
the reflectance for n + ik. Not modelled: diffraction, polarisation, and what the correlation of neighbouring slopes
adds.

References
----------
B. Walter, S. Marschner, H. Li, K. Torrance: Microfacet Models for Refraction through Rough Surfaces, EGSR 2007.
E. Heitz, J. Hanika, E. d'Eon, C. Dachsbacher: Multiple-Scattering Microfacet BSDFs with the Smith Model, SIGGRAPH 2016.
J. Dupuy, A. Benyoub: Sampling Visible GGX Normals with Spherical Caps, HPG 2023.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raymaps.effects import conductor
from raymaps.effects.fresnel import fresnel_reflectance
from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import faces_of_kind
from raymaps.materials import RoughInterface
from raymaps.scene import Scene

__all__ = ["Data", "facet_density", "lower", "needed_by", "smith_lambda", "walked_direction"]


class Data(NamedTuple):
    """What the kernel reads."""

    alpha: NDArray[np.float64]  # (n_surfaces,) roughness
    is_conductor: NDArray[np.bool_]  # (n_media,)
    n: NDArray[np.float64]  # (n_media, n_bands) index n + ik of conductors
    k: NDArray[np.float64]


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for microfacets if a face is a rough interface."""
    return faces_of_kind(scene, "rough")


def lower(lowering: Lowering) -> Data:
    """Roughness of each surface, and the index of each metal."""
    surfaces = lowering.scene.surfaces.values()
    alpha = np.array([prop.roughness if isinstance(prop, RoughInterface) else 1.0 for prop in surfaces])
    return Data(alpha, *conductor.lower(lowering))


def facet_density(cos_theta: ArrayLike, alpha: float) -> NDArray[np.float64]:
    """Density of microfacet normals at an angle to the mean normal, in area per area of the surface and steradian.

    References
    ----------
    Walter et al. 2007, eq. 33.
    """
    cos = np.asarray(cos_theta, np.float64)
    return np.where(cos > 0, alpha**2 / (math.pi * (cos**2 * (alpha**2 - 1) + 1) ** 2), 0.0)


def smith_lambda(cos_theta: ArrayLike, alpha: float) -> NDArray[np.float64]:
    """Smith's Lambda: microfacets in the way of light that leaves at an angle; below the horizon -1 - Lambda above it.

    References
    ----------
    Heitz et al. 2016, section 3; for GGX Walter et al. 2007, eq. 34, with G1 = 1 / (1 + Lambda).
    """
    cos = np.asarray(cos_theta, np.float64)
    with np.errstate(divide="ignore"):
        root = np.sqrt(1 + alpha**2 * (1 / cos**2 - 1))
    return (np.copysign(root, cos) - 1) / 2


def walked_direction(
    direction: NDArray[np.float64], alpha: float, n_i: float, n_t: float, draws: NDArray[np.float64]
) -> tuple[NDArray[np.float64], int]:
    """Direction in which a ray leaves a rough interface of clear media, bounce by bounce.

    Parameters
    ----------
    direction : (3,) float64
        Unit vector in which it arrives; the surface is z = 0 and z < 0.
    alpha, n_i, n_t : float
        Roughness, refractive index before and beyond.
    draws : (n_bounces, 4) float64
        Uniform numbers: height, two for the normal, reflected or refracted.

    Returns
    -------
    direction : (3,) float64
        With z above 0 on the side that the ray came from.
    bounces : int

    References
    ----------
    Heitz et al. 2016, section 4 (the next height) and 5 (the walk); Dupuy, Benyoub 2023, listing 3 (the normal).
    """
    below, side = 1.0, 1.0  # share of the surface below the ray; -1 on the far side, where z is turned round
    w = np.array(direction, np.float64)
    for bounce, (u_height, u_cap, u_azimuth, u_chosen) in enumerate(draws):
        with np.errstate(divide="ignore", over="ignore"):
            below = below * float(u_height ** (-1 / smith_lambda(w[2], alpha)))
        if below >= 1:
            return w * (1, 1, side), bounce
        # the normal: for the surface stretched to alpha = 1 light is reflected into a cap of the sphere of directions
        seen = -w * (alpha, alpha, 1)
        seen /= np.linalg.norm(seen)
        z = 1 - u_cap * (1 + seen[2])
        rho, phi = math.sqrt(max(0, 1 - z * z)), 2 * math.pi * u_azimuth
        normal = (np.array([rho * math.cos(phi), rho * math.sin(phi), z]) + seen) * (alpha, alpha, 1)
        normal /= np.linalg.norm(normal)
        cosine = -float(w @ normal)
        if u_chosen < fresnel_reflectance(np.array(cosine), np.array(n_i), np.array(n_t)):
            w = w + 2 * cosine * normal
        else:
            eta = n_i / n_t
            w = eta * w + (eta * cosine - math.sqrt(1 - eta**2 * (1 - cosine**2))) * normal
            w[2], side = -w[2], -side
            n_i, n_t, below = n_t, n_i, 1 - below
    raise ValueError("more bounces than draws")
