# SPDX-License-Identifier: LGPL-2.1-or-later
"""From an event to the next place: start rays for Embree, decide its hits in float64, arrive on a surface.

Embree works in float32 and only names a triangle of the bounding mesh; `raymaps.kernels.crossing` and `interface`
decide what is crossed where. Rays for which its hits can't be right are decided slowly, over all faces.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import inlined_kernel, kernel
from raymaps.kernels.crossing import NONE, STRAY, along, around, crossing, height_above, passes_over
from raymaps.kernels.interface import end_at, keep, settle
from raymaps.kinds import CONTACT, EventKind

__all__ = [
    "DOUBTFUL", "MAX_SHORT", "PENDING", "SEARCHING", "START_OFFSET",
    "arrive", "begin", "leave", "locate", "lose", "propose", "start",
]  # fmt: skip

#: In frame units; float32 keeps coordinates below 1 to 2^-25, and as many again for a triangle's corners.
START_OFFSET = 2.0**-21
#: Below this cosine a ray runs along a facet: it crosses its plane far from where it crosses the face.
STEEP_COSINE = 0.05

#: Segments in a row without a length after which a ray is taken to go in and out at one place; in the corner of a box
#: three are right.
MAX_SHORT = 8

#: States of a ray between two events, beside the kinds of events themselves: it arrives on a surface; its search goes
#: on; what Embree found does not agree with where the ray is.
PENDING, SEARCHING, DOUBTFUL = 255, 254, 253

_LEFT = int(EventKind.LEFT)
_NUMERICAL = int(EventKind.KILLED_NUMERICAL)


@kernel
def begin(rays, wave):
    """Forget what an earlier search has left; count segments without a length."""
    for k in range(len(rays)):
        i = rays[k]
        is_short = wave.triangle[i] >= 0 and wave.distance[i] <= CONTACT
        wave.n_short[i] = min(wave.n_short[i] + 1, MAX_SHORT) if is_short else 0
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
    wave, tables, boundary : see `raymaps.wave.Wave`, `raymaps.compile.Tables`, `raymaps.boundary.Boundary`
    advance : (n,) float64
        Distance already searched along each ray; moved to the start.
    origin, direction : (n, 3) float32, filled
    """
    for k in range(len(rays)):
        i = rays[k]
        triangle, shift = wave.triangle[i], 0.0
        if triangle >= 0:
            plane, side = tables.plane[triangle], wave.side[i]
            height = side * height_above(plane, wave.position[i])
            if height < START_OFFSET:
                steep = side * along(wave, i, plane)
                if height > -START_OFFSET:
                    shift = START_OFFSET * side
                elif steep > STEEP_COSINE:
                    ahead = START_OFFSET - height / steep
                    if _is_apart(i, triangle, ahead, wave, tables, boundary):
                        advance[k] = max(advance[k], ahead)
        elif advance[k] == 0.0:
            advance[k] = -2.0 * START_OFFSET
        for axis in range(3):
            moved = shift * tables.plane[triangle, axis] if shift != 0.0 else 0.0
            origin[k, axis] = wave.position[i, axis] + moved + advance[k] * wave.direction[i, axis]
            direction[k, axis] = wave.direction[i, axis]


@kernel
def locate(rays, wave, tables, boundary, advance, hits, ways, guesses, found, slowly):
    """Decide each hit in float64: sets the wave's state, hit triangle, normal, distance and end point.

    State `PENDING`: the ray arrives on a face; `LEFT`: it leaves the scene's box; `SEARCHING`: what was hit is no
    crossing, or one that changes nothing as another solid rules there, and the search goes on past it; `DOUBTFUL`: the
    hits do not agree with the solids that the ray is in; see `raymaps.slow_search`. Beside what was hit, triangles are
    asked that are near to it, or to the one that the ray stands on (``boundary.near``): their faces may be crossed
    first.

    Parameters
    ----------
    rays : (n,) int32, slots of the wave
    advance : (n,) float64
        Distance already searched; moved past what was hit.
    hits : (n, n_places) int32
        Triangles, -1 for none: what Embree found first, then what may be in contact with it; or what `propose` lists.
    ways : (n, n_places) int8
        Whether their faces are crossed outwards, 1, inwards, -1, or as their facets are, 0.
    guesses : (n, n_places) float64
        About where, as distances from the ray's position.
    found : see `raymaps.wave.Found`
    slowly : bool
        Whether the triangles are all that the ray may cross.

    Returns
    -------
    int: number of rays whose search goes on or is doubtful
    """
    unsettled = 0
    for k in range(len(rays)):
        i = rays[k]
        if not slowly and (
            wave.n_short[i] == MAX_SHORT or _is_at_edge(i, wave.triangle[i], 0.0, wave, tables, boundary)
        ):
            wave.state[i] = DOUBTFUL
            unsettled += 1
            continue
        count, first, first_stray = 0, np.inf, np.inf
        limit = np.inf  # what is near and crossed beyond it is for a later search
        n_found = hits.shape[1]
        n_near = 0 if slowly else _count_near(wave.triangle[i], boundary) + _count_near(hits[k, 0], boundary)
        for c in range(n_found + 2 * n_near):
            if c < n_found:
                hit, guess, way = hits[k, c], guesses[k, c], ways[k, c]
                if hit < 0:
                    continue
                if way == 0:
                    way = 1 if along(wave, i, tables.plane[hit]) > 0.0 else -1
            else:
                if c == n_found and hits[k, 0] >= 0:
                    limit = first if count > 0 else guesses[k, 0]
                hit = _near(wave.triangle[i], hits[k, 0], (c - n_found) // 2, boundary)
                guess, turn = _where_it_may_cross(i, hit, wave, tables, boundary)
                way = 1 if c % 2 == 0 else -1
                if math.isnan(guess) or turn * way < 0:
                    continue
            is_asked = slowly or c >= n_found  # and not met
            leeway = around(hit, boundary) if is_asked else 0.0
            verdict, t, nx, ny, nz, triangle = crossing(i, hit, way, guess, leeway, wave, tables, boundary)
            if verdict == NONE or t > limit + CONTACT:
                continue
            if is_asked and not passes_over(i, triangle, t, leeway, wave, boundary):
                continue
            if verdict == STRAY:
                first_stray = min(first_stray, t)
            elif count < found.t.shape[1]:
                keep(found, k, count, t, nx, ny, nz, triangle)
                count += 1
                first = min(first, t)
            else:  # there is no place for it
                first_stray = -np.inf
        if first_stray < first - CONTACT:
            wave.state[i] = DOUBTFUL
        elif settle(i, k, count, found, wave, tables, boundary):
            wave.state[i] = PENDING
        elif (slowly and count == 0) or hits[k, 0] < 0:  # nothing is ahead
            wave.state[i] = DOUBTFUL
            if _is_outside(wave, i, boundary):
                _leave(wave, i, tables)
        else:
            wave.state[i] = SEARCHING
            advance[k] = guesses[k, 0] + START_OFFSET
            if not slowly and _is_at_edge(i, hits[k, 0], guesses[k, 0], wave, tables, boundary):
                wave.state[i] = DOUBTFUL
        if wave.state[i] >= DOUBTFUL and wave.state[i] != PENDING:
            unsettled += 1
    return unsettled


@inlined_kernel
def _count_near(triangle, boundary):
    """How many triangles are so near to one that they are asked as well."""
    return boundary.near_start[triangle + 1] - boundary.near_start[triangle] if triangle >= 0 else 0


@inlined_kernel
def _near(standing, hit, k, boundary):
    """Triangle k of those near the one that a ray stands on, and then of those near the one that it has hit."""
    n = _count_near(standing, boundary)
    return (
        boundary.near[boundary.near_start[standing] + k] if k < n else boundary.near[boundary.near_start[hit] + k - n]
    )


@inlined_kernel
def _is_apart(i, triangle, distance, wave, tables, boundary):
    """Whether ray i, standing on a triangle, is further than twice a distance from all faces next to it."""
    if not boundary.sharp[triangle]:
        return False
    for place in range(boundary.neighbour.shape[1]):
        if boundary.bend[triangle, place] != 0:
            other = boundary.neighbour[triangle, place]
            height = height_above(tables.plane[other], wave.position[i])
            if abs(height) < 2.0 * (distance + around(other, boundary)):
                return False
    return True


@inlined_kernel
def _is_at_edge(i, triangle, t, wave, tables, boundary):
    """Whether the next start of ray i, from a triangle at the distance t, may be beyond another face next to it."""
    if triangle < 0 or boundary.inner[triangle]:
        return False
    for place in range(boundary.neighbour.shape[1]):
        if boundary.bend[triangle, place] != 0:
            plane = tables.plane[boundary.neighbour[triangle, place]]
            if abs(height_above(plane, wave.position[i]) + t * along(wave, i, plane)) < 2.0 * START_OFFSET:
                return True
    return False


@kernel
def propose(rays, wave, tables, boundary, hits, ways, guesses):
    """List all triangles whose faces the lines of rays may cross, those nearest where there are too many.

    Parameters
    ----------
    hits, ways, guesses : (n, n_places), filled, see `locate`
    """
    for k in range(len(rays)):
        i = rays[k]
        count = 0
        for place in range(hits.shape[1]):
            hits[k, place] = -1
        for triangle in range(len(boundary.corners)):
            guess, way = _where_it_may_cross(i, triangle, wave, tables, boundary)
            if math.isnan(guess):
                continue
            for turn in (-1, 1):
                if way * turn < 0:
                    continue
                place = count
                if count == hits.shape[1]:
                    place = _furthest(guesses[k])
                    if abs(guess) >= abs(guesses[k, place]):
                        continue
                else:
                    count += 1
                hits[k, place], ways[k, place], guesses[k, place] = triangle, turn, guess


@inlined_kernel
def _where_it_may_cross(i, triangle, wave, tables, boundary):
    """About where the line of ray i crosses a triangle's face, NaN if it does not, and which way, 0 for either."""
    corners, p, d = boundary.corners[triangle], wave.position[i], wave.direction[i]
    leeway = around(triangle, boundary)
    mx, my, mz = (
        (corners[0, 0] + corners[1, 0] + corners[2, 0]) / 3.0,
        (corners[0, 1] + corners[1, 1] + corners[2, 1]) / 3.0,
        (corners[0, 2] + corners[1, 2] + corners[2, 2]) / 3.0,
    )
    closest = (mx - p[0]) * d[0] + (my - p[1]) * d[1] + (mz - p[2]) * d[2]
    away2 = (p[0] + closest * d[0] - mx) ** 2 + (p[1] + closest * d[1] - my) ** 2 + (p[2] + closest * d[2] - mz) ** 2
    radius2 = 0.0
    for corner in range(3):
        x, y, z = corners[corner, 0] - mx, corners[corner, 1] - my, corners[corner, 2] - mz
        radius2 = max(radius2, x * x + y * y + z * z)
    if away2 > (math.sqrt(radius2) + leeway) ** 2:
        return np.nan, 0
    plane = tables.plane[triangle]
    steep = along(wave, i, plane)
    if not abs(steep) > STEEP_COSINE:
        return closest, 0
    t = -height_above(plane, p) / steep
    if not passes_over(i, triangle, t, 2.0 * leeway / abs(steep), wave, boundary):
        return np.nan, 0
    return t, 1 if steep > 0.0 else -1


@inlined_kernel
def _furthest(guesses):
    furthest = 0
    for place in range(len(guesses)):
        if abs(guesses[place]) > abs(guesses[furthest]):
            furthest = place
    return furthest


@kernel
def leave(rays, wave, tables, boundary):
    """Let rays leave the scene that are outside of all bodies; kill the others where they stand."""
    for k in range(len(rays)):
        if _is_outside(wave, rays[k], boundary):
            _leave(wave, rays[k], tables)
        else:
            _lose(wave, rays[k])


@kernel
def lose(rays, wave):
    """Kill rays where they stand."""
    for k in range(len(rays)):
        _lose(wave, rays[k])


@inlined_kernel
def _lose(wave, i):
    wave.state[i], wave.hit[i] = _NUMERICAL, wave.triangle[i]
    end_at(wave, i, 0.0)


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
    end_at(wave, i, distance)


@inlined_kernel
def _distance_to_box(p, d, box):
    """Distance along a direction to the inside of an axis-aligned box; 0 from outside."""
    distance = np.inf
    for axis in range(3):
        if d[axis] != 0.0:
            distance = min(distance, ((box[1, axis] if d[axis] > 0.0 else box[0, axis]) - p[axis]) / d[axis])
    return max(distance, 0.0)


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
        cosine = along(wave, i, wave.normal[i])
        wave.near_side[i] = 1 if cosine < 0.0 else -1
        wave.surface[i] = tables.face_surface[tables.triangle_face[wave.hit[i]]]
        met[tables.surface_kind[wave.surface[i]]] = True
        media[wave.beyond[i]] = True
        wave.n_near[i] = tables.medium_index[wave.medium[i]]
        wave.n_far[i] = tables.medium_index[wave.beyond[i]]
        if not math.isfinite(cosine):
            wave.state[i] = _NUMERICAL
