# SPDX-License-Identifier: LGPL-2.1-or-later
"""Power reflectance of smooth interfaces, unpolarised.

The formulas are those of `raymaps.effects.fresnel` and `raymaps.effects.conductor`.
"""

from __future__ import annotations

import cmath
import math

from raymaps.jit import kernel

__all__ = ["cos2_of_refraction", "of_clear_medium", "of_metal"]


@kernel
def cos2_of_refraction(cos_i, n_i, n_t):
    """Square of the cosine of the angle of refraction, at most 1; 0 or less under total internal reflection.

    Snell's law without 1 - sin², of which grazing incidence between nearly equal indices would leave nothing:
    n_t² cos²_t = (n_t - n_i) (n_t + n_i) + n_i² cos²_i.
    """
    return min(1.0, ((n_t - n_i) * (n_t + n_i) + (n_i * cos_i) ** 2) / n_t**2)


@kernel
def of_clear_medium(cos_i, n_i, n_t):
    """Power reflectance and cosine of refraction; (1, 0) under total internal reflection, (0, cos_i) between equals.

    Parameters
    ----------
    cos_i : float, 0 to 1
    n_i, n_t : float, > 0
        Refractive index before and beyond.
    """
    if n_i == n_t:
        return 0.0, cos_i
    cos2_t = cos2_of_refraction(cos_i, n_i, n_t)
    if cos2_t <= 0.0:
        return 1.0, 0.0
    cos_t = math.sqrt(cos2_t)
    r_s = (n_i * cos_i - n_t * cos_t) / (n_i * cos_i + n_t * cos_t)
    r_p = (n_t * cos_i - n_i * cos_t) / (n_t * cos_i + n_i * cos_t)
    return 0.5 * (r_s * r_s + r_p * r_p), cos_t


@kernel
def of_metal(cos_i, n_i, n, k):
    """Power reflectance of the surface of a metal of index n + ik in a medium of index n_i, at most 1."""
    index = complex(n, k) / n_i
    epsilon = index * index
    inside = cmath.sqrt((complex(n - n_i, k) / n_i) * (index + 1.0) + cos_i * cos_i)
    r_s = (cos_i - inside) / (cos_i + inside)
    r_p = (epsilon * cos_i - inside) / (epsilon * cos_i + inside)
    return min(1.0, 0.5 * (r_s.real**2 + r_s.imag**2 + r_p.real**2 + r_p.imag**2))
