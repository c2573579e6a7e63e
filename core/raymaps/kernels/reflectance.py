# SPDX-License-Identifier: LGPL-2.1-or-later
"""Power reflectance of smooth interfaces, unpolarised.

The formulas are those of `raymaps.effects.fresnel` and `raymaps.effects.conductor`.
"""

from __future__ import annotations

import cmath
import math

from raymaps.jit import kernel

__all__ = ["of_clear_medium", "of_metal"]


@kernel
def of_clear_medium(cos_i, n_i, n_t):
    """Power reflectance and cosine of refraction; (1, 0) under total internal reflection.

    Parameters
    ----------
    cos_i : float, 0 to 1
    n_i, n_t : float, > 0
        Refractive index before and beyond.
    """
    sin2_t = (n_i / n_t) ** 2 * (1.0 - cos_i * cos_i)
    if sin2_t >= 1.0:
        return 1.0, 0.0
    cos_t = math.sqrt(1.0 - sin2_t)
    r_s = (n_i * cos_i - n_t * cos_t) / (n_i * cos_i + n_t * cos_t)
    r_p = (n_t * cos_i - n_i * cos_t) / (n_t * cos_i + n_i * cos_t)
    return 0.5 * (r_s * r_s + r_p * r_p), cos_t


@kernel
def of_metal(cos_i, n_i, n, k):
    """Power reflectance of the surface of a metal of index n + ik in a medium of index n_i."""
    epsilon = (complex(n, k) / n_i) ** 2
    inside = cmath.sqrt(epsilon - (1.0 - cos_i * cos_i))
    r_s = (cos_i - inside) / (cos_i + inside)
    r_p = (epsilon * cos_i - inside) / (epsilon * cos_i + inside)
    return 0.5 * (r_s.real**2 + r_s.imag**2 + r_p.real**2 + r_p.imag**2)
