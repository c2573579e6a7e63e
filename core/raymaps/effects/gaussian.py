# SPDX-License-Identifier: LGPL-2.1-or-later
"""Specular reflection and transmission of which a share scatters with a Gaussian lobe.

The lobe is a Gaussian in the projections of directions on the surface, about that of the specular (reflected or
refracted) direction. The unit disc, beyond which there are no directions, cuts it off, and what is left is scaled so
that the share that scatters is the same at every angle. (So the BSDF is reciprocal only as far as little is cut off.)
Under total reflection what would be transmitted is reflected.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import faces_of_kind
from raymaps.materials import GaussianScatter
from raymaps.scene import Scene

__all__ = ["Data", "lobe_density", "lower", "needed_by"]


class Data(NamedTuple):
    """What the kernel reads."""

    reflectance: NDArray[np.float64]  # (n_surfaces, n_bands)
    transmittance: NDArray[np.float64]  # (n_surfaces, n_bands)
    scattered_share: NDArray[np.float64]  # (n_surfaces,)
    sigma: NDArray[np.float64]  # (n_surfaces,)
    is_conductor: NDArray[np.bool_]  # (n_media,)


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for Gaussian lobes if a face scatters so."""
    return faces_of_kind(scene, "gaussian")


def lower(lowering: Lowering) -> Data:
    """Shares by band, and the lobes."""
    props = [prop if isinstance(prop, GaussianScatter) else None for prop in lowering.scene.surfaces.values()]
    return Data(
        lowering.by_surface("gaussian", "reflectance"),
        lowering.by_surface("gaussian", "transmittance"),
        np.array([0.0 if prop is None else prop.scattered_share for prop in props]),
        np.array([1.0 if prop is None else prop.sigma for prop in props]),
        lowering.is_conductor,
    )


def lobe_density(p: NDArray[np.float64], q: NDArray[np.float64], specular: float, sigma: float) -> NDArray[np.float64]:
    """Density of scattered directions over their projections; its integral over the disc is 1.

    Parameters
    ----------
    p, q : (n,) float64
        Projection of the direction along and across the plane of incidence.
    specular : float, 0 to 1
        Projection of the specular direction along the plane of incidence.
    sigma : float

    Returns
    -------
    (n,) float64, 1 over the area of the disc; the BRDF is the scattered share times this.

    References
    ----------
    J. E. Harvey: Light-Scattering Characteristics of Optical Surfaces, thesis, University of Arizona (1976).
    """

    def lobe(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.exp(-((p - specular) ** 2 + q**2) / (2 * sigma**2))

    # the lobe's integral over the disc, in rings about the specular direction: r = 1 + specular is the farthest
    r, weight = _rings(specular, sigma)
    within = np.where(r <= 1 - specular, math.pi, 0.0)
    cut = r > 1 - specular
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (1 - r[cut] ** 2 - specular**2) / (2 * r[cut] * specular)
    within[cut] = math.pi - np.arccos(np.clip(cosine, -1, 1))
    whole = float((weight * 2 * within * r * np.exp(-(r**2) / (2 * sigma**2))).sum())
    return np.where(p**2 + q**2 < 1, lobe(p, q) / whole, 0.0)


def _rings(specular: float, sigma: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radii and widths of rings fine enough for a lobe, up to the farthest point of the disc."""
    farthest = min(1 + specular, 12 * sigma)
    count = 200_000
    return (np.arange(count) + 0.5) * farthest / count, np.full(count, farthest / count)
