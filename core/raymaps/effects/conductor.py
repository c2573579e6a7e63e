# SPDX-License-Identifier: LGPL-2.1-or-later
"""Smooth metals: reflection by Fresnel's equations with a complex index, unpolarised; the rest is absorbed at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raymaps.effects.lowering import Lowering, index_in_bands
from raymaps.effects.usage import surfaces_of
from raymaps.materials import Mixture
from raymaps.scene import Scene

__all__ = ["Data", "acts_on", "lower", "metal_reflectance", "needed_by"]


class Data(NamedTuple):
    """What the kernel reads."""

    is_conductor: NDArray[np.bool_]  # (n_media,)
    n: NDArray[np.float64]  # (n_media, n_bands) real part of the index of conductors, 1 for other media
    k: NDArray[np.float64]  # (n_media, n_bands) its imaginary part, 0 for other media


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for smooth metals if a smooth interface is one of a metal, or may touch one."""
    metal = {name: b.medium for name, b in scene.bodies.items() if b.medium and scene.media[b.medium].is_conductor}
    reasons = []
    for name, body in scene.bodies.items():
        polished = [surface for surface in surfaces_of(body) if _is_smooth_interface(scene, surface)]
        if not polished or not metal:
            continue
        if name in metal:
            reasons.append(f"surface '{polished[0]}' of body '{name}' of the metal '{metal[name]}'")
        elif body.medium is not None:
            reasons.append(
                f"surface '{polished[0]}' of body '{name}', which may touch the metal body '{next(iter(metal))}'"
            )
    return tuple(reasons)


def _is_smooth_interface(scene: Scene, surface: str) -> bool:
    prop = scene.surfaces[surface]
    if isinstance(prop, Mixture):
        return any(part.weight > 0 and scene.surfaces[part.surface].kind == "fresnel" for part in prop.parts)
    return prop.kind == "fresnel"


def acts_on(data: Data) -> NDArray[np.bool_]:
    """Media that are metals, (n_media,)."""
    return data.is_conductor


def lower(lowering: Lowering) -> Data:
    """The complex index of each metal by band."""
    is_conductor = lowering.is_conductor
    shape = len(is_conductor), lowering.bands.n
    n, k = np.ones(shape), np.zeros(shape)
    for index in np.flatnonzero(is_conductor):
        name, medium = lowering.names.media[index], lowering.media[index]
        n[index] = index_in_bands(name, medium, lowering.bands)
        k[index] = lowering.bands.average(medium.extinction, f"Medium '{name}', extinction")
    return Data(is_conductor, n, k)


def metal_reflectance(cos_theta_i: ArrayLike, n_i: ArrayLike, n: ArrayLike, k: ArrayLike) -> NDArray[np.float64]:
    """Power reflectance of the smooth surface of a metal for unpolarised light, in real numbers.

    Parameters
    ----------
    cos_theta_i : float64, 0 to 1, any shape
    n_i : float64, > 0
        Refractive index of the clear medium in front.
    n, k : float64
        Index n + ik of the metal.

    Returns
    -------
    float64, 0 to 1

    References
    ----------
    M. Born, E. Wolf: Principles of Optics, 7th ed., section 14.4.1: the wave in the metal, n cos(theta) = u + iv, and
    the amplitudes r_12 of both polarisations.
    """
    cos, n_i, n, k = (np.asarray(x, np.float64) for x in (cos_theta_i, n_i, n, k))
    real = (n - n_i) * (n + n_i) - k**2 + (n_i * cos) ** 2
    larger = np.sqrt((np.hypot(real, 2 * n * k) + np.abs(real)) / 2)
    smaller = np.divide(n * k, larger, out=np.zeros_like(larger), where=larger > 0)  # u v = n k
    u, v = np.where(real >= 0, larger, smaller), np.where(real >= 0, smaller, larger)
    r_s = ((n_i * cos - u) ** 2 + v**2) / ((n_i * cos + u) ** 2 + v**2)
    p_u, p_v = (n**2 - k**2) * cos, 2 * n * k * cos
    r_p = ((p_u - n_i * u) ** 2 + (p_v - n_i * v) ** 2) / ((p_u + n_i * u) ** 2 + (p_v + n_i * v) ** 2)
    return np.minimum((r_s + r_p) / 2, 1.0)
