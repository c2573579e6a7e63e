# SPDX-License-Identifier: LGPL-2.1-or-later
"""Diffuse reflection and transmission by Lambert's law."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import faces_of_kind
from raymaps.scene import Scene

__all__ = ["Data", "lambertian_direction", "lower", "needed_by"]


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for Lambertian scattering if a face scatters so."""
    return faces_of_kind(scene, "lambertian")


class Data(NamedTuple):
    """What the kernel reads."""

    reflectance: NDArray[np.float64]  # (n_surfaces, n_bands)
    transmittance: NDArray[np.float64]  # (n_surfaces, n_bands)


def lower(lowering: Lowering) -> Data:
    """Reflectances and transmittances by band."""
    return Data(lowering.by_surface("lambertian", "reflectance"), lowering.by_surface("lambertian", "transmittance"))


def lambertian_direction(
    u: NDArray[np.float64], v: NDArray[np.float64], normal: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Directions with density cos(theta) / pi around a normal: a uniform disc lifted to the hemisphere.

    Parameters
    ----------
    u, v : (n_rays,) float64, 0 to 1
        Uniform numbers: sin²(theta) = u, azimuth = 2 pi v.
    normal : (n_rays, 3) float64, unit vectors on the side of scattering

    Returns
    -------
    (n_rays, 3) float64, unit vectors

    References
    ----------
    M. Pharr, W. Jakob, G. Humphreys: Physically Based Rendering, 4th ed., section A.5.3 (Malley's method);
    T. Duff et al.: Building an Orthonormal Basis, Revisited, JCGT 6 (2017), listing 3.
    """
    x, y, z = normal.T
    sign = np.copysign(1.0, z)
    a = -1 / (sign + z)
    b = x * y * a
    tangent = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=1)
    bitangent = np.stack([b, sign + y * y * a, -y], axis=1)
    radius, azimuth = np.sqrt(u), 2 * np.pi * v
    return (
        (radius * np.cos(azimuth))[:, None] * tangent
        + (radius * np.sin(azimuth))[:, None] * bitangent
        + np.sqrt(1 - u)[:, None] * normal
    )
