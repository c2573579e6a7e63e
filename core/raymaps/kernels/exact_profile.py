# SPDX-License-Identifier: LGPL-2.1-or-later
"""The profile of a surface of revolution: radius R(v) and height Z(v), piecewise rational polynomials of one parameter.

The pieces are those of `raymaps.exact.revolution`; `raymaps.exact.tables` says where they stand. Derivatives are by a
piece's own parameter b = (v - reference) / width. Where the profile begins or ends on the axis, in a pole, v is
reflected: what goes on beyond the axis is the other side of the surface.
"""

from __future__ import annotations

import math

from raymaps.jit import inlined_kernel, kernel
from raymaps.kernels.exact_axes import interval, shares

__all__ = [
    "guess_profile",
    "mean_slopes",
    "profile",
    "sample",
    "samples_of_piece",
    "settle_on_profile",
    "stepped",
    "within",
]

_MAX_STEPS = 30
#: How far a profile goes on past an end that is no pole, in widths of the piece there.
EXTENSION = 0.25
#: A step of Newton below this is the last, as the next is its square.
_LAST_STEP = 1e-9
#: Places of a profile that are looked at, two of each piece at least.
_SAMPLES = 12


@inlined_kernel
def profile(exact, surface, v):
    """R, Z, their first and second derivatives by the own parameter of v's piece, and one over its width.

    Returns
    -------
    R, Z, R', Z', R'', Z'', 1 / width
    """
    sheet = exact.sheet[surface]
    j = interval(exact.breaks, sheet[6], sheet[2], v)
    own, n = exact.patch[sheet[0] + j], sheet[4] + 1
    first = sheet[7] + j * n
    b = (v - own[4]) * own[6]
    r, z, w, ra, za, wa, rb, zb, wb = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if sheet[10] == 0:  # a polynomial
        for k in range(n - 1, -1, -1):
            c = exact.coefficient[first + k]
            rb, zb = rb * b + ra, zb * b + za
            ra, za = ra * b + r, za * b + z
            r, z = r * b + c[0], z * b + c[2]
        return own[0] + r, own[2] + z, ra, za, 2.0 * rb, 2.0 * zb, own[6]
    for k in range(n - 1, -1, -1):
        c = exact.coefficient[first + k]
        rb, zb, wb = rb * b + ra, zb * b + za, wb * b + wa
        ra, za, wa = ra * b + r, za * b + z, wa * b + w
        r, z, w = r * b + c[0], z * b + c[2], w * b + c[3]
    share = 1.0 / w
    r, z = r * share, z * share
    ra, za = (ra - wa * r) * share, (za - wa * z) * share
    return (
        own[0] + r, own[2] + z, ra, za, 2.0 * (rb - wa * ra - wb * r) * share, 2.0 * (zb - wa * za - wb * z) * share,
        own[6],
    )  # fmt: skip


@inlined_kernel
def stepped(exact, surface, v, db, scale):
    """A parameter after a step ``db`` in widths of the piece, of one at most; ``scale`` is one over the width."""
    return within(exact, surface, v + min(max(db, -1.0), 1.0) * (1.0 / scale))


@inlined_kernel
def within(exact, surface, v):
    """A parameter wrapped, reflected at a pole, or kept by an end."""
    sheet, number = exact.sheet[surface], exact.number[surface]
    first, n = sheet[6], sheet[2]
    end = exact.breaks[first + n]
    if sheet[9]:
        return v - end * math.floor(v / end)
    if v < 0.0:
        return -v if number[12] != 0.0 else max(v, -EXTENSION * exact.breaks[first + 1])
    if v > end:
        return 2.0 * end - v if number[13] != 0.0 else min(v, end + EXTENSION * (end - exact.breaks[first + n - 1]))
    return v


@inlined_kernel
def guess_profile(exact, surface, triangle, x, y, z, radius, height):
    """Parameter near a point (x, y, z) of a triangle; without one near (radius, height), of the samples the nearest."""
    row = exact.guess_row[triangle] if triangle >= 0 else -1
    if row < 0:
        return nearest_sample(exact, surface, radius, height)
    f, g = shares(exact.guess_sides[row], x, y, z)
    uv = exact.guess_uv[row]
    return within(exact, surface, uv[0, 1] + f * (uv[1, 1] - uv[0, 1]) + g * (uv[2, 1] - uv[0, 1]))


@inlined_kernel
def samples_of_piece(exact, surface):
    """Number of places of each piece that are looked at where nothing better is known."""
    return max(2, _SAMPLES // exact.sheet[surface, 2])


@inlined_kernel
def sample(exact, surface, k):
    """Parameter of place k, counted from the begin, also from before it or to past the end of a profile that wraps.

    A little past ends that are no poles counts as well.
    """
    sheet, number = exact.sheet[surface], exact.number[surface]
    first, n, each = sheet[6], sheet[2], samples_of_piece(exact, surface)
    end = exact.breaks[first + n]
    if sheet[9]:
        turns = math.floor(k / (n * each))
        j, k = (k // each) % n, k % each
        low, high = exact.breaks[first + j], exact.breaks[first + j + 1]
        return turns * end + low + (high - low) * k / each
    j = min(max(k // each, 0), n - 1)
    low, high = exact.breaks[first + j], exact.breaks[first + j + 1]
    if j == 0 and number[12] == 0.0:
        low -= EXTENSION * (exact.breaks[first + 1] - low)
    if j == n - 1 and number[13] == 0.0:
        high += EXTENSION * (high - exact.breaks[first + n - 1])
    return low + (high - low) * (k - j * each) / each


@kernel
def nearest_sample(exact, surface, radius, height):
    """Parameter of that sample of a profile that is nearest to (radius, height)."""
    best, best_v = math.inf, 0.0
    for k in range(exact.sheet[surface, 2] * samples_of_piece(exact, surface) + 1):
        v = within(exact, surface, sample(exact, surface, k))
        p = profile(exact, surface, v)
        square = (p[0] - radius) ** 2 + (p[1] - height) ** 2
        if square < best:
            best, best_v = square, v
    return best_v


@inlined_kernel
def settle_on_profile(exact, surface, v, radius, height):
    """Parameter of the point nearest to (radius, height): Newton's method."""
    for _ in range(_MAX_STEPS):
        r, z, r1, z1, r2, z2, scale = profile(exact, surface, v)
        off_r, off_z = radius - r, height - z
        square = r1 * r1 + z1 * z1
        bent = square - off_r * r2 - off_z * z2
        step = (off_r * r1 + off_z * z1) / (bent if bent > 0.1 * square else square)
        if not math.isfinite(step):
            break
        v = stepped(exact, surface, v, step, scale)
        if abs(step) < _LAST_STEP * min(1.0, abs(r)):
            break
    return v


@kernel
def mean_slopes(exact, surface, v, to):
    """(R(to) - R(v)) / (to - v) and the same of Z, from divided differences: nearly equal ends keep all digits.

    Parameters ``to`` of a profile that wraps may lie before its begin and past its end.
    """
    sheet = exact.sheet[surface]
    first, n = sheet[6], sheet[2]
    end = exact.breaks[first + n]
    j = interval(exact.breaks, first, n, v)
    turns, way = 0.0, 1 if to >= v else -1
    sum_r, sum_z, begin = 0.0, 0.0, v
    for _ in range(n + 1):
        border = exact.breaks[first + j + (1 if way > 0 else 0)] + turns
        is_last = way * (to - border) <= 0.0 or (sheet[9] == 0 and j == (n - 1 if way > 0 else 0))
        stop = to if is_last else border
        r, z = _divided(exact, surface, j, begin - turns, stop - turns)
        if is_last and begin == v:
            return r, z
        sum_r, sum_z = sum_r + r * (stop - begin), sum_z + z * (stop - begin)
        if is_last:
            break
        begin, j = stop, j + way
        if j < 0 or j >= n:
            turns += way * end
            j -= way * n
    return sum_r / (to - v), sum_z / (to - v)


@inlined_kernel
def _divided(exact, surface, j, v, to):
    """Divided differences of R and Z on a piece."""
    sheet = exact.sheet[surface]
    own, n = exact.patch[sheet[0] + j], sheet[4] + 1
    first = sheet[7] + j * n
    b, c = (v - own[4]) * own[6], (to - own[4]) * own[6]
    r, z, w, dr, dz, dw, end_w = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(n - 1, -1, -1):
        p = exact.coefficient[first + k]
        dr, dz, dw = dr * c + r, dz * c + z, dw * c + w
        r, z, w = r * b + p[0], z * b + p[2], w * b + p[3]
        end_w = end_w * c + p[3]
    share = own[6] / end_w
    return (dr - r / w * dw) * share, (dz - z / w * dw) * share
