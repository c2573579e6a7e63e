# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scattering angles drawn from phase functions: exact inversions, precise at all angles.

A drawn angle comes as the pair cos(theta), sin(theta): near 0 and 180 degrees the sine is not computed from the cosine.
"""

from __future__ import annotations

import math

from raymaps.jit import kernel

__all__ = ["cell_integral", "henyey_greenstein", "tabulated"]


@kernel
def henyey_greenstein(g, u):
    """Scattering angle of Henyey and Greenstein's phase function; isotropic for g = 0.

    The inversion of the cumulated density written without differences, so that it holds for every -1 < g < 1:
    with v = 1 - u and d = v (1 - g) + u (1 + g),
    1 - cos = 2 (1 - g)² v (v + u (1 + g)) / d² and 1 + cos = 2 (1 + g)² u (u + v (1 - g)) / d².

    Parameters
    ----------
    g : float, -1 to 1, both excluded
        Mean cosine.
    u : float, uniform in (0, 1)

    Returns
    -------
    cos_theta, sin_theta : float

    References
    ----------
    L. Henyey, J. Greenstein: Diffuse radiation in the galaxy, Astrophys. J. 93 (1941), p. 70; the inversion, here
    rearranged: L. Wang, S. Jacques, L. Zheng: MCML, Comput. Methods Programs Biomed. 47 (1995), p. 131.
    """
    v = 1.0 - u
    back, ahead = 1.0 - g, 1.0 + g
    d = v * back + u * ahead
    below_one = 2.0 * (back / d) * (back / d) * v * (v + u * ahead)
    above_minus_one = 2.0 * (ahead / d) * (ahead / d) * u * (u + v * back)
    cosine = 1.0 - below_one if below_one < 1.0 else above_minus_one - 1.0
    return cosine, math.sqrt(below_one * above_minus_one)


@kernel
def cell_integral(angle, value, slope, x):
    """Integral of (value + slope t) sin(angle + t) over t from 0 to x, without differences of nearly equal cosines."""
    half = 0.5 * x
    sine = math.sin(half)
    linear = 2.0 * math.cos(angle + half) * sine - x * math.cos(angle + x)
    return 2.0 * value * math.sin(angle + half) * sine + slope * linear


@kernel
def tabulated(angle_rad, value, cumulated, u):
    """Scattering angle of a phase function that is linear in the angle between the entries of a table.

    Its density over the angle is p(theta) sin(theta). The cell follows from the cumulated density; within it
    `cell_integral` is inverted by Newton's method, kept inside a shrinking bracket, to the last digits.

    Parameters
    ----------
    angle_rad, value : (n_angles,) float64
        Angles from 0 to pi, climbing, and p there.
    cumulated : (n_angles,) float64
        Cumulated density at the angles, 0 to 1.
    u : float, uniform in (0, 1)

    Returns
    -------
    cos_theta, sin_theta : float
    """
    first, last = 0, len(angle_rad) - 1  # the cell whose cumulated density reaches from not above u to above u
    while last - first > 1:
        middle = (first + last) // 2
        if cumulated[middle] <= u:
            first = middle
        else:
            last = middle
    angle, width = angle_rad[first], angle_rad[last] - angle_rad[first]
    part = (u - cumulated[first]) / (cumulated[last] - cumulated[first])
    slope = (value[last] - value[first]) / width
    target = part * cell_integral(angle, value[first], slope, width)
    low, high = 0.0, width
    x = part * width
    for _ in range(100):
        off = cell_integral(angle, value[first], slope, x) - target
        if off > 0.0:
            high = x
        else:
            low = x
        density = (value[first] + slope * x) * math.sin(angle + x)
        closer = x - off / density if density > 0.0 else -1.0
        if not low < closer < high:
            closer = 0.5 * (low + high)
        step = abs(closer - x)
        x = closer
        if step <= 1e-15 * width:
            break
    return math.cos(angle + x), math.sin(angle + x)
