# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reflection and refraction at a smooth interface between two media, unpolarised."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.effects.usage import faces_of_kind
from raymaps.scene import Scene

__all__ = ["fresnel_reflectance", "needed_by", "refracted_direction"]


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for Fresnel's equations if a face is a smooth interface."""
    return faces_of_kind(scene, "fresnel")


def fresnel_reflectance(
    cos_theta_i: NDArray[np.float64], n_i: NDArray[np.float64], n_t: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Power reflectance of a smooth dielectric interface for unpolarised light.

    Parameters
    ----------
    cos_theta_i : (n_rays,) float64, 0 to 1
    n_i, n_t : (n_rays,) float64, > 0
        Refractive index before and after the interface.

    Returns
    -------
    (n_rays,) float64, 0 to 1; exactly 1 under total internal reflection, 0 between equal indices.

    Raises
    ------
    ValueError
        If an index is not finite and positive.

    References
    ----------
    M. Born, E. Wolf: Principles of Optics, 7th ed., section 1.5.2, eq. 21 and 35.
    """
    cos_theta_i, n_i, n_t = np.broadcast_arrays(*(np.asarray(x, float) for x in (cos_theta_i, n_i, n_t)))
    if not (np.isfinite(n_i).all() and np.isfinite(n_t).all() and (n_i > 0).all() and (n_t > 0).all()):
        raise ValueError("refractive indices must be finite and > 0")
    cos2_theta_t = ((n_t - n_i) * (n_t + n_i) + (n_i * cos_theta_i) ** 2) / n_t**2
    total = cos2_theta_t <= 0
    cos_theta_t = np.sqrt(np.where(total, 0, cos2_theta_t))
    with np.errstate(invalid="ignore"):  # 0 / 0 along an interface between equal indices
        r_s = (n_i * cos_theta_i - n_t * cos_theta_t) / (n_i * cos_theta_i + n_t * cos_theta_t)
        r_p = (n_t * cos_theta_i - n_i * cos_theta_t) / (n_t * cos_theta_i + n_i * cos_theta_t)
    return np.where(n_i == n_t, 0.0, np.where(total, 1.0, 0.5 * (r_s**2 + r_p**2)))


def refracted_direction(
    direction: NDArray[np.float64], normal: NDArray[np.float64], n_i: float, n_t: float
) -> NDArray[np.float64]:
    """Direction after refraction by Snell's law in vector form.

    Parameters
    ----------
    direction, normal : (n_rays, 3) float64, unit vectors; the normal points against the direction
    n_i, n_t : float, > 0
        Refractive index before and after the interface.

    Returns
    -------
    (n_rays, 3) float64, unit vectors; NaN under total internal reflection.

    References
    ----------
    M. Pharr, W. Jakob, G. Humphreys: Physically Based Rendering, 4th ed., eq. 9.2 to 9.4.
    """
    cos_theta_i = -np.einsum("ij,ij->i", direction, normal)
    eta = n_i / n_t
    with np.errstate(invalid="ignore"):
        cos_theta_t = np.sqrt(1 - eta**2 * (1 - cos_theta_i**2))
    return eta * direction + (eta * cos_theta_i - cos_theta_t)[:, None] * normal
