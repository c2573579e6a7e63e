# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a line crosses a torus: the roots of a quartic, each between two of its extrema.

In local axes with z along the axis and the origin in the centre, lengths in units of the outermost radius.
"""

from __future__ import annotations

import math

from raymaps.jit import kernel

__all__ = ["torus_root"]

#: Steps of Newton or bisection to a root; bisection alone needs 53.
_MAX_STEPS = 60
#: By how much the square of the sphere around the torus is enlarged.
_MARGIN = 1e-12
#: A crossing steeper than this is refined on the torus itself.
_STEEP = 0.03


@kernel
def torus_root(major, minor, qx, qy, qz, ex, ey, ez, guess, towards, stands_on):
    """Distance to the crossing nearest to a guess of those where the line goes out (towards +1) or in (-1); or NaN."""
    size = major + minor
    big, small = major / size, minor / size
    qx, qy, qz = qx / size, qy / size, qz / size
    foot = -(qx * ex + qy * ey + qz * ez)
    ox, oy, oz = qx + foot * ex, qy + foot * ey, qz + foot * ez
    square = 1.0 - (ox * ox + oy * oy + oz * oz)
    if square <= -_MARGIN:
        return math.nan
    half = math.sqrt(square + _MARGIN)  # beyond it the line is outside the sphere around the torus
    if stands_on:
        t = _deflated_root(big, small, qx, qy, qz, ex, ey, ez, foot - half, foot + half, guess / size, towards)
    else:
        t = foot + _quartic_root(big, small, ox, oy, oz, ex, ey, ez, half, guess / size - foot, towards)
    t = _refined(big, small, qx, qy, qz, ex, ey, ez, t)
    return size * t


@kernel
def _quartic_root(big, small, ox, oy, oz, ex, ey, ez, half, guess, towards):
    """Root of ((r² - R² - s²)² + 4 R² (z² - s²)) along o + t e with o the foot from the centre, in -half to half."""
    rest = ox * ox + oy * oy + oz * oz - big * big - small * small
    c2 = 2.0 * rest + 4.0 * big * big * ez * ez
    c1 = 8.0 * big * big * oz * ez
    c0 = rest * rest + 4.0 * big * big * (oz - small) * (oz + small)
    extrema = _cubic_roots(4.0, 0.0, 2.0 * c2, c1, -half, half)
    best, low = math.nan, -half
    for i in range(4):
        high = half
        if i < 3:
            if math.isnan(extrema[i]):
                continue
            high = extrema[i]
        root = _bracketed(1.0, 0.0, c2, c1, c0, low, high, towards)
        if _belongs(big, small, ox, oy, oz, ex, ey, ez, root) and not abs(root - guess) >= abs(best - guess):
            best = root
        low = high
    return best


@kernel
def _deflated_root(big, small, qx, qy, qz, ex, ey, ez, low, high, guess, towards):
    """The same from a point on the torus: the quartic without its root 0."""
    along = qx * ex + qy * ey + qz * ez
    rest = qx * qx + qy * qy + qz * qz - big * big - small * small
    across = math.hypot(qx, qy)
    scale = 1.0 - big / across if across > 0.0 else 0.0
    c3, c2 = 4.0 * along, 4.0 * along * along + 2.0 * rest + 4.0 * big * big * ez * ez
    c1 = 8.0 * big * across * (scale * (qx * ex + qy * ey) + qz * ez)  # along the gradient
    roots = _cubic_roots(1.0, c3, c2, c1, low, high)
    best = math.nan
    for i in range(3):
        root = roots[i]
        slope = root * ((3.0 * root + 2.0 * c3) * root + c2)
        right = towards * slope > 0.0 and _belongs(big, small, qx, qy, qz, ex, ey, ez, root)
        if right and not abs(root - guess) >= abs(best - guess):
            best = root
    return best


@kernel
def _belongs(big, small, ox, oy, oz, ex, ey, ez, t):
    """Whether a root is on the outer part of a torus that crosses itself."""
    if math.isnan(t):
        return False
    if small <= big:
        return True
    across, z = math.hypot(ox + t * ex, oy + t * ey), oz + t * ez
    outer, inner = math.hypot(across - big, z) - small, math.hypot(across + big, z) - small
    return abs(outer) <= abs(inner)


@kernel
def _refined(big, small, qx, qy, qz, ex, ey, ez, t):
    """A root after two steps of Newton on the distance from the core circle, where the line is steep enough."""
    for _ in range(2):
        x, y, z = qx + t * ex, qy + t * ey, qz + t * ez
        across = math.hypot(x, y)
        distance = math.hypot(across - big, z)
        if not across > 0.0 or not distance > 0.0:
            return t
        slope = ((across - big) * (x * ex + y * ey) / across + z * ez) / distance
        if not abs(slope) > _STEEP:
            return t
        t -= (distance - small) / slope
    return t


@kernel
def _cubic_roots(a3, a2, a1, a0, low, high):
    """Roots, rising, of a cubic between two bounds, three numbers; NaN where there is none."""
    # its slope is zero at up to two places, between which it is monotone
    square = a2 * a2 - 3.0 * a3 * a1
    first, second = low, low
    if square > 0.0:
        q = -(a2 + math.copysign(math.sqrt(square), a2))
        one, other = q / (3.0 * a3), a1 / q
        first, second = min(max(min(one, other), low), high), min(max(max(one, other), low), high)
    return (
        _bracketed(0.0, a3, a2, a1, a0, low, first, 0),
        _bracketed(0.0, a3, a2, a1, a0, first, second, 0),
        _bracketed(0.0, a3, a2, a1, a0, second, high, 0),
    )


@kernel
def _bracketed(a4, a3, a2, a1, a0, low, high, towards):
    """Root of a polynomial that is monotone between two bounds; NaN if there is none or it does not climb towards."""
    at_low = (((a4 * low + a3) * low + a2) * low + a1) * low + a0
    at_high = (((a4 * high + a3) * high + a2) * high + a1) * high + a0
    climbs = at_high > at_low
    if not (low < high and min(at_low, at_high) <= 0.0 <= max(at_low, at_high)):
        return math.nan
    if (towards > 0 and not climbs) or (towards < 0 and climbs):
        return math.nan
    t = 0.5 * (low + high)
    for _ in range(_MAX_STEPS):
        value = (((a4 * t + a3) * t + a2) * t + a1) * t + a0
        if value == 0.0:
            return t
        if (value > 0.0) == climbs:
            high = t
        else:
            low = t
        slope = ((4.0 * a4 * t + 3.0 * a3) * t + 2.0 * a2) * t + a1
        step = t - value / slope
        if not low < step < high:
            step = 0.5 * (low + high)
        if step == t or not low < step < high:
            return t
        t = step
    return t
