# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a ray crosses the face that a triangle of the bounding mesh belongs to, and what that means to it.

The crossing is that with the face's exact surface, or with the triangle's plane; next to an edge the surface beyond it
decides which of the two faces is crossed. A ray knows the solids that it is in: a crossing that does not agree with
them (into a solid that it is in already) is one where the ray stands, or shows that a crossing was missed.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import inlined_kernel, kernel
from raymaps.kernels import exact
from raymaps.kernels.inside import is_in
from raymaps.kinds import CONTACT, ExactKind

__all__ = [
    "AT_EDGE", "CROSSED", "NONE", "ROUNDING", "STRAY",
    "along", "around", "crossing", "height_above", "height_over_face", "is_over", "normal_at", "over_face",
    "passes_over",
]  # fmt: skip

#: How far from its face a triangle may be hit, in frame units: facets may overlap by a few steps of float32.
AT_EDGE = 2.0**-19
#: A crossing further than this from where Embree met the triangle is looked at again, in frame units.
FAR = 2.0**-12
#: Secant of the angle of incidence up to which a crossing is over the triangle that Embree meets, or one next to it.
GRAZING_SECANT = 8.0
#: Triangles between that which Embree meets and that over which its face is crossed.
MAX_STEPS = 64
#: How far beyond a neighbouring face a point may lie by rounding, in frame units: where a ray leaves, and, less so that
#: what came in also gets out, where it enters.
ROUNDING = 2.0**-40
ROUNDING_INWARDS = 2.0**-48

#: What a triangle means to a ray: no crossing, or one where it stands; a crossing; one that does not agree.
NONE, CROSSED, STRAY = 0, 1, 2

_PLANE = int(ExactKind.PLANE)
_PATCHES = int(ExactKind.PATCHES)


@inlined_kernel
def height_above(plane, point):
    """Distance of a point from a triangle's plane, negative behind it."""
    return plane[0] * point[0] + plane[1] * point[1] + plane[2] * point[2] - plane[3]


@inlined_kernel
def along(wave, i, normal):
    """Cosine between the way of ray i and a normal."""
    return wave.direction[i, 0] * normal[0] + wave.direction[i, 1] * normal[1] + wave.direction[i, 2] * normal[2]


@inlined_kernel
def crossing(i, triangle, way, guess, leeway, wave, tables, boundary):
    """What crossing the face of a triangle of the bounding mesh outwards (``way`` 1) or inwards (-1) means to ray i.

    A crossing that agrees with where the ray is may lie behind it by rounding. With a ``leeway`` the triangle may be
    that far from the crossing.

    Returns
    -------
    verdict, distance, outward normal (3 floats), triangle of the face that is crossed
    """
    solid = boundary.solid[tables.triangle_face[triangle]]
    agrees = solid < 0 or is_in(wave.inside[i], solid) == (way > 0)
    t, nx, ny, nz, crossed = _trimmed(i, triangle, guess, way, agrees, leeway, wave, tables, boundary)
    if not math.isfinite(t) or (abs(t - guess) > FAR and _is_elsewhere(i, crossed, t, leeway, wave, tables, boundary)):
        return NONE, t, nx, ny, nz, crossed
    height = (t - wave.passed[i]) * abs(
        nx * wave.direction[i, 0] + ny * wave.direction[i, 1] + nz * wave.direction[i, 2]
    )
    near = CONTACT + boundary.slack[crossed]
    if solid < 0:
        return (CROSSED if t > wave.passed[i] else NONE), t, nx, ny, nz, crossed
    if agrees:
        return (CROSSED if height >= -near else NONE), max(t, wave.passed[i]), nx, ny, nz, crossed
    return (STRAY if height > near else NONE), t, nx, ny, nz, crossed


@inlined_kernel
def _trimmed(i, triangle, guess, way, agrees, leeway, wave, tables, boundary):
    """Crossing of ray i with the face of a triangle, or with the face beyond the edge where that one comes first.

    Along a convex edge a body is what lies behind both faces' surfaces, along a concave one what lies behind either.
    Near an edge the bounding mesh may name the wrong one of them; NaN where the ray passes by the edge.
    """
    t, nx, ny, nz, crossed = np.nan, 0.0, 0.0, 0.0, triangle
    room = 0.0 if not agrees else (ROUNDING if way > 0 else ROUNDING_INWARDS)
    for place in range(-1, boundary.neighbour.shape[1]):  # first its own face
        other, bend, is_missed, beyond, off_facets = triangle, 0, True, 0.0, 0.0
        if place >= 0:
            other, bend = boundary.neighbour[triangle, place], boundary.bend[triangle, place]
            if other < 0 or bend == 0:
                continue
            off_facets = AT_EDGE + leeway + 2.0 * (boundary.reach[triangle] + boundary.reach[other])
            is_missed = not math.isfinite(t)
            if not is_missed:
                near_edge = off_facets + abs(t - guess)  # so far it may be from the triangle that was hit
                if leeway == 0.0 and _is_clear(i, other, t, 2.0 * near_edge, wave, tables, boundary):
                    continue
                beyond = bend * height_over_face(i, other, t, wave, tables, boundary)
                if not room < beyond <= near_edge:
                    continue
        s, sx, sy, sz, other = over_face(i, other, guess if is_missed else t, way, wave, tables, boundary)
        if place < 0:
            t, nx, ny, nz, triangle, crossed = s, sx, sy, sz, other, other
            if boundary.inner[triangle]:
                break
            continue
        if math.isfinite(s):
            past = bend * height_over_face(i, triangle, s, wave, tables, boundary)
            steep = abs(sx * wave.direction[i, 0] + sy * wave.direction[i, 1] + sz * wave.direction[i, 2])
            is_far = past < -off_facets if is_missed else abs(s - t) * steep > off_facets + 2.0 * beyond
            if is_far or ((is_missed or not agrees or bend * way < 0) and past > ROUNDING):
                s = np.nan
        if math.isfinite(s) or not agrees or bend * way < 0:
            t, nx, ny, nz, crossed = s, sx, sy, sz, other
    return t, nx, ny, nz, crossed


@inlined_kernel
def over_face(i, triangle, guess, way, wave, tables, boundary):
    """As `_with_face`, and the triangle over which the crossing is, or the last on the way there.

    A ray that grazes a face crosses it some triangles away from where it meets the bounding mesh. Where one face goes
    on smoothly into another, that is crossed on whose side of the edge the crossing is; NaN if neither is.
    """
    t, nx, ny, nz = guess, 0.0, 0.0, 0.0
    before, edge, is_met = -1, 0, False
    for _ in range(MAX_STEPS):
        if not is_met:
            s, sx, sy, sz = _with_face(i, triangle, t, way, wave, tables, boundary)
            is_met = True
            if before < 0:
                aside = boundary.reach[triangle] if boundary.sharp[triangle] else 0.0
                if not abs(s - guess) > AT_EDGE + GRAZING_SECANT * aside:
                    return s, sx, sy, sz, triangle
            elif not _is_past_edge(i, before, edge, s, nx, ny, nz, wave, boundary) and abs(s - t) > ROUNDING:
                return np.nan, sx, sy, sz, triangle
            t, nx, ny, nz = s, sx, sy, sz
        before = triangle
        for edge in range(3):
            other = boundary.beside[before, edge]
            if other >= 0 and _is_past_edge(i, before, edge, t, nx, ny, nz, wave, boundary):
                is_met = tables.triangle_face[other] == tables.triangle_face[before]
                if is_met or boundary.bend[before, edge] == 0:
                    triangle = other
                    break
        if triangle == before:
            break
    return t, nx, ny, nz, triangle


@inlined_kernel
def _is_past_edge(i, triangle, edge, t, nx, ny, nz, wave, boundary):
    """Whether the point at the distance t of ray i lies beyond an edge of a triangle, seen along a normal."""
    corners, p, d = boundary.corners[triangle], wave.position[i], wave.direction[i]
    a, b, c = corners[edge], corners[(edge + 1) % 3], corners[(edge + 2) % 3]
    ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    x, y, z = ey * nz - ez * ny, ez * nx - ex * nz, ex * ny - ey * nx  # across the edge
    of_corner = x * (c[0] - a[0]) + y * (c[1] - a[1]) + z * (c[2] - a[2])
    of_point = x * (p[0] + t * d[0] - a[0]) + y * (p[1] + t * d[1] - a[1]) + z * (p[2] + t * d[2] - a[2])
    return of_corner * of_point < 0.0


@inlined_kernel
def _is_elsewhere(i, triangle, t, leeway, wave, tables, boundary):
    """Whether ray i crosses a triangle's plane beside the triangle: the plane of one that it runs along."""
    surface = boundary.exact.face[tables.triangle_face[triangle]]
    if surface >= 0 and boundary.exact.kind[surface] != _PLANE:
        return False
    return not passes_over(i, triangle, t, leeway + around(triangle, boundary), wave, boundary)


@inlined_kernel
def _is_clear(i, triangle, t, distance, wave, tables, boundary):
    """Whether the point at distance t of ray i is further from a triangle's plane than a distance.

    Asked of B-splines only, patches and profiles: heights over them take time, above all far from them.
    """
    surface = boundary.exact.face[tables.triangle_face[triangle]]
    if surface < 0 or boundary.exact.kind[surface] < _PATCHES:
        return False
    plane = tables.plane[triangle]
    return abs(height_above(plane, wave.position[i]) + t * along(wave, i, plane)) > distance


@inlined_kernel
def _with_face(i, triangle, guess, way, wave, tables, boundary):
    """Distance of ray i to the exact surface of a triangle's face, or to the triangle's plane, and the outward normal.

    NaN if it is not crossed outwards (``way`` 1) or inwards (-1), or if the ray stands on it.
    """
    plane, face, standing = tables.plane[triangle], tables.triangle_face[triangle], wave.triangle[i]
    p, d = wave.position[i], wave.direction[i]
    surface = boundary.exact.face[face]
    if surface >= 0:
        outward = boundary.exact.outward[face]
        stands_on = standing >= 0 and boundary.exact.face[tables.triangle_face[standing]] == surface
        t, nx, ny, nz = exact.meet(
            boundary.exact, surface, triangle, guess, way * outward, stands_on, p[0], p[1], p[2], d[0], d[1], d[2]
        )
        return t, outward * nx, outward * ny, outward * nz
    steep = along(wave, i, plane)
    t = -height_above(plane, p) / steep if steep * way > 0 and triangle != standing else np.nan
    return t, plane[0], plane[1], plane[2]


@inlined_kernel
def height_over_face(i, triangle, t, wave, tables, boundary):
    """How far the point at distance t of ray i lies outside the surface of a triangle's face."""
    x, y, z = (
        wave.position[i, 0] + t * wave.direction[i, 0],
        wave.position[i, 1] + t * wave.direction[i, 1],
        wave.position[i, 2] + t * wave.direction[i, 2],
    )
    face = tables.triangle_face[triangle]
    surface = boundary.exact.face[face]
    if surface >= 0:
        return boundary.exact.outward[face] * exact.height(boundary.exact, surface, x, y, z, triangle)
    plane = tables.plane[triangle]
    return plane[0] * x + plane[1] * y + plane[2] * z - plane[3]


@inlined_kernel
def normal_at(i, triangle, t, wave, tables, boundary):
    """Outward normal of a triangle's face at the distance t of ray i, which is on it."""
    plane, face = tables.plane[triangle], tables.triangle_face[triangle]
    surface = boundary.exact.face[face]
    if surface < 0:
        return plane[0], plane[1], plane[2]
    p, d = wave.position[i], wave.direction[i]
    nx, ny, nz = exact.normal(boundary.exact, surface, p[0] + t * d[0], p[1] + t * d[1], p[2] + t * d[2], triangle)
    outward = boundary.exact.outward[face]
    return outward * nx, outward * ny, outward * nz


@inlined_kernel
def around(triangle, boundary):
    """How far from a triangle its face may be crossed, in frame units."""
    return 2.0 * boundary.reach[triangle] + AT_EDGE


@inlined_kernel
def passes_over(i, triangle, t, distance, wave, boundary):
    """Whether the point at the distance t of ray i is over a triangle, to within a distance beside and above it."""
    p, d = wave.position[i], wave.direction[i]
    return is_over(p[0] + t * d[0], p[1] + t * d[1], p[2] + t * d[2], boundary.corners[triangle], distance)


@kernel
def is_over(x, y, z, corners, distance):
    """Whether a point is over a triangle, (3 corners, 3), to within a distance beside and above it."""
    ax, ay, az = corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2]
    bx, by, bz = corners[2, 0] - corners[0, 0], corners[2, 1] - corners[0, 1], corners[2, 2] - corners[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if not size > 0.0:
        return False
    nx, ny, nz = nx / size, ny / size, nz / size
    if abs((x - corners[0, 0]) * nx + (y - corners[0, 1]) * ny + (z - corners[0, 2]) * nz) > distance:
        return False
    for corner in range(3):
        start, end = corners[corner], corners[(corner + 1) % 3]
        ex, ey, ez = end[0] - start[0], end[1] - start[1], end[2] - start[2]
        qx, qy, qz = x - start[0], y - start[1], z - start[2]
        beside = (ey * qz - ez * qy) * nx + (ez * qx - ex * qz) * ny + (ex * qy - ey * qx) * nz
        if beside < -distance * math.sqrt(ex * ex + ey * ey + ez * ez):
            return False
    return True
