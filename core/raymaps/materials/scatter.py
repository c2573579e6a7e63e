# SPDX-License-Identifier: LGPL-2.1-or-later
"""How much light the ABg model scatters."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["abg_total_scatter"]

#: Panels that halve towards the lobe's centre, and points of Gauss's rule in each.
_N_PANELS, _N_POINTS = 50, 12


def abg_total_scatter(specular: ArrayLike, a: float, b: float, g: float) -> NDArray[np.float64]:
    """Total integrated scatter of the ABg model: the share of the light that scatters to one side.

    The BSDF A / (B + |b - b0|^g) is integrated over the unit disc of projections b of directions, in rings about the
    projection b0 of the specular direction. It is largest at normal incidence, b0 = 0; for g = 2 it is pi A ln(1 + 1/B)
    there.

    Parameters
    ----------
    specular : (n,) float64, 0 to 1
        Length of b0, the sine of the specular direction's angle.
    a, b, g : float

    Returns
    -------
    (n,) float64; right to 1e-7 of the value

    References
    ----------
    J. E. Harvey: Light-Scattering Characteristics of Optical Surfaces, thesis, University of Arizona (1976);
    J. C. Stover: Optical Scattering, 3rd ed., SPIE (2012), sections 1.3 and 4.4.
    """
    s = np.atleast_1d(np.asarray(specular, np.float64))[:, None]
    node, weight = np.polynomial.legendre.leggauss(_N_POINTS)
    edge = np.concatenate([[0.0], 2.0 ** np.arange(-_N_PANELS, 1)])
    width = np.diff(edge)[:, None]
    t = (edge[:-1, None] + width * (node + 1) / 2).ravel()  # 0 to 1
    dt = (width * weight / 2).ravel()
    # rings that lie in the disc as a whole: r from 0 to 1 - s
    r = (1 - s) * t
    whole = (2 * np.pi * r / (b + r**g) * (1 - s)) @ dt
    # rings that the disc's edge cuts: r = 1 - s cos(x), of which arcs of 2 (pi - arccos c) are within, and
    # 1 - c = (1 - cos x) (2 + s (1 - cos x)) / (2 r)
    x = np.pi * t
    rise = 2 * np.sin(x / 2) ** 2
    r = 1 - s + s * rise
    sine = np.sqrt(np.clip(rise * (2 + s * rise) / (4 * np.maximum(r, 1e-300)), 0, 1))
    cut = ((2 * np.pi - 4 * np.arcsin(sine)) * r / (b + r**g) * s * np.sin(x) * np.pi) @ dt
    return a * (whole + cut)
