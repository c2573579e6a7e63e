# SPDX-License-Identifier: LGPL-2.1-or-later
"""Drawing from tables: an entry by its share, and an angle within a cell of a table of intensities."""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.random import REJECTION, uniforms

__all__ = ["angle_between", "choose"]


@kernel
def choose(cumulated, u, v):
    """Index of an entry, drawn by its share of the sum.

    Parameters
    ----------
    cumulated : (n,) float64
        Shares summed up; 1 from the last entry on that has a share.
    u, v : float
        Uniform numbers, multiples of 2^-33: together they are fine enough for tables of millions.
    """
    return min(np.searchsorted(cumulated, u + (v - 0.5) * 2.0**-32, side="right"), len(cumulated) - 1)


@kernel
def angle_between(low, high, at_low, at_high, seed, ray):
    """Polar angle between two angles of a density sin θ times an intensity that is linear in θ.

    Even in cos θ, kept in proportion to the intensity: at least every second draw is.
    """
    below_low, below_high = 2.0 * math.sin(0.5 * low) ** 2, 2.0 * math.sin(0.5 * high) ** 2  # 1 - cos
    most = max(at_low, at_high)
    theta = low
    for k in range(128):
        a, b, c, d = uniforms(seed, ray, 0, REJECTION + k)
        for u, v in ((a, b), (c, d)):
            below = below_low + u * (below_high - below_low)
            theta = min(max(2.0 * math.asin(min(math.sqrt(0.5 * below), 1.0)), low), high)
            if v * most <= at_low + (theta - low) / (high - low) * (at_high - at_low):
                return theta
    return theta
