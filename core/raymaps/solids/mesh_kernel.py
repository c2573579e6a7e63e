# SPDX-License-Identifier: LGPL-2.1-or-later
"""The loops behind `raymaps.solids`: overlapping boxes, distances and crossings of triangles, winding numbers."""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel

__all__ = [
    "are_close",
    "close_pairs",
    "crossing_depth",
    "distances_to",
    "mark_close",
    "mark_crossing",
    "overlapping_boxes",
    "winding_numbers",
]


@kernel
def overlapping_boxes(first, second, itself, axis, low, high, place, pairs):
    """Fill in pairs of boxes that overlap, until there is no room or no further one.

    Each box is compared with those of the other list that begin, along the axis, while it lasts.

    Parameters
    ----------
    first, second : (n,) int64
        Rows of the boxes, each list sorted by ``low`` along the axis.
    itself : bool
        Both lists are one: each pair counts once.
    low, high : (n_boxes, 3) float64
    place : (2,) int64
        Where to go on; zeros at first.
    pairs : (n_room, 2) int64, filled

    Returns
    -------
    int: number of pairs
    """
    n = 0
    n_first = len(first)
    n_all = n_first if itself else n_first + len(second)
    while place[0] < n_all:
        k = place[0]
        from_first = k < n_first
        row = first[k] if from_first else second[k - n_first]
        others = second if from_first else first
        if place[1] == 0:
            place[1] = k + 1 if itself else _first_beginning(others, low, axis, low[row, axis], from_first)
        while place[1] < len(others) and low[others[place[1]], axis] <= high[row, axis]:
            if n == len(pairs):
                return n
            other = others[place[1]]
            place[1] += 1
            overlap = True
            for x in range(3):
                overlap = overlap and low[row, x] <= high[other, x] and low[other, x] <= high[row, x]
            if overlap:
                pairs[n, 0] = row if from_first else other
                pairs[n, 1] = other if from_first else row
                n += 1
        place[0] += 1
        place[1] = 0
    return n


@kernel
def _first_beginning(rows, low, axis, value, equal_too):
    """Index of the first of sorted boxes that begins after a value, or at it."""
    start, end = 0, len(rows)
    while start < end:
        middle = (start + end) // 2
        begin = low[rows[middle], axis]
        if begin > value or (equal_too and begin == value):
            end = middle
        else:
            start = middle + 1
    return start


@kernel
def mark_close(pairs, corners, radius, found, close):
    """Mark the triangles of pairs that are no farther apart than the sum of their radii.

    Parameters
    ----------
    pairs : (n, 2) int64
    corners : (n_triangles, 3 corners, 3) float64
    radius : (n_triangles,) float64
    found : bool
        Whether such a pair of these bodies is known already.
    close : (n_triangles,) bool, set

    Returns
    -------
    bool: whether such a pair is known now
    """
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        if found and close[i] and close[j]:
            continue
        if are_close(corners[i], corners[j], radius[i] + radius[j]):
            close[i] = close[j] = found = True
    return found


@kernel
def close_pairs(pairs, corners, radius, is_close):
    """Tell which pairs of triangles are no farther apart than the sum of their radii.

    Parameters
    ----------
    pairs : (n, 2) int64
    corners : (n_triangles, 3 corners, 3) float64
    radius : (n_triangles,) float64
    is_close : (n,) bool, filled
    """
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        is_close[k] = are_close(corners[i], corners[j], radius[i] + radius[j])


@kernel
def are_close(a, b, distance):
    """Whether two triangles, (3 corners, 3) each, have points that are no farther apart than a distance."""
    if _is_clear_of_plane(a, b, distance) or _is_clear_of_plane(b, a, distance):
        return False
    for k in range(3):
        if _stands_over(a, b[k], distance) or _stands_over(b, a[k], distance):
            return True
        if pierces(a, b[k], b[(k + 1) % 3]) or pierces(b, a[k], a[(k + 1) % 3]):
            return True
    for k in range(3):
        for m in range(3):
            if _squared_distance(a[k], a[(k + 1) % 3], b[m], b[(m + 1) % 3]) <= distance * distance:
                return True
    return False


@kernel
def normal_of(a):
    """Unit normal of a triangle; NaN without an area."""
    ux, uy, uz = a[1, 0] - a[0, 0], a[1, 1] - a[0, 1], a[1, 2] - a[0, 2]
    vx, vy, vz = a[2, 0] - a[0, 0], a[2, 1] - a[0, 1], a[2, 2] - a[0, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


@kernel
def height_over(a, point):
    """Distance of a point from the plane of a triangle, negative behind it; NaN without an area."""
    x, y, z = normal_of(a)
    return x * (point[0] - a[0, 0]) + y * (point[1] - a[0, 1]) + z * (point[2] - a[0, 2])


@kernel
def _is_clear_of_plane(a, b, distance):
    """Whether a triangle b lies farther than a distance on one side of the plane of a."""
    p, q, r = height_over(a, b[0]), height_over(a, b[1]), height_over(a, b[2])
    return (p > distance and q > distance and r > distance) or (p < -distance and q < -distance and r < -distance)


@kernel
def _lies_within(a, nx, ny, nz, x, y, z):
    """Whether a point, seen along the normal of a triangle, lies within it."""
    for k in range(3):
        start, end = a[k], a[(k + 1) % 3]
        ex, ey, ez = end[0] - start[0], end[1] - start[1], end[2] - start[2]
        px, py, pz = x - start[0], y - start[1], z - start[2]
        turn = (ey * pz - ez * py) * nx + (ez * px - ex * pz) * ny + (ex * py - ey * px) * nz
        if not turn >= 0.0:
            return False
    return True


@kernel
def _stands_over(a, point, distance):
    """Whether a point stands over or under a triangle, no farther from it than a distance."""
    nx, ny, nz = normal_of(a)
    return abs(height_over(a, point)) <= distance and _lies_within(a, nx, ny, nz, point[0], point[1], point[2])


@kernel
def pierces(a, start, end):
    """Whether the line from a start to an end point goes through a triangle, from one side to the other."""
    p, q = height_over(a, start), height_over(a, end)
    if not (p > 0.0 > q or p < 0.0 < q):
        return False
    nx, ny, nz = normal_of(a)
    t = p / (p - q)
    return _lies_within(
        a, nx, ny, nz,
        start[0] + t * (end[0] - start[0]), start[1] + t * (end[1] - start[1]), start[2] + t * (end[2] - start[2]),
    )  # fmt: skip


@kernel
def _squared_distance(p, q, r, s):
    """Squared distance between two line segments p-q and r-s (Ericson, Real-Time Collision Detection, 5.1.9)."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = s[0] - r[0], s[1] - r[1], s[2] - r[2]
    wx, wy, wz = p[0] - r[0], p[1] - r[1], p[2] - r[2]
    uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    uv = ux * vx + uy * vy + uz * vz
    uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    determinant = uu * vv - uv * uv
    t = _clamped((uv * vw - uw * vv) / determinant) if determinant > 1e-14 * uu * vv else 0.0
    m = _clamped((uv * t + vw) / vv) if vv > 0.0 else 0.0
    t = _clamped((uv * m - uw) / uu) if uu > 0.0 else 0.0
    x, y, z = wx + t * ux - m * vx, wy + t * uy - m * vy, wz + t * uz - m * vz
    return x * x + y * y + z * z


@kernel
def _clamped(t):
    """A parameter of a line segment, kept within its ends."""
    return min(max(t, 0.0), 1.0)


@kernel
def _crossing(a, b):
    """How far two triangles that go through each other do so, 0 if they don't.

    Each stands on both sides of the plane of the other; what is told is the least that one must move to be clear.
    """
    depth = min(_stands_on_both_sides(a, b), _stands_on_both_sides(b, a))
    if not depth > 0.0:
        return 0.0
    for k in range(3):
        if pierces(a, b[k], b[(k + 1) % 3]) or pierces(b, a[k], a[(k + 1) % 3]):
            return depth
    return 0.0


@kernel
def _stands_on_both_sides(a, b):
    """How far a triangle b reaches to that side of the plane of a to which it reaches less; negative if only to one."""
    p, q, r = height_over(a, b[0]), height_over(a, b[1]), height_over(a, b[2])
    return min(max(p, q, r), -min(p, q, r))


@kernel
def crossing_depth(pairs, corners, radius):
    """How far the triangles of any of the pairs go through each other, 0 if by no more than the sum of their radii.

    Parameters
    ----------
    pairs : (n, 2) int64
    corners : (n_triangles, 3 corners, 3) float64
    radius : (n_triangles,) float64
    """
    deepest = 0.0
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        depth = _crossing(corners[i], corners[j])
        if depth > max(deepest, radius[i] + radius[j]):
            deepest = depth
    return deepest


@kernel
def mark_crossing(pairs, corners, places, distance, crossing):
    """Mark triangles that go through each other by more than a distance and have no corner in common.

    Parameters
    ----------
    pairs : (n, 2) int64
    corners : (n_triangles, 3 corners, 3) float64
    places : (n_triangles, 3) int64, number of the place of each corner
    distance : float
    crossing : (n_triangles,) bool, set
    """
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        are_neighbours = False
        for m in range(3):
            for n in range(3):
                are_neighbours = are_neighbours or places[i, m] == places[j, n]
        if not are_neighbours and _crossing(corners[i], corners[j]) > distance:
            crossing[i] = crossing[j] = True


@kernel
def distances_to(corners, points, distance):
    """Distance of each point to the nearest triangle.

    Parameters
    ----------
    corners : (n_triangles, 3 corners, 3) float64
    points : (n, 3) float64
    distance : (n,) float64, filled
    """
    for k in range(len(points)):
        best = np.inf
        for i in range(len(corners)):
            if _box_distance(corners[i], points[k]) < best:
                best = min(best, _distance_to(corners[i], points[k]))
        distance[k] = best


@kernel
def _box_distance(a, point):
    """Distance of a point to the box around a triangle."""
    x = _outside(a[0, 0], a[1, 0], a[2, 0], point[0])
    y = _outside(a[0, 1], a[1, 1], a[2, 1], point[1])
    z = _outside(a[0, 2], a[1, 2], a[2, 2], point[2])
    return _length(x, y, z)


@kernel
def _outside(a, b, c, x):
    """How far a value is from the range of three values."""
    return max(min(a, b, c) - x, x - max(a, b, c), 0.0)


@kernel
def _distance_to(a, point):
    """Distance of a point to a triangle."""
    height = abs(height_over(a, point))
    if _stands_over(a, point, height):
        return height
    squared = np.inf
    for k in range(3):
        squared = min(squared, _squared_distance(a[k], a[(k + 1) % 3], point, point))
    return math.sqrt(squared)


@kernel
def winding_numbers(corners, points, winding):
    """How often triangles wind around each point, as `raymaps.geometry.winding_number` tells it of one.

    Parameters
    ----------
    corners : (n_triangles, 3 corners, 3) float64
    points : (n, 3) float64
    winding : (n,) float64, filled
    """
    for k in range(len(points)):
        total = 0.0
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        for i in range(len(corners)):
            c = corners[i]
            ax, ay, az = c[0, 0] - x, c[0, 1] - y, c[0, 2] - z
            bx, by, bz = c[1, 0] - x, c[1, 1] - y, c[1, 2] - z
            cx, cy, cz = c[2, 0] - x, c[2, 1] - y, c[2, 2] - z
            la, lb, lc = _length(ax, ay, az), _length(bx, by, bz), _length(cx, cy, cz)
            across = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            product = la * lb * lc
            if abs(across) <= 1e-14 * product:  # seen edge-on: no solid angle
                continue
            along = product + (ax * bx + ay * by + az * bz) * lc + (bx * cx + by * cy + bz * cz) * la
            along += (cx * ax + cy * ay + cz * az) * lb
            total += math.atan2(across, along)
        winding[k] = total / (2 * np.pi)


@kernel
def _length(x, y, z):
    return math.sqrt(x * x + y * y + z * z)
