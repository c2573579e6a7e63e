# SPDX-License-Identifier: LGPL-2.1-or-later
"""Widths of a beam."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["beam_angle_deg", "plane_profile"]

Float = NDArray[np.float64]


def plane_profile(intensity: Float, c_deg: float) -> tuple[Float, Float]:
    """Intensities all around in the plane of the half planes C and C + 180 degrees.

    Parameters
    ----------
    intensity : (n_c, n_gamma + 1) float64
        At equal steps of C from 0, and of gamma from 0 to 180 degrees.
    c_deg : float

    Returns
    -------
    angle_deg, intensity : (2 n_gamma,) float64
        Angle from 0 on, first through the half plane C; linear between half planes.
    """
    n_c, n_gamma = intensity.shape[0], intensity.shape[1] - 1

    def half_plane(c: float) -> Float:
        at = (c % 360.0) * n_c / 360.0
        low = int(np.floor(at + 1e-9))
        share = max(at - low, 0.0)
        return np.asarray((1 - share) * intensity[low % n_c] + share * intensity[(low + 1) % n_c])

    there, back = half_plane(c_deg), half_plane(c_deg + 180.0)
    return np.arange(2 * n_gamma) * (180.0 / n_gamma), np.concatenate([there, back[-2:0:-1]])


def beam_angle_deg(intensity: Float, level: float, c_deg: float) -> float | None:
    """Full width of a beam in a plane: the smallest angle that holds all directions in which the intensity is at least
    a share of the largest one of all directions.

    Of a beam with one peak it is the width at that level; of a batwing that from wing to wing.

    Parameters
    ----------
    intensity : (n_c, n_gamma + 1) float64
    level : float, 0 to 1
    c_deg : float
        Half plane that the plane holds.

    Returns
    -------
    float, 0 to 360; None where the plane does not reach that level
    """
    angle_deg, values = plane_profile(intensity, c_deg)
    limit = level * float(intensity.max())
    lit = values >= limit
    if not limit > 0 or not lit.any():
        return None
    if lit.all():
        return 360.0
    n, step = len(values), float(angle_deg[1] - angle_deg[0])
    start = int(np.flatnonzero(lit & ~np.roll(lit, -1))[0])  # lit, and dark behind it
    values, lit = np.roll(values, -start), np.roll(lit, -start)
    widest, at = 0.0, 0
    while at < n:
        if lit[at]:
            at += 1
            continue
        end = at
        while end < n and not lit[end]:
            end += 1
        before, after = values[at - 1], values[end % n]
        dark = (
            (end - at - 1)
            + (limit - values[at]) / (before - values[at])
            + ((limit - values[end - 1]) / (after - values[end - 1]))
        )
        widest = max(widest, dark * step)
        at = end
    return 360.0 - widest
