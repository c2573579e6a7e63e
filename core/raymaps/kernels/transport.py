# SPDX-License-Identifier: LGPL-2.1-or-later
"""From an event to the next place: start rays for Embree, decide its hits in float64, arrive on a surface.

Embree works in float32 and only names a triangle of the bounding mesh. Where the ray crosses the face that the triangle
belongs to is decided in float64, on the face's exact surface or the triangle's plane, by what the ray knows of itself:
the set of solids that it is in. A crossing that does not agree with it (into a solid that the ray is in already) is one
where the ray stands, or shows that a crossing was missed.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import inlined_kernel, kernel
from raymaps.kernels import exact
from raymaps.kernels.inside import is_in, medium_of, ruling, toggle
from raymaps.kinds import EventKind, ExactKind, SurfaceKind

__all__ = [
    "CONTACT",
    "DOUBTFUL",
    "MAX_PASSES",
    "PENDING",
    "SEARCHING",
    "START_OFFSET",
    "arrive",
    "begin",
    "locate",
    "recover",
    "start",
    "undo_passes",
]

#: In frame units; float32 keeps coordinates below 1 to 2^-25, and as many again for a triangle's corners.
START_OFFSET = 2.0**-21
#: Crossings closer than this along the normal are one interface, in frame units.
CONTACT = 2.0**-21
#: Below this cosine a ray is not moved along itself to the right side of its facet, but along the facet's normal.
STEEP_COSINE = 0.05
#: How far from its face a triangle may be hit, in frame units: facets may overlap by a few steps of float32.
AT_EDGE = 2.0**-19
#: Crossings further apart are never one interface, in frame units.
WIDEST_INTERFACE = 2.0**-6
#: Cosine between normals of facets that run alongside each other.
ALONGSIDE = 0.94
#: By how much of its size a point of an entry may lie beyond a neighbouring face.
ROUNDING = 2.0**-40
#: Silent passes into and out of overlapped solids that are kept for each ray, should it be scattered before them.
MAX_PASSES = 4

#: States of a ray between two events, beside the kinds of events themselves: it arrives on a surface; its search goes
#: on; what Embree found does not agree with where the ray is.
PENDING, SEARCHING, DOUBTFUL = 255, 254, 253

#: What a triangle means to a ray: no crossing, or one where it stands; a crossing; one that does not agree.
_NONE, _CROSSED, _STRAY = 0, 1, 2

_LEFT = int(EventKind.LEFT)
_NUMERICAL = int(EventKind.KILLED_NUMERICAL)
_FRESNEL = int(SurfaceKind.FRESNEL)
_PATCHES = int(ExactKind.PATCHES)


@kernel
def begin(rays, wave):
    """Forget what an earlier search has left."""
    for k in range(len(rays)):
        i = rays[k]
        wave.passed[i] = 0.0
        wave.n_passes[i] = 0


@kernel
def start(rays, wave, tables, boundary, advance, origin, direction):
    """Fill Embree's float32 origins and directions.

    A ray that stands on a triangle starts on its own side of it: where the exact surface lies on the other side of the
    facet, past the facet along the ray, unless another face is next to it. One that stands nowhere starts a little
    early.

    Parameters
    ----------
    rays : (n,) int32, slots of the wave
    wave, tables : see `raymaps.trace.Wave`, `raymaps.compile.Tables`
    advance : (n,) float64
        Distance already searched along each ray; moved to the start.
    origin, direction : (n, 3) float32, filled
    """
    for k in range(len(rays)):
        i = rays[k]
        triangle, shift = wave.triangle[i], 0.0
        if triangle >= 0:
            plane, side = tables.plane[triangle], wave.side[i]
            height = side * _height_above(plane, wave.position[i])
            if height < START_OFFSET:
                bend = boundary.bend[triangle]
                steep = side * _along(wave, i, plane)
                if height > -START_OFFSET:
                    shift = START_OFFSET * side
                elif steep > STEEP_COSINE and bend[0] == 0 and bend[1] == 0 and bend[2] == 0:
                    advance[k] = max(advance[k], -height / steep + START_OFFSET)
        elif advance[k] == 0.0:
            advance[k] = -2.0 * START_OFFSET
        for axis in range(3):
            moved = shift * tables.plane[triangle, axis] if shift != 0.0 else 0.0
            origin[k, axis] = wave.position[i, axis] + moved + advance[k] * wave.direction[i, axis]
            direction[k, axis] = wave.direction[i, axis]


@inlined_kernel
def _height_above(plane, point):
    """Distance of a point from a triangle's plane, negative behind it."""
    return plane[0] * point[0] + plane[1] * point[1] + plane[2] * point[2] - plane[3]


@inlined_kernel
def _along(wave, i, normal):
    """Cosine between the way of ray i and a normal."""
    return wave.direction[i, 0] * normal[0] + wave.direction[i, 1] * normal[1] + wave.direction[i, 2] * normal[2]


@kernel
def locate(rays, wave, tables, boundary, advance, hits, guesses, found):
    """Decide each hit in float64: sets the wave's state, hit triangle, normal, distance and end point.

    State `PENDING`: the ray arrives on a face; `LEFT`: it leaves the scene's box; `SEARCHING`: what was hit is no
    crossing, or one that changes nothing as another solid rules there, and the search goes on past it; `DOUBTFUL`: the
    hits do not agree with the solids that the ray is in.

    Parameters
    ----------
    rays : (n,) int32, slots of the wave
    boundary : see `raymaps.boundary.Boundary`
    advance : (n,) float64
        Distance already searched; moved past what was hit.
    hits : (n, n_searches) int32
        Triangles that Embree found, -1 for none: first of all, then of those that may be in contact with it.
    guesses : (n, n_searches) float64
        Embree's distances of them from the ray's position.
    found : `Found` with n_searches places a ray

    Returns
    -------
    int: number of rays whose search goes on or is doubtful
    """
    unsettled = 0
    for k in range(len(rays)):
        i = rays[k]
        if hits[k, 0] < 0:
            if _is_outside(wave, i, boundary):
                _leave(wave, i, tables)
            else:
                wave.state[i] = DOUBTFUL
                unsettled += 1
            continue
        count, is_stray = 0, False
        for c in range(hits.shape[1]):
            if hits[k, c] >= 0:
                way = 1.0 if _along(wave, i, tables.plane[hits[k, c]]) > 0.0 else -1.0
                verdict, t, nx, ny, nz, triangle = _crossing(
                    i, hits[k, c], way, guesses[k, c], 0.0, wave, tables, boundary
                )
                if verdict == _CROSSED:
                    _keep(found, k, count, t, nx, ny, nz, triangle)
                    count += 1
                elif verdict == _STRAY and c == 0:
                    is_stray = True
        if is_stray and count == 0:
            wave.state[i] = DOUBTFUL
        else:
            wave.state[i] = _settle(i, k, count, found, wave, tables, boundary)
            advance[k] = guesses[k, 0] + START_OFFSET
        if wave.state[i] != PENDING:
            unsettled += 1
    return unsettled


@kernel
def recover(rays, wave, tables, boundary, found):
    """Decide doubtful rays slowly: in float64, over all faces; a ray that stays in doubt is killed where it stands.

    That are those few that cross a body where its bounding mesh does not: next to edges that float32 can't tell from
    the ray's start, or between an exact surface and its facets.
    """
    for k in range(len(rays)):
        i = rays[k]
        wave.state[i] = SEARCHING
        first_stray = np.inf
        for _ in range(2 * MAX_PASSES):
            count, first, first_stray = 0, np.inf, np.inf
            for other in range(len(boundary.corners)):
                around = 2.0 * boundary.reach[other] + AT_EDGE
                guess = _distance_where_closest(wave, i, boundary.corners[other], around)
                if math.isnan(guess):
                    continue
                steep = _along(wave, i, tables.plane[other])
                if abs(steep) > STEEP_COSINE:  # it crosses the facet's plane near the exact surface, and one way only
                    guess = -_height_above(tables.plane[other], wave.position[i]) / steep
                    if not _is_over(wave, i, guess, boundary.corners[other], 2.0 * around / abs(steep)):
                        continue
                for turn in range(2):
                    way = 1.0 - 2.0 * turn
                    if way * steep < -STEEP_COSINE:
                        continue
                    verdict, t, nx, ny, nz, triangle = _crossing(i, other, way, guess, around, wave, tables, boundary)
                    if verdict == _NONE or not _is_over(wave, i, t, boundary.corners[triangle], around):
                        continue
                    if verdict == _STRAY:
                        first_stray = min(first_stray, t)
                        continue
                    if t < first - WIDEST_INTERFACE:
                        count = 0  # what was found before lies behind
                    if t < first + WIDEST_INTERFACE and count < found.t.shape[1]:
                        _keep(found, k, count, t, nx, ny, nz, triangle)
                        count += 1
                        first = min(first, t)
            if count == 0 or first_stray < first - CONTACT:
                break
            wave.state[i] = _settle(i, k, count, found, wave, tables, boundary)
            if wave.state[i] == PENDING:
                break
        if wave.state[i] != PENDING:
            if math.isinf(first_stray) and _is_outside(wave, i, boundary):
                _leave(wave, i, tables)
            else:
                wave.state[i] = _NUMERICAL
                wave.hit[i] = wave.triangle[i]
                wave.distance[i] = 0.0
                for axis in range(3):
                    wave.end[i, axis] = wave.position[i, axis]


@inlined_kernel
def _distance_where_closest(wave, i, corners, around):
    """Distance at which the line of ray i is closest to a triangle's middle; NaN if it does not come near it."""
    middle_away, radius2 = 0.0, 0.0
    distance = 0.0
    for axis in range(3):
        middle = (corners[0, axis] + corners[1, axis] + corners[2, axis]) / 3.0 - wave.position[i, axis]
        distance += middle * wave.direction[i, axis]
    for axis in range(3):
        middle = (corners[0, axis] + corners[1, axis] + corners[2, axis]) / 3.0 - wave.position[i, axis]
        middle_away += (middle - distance * wave.direction[i, axis]) ** 2
    for corner in range(3):
        away2 = 0.0
        for axis in range(3):
            middle = (corners[0, axis] + corners[1, axis] + corners[2, axis]) / 3.0
            away2 += (corners[corner, axis] - middle) ** 2
        radius2 = max(radius2, away2)
    return distance if middle_away <= (math.sqrt(radius2) + around) ** 2 else np.nan


@inlined_kernel
def _is_over(wave, i, t, corners, around):
    """Whether the point at distance t of ray i is over a triangle, within a distance of it."""
    ax, ay, az = corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2]
    bx, by, bz = corners[2, 0] - corners[0, 0], corners[2, 1] - corners[0, 1], corners[2, 2] - corners[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if not size > 0.0:
        return False
    nx, ny, nz = nx / size, ny / size, nz / size
    x, y, z = (
        wave.position[i, 0] + t * wave.direction[i, 0],
        wave.position[i, 1] + t * wave.direction[i, 1],
        wave.position[i, 2] + t * wave.direction[i, 2],
    )
    px, py, pz = x - corners[0, 0], y - corners[0, 1], z - corners[0, 2]
    if abs(px * nx + py * ny + pz * nz) > around:
        return False
    for corner in range(3):
        start, end = corners[corner], corners[(corner + 1) % 3]
        ex, ey, ez = end[0] - start[0], end[1] - start[1], end[2] - start[2]
        qx, qy, qz = x - start[0], y - start[1], z - start[2]
        beside = (ey * qz - ez * qy) * nx + (ez * qx - ex * qz) * ny + (ex * qy - ey * qx) * nz
        if beside < -around * math.sqrt(ex * ex + ey * ey + ez * ez):
            return False
    return True


@inlined_kernel
def _keep(found, k, place, t, nx, ny, nz, triangle):
    found.t[k, place], found.triangle[k, place] = t, triangle
    found.normal[k, place, 0], found.normal[k, place, 1], found.normal[k, place, 2] = nx, ny, nz


@inlined_kernel
def _is_outside(wave, i, boundary):
    """Whether ray i is in those solids only that reach to infinity."""
    differing = np.uint64(0)
    for word in range(len(boundary.far)):
        differing |= wave.inside[i, word] ^ boundary.far[word]
    return differing == np.uint64(0)


@inlined_kernel
def _leave(wave, i, tables):
    distance = _distance_to_box(wave.position[i], wave.direction[i], tables.box)
    wave.state[i], wave.hit[i] = _LEFT, -1
    _end_at(wave, i, distance)


@inlined_kernel
def _end_at(wave, i, distance):
    wave.distance[i] = distance
    for axis in range(3):
        wave.end[i, axis] = wave.position[i, axis] + distance * wave.direction[i, axis]


@inlined_kernel
def _distance_to_box(p, d, box):
    """Distance along a direction to the inside of an axis-aligned box; 0 from outside."""
    distance = np.inf
    for axis in range(3):
        if d[axis] != 0.0:
            distance = min(distance, ((box[1, axis] if d[axis] > 0.0 else box[0, axis]) - p[axis]) / d[axis])
    return max(distance, 0.0)


@inlined_kernel
def _crossing(i, triangle, way, guess, leeway, wave, tables, boundary):
    """What crossing the face of a triangle of the bounding mesh outwards (``way`` 1) or inwards (-1) means to ray i.

    A crossing that agrees with where the ray is may lie behind it by rounding, or by a ``leeway``.

    Returns
    -------
    verdict, distance, outward normal (3 floats), triangle of the face that is crossed
    """
    solid = boundary.solid[tables.triangle_face[triangle]]
    agrees = solid < 0 or is_in(wave.inside[i], solid) == (way > 0.0)
    t, nx, ny, nz, crossed = _trimmed(i, triangle, guess, way, agrees, leeway, wave, tables, boundary)
    if not math.isfinite(t):
        return _NONE, t, nx, ny, nz, crossed
    height = (t - wave.passed[i]) * abs(
        nx * wave.direction[i, 0] + ny * wave.direction[i, 1] + nz * wave.direction[i, 2]
    )
    near = CONTACT + boundary.slack[crossed]
    if solid < 0:
        return (_CROSSED if t > wave.passed[i] else _NONE), t, nx, ny, nz, crossed
    if agrees:
        return (_CROSSED if height >= -near - leeway else _NONE), max(t, wave.passed[i]), nx, ny, nz, crossed
    return (_STRAY if height > near else _NONE), t, nx, ny, nz, crossed


@inlined_kernel
def _trimmed(i, triangle, guess, way, agrees, leeway, wave, tables, boundary):
    """Crossing of ray i with the face of a triangle, or with the face beyond the edge where that one comes first.

    Along a convex edge a body is what lies behind both faces' surfaces, along a concave one what lies behind either.
    Near an edge the bounding mesh may name the wrong one of them; NaN where the ray passes by the edge.
    """
    t, nx, ny, nz = _with_face(i, triangle, guess, way, wave, tables, boundary)
    crossed = triangle
    for edge in range(3):
        other, bend = boundary.neighbour[triangle, edge], boundary.bend[triangle, edge]
        if other < 0 or bend == 0:
            continue
        off_facets = AT_EDGE + leeway + 2.0 * (boundary.reach[triangle] + boundary.reach[other])
        is_missed = not math.isfinite(t)
        beyond = 0.0
        if not is_missed:
            near_edge = off_facets + abs(t - guess)  # so far it may be from the triangle that was hit
            if leeway == 0.0 and _is_clear(i, other, t, 2.0 * near_edge, wave, tables, boundary):
                continue
            beyond = bend * _height(i, other, t, wave, tables, boundary)
            if not 0.0 < beyond <= near_edge:
                continue
        s, sx, sy, sz = _with_face(i, other, guess if is_missed else t, way, wave, tables, boundary)
        if math.isfinite(s):
            past = bend * _height(i, triangle, s, wave, tables, boundary)
            steep = abs(sx * wave.direction[i, 0] + sy * wave.direction[i, 1] + sz * wave.direction[i, 2])
            is_far = past < -off_facets if is_missed else abs(s - t) * steep > off_facets + 2.0 * beyond
            if is_far or ((is_missed or not agrees or bend * way < 0.0) and past > ROUNDING):
                s = np.nan
        if math.isfinite(s) or not agrees or bend * way < 0.0:
            t, nx, ny, nz, crossed = s, sx, sy, sz, other
    return t, nx, ny, nz, crossed


@inlined_kernel
def _is_clear(i, triangle, t, distance, wave, tables, boundary):
    """Whether the point at distance t of ray i is further from a triangle's plane than a distance.

    Asked of B-splines only: heights over them take time, above all far from them.
    """
    surface = boundary.exact.face[tables.triangle_face[triangle]]
    if surface < 0 or boundary.exact.kind[surface] != _PATCHES:
        return False
    plane = tables.plane[triangle]
    return abs(_height_above(plane, wave.position[i]) + t * _along(wave, i, plane)) > distance


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
    along = _along(wave, i, plane)
    t = -_height_above(plane, p) / along if along * way > 0.0 and triangle != standing else np.nan
    return t, plane[0], plane[1], plane[2]


@inlined_kernel
def _height(i, triangle, t, wave, tables, boundary):
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
def _settle(i, k, count, found, wave, tables, boundary):
    """Let ray i arrive at the first of the crossings found at which something changes.

    Crossings closer than a contact are one interface, between the medium before all of them and that behind all.

    Returns
    -------
    `PENDING`, or `SEARCHING` if no crossing is left
    """
    _sort(k, count, found)
    first = 0
    while first < count:
        end = first + 1
        while end < count and _is_member(i, k, end, first, found, wave, boundary):
            end += 1
        before = ruling(wave.inside[i], boundary.has_medium)
        for word in range(wave.across.shape[1]):
            wave.across[i, word] = 0
        for c in range(first, end):
            solid = boundary.solid[tables.triangle_face[found.triangle[k, c]]]
            outwards = _along(wave, i, found.normal[k, c]) > 0.0
            if solid >= 0 and is_in(wave.inside[i], solid) == outwards:
                toggle(wave.inside[i], solid)
                toggle(wave.across[i], solid)
        after = ruling(wave.inside[i], boundary.has_medium)
        chosen, best = -1, 1 << 30
        for c in range(first, end):
            rank = _precedence(found.triangle[k, c], before, after, tables, boundary)
            if 0 <= rank < best:
                chosen, best = c, rank
        if chosen >= 0:
            toggle_all(wave.inside[i], wave.across[i])  # it is not through yet
            wave.hit[i] = found.triangle[k, chosen]
            for axis in range(3):
                wave.normal[i, axis] = found.normal[k, chosen, axis]
            wave.beyond[i] = medium_of(after, boundary.solid_medium, tables.ambient)
            _end_at(wave, i, found.t[k, first])
            return PENDING
        wave.passed[i] = found.t[k, first]
        for c in range(first, end):
            solid = boundary.solid[tables.triangle_face[found.triangle[k, c]]]
            if is_in(wave.across[i], solid):
                toggle(wave.across[i], solid)
                _note_pass(wave, i, found.t[k, first], solid)
        first = end
    return SEARCHING


@inlined_kernel
def _sort(k, count, found):
    """Put the crossings of a ray in the order of their distances."""
    for last in range(1, count):
        for c in range(last, 0, -1):
            if found.t[k, c - 1] <= found.t[k, c]:
                break
            found.t[k, c - 1], found.t[k, c] = found.t[k, c], found.t[k, c - 1]
            found.triangle[k, c - 1], found.triangle[k, c] = found.triangle[k, c], found.triangle[k, c - 1]
            for axis in range(3):
                found.normal[k, c - 1, axis], found.normal[k, c, axis] = (
                    found.normal[k, c, axis],
                    found.normal[k, c - 1, axis],
                )


@inlined_kernel
def _is_member(i, k, c, first, found, wave, boundary):
    """Whether a crossing belongs to the interface of the first one.

    Facets of faces that run alongside may be as far apart as they are off the surfaces that they stand for.
    """
    normal, other = found.normal[k, first], found.normal[k, c]
    apart = (found.t[k, c] - found.t[k, first]) * abs(_along(wave, i, other))
    if apart <= CONTACT:
        return True
    parallel = abs(normal[0] * other[0] + normal[1] * other[1] + normal[2] * other[2])
    slack = boundary.slack[found.triangle[k, first]] + boundary.slack[found.triangle[k, c]]
    return parallel > ALONGSIDE and apart <= CONTACT + slack


@inlined_kernel
def _precedence(triangle, before, after, tables, boundary):
    """Which face of an interface acts: the least number, -1 for one that does not.

    First a surface that is no boundary of a medium, then one that is more than a smooth boundary, then the face of the
    solid of the higher priority. A solid that rules on neither side has no face here.
    """
    face = tables.triangle_face[triangle]
    solid = boundary.solid[face]
    if solid < 0 or boundary.solid_medium[solid] < 0:
        return 0
    if before == after or solid not in (before, after):
        return -1
    plain = tables.surface_kind[tables.face_surface[face]] == _FRESNEL
    return 1 + solid + (1 << 24) * plain


@inlined_kernel
def toggle_all(inside, across):
    """Enter the solids of a set that a ray is not in, leave those that it is in."""
    for word in range(len(inside)):
        inside[word] ^= across[word]


@inlined_kernel
def _note_pass(wave, i, t, solid):
    if wave.n_passes[i] < MAX_PASSES:
        wave.pass_t[i, wave.n_passes[i]] = t
        wave.pass_solid[i, wave.n_passes[i]] = solid
        wave.n_passes[i] += 1


@inlined_kernel
def undo_passes(wave, i, distance):
    """Take back what ray i passed beyond a distance, where it is scattered before it gets there."""
    for k in range(wave.n_passes[i]):
        if wave.pass_t[i, k] > distance:
            toggle(wave.inside[i], wave.pass_solid[i, k])


@kernel
def arrive(rays, wave, tables, met, media):
    """Tell each pending ray which surface property it meets, from which side, and the indices before and beyond.

    Parameters
    ----------
    met : (256,) bool, set for each `SurfaceKind` that a ray meets
    media : (n_media,) bool, set for each medium that lies beyond a surface that a ray meets
    """
    for k in range(len(rays)):
        i = rays[k]
        if wave.state[i] != PENDING:
            continue
        cosine = _along(wave, i, wave.normal[i])
        wave.near_side[i] = 1 if cosine < 0.0 else -1
        wave.surface[i] = tables.face_surface[tables.triangle_face[wave.hit[i]]]
        met[tables.surface_kind[wave.surface[i]]] = True
        media[wave.beyond[i]] = True
        wave.n_near[i] = tables.medium_index[wave.medium[i]]
        wave.n_far[i] = tables.medium_index[wave.beyond[i]]
        if not math.isfinite(cosine):
            wave.state[i] = _NUMERICAL
