# SPDX-License-Identifier: LGPL-2.1-or-later
"""Local axes of exact surfaces, and where on a triangle a point is: what several of their kernels share."""

from __future__ import annotations

from raymaps.jit import inlined_kernel, kernel

__all__ = ["from_axes", "interval", "shares", "to_axes"]

#: Of so many intervals at most each is looked at.
_FEW = 4


@kernel
def to_axes(number, x, y, z):
    """Components of a vector along a surface's local axes."""
    return (
        x * number[3] + y * number[4] + z * number[5],
        x * number[6] + y * number[7] + z * number[8],
        x * number[9] + y * number[10] + z * number[11],
    )


@kernel
def from_axes(number, x, y, z):
    """A vector from its components along a surface's local axes."""
    return (
        x * number[3] + y * number[6] + z * number[9],
        x * number[4] + y * number[7] + z * number[10],
        x * number[5] + y * number[8] + z * number[11],
    )


@inlined_kernel
def shares(sides, x, y, z):
    """Shares f, g of the two sides at a triangle's first corner in the point of it next to (x, y, z), or a bit past.

    ``sides`` are a row of `ExactTables.guess_sides`.
    """
    qx, qy, qz = x - sides[0, 0], y - sides[0, 1], z - sides[0, 2]
    f = qx * sides[1, 0] + qy * sides[1, 1] + qz * sides[1, 2]
    g = qx * sides[2, 0] + qy * sides[2, 1] + qz * sides[2, 2]
    return min(max(f, -0.5), 1.5), min(max(g, -0.5), 1.5)


@inlined_kernel
def interval(breaks, first, n, x):
    """Which of n intervals between breaks holds x, the outer ones what is past them; breaks are about even."""
    if n <= _FEW:
        k = 0
        for j in range(first + 1, first + n):
            k += x >= breaks[j]
        return k
    begin, end = breaks[first], breaks[first + n]
    k = min(max(int((x - begin) / (end - begin) * n), 0), n - 1)
    while k > 0 and x < breaks[first + k]:
        k -= 1
    while k < n - 1 and x >= breaks[first + k + 1]:
        k += 1
    return k
