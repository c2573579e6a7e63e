# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a line crosses a surface of revolution: two equations for the distance t and the profile's parameter v.

With the line at q + t e in local axes, z along the axis,

    F1 = hypot(x, y) - R(v) = 0,    F2 = z - Z(v) = 0.

Newton's steps are bent by the second derivatives (Chebyshev's method), so two or three lead from a triangle to
rounding. Where they fail, or lead to where the line crosses the other way, the other end of the chord is found as in
`_chord`, or all of the profile is searched. Lengths are in frame units.

References
----------
J. F. Traub: Iterative Methods for the Solution of Equations, section 5.2 (Chebyshev's method).
"""

from __future__ import annotations

import math

from raymaps.jit import inlined_kernel, kernel
from raymaps.kernels.exact_axes import from_axes, to_axes
from raymaps.kernels.exact_profile import guess_profile, mean_slopes, profile, settle_on_profile, stepped, within
from raymaps.kernels.exact_revolution_search import reach, search_profile

__all__ = ["height_over_revolution", "meet_revolution", "normal_of_revolution", "settle_on_revolution"]

_MAX_STEPS, _MAX_CHORD_STEPS = 12, 30
#: Squares of steps, of the piece's parameter and across the axis over the radius, below which the next is rounding.
_LAST_SQUARE = 1e-13
#: Distance of a point of the surface from the line that may be rounding; a step must lessen it by more than this share.
_ROUNDING, _STALLED = 2e-14, 0.25
#: Crossings nearer to where a line stands than this are chords; those that Newton finds nearer are where it stands.
_SHORT, _APART = 1e-2, 1e-6
#: Steps to the end of a chord: one that is the last, and one that may be if it is not shorter than the step before.
_LAST_CHORD, _STALLED_CHORD = 4e-15, 1e-12
#: Newton's method goes less far from a zero that has been found to rounding.
_STRAYED = 1e-7
#: Nearer to the axis than this the way along the surface is away from it.
_ON_AXIS = 1e-9

#: No crossing.
_NONE = (math.nan, 0.0, 0.0, 0.0)


@inlined_kernel
def meet_revolution(exact, surface, triangle, guess, towards, stands_on, px, py, pz, dx, dy, dz):
    """See `raymaps.kernels.exact.meet`."""
    number = exact.number[surface]
    qx, qy, qz = to_axes(number, px - number[0], py - number[1], pz - number[2])
    ex, ey, ez = to_axes(number, dx, dy, dz)
    x, y = qx + guess * ex, qy + guess * ey
    v = guess_profile(
        exact, surface, triangle, px + guess * dx, py + guess * dy, pz + guess * dz,
        math.sqrt(x * x + y * y), qz + guess * ez,
    )  # fmt: skip
    is_met, t, v, nr, nz = _newton(exact, surface, v, guess, qx, qy, qz, ex, ey, ez)
    nx, ny, nz = _normal(number, nr, nz, qx + t * ex, qy + t * ey)
    is_crossed = is_met and towards * (nx * ex + ny * ey + nz * ez) > 0.0
    if not is_crossed or (stands_on and abs(t) < _SHORT) or abs(t - guess) > reach(exact, triangle):
        t, nx, ny, nz = _meet_elsewhere(
            exact, surface, triangle, guess, towards, stands_on, is_met, is_crossed, t, v, px, py, pz, dx, dy, dz
        )
        if not math.isfinite(t):
            return _NONE
    nx, ny, nz = from_axes(number, nx, ny, nz)
    return t, nx, ny, nz


@kernel
def height_over_revolution(exact, surface, triangle, x, y, z):
    """Signed distance along the own normal of a point next to the surface."""
    _, _, qz, radius, v = _nearest(exact, surface, triangle, x, y, z)
    r, h, r1, h1, _, _, _ = profile(exact, surface, v)
    return exact.number[surface, 14] * ((radius - r) * h1 - (qz - h) * r1) / math.sqrt(r1 * r1 + h1 * h1)


@kernel
def normal_of_revolution(exact, surface, triangle, x, y, z):
    """Own unit normal at the nearest point."""
    qx, qy, _, _, v = _nearest(exact, surface, triangle, x, y, z)
    number = exact.number[surface]
    _, _, r1, h1, _, _, _ = profile(exact, surface, v)
    nx, ny, nz = _normal(number, h1, -r1, qx, qy)
    return from_axes(number, nx, ny, nz)


@kernel
def settle_on_revolution(exact, surface, triangle, x, y, z):
    """Nearest point of the surface, three numbers."""
    number = exact.number[surface]
    qx, qy, _, radius, v = _nearest(exact, surface, triangle, x, y, z)
    r, h, _, _, _, _, _ = profile(exact, surface, v)
    ux, uy = (qx / radius, qy / radius) if radius > 0.0 else (1.0, 0.0)
    x, y, z = from_axes(number, r * ux, r * uy, h)
    return number[0] + x, number[1] + y, number[2] + z


@inlined_kernel
def _nearest(exact, surface, triangle, x, y, z):
    """A point in local axes, its distance from the axis, and the parameter of the profile that is nearest to it."""
    number = exact.number[surface]
    qx, qy, qz = to_axes(number, x - number[0], y - number[1], z - number[2])
    radius = math.hypot(qx, qy)
    v = guess_profile(exact, surface, triangle, x, y, z, radius, qz)
    return qx, qy, qz, radius, settle_on_profile(exact, surface, v, radius, qz)


@inlined_kernel
def _normal(number, nr, nz, x, y):
    """Own unit normal, in local axes, from its parts away from and along the axis, at a point at (x, y)."""
    share = number[14] / math.sqrt(nr * nr + nz * nz)
    across = math.sqrt(x * x + y * y)
    if across < 1e-150:
        across = math.hypot(x, y)
    ux, uy = (x / across, y / across) if across > 0.0 else (1.0, 0.0)
    return nr * share * ux, nr * share * uy, nz * share


@inlined_kernel
def _newton(exact, surface, v, t, qx, qy, qz, ex, ey, ez):
    """Solve F1 = F2 = 0.

    Returns
    -------
    is_met, t, v, and the normal's parts away from and along the axis, of any length
    """
    across = ex * ex + ey * ey
    before = math.inf
    for _ in range(_MAX_STEPS):
        r, z, r1, z1, r2, z2, scale = profile(exact, surface, v)
        x, y = qx + t * ex, qy + t * ey
        radius = math.sqrt(x * x + y * y)
        if radius < 1e-150:
            radius = math.hypot(x, y)
        f1, f2 = radius - r, (qz - z) + t * ez
        slope, bend = math.sqrt(across), 0.0
        if radius > 0.0:
            slope = (x * ex + y * ey) / radius
            bend = (across - slope * slope) / radius
        error = abs(f1) + abs(f2)
        if error < _ROUNDING and error > _STALLED * before:
            return True, t, v, z1, -r1
        before = error
        share = 1.0 / (r1 * ez - slope * z1)
        dt, db = (f1 * z1 - r1 * f2) * share, (ez * f1 - slope * f2) * share
        if not math.isfinite(dt + db):
            break
        # what the second derivatives leave after the step
        g1, g2 = 0.5 * (bend * dt * dt - r2 * db * db), -0.5 * z2 * db * db
        more_t, more_b = (g1 * z1 - r1 * g2) * share, (ez * g1 - slope * g2) * share
        if abs(more_t) < 0.5 * abs(dt) and abs(more_b) < 0.5 * abs(db):
            dt, db = dt + more_t, db + more_b
        t, v = t + dt, stepped(exact, surface, v, db, scale)
        if db * db < _LAST_SQUARE and across * dt * dt <= _LAST_SQUARE * radius:
            return True, t, v, z1 + z2 * db, -(r1 + r2 * db)
    return False, math.nan, v, 0.0, 0.0


@kernel
def _meet_elsewhere(
    exact, surface, triangle, guess, towards, stands_on, is_met, is_crossed, t, v, px, py, pz, dx, dy, dz
):
    """The crossing where Newton's method has failed, has found where the line stands or a crossing the other way.

    Returns
    -------
    t, own unit normal in local axes (3 floats)
    """
    number = exact.number[surface]
    qx, qy, qz = to_axes(number, px - number[0], py - number[1], pz - number[2])
    ex, ey, ez = to_axes(number, dx, dy, dz)
    is_far = is_met and abs(t - guess) > reach(exact, triangle)
    begin, base = 0.0, v
    if stands_on and not (is_met and abs(t) >= _SHORT):
        radius = math.hypot(qx, qy)
        if not is_met:
            base = guess_profile(exact, surface, triangle, px, py, pz, radius, qz)
        base = settle_on_profile(exact, surface, base, radius, qz)
    elif is_met:
        begin = t
    if stands_on or (is_met and not is_far):
        x, y, z = qx + begin * ex, qy + begin * ey, qz + begin * ez
        chord, end = _chord(exact, surface, base, x, y, z, ex, ey, ez)
        is_base = stands_on and begin != 0.0 and abs(begin + chord) < _APART
        if math.isfinite(chord) and not is_base:
            _, _, r1, z1, _, _, _ = profile(exact, surface, end)
            nx, ny, nz = _normal(number, z1, -r1, x + chord * ex, y + chord * ey)
            if towards * (nx * ex + ny * ey + nz * ez) > 0.0:
                return begin + chord, nx, ny, nz
    is_apart = is_crossed and not (stands_on and abs(t) < _APART)
    if not (is_apart and not is_far) and not (stands_on and abs(guess) < _SHORT):
        s, w = _search(exact, surface, triangle, guess, towards, stands_on, qx, qy, qz, ex, ey, ez)
        if math.isfinite(s):
            t, v, is_apart = s, w, True
    if not is_apart:
        return _NONE
    _, _, r1, z1, _, _, _ = profile(exact, surface, v)
    nx, ny, nz = _normal(number, z1, -r1, qx + t * ex, qy + t * ey)
    return t, nx, ny, nz


@inlined_kernel
def _search(exact, surface, triangle, guess, towards, stands_on, qx, qy, qz, ex, ey, ez):
    """Crossing near a triangle, of all nearest to the guess, to rounding: t (NaN if there is none), parameter."""
    least = _APART if stands_on else -1.0
    t, v = search_profile(exact, surface, triangle, guess, towards, least, qx, qy, qz, ex, ey, ez)
    if math.isfinite(t):
        is_met, s, w, _, _ = _newton(exact, surface, v, t, qx, qy, qz, ex, ey, ez)
        if is_met and abs(s - t) < _STRAYED:
            return s, w
    return t, v


@kernel
def _chord(exact, surface, v, qx, qy, qz, ex, ey, ez):
    """The other crossing near that at q, of the profile's parameter v: the root 0 of both equations is divided out.

    Unknowns are t and k = (v(t) - v) / t. The differences of radius and height, over t, have no cancellation.

    Returns
    -------
    t (NaN if there is none near), parameter there
    """
    _, _, r1, z1, r2, z2, scale = profile(exact, surface, v)
    across, along = ex * ex + ey * ey, qx * ex + qy * ey
    radius = math.hypot(qx, qy)
    # the line rises as (normal · d) t, the surface below it as bend t² / 2
    square = r1 * r1 + z1 * z1
    slope = along / radius if radius > _ON_AXIS else math.sqrt(across)
    run = (r1 * slope + z1 * ez) / square
    bend = (z1 * r2 - r1 * z2) * run * run
    rise = -r1 * ez
    if radius > _ON_AXIS:
        bend -= z1 * (across - slope * slope) / radius
        rise += z1 * slope
    t = 2.0 * rise / bend
    if not math.isfinite(t) or abs(t) > 4.0 or t == 0.0:
        return math.nan, v
    x, y = qx + t * ex, qy + t * ey
    mean = (2.0 * along + t * across) / (math.hypot(x, y) + radius)
    k = (mean * r1 + ez * z1) / square / scale
    least, before = 1e-3 * abs(t), math.inf
    for _ in range(_MAX_CHORD_STEPS):
        to = v + k * t
        inside = within(exact, surface, to)
        if exact.sheet[surface, 9] == 0 and inside != to:
            to = inside
            k = (to - v) / t
        mean_r, mean_z = mean_slopes(exact, surface, v, to)
        _, _, r1, z1, _, _, scale = profile(exact, surface, inside)
        r1, z1 = r1 * scale, z1 * scale
        x, y = qx + t * ex, qy + t * ey
        end = math.hypot(x, y)
        mean = (2.0 * along + t * across) / (end + radius)
        f1, f2 = mean - k * mean_r, ez - k * mean_z
        a = (across - mean * (along + t * across) / end) / (end + radius) - k * (r1 - mean_r) / t
        c = -k * (z1 - mean_z) / t
        share = 1.0 / (c * r1 - a * z1)
        dt, dk = (f1 * z1 - f2 * r1) * share, (c * f1 - a * f2) * share
        change = max(abs(dt), abs(dk * t) * math.sqrt(r1 * r1 + z1 * z1))
        if not math.isfinite(dt + dk) or abs(t) > 4.0 or abs(t) < least:
            break
        if change <= 1e-13 * abs(t) + _LAST_CHORD or (change < _STALLED_CHORD and change > _STALLED * before):
            return t + dt, within(exact, surface, v + (k + dk) * (t + dt))
        before = change
        part = min(1.0, 0.7 * abs(t) / abs(dt)) if dt != 0.0 else 1.0
        t, k = t + part * dt, k + part * dk
    return math.nan, v
