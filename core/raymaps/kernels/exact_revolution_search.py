# SPDX-License-Identifier: LGPL-2.1-or-later
"""Crossings of a line with a surface of revolution near a triangle: zeros of one function of the profile's parameter.

Seen around the axis a line is a hyperbola. A steep line has one point at each height, and its *gap* to the profile is a
difference of radii; a flat one has two at each radius, and the gap is a difference of heights. Zeros of the gap lie
between samples of opposite sign, or in pairs about a least gap.
"""

from __future__ import annotations

import math

from raymaps.jit import inlined_kernel, kernel
from raymaps.kernels.exact_axes import interval
from raymaps.kernels.exact_profile import profile, sample, samples_of_piece, within

__all__ = ["reach", "search_profile"]

_HALVINGS = 60
#: How far a crossing may be from the guess, in longest edges of the triangle.
_REACH = 4.0
#: How much more of the profile than the triangle spans is searched to either side of it.
_MORE = 0.5
#: What rounding may leave of a gap.
_OFF = 1e-9


@kernel
def search_profile(exact, surface, triangle, guess, towards, least, qx, qy, qz, ex, ey, ez):
    """Crossing with an orientation that is nearest to a guess, of those near a triangle and further than `least` away.

    Without a triangle (-1) all of the profile is searched.

    Returns
    -------
    t (NaN if there is none), parameter there
    """
    first, last = _around(exact, surface, triangle)
    farthest = reach(exact, triangle)
    best, best_v = math.nan, 0.0
    for branch in (-1.0, 1.0):
        if branch > 0.0 and _is_steep(ex, ey, ez):
            break
        low = sample(exact, surface, first)
        g, rise, _ = _gap(exact, surface, low, branch, qx, qy, qz, ex, ey, ez)
        for k in range(first + 1, last + 1):
            high = sample(exact, surface, k)
            next_g, next_rise, _ = _gap(exact, surface, high, branch, qx, qy, qz, ex, ey, ez)
            middle = high
            is_between = g * next_g <= 0.0
            if not is_between and g * rise < 0.0 and next_g * next_rise > 0.0:  # it falls, then rises
                middle = _least_gap(exact, surface, low, high, branch, qx, qy, qz, ex, ey, ez)
                least_g, _, _ = _gap(exact, surface, middle, branch, qx, qy, qz, ex, ey, ez)
                is_between = g * least_g <= 0.0
            for half in range(2 if is_between else 0):
                if half == 0:
                    t, v = _halved(exact, surface, low, middle, branch, qx, qy, qz, ex, ey, ez)
                elif middle == high:
                    break
                else:
                    t, v = _halved(exact, surface, middle, high, branch, qx, qy, qz, ex, ey, ez)
                is_near = abs(t) > least and abs(t - guess) <= farthest and not abs(t - guess) >= abs(best - guess)
                if is_near and _is_crossing(exact, surface, t, v, towards, qx, qy, ex, ey, ez):
                    best, best_v = t, v
            low, g, rise = high, next_g, next_rise
    return best, within(exact, surface, best_v)


@inlined_kernel
def reach(exact, triangle):
    """How far from the guess a crossing near a triangle may be."""
    row = exact.guess_row[triangle] if triangle >= 0 else -1
    return _REACH * exact.guess_longest[row] if row >= 0 else math.inf


@inlined_kernel
def _around(exact, surface, triangle):
    """First and last sample of the profile around a triangle."""
    sheet, each = exact.sheet[surface], samples_of_piece(exact, surface)
    n = sheet[2]
    row = exact.guess_row[triangle] if triangle >= 0 else -1
    if row < 0:
        return 0, n * each
    uv = exact.guess_uv[row]
    low, high = min(uv[0, 1], uv[1, 1], uv[2, 1]), max(uv[0, 1], uv[1, 1], uv[2, 1])
    low, high = low - _MORE * (high - low), high + _MORE * (high - low)
    end = exact.breaks[sheet[6] + n]
    turns = math.floor(low / end) if sheet[9] else 0.0
    more = math.floor(high / end) if sheet[9] else 0.0
    begin = int(turns) * n + interval(exact.breaks, sheet[6], n, low - turns * end) - 1
    stop = int(more) * n + interval(exact.breaks, sheet[6], n, high - more * end) + 2
    if sheet[9] == 0:
        begin, stop = max(begin, 0), min(stop, n)
    return begin * each, min(stop, begin + n) * each


@inlined_kernel
def _is_steep(ex, ey, ez):
    return ez * ez >= ex * ex + ey * ey


@kernel
def _gap(exact, surface, v, branch, qx, qy, qz, ex, ey, ez):
    """How far a point of the line is from that of the profile at its height, or at its radius.

    Returns
    -------
    gap, its slope by the piece's own parameter, distance t of the line's point
    """
    r, z, r1, z1, _, _, _ = profile(exact, surface, within(exact, surface, v))
    if _is_steep(ex, ey, ez):
        t = (z - qz) / ez
        x, y = qx + t * ex, qy + t * ey
        radius = math.sqrt(x * x + y * y)
        slope = (x * ex + y * ey) / radius if radius > 0.0 else 0.0
        return radius - r, slope * z1 / ez - r1, t
    across = ex * ex + ey * ey
    half = math.sqrt(max(r * r * across - (qx * ey - qy * ex) ** 2, 0.0))
    t = (branch * half - (qx * ex + qy * ey)) / across
    slope = branch * r * r1 / half if half > 0.0 else 0.0
    return qz + t * ez - z, ez * slope - z1, t


@kernel
def _halved(exact, surface, low, high, branch, qx, qy, qz, ex, ey, ez):
    """Zero of the gap between two parameters at which its signs differ: t, v."""
    start, _, t = _gap(exact, surface, low, branch, qx, qy, qz, ex, ey, ez)
    v = low
    for _ in range(_HALVINGS):
        v = 0.5 * (low + high)
        gap, _, t = _gap(exact, surface, v, branch, qx, qy, qz, ex, ey, ez)
        if v in (low, high):
            break
        if gap * start > 0.0:
            low = v
        else:
            high = v
    return t, v


@kernel
def _least_gap(exact, surface, low, high, branch, qx, qy, qz, ex, ey, ez):
    """Parameter between two at which the gap is least, or has changed its sign."""
    start, _, _ = _gap(exact, surface, low, branch, qx, qy, qz, ex, ey, ez)
    v = low
    for _ in range(_HALVINGS):
        v = 0.5 * (low + high)
        gap, rise, _ = _gap(exact, surface, v, branch, qx, qy, qz, ex, ey, ez)
        if gap * start <= 0.0 or v in (low, high):
            break
        if rise * start < 0.0:
            low = v
        else:
            high = v
    return v


@inlined_kernel
def _is_crossing(exact, surface, t, v, towards, qx, qy, ex, ey, ez):
    """Whether a zero of the gap is a crossing with the orientation that is asked for."""
    r, _, r1, z1, _, _, _ = profile(exact, surface, within(exact, surface, v))
    x, y = qx + t * ex, qy + t * ey
    radius = math.hypot(x, y)
    if abs(radius - r) > _OFF:  # a flat line passes the axis farther out
        return False
    slope = (x * ex + y * ey) / radius if radius > 0.0 else 0.0
    return towards * exact.number[surface, 14] * (z1 * slope - r1 * ez) > 0.0
