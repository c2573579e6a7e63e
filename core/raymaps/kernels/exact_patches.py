# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a line crosses a B-spline surface: Newton from a near guess, over polynomial patches.

The patches, their parameters and their poles are those of `raymaps.exact.bspline`; lengths in frame units. From a point
of the surface the line's other crossing is found by the difference of the two points, which a polynomial gives without
cancellation: a short chord is as accurate as a long one.
"""

from __future__ import annotations

import math

from raymaps.jit import inlined_kernel, kernel
from raymaps.kernels.exact_axes import interval, shares

__all__ = ["height_over_patches", "meet_patches", "normal_of_patches", "settle_on_patches"]

_MAX_STEPS = 30
#: Distance of a point on the surface from the line at which Newton is done, and the most that rounding may leave of it.
_EXACT, _ROUNDING = 2e-16, 2e-14
#: Chords below this are computed from the difference of their ends.
_SHORT = 1e-2
#: A crossing this near to where a line stands is where it stands.
_WHERE_IT_STANDS = 1e-9
#: A crossing further than this is not that where a line stands, however flat it leaves the surface.
_APART = 1e-6
#: Steps to the end of a chord: one that is the last, and one that may be if it is not shorter than
#: the step before by much, as only rounding is left.
_LAST_STEP, _STALLED = 4e-15, 1e-12
#: A chord that leaves its patch by more, in sizes of the patch, is not one of the patch's polynomial.
_PAST = 1e-5
#: By how much of its range v is kept off the poles at its lower and upper border, where u is not defined.
_NUDGE_LOW, _NUDGE_HIGH = 1e-100, 1e-14
#: How far patches at a border go on past it, in widths of the patch.
_EXTENSION = 0.25

#: No crossing.
_NONE = (math.nan, 0.0, 0.0, 0.0)


@kernel
def meet_patches(exact, surface, triangle, guess, towards, stands_on, px, py, pz, dx, dy, dz):
    """See `raymaps.kernels.exact.meet`."""
    row = _row(exact, triangle)
    u, v = _guess(exact, surface, triangle, px + guess * dx, py + guess * dy, pz + guess * dz)
    is_met, t, nx, ny, nz = False, math.nan, 0.0, 0.0, 0.0
    for attempt in range(4 if row >= 0 else 1):
        if attempt > 0:  # from the corners of the triangle
            u, v = exact.guess_uv[row, attempt - 1, 0], exact.guess_uv[row, attempt - 1, 1]
        is_met, u, v, t, nx, ny, nz = _newton(exact, surface, u, v, px, py, pz, dx, dy, dz)
        if is_met:
            break
    is_crossed = is_met and towards * (nx * dx + ny * dy + nz * dz) > 0.0
    if is_crossed and not (stands_on and abs(t) < _SHORT):
        return t, nx, ny, nz
    begin, first = t, (t, nx, ny, nz)
    is_apart = is_crossed and abs(t) > _APART
    if stands_on and not abs(t) >= _SHORT:
        if not is_met:  # both ends of a short chord are too near to each other to be told apart
            u, v = _guess(exact, surface, triangle, px, py, pz)
        u, v, _ = _settled(exact, surface, u, v, px, py, pz)
        j = _jet(exact, surface, _patch(exact, surface, u, v), u, v)
        is_met = abs(j[0] + j[3] - px) + abs(j[1] + j[4] - py) + abs(j[2] + j[5] - pz) < _WHERE_IT_STANDS
        begin = 0.0
    if not is_met:
        return first if is_apart else _NONE
    t, nx, ny, nz = _other_end(exact, surface, u, v, begin, px, py, pz, dx, dy, dz)
    if not towards * (nx * dx + ny * dy + nz * dz) > 0.0 or (stands_on and begin != 0.0 and abs(t) < _WHERE_IT_STANDS):
        return first if is_apart else _NONE
    return t, nx, ny, nz


@kernel
def settle_on_patches(exact, surface, triangle, x, y, z):
    """Nearest point of the surface, three numbers."""
    u, v = _guess(exact, surface, triangle, x, y, z)
    u, v, _ = _settled(exact, surface, u, v, x, y, z)
    j = _jet(exact, surface, _patch(exact, surface, u, v), u, v)
    return j[0] + j[3], j[1] + j[4], j[2] + j[5]


@kernel
def normal_of_patches(exact, surface, triangle, x, y, z):
    """Own unit normal at the nearest point."""
    u, v = _guess(exact, surface, triangle, x, y, z)
    u, v, _ = _settled(exact, surface, u, v, x, y, z)
    return _normal(exact, surface, u, v)


@kernel
def height_over_patches(exact, surface, triangle, x, y, z):
    """Signed distance along the own normal of a point next to the surface."""
    u, v = _guess(exact, surface, triangle, x, y, z)
    u, v, _ = _settled(exact, surface, u, v, x, y, z)
    j = _jet(exact, surface, _patch(exact, surface, u, v), u, v)
    nx, ny, nz = _normal(exact, surface, u, v)
    return (x - j[0] - j[3]) * nx + (y - j[1] - j[4]) * ny + (z - j[2] - j[5]) * nz


@inlined_kernel
def _row(exact, triangle):
    return exact.guess_row[triangle] if triangle >= 0 else -1


@inlined_kernel
def _guess(exact, surface, triangle, x, y, z):
    """Parameters near a point: between those of its triangle's corners, or of the nearest patch."""
    row = _row(exact, triangle)
    if row < 0:
        return _nearest_patch(exact, surface, x, y, z)
    f, g = shares(exact.guess_sides[row], x, y, z)
    uv = exact.guess_uv[row]
    u = uv[0, 0] + f * (uv[1, 0] - uv[0, 0]) + g * (uv[2, 0] - uv[0, 0])
    v = uv[0, 1] + f * (uv[1, 1] - uv[0, 1]) + g * (uv[2, 1] - uv[0, 1])
    return _within(exact, surface, 0, u), _within(exact, surface, 1, v)


@kernel
def _nearest_patch(exact, surface, x, y, z):
    """Parameters of the middle that is nearest to a point, of all patches."""
    sheet = exact.sheet[surface]
    best, best_u, best_v = math.inf, 0.0, 0.0
    for i in range(sheet[1]):
        for j in range(sheet[2]):
            u = 0.5 * (exact.breaks[sheet[5] + i] + exact.breaks[sheet[5] + i + 1])
            v = 0.5 * (exact.breaks[sheet[6] + j] + exact.breaks[sheet[6] + j + 1])
            p = _jet(exact, surface, sheet[0] + i * sheet[2] + j, u, v)
            square = (p[0] + p[3] - x) ** 2 + (p[1] + p[4] - y) ** 2 + (p[2] + p[5] - z) ** 2
            if square < best:
                best, best_u, best_v = square, u, v
    return best_u, best_v


@inlined_kernel
def _newton(exact, surface, u, v, px, py, pz, dx, dy, dz):
    """Solve S(u, v) = p + t d.

    Returns
    -------
    is_met, u, v, t, own unit normal (3 floats)
    """
    before = math.inf
    for _ in range(_MAX_STEPS):
        v = _off_poles(exact, surface, v)
        cx, cy, cz, x, y, z, ux, uy, uz, vx, vy, vz = _jet(exact, surface, _patch(exact, surface, u, v), u, v)
        rx, ry, rz = (cx - px) + x, (cy - py) + y, (cz - pz) + z
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        t = rx * dx + ry * dy + rz * dz
        ex, ey, ez = rx - t * dx, ry - t * dy, rz - t * dz
        error = math.sqrt(ex * ex + ey * ey + ez * ez)
        if error <= _EXACT or (error < _ROUNDING and error > 0.25 * before):
            nx, ny, nz = _turned(exact.number[surface, 2], nx, ny, nz)
            return True, u, v, t, nx, ny, nz
        before = error
        along = nx * dx + ny * dy + nz * dz
        if along == 0.0 or not math.isfinite(along):
            break
        # Cramer's rule for  Su du + Sv dv - d dt = -r
        du = -(ex * (vy * dz - vz * dy) + ey * (vz * dx - vx * dz) + ez * (vx * dy - vy * dx)) / along
        dv = -(ux * (ey * dz - ez * dy) + uy * (ez * dx - ex * dz) + uz * (ex * dy - ey * dx)) / along
        u, v = _moved(exact, surface, u, v, du, dv)
    return False, u, v, math.nan, 0.0, 0.0, 0.0


@kernel
def _settled(exact, surface, u, v, x, y, z):
    """Parameters of the nearest point: steps of Gauss and Newton. Two numbers, and the length of the last step."""
    size = math.inf
    for _ in range(_MAX_STEPS):
        v = _off_poles(exact, surface, v)
        cx, cy, cz, sx, sy, sz, ux, uy, uz, vx, vy, vz = _jet(exact, surface, _patch(exact, surface, u, v), u, v)
        qx, qy, qz = (x - cx) - sx, (y - cy) - sy, (z - cz) - sz
        a, b, c = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
        qu, qv = qx * ux + qy * uy + qz * uz, qx * vx + qy * vy + qz * vz
        determinant = a * c - b * b
        if determinant > 0.0:
            du, dv = (c * qu - b * qv) / determinant, (a * qv - b * qu) / determinant
        else:
            du, dv = 0.0, qv / c if c > 0.0 else 0.0
        mx, my, mz = du * ux + dv * vx, du * uy + dv * vy, du * uz + dv * vz
        size = math.sqrt(mx * mx + my * my + mz * mz)
        u, v = _moved(exact, surface, u, v, du, dv)
        if size < 1e-16:
            break
    return u, v, size


@kernel
def _other_end(exact, surface, u, v, begin, px, py, pz, dx, dy, dz):
    """The other crossing near one that is at distance `begin` and parameters (u, v).

    Returns
    -------
    t (NaN if there is none near), own unit normal there (3 floats)
    """
    v = _off_poles(exact, surface, v)
    is_pole = _is_on_pole(exact, surface, v)
    if is_pole:  # it has any u: take that which the line goes along
        _, _, _, _, _, _, ux, uy, uz, vx, vy, vz = _jet(exact, surface, _patch(exact, surface, u, v), u, v)
        ku, kv = _along_surface(ux, uy, uz, vx, vy, vz, dx, dy, dz)
        u, _ = _moved(exact, surface, u, v, 1e-3 * ku, 1e-3 * kv)
    patch = _patch(exact, surface, u, v)
    _, _, _, _, _, _, ux, uy, uz, vx, vy, vz = _jet(exact, surface, patch, u, v)
    nx, ny, nz = _turned(1.0, uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
    along = nx * dx + ny * dy + nz * dz
    # the way along the surface below the line, and how it bends: the line rises as t along, the surface as bend t²/2
    ku, kv = _along_surface(ux, uy, uz, vx, vy, vz, dx, dy, dz)
    if is_pole:
        ku, kv = 0.0, (vx * dx + vy * dy + vz * dz) / (vx * vx + vy * vy + vz * vz)
    widths = exact.patch[patch]
    step = 1e-4 / max(abs(ku) * abs(widths[5]), abs(kv) * abs(widths[6]), 1e-300)
    ahead = _jet(exact, surface, patch, u + step * ku, v + step * kv)
    bend = (
        nx * ((ahead[6] - ux) * ku + (ahead[9] - vx) * kv)
        + ny * ((ahead[7] - uy) * ku + (ahead[10] - vy) * kv)
        + nz * ((ahead[8] - uz) * ku + (ahead[11] - vz) * kv)
    ) / step
    first = 2.0 * along / bend
    if not math.isfinite(first) or abs(first) > 4.0:
        return math.nan, 0.0, 0.0, 0.0
    hu, hv = first * ku, first * kv
    is_met, hu, hv, t, mx, my, mz = _chord(exact, surface, patch, u, v, hu, hv, dx, dy, dz)
    if is_met and _is_past(exact, surface, patch, u + hu, v + hv) <= _PAST:
        return begin + t, mx, my, mz
    if is_met and exact.number[surface, 0] == 0.0 and exact.number[surface, 1] == 0.0:
        wu, wv = _within(exact, surface, 0, u + hu), _within(exact, surface, 1, v + hv)
    else:
        wu, wv = _moved(exact, surface, u, v, first * ku, first * kv)
    is_met, wu, wv, t, mx, my, mz = _newton(exact, surface, wu, wv, px, py, pz, dx, dy, dz)
    if not is_met or abs(t - begin) < 1e-7:
        return math.nan, 0.0, 0.0, 0.0
    return t, mx, my, mz


@kernel
def _along_surface(ux, uy, uz, vx, vy, vz, dx, dy, dz):
    """Changes of u and v per unit of length of a line, of its shadow on the surface."""
    a, b, c = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    du, dv = ux * dx + uy * dy + uz * dz, vx * dx + vy * dy + vz * dz
    determinant = a * c - b * b
    return (c * du - b * dv) / determinant, (a * dv - b * du) / determinant


@inlined_kernel
def _is_past(exact, surface, patch, u, v):
    """By how much parameters lie past the borders of a patch, in its sizes."""
    sheet = exact.sheet[surface]
    i, j = (patch - sheet[0]) // sheet[2], (patch - sheet[0]) % sheet[2]
    u0, u1 = exact.breaks[sheet[5] + i], exact.breaks[sheet[5] + i + 1]
    v0, v1 = exact.breaks[sheet[6] + j], exact.breaks[sheet[6] + j + 1]
    return max((u0 - u) / (u1 - u0), (u - u1) / (u1 - u0), (v0 - v) / (v1 - v0), (v - v1) / (v1 - v0))


@kernel
def _chord(exact, surface, patch, u, v, hu, hv, dx, dy, dz):
    """Solve S(u + hu, v + hv) - S(u, v) = t d for a step that is not zero, on one patch.

    Returns
    -------
    is_met, hu, hv, t, own unit normal at the other end (3 floats)
    """
    before = math.inf
    least = 0.0
    for _ in range(_MAX_STEPS):
        rx, ry, rz = _difference(exact, surface, patch, u, v, hu, hv)
        _, _, _, _, _, _, ux, uy, uz, vx, vy, vz = _jet(exact, surface, patch, u + hu, v + hv)
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        t = rx * dx + ry * dy + rz * dz
        ex, ey, ez = rx - t * dx, ry - t * dy, rz - t * dz
        along = nx * dx + ny * dy + nz * dz
        du = -(ex * (vy * dz - vz * dy) + ey * (vz * dx - vx * dz) + ez * (vx * dy - vy * dx)) / along
        dv = -(ux * (ey * dz - ez * dy) + uy * (ez * dx - ex * dz) + uz * (ex * dy - ey * dx)) / along
        mx, my, mz = du * ux + dv * vx, du * uy + dv * vy, du * uz + dv * vz
        size, change = math.sqrt(rx * rx + ry * ry + rz * rz), math.sqrt(mx * mx + my * my + mz * mz)
        if before == math.inf:
            least = 1e-3 * size
        if not math.isfinite(change) or size > 4.0 or size < least:
            break
        if change <= 1e-13 * size + _LAST_STEP or (change < _STALLED and change > 0.25 * before):
            nx, ny, nz = _turned(exact.number[surface, 2], nx, ny, nz)
            return True, hu, hv, t, nx, ny, nz
        before = change
        share = min(1.0, 0.7 * size / change)
        hu, hv = hu + share * du, hv + share * dv
    return False, hu, hv, math.nan, 0.0, 0.0, 0.0


@inlined_kernel
def _difference(exact, surface, patch, u, v, hu, hv):
    """S(u + hu, v + hv) - S(u, v) of one patch from divided differences, so small ones keep all their digits."""
    sheet, own = exact.sheet[surface], exact.patch[patch]
    n_u, n_v = sheet[3] + 1, sheet[4] + 1
    first = sheet[7] + (patch - sheet[0]) * n_u * n_v
    a0, b0 = (u - own[3]) * own[5], (v - own[4]) * own[6]
    ha, hb = hu * own[5], hv * own[6]
    a1, b1 = a0 + ha, b0 + hb
    x0, y0, z0, w0 = 0.0, 0.0, 0.0, 0.0  # at (a0, b1), then its divided difference along a
    xa, ya, za, wa = 0.0, 0.0, 0.0, 0.0
    xb, yb, zb, wb = 0.0, 0.0, 0.0, 0.0  # divided difference along b at a0
    xs, ys, zs, ws = 0.0, 0.0, 0.0, 0.0  # at (a0, b0)
    for i in range(n_u - 1, -1, -1):
        fx, fy, fz, fw = 0.0, 0.0, 0.0, 0.0  # at b1
        gx, gy, gz, gw = 0.0, 0.0, 0.0, 0.0  # at b0
        qx, qy, qz, qw = 0.0, 0.0, 0.0, 0.0  # divided difference
        for j in range(n_v - 1, -1, -1):
            c = exact.coefficient[first + i * n_v + j]
            qx, qy, qz, qw = qx * b1 + gx, qy * b1 + gy, qz * b1 + gz, qw * b1 + gw
            gx, gy, gz, gw = gx * b0 + c[0], gy * b0 + c[1], gz * b0 + c[2], gw * b0 + c[3]
            fx, fy, fz, fw = fx * b1 + c[0], fy * b1 + c[1], fz * b1 + c[2], fw * b1 + c[3]
        xa, ya, za, wa = xa * a1 + x0, ya * a1 + y0, za * a1 + z0, wa * a1 + w0
        x0, y0, z0, w0 = x0 * a0 + fx, y0 * a0 + fy, z0 * a0 + fz, w0 * a0 + fw
        xb, yb, zb, wb = xb * a0 + qx, yb * a0 + qy, zb * a0 + qz, wb * a0 + qw
        xs, ys, zs, ws = xs * a0 + gx, ys * a0 + gy, zs * a0 + gz, ws * a0 + gw
    sx, sy, sz = xs / ws, ys / ws, zs / ws
    dw = ha * wa + hb * wb
    w1 = ws + dw
    return (
        (ha * xa + hb * xb - sx * dw) / w1,
        (ha * ya + hb * yb - sy * dw) / w1,
        (ha * za + hb * zb - sz * dw) / w1,
    )


@inlined_kernel
def _jet(exact, surface, patch, u, v):
    """Centre of a patch, its point from there, and its derivatives by u and v: twelve numbers."""
    sheet, own = exact.sheet[surface], exact.patch[patch]
    n_u, n_v = sheet[3] + 1, sheet[4] + 1
    first = sheet[7] + (patch - sheet[0]) * n_u * n_v
    a, b = (u - own[3]) * own[5], (v - own[4]) * own[6]
    x, y, z, w = 0.0, 0.0, 0.0, 0.0
    xa, ya, za, wa = 0.0, 0.0, 0.0, 0.0
    xb, yb, zb, wb = 0.0, 0.0, 0.0, 0.0
    for i in range(n_u - 1, -1, -1):
        fx, fy, fz, fw = 0.0, 0.0, 0.0, 0.0
        gx, gy, gz, gw = 0.0, 0.0, 0.0, 0.0
        for j in range(n_v - 1, -1, -1):
            c = exact.coefficient[first + i * n_v + j]
            gx, gy, gz, gw = gx * b + fx, gy * b + fy, gz * b + fz, gw * b + fw
            fx, fy, fz, fw = fx * b + c[0], fy * b + c[1], fz * b + c[2], fw * b + c[3]
        xa, ya, za, wa = xa * a + x, ya * a + y, za * a + z, wa * a + w
        x, y, z, w = x * a + fx, y * a + fy, z * a + fz, w * a + fw
        xb, yb, zb, wb = xb * a + gx, yb * a + gy, zb * a + gz, wb * a + gw
    x, y, z = x / w, y / w, z / w
    fu, fv = own[5] / w, own[6] / w
    return (
        own[0], own[1], own[2], x, y, z,
        (xa - wa * x) * fu, (ya - wa * y) * fu, (za - wa * z) * fu,
        (xb - wb * x) * fv, (yb - wb * y) * fv, (zb - wb * z) * fv,
    )  # fmt: skip


@kernel
def _normal(exact, surface, u, v):
    v = _off_poles(exact, surface, v)
    j = _jet(exact, surface, _patch(exact, surface, u, v), u, v)
    return _turned(
        exact.number[surface, 2], j[7] * j[11] - j[8] * j[10], j[8] * j[9] - j[6] * j[11], j[6] * j[10] - j[7] * j[9]
    )


@inlined_kernel
def _turned(sign, x, y, z):
    """A vector brought to length one, and turned about if the sign is negative."""
    largest = max(abs(x), abs(y), abs(z))
    if largest == 0.0:
        return math.nan, math.nan, math.nan
    x, y, z = x / largest, y / largest, z / largest  # next to a pole it is too small to be squared
    length = sign * math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


@inlined_kernel
def _off_poles(exact, surface, v):
    sheet = exact.sheet[surface]
    end = exact.breaks[sheet[6] + sheet[2]]
    if exact.number[surface, 0] != 0.0 and v < _NUDGE_LOW * end:
        return _NUDGE_LOW * end
    if exact.number[surface, 1] != 0.0 and v > (1.0 - _NUDGE_HIGH) * end:
        return (1.0 - _NUDGE_HIGH) * end
    return v


@kernel
def _is_on_pole(exact, surface, v):
    sheet = exact.sheet[surface]
    end = exact.breaks[sheet[6] + sheet[2]]
    at_low = exact.number[surface, 0] != 0.0 and v <= 2.0 * _NUDGE_HIGH * end
    return at_low or (exact.number[surface, 1] != 0.0 and v >= (1.0 - 2.0 * _NUDGE_HIGH) * end)


@inlined_kernel
def _patch(exact, surface, u, v):
    """Patch that holds parameters; the one at the border past it."""
    sheet = exact.sheet[surface]
    return (
        sheet[0]
        + interval(exact.breaks, sheet[5], sheet[1], u) * sheet[2]
        + interval(exact.breaks, sheet[6], sheet[2], v)
    )


@inlined_kernel
def _moved(exact, surface, u, v, du, dv):
    """Parameters after a step: polar near a pole, at most a patch wide, wrapped, and kept by the borders."""
    sheet, number = exact.sheet[surface], exact.number[surface]
    end = exact.breaks[sheet[6] + sheet[2]]
    has_pole = number[0] != 0.0 or number[1] != 0.0
    j = sheet[6] + interval(exact.breaks, sheet[6], sheet[2], v)
    most = exact.breaks[j + 1] - exact.breaks[j]
    share = min(1.0, most / abs(dv)) if dv != 0.0 else 1.0
    if not has_pole:
        i = sheet[5] + interval(exact.breaks, sheet[5], sheet[1], u)
        most = exact.breaks[i + 1] - exact.breaks[i]
        share = min(share, most / abs(du)) if du != 0.0 else share
    du, dv = share * du, share * dv
    turn, away, way = 0.0, 0.0, 1.0
    if number[0] != 0.0 and (number[1] == 0.0 or v < 0.5 * end):
        turn, away = number[0], v
    elif number[1] != 0.0:
        turn, away, way = number[1], end - v, -1.0
    if turn != 0.0:
        along, aside = away + way * dv, away * turn * du
        du = math.atan2(aside, along) / turn
        dv = way * (math.hypot(along, aside) - away)
    return _within(exact, surface, 0, u + du), _within(exact, surface, 1, v + dv)


@inlined_kernel
def _within(exact, surface, axis, x):
    """A parameter wrapped, or kept by the borders: by a little more than the border, by a pole just so."""
    sheet = exact.sheet[surface]
    first, n = sheet[5 + axis], sheet[1 + axis]
    end = exact.breaks[first + n]
    if sheet[8 + axis]:
        return x - end * math.floor(x / end)
    low = _EXTENSION * exact.breaks[first + 1]
    high = _EXTENSION * (end - exact.breaks[first + n - 1])
    if axis == 1 and exact.number[surface, 0] != 0.0:
        low = 0.0
    if axis == 1 and exact.number[surface, 1] != 0.0:
        high = 0.0
    return min(max(x, -low), end + high)
