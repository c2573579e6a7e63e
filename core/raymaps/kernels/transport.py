# SPDX-License-Identifier: LGPL-2.1-or-later
"""From an event to the next place: start rays for Embree, locate its hits in float64, arrive on a surface.

Embree works in float32 and only names the triangle. A ray starts `START_OFFSET` off the triangle that it stands on,
along the normal, a few steps of float32 in frame units; its hit point is computed in float64 from the exact start
and the triangle's plane.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import kernel
from raymaps.kinds import EventKind

__all__ = ["PENDING", "REJECTED", "START_OFFSET", "arrive", "close_to", "height_above", "locate", "start"]

#: In frame units; float32 keeps coordinates below 1 to 2^-25, and as many again for a triangle's corners.
START_OFFSET = 2.0**-21
#: Below this cosine the plane says less about the hit's distance than Embree does.
GRAZING_COSINE = 1e-5

#: States of a ray between two events, beside the kinds of events themselves.
PENDING, REJECTED = 255, 254

_LEFT = int(EventKind.LEFT)
_NUMERICAL = int(EventKind.KILLED_NUMERICAL)
_MISMATCH = int(EventKind.KILLED_MEDIUM_MISMATCH)


@kernel
def close_to(triangle):
    """Code in `Wave.triangle` of a ray that stands on no triangle, but next to one; its own inverse; -1 stays -1."""
    return -2 - triangle


@kernel
def height_above(plane, point):
    """Distance of a point from a triangle's plane, negative behind it."""
    return plane[0] * point[0] + plane[1] * point[1] + plane[2] * point[2] - plane[3]


@kernel
def start(rays, wave, tables, advance, origin, direction):
    """Fill Embree's float32 origins and directions.

    Parameters
    ----------
    rays : (n,) int32, slots of the wave
    wave, tables : see `raymaps.trace.Wave`, `raymaps.compile.Tables`
    advance : (n,) float64
        Distance already searched along each ray.
    origin, direction : (n, 3) float32, filled
    """
    for k in range(len(rays)):
        i = rays[k]
        triangle, offset = wave.triangle[i], 0.0
        if triangle >= 0:
            offset = START_OFFSET * wave.side[i]
        elif triangle < -1:  # scattered next to a triangle, which rounding to float32 must not carry it through
            triangle = close_to(triangle)
            height = height_above(tables.plane[triangle], wave.position[i])
            offset = math.copysign(max(START_OFFSET - abs(height), 0.0), height)
        for axis in range(3):
            shift = 0.0 if triangle < 0 else offset * tables.plane[triangle, axis]
            origin[k, axis] = wave.position[i, axis] + shift + advance[k] * wave.direction[i, axis]
            direction[k, axis] = wave.direction[i, axis]


@kernel
def locate(rays, wave, tables, advance, hit_triangle, hit_distance):
    """Decide each hit in float64: sets the wave's state, hit triangle, distance and end point.

    State `PENDING`: the ray arrives on a triangle; `LEFT`: it leaves the scene's box (from the ambient medium: one that
    leaves from inside a body slipped out by an edge and is killed); `REJECTED`: the hit lies where
    the ray stands or behind it, and the search must go on past it.

    Parameters
    ----------
    rays : (n,) int32, slots of the wave
    advance : (n,) float64
        Distance already searched; moved past rejected hits.
    hit_triangle : (n,) int32, -1 where Embree found none
    hit_distance : (n,) float32, from Embree's origin

    Returns
    -------
    int: number of rejected hits
    """
    rejected = 0
    for k in range(len(rays)):
        i = rays[k]
        triangle = hit_triangle[k]
        px, py, pz = wave.position[i, 0], wave.position[i, 1], wave.position[i, 2]
        dx, dy, dz = wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2]
        if triangle < 0:
            distance = _distance_to_box(px, py, pz, dx, dy, dz, tables.box)
            wave.state[i] = _LEFT if wave.medium[i] == tables.ambient[0] else _MISMATCH
        else:
            nx, ny, nz = tables.plane[triangle, 0], tables.plane[triangle, 1], tables.plane[triangle, 2]
            cosine = dx * nx + dy * ny + dz * nz
            if abs(cosine) > GRAZING_COSINE:
                distance = (tables.plane[triangle, 3] - (px * nx + py * ny + pz * nz)) / cosine
            else:
                distance = advance[k] + hit_distance[k]
            if triangle == wave.triangle[i] or distance <= 0.0:
                wave.state[i] = REJECTED
                advance[k] += hit_distance[k] + START_OFFSET
                rejected += 1
                continue
            wave.state[i] = PENDING
        if not math.isfinite(distance):
            wave.state[i] = _NUMERICAL
            distance = 0.0
        wave.hit[i] = triangle
        wave.distance[i] = distance
        wave.end[i, 0] = px + distance * dx
        wave.end[i, 1] = py + distance * dy
        wave.end[i, 2] = pz + distance * dz
    return rejected


@kernel
def _distance_to_box(px, py, pz, dx, dy, dz, box):
    """Distance along a direction to the inside of an axis-aligned box; 0 from outside."""
    distance = np.inf
    if dx != 0.0:
        distance = min(distance, ((box[1, 0] if dx > 0.0 else box[0, 0]) - px) / dx)
    if dy != 0.0:
        distance = min(distance, ((box[1, 1] if dy > 0.0 else box[0, 1]) - py) / dy)
    if dz != 0.0:
        distance = min(distance, ((box[1, 2] if dz > 0.0 else box[0, 2]) - pz) / dz)
    return max(distance, 0.0)


@kernel
def arrive(rays, wave, tables, met, media):
    """Tell each pending ray which surface property it meets, from which side, and the media before and beyond.

    A ray that comes from another medium than the surface's near side has was lost among overlapping or touching bodies.

    Parameters
    ----------
    met : (256,) bool, set for each `SurfaceKind` that a ray meets
    media : (n_media,) bool, set for each medium that lies beyond a surface that a ray meets
    """
    for k in range(len(rays)):
        i = rays[k]
        if wave.state[i] != PENDING:
            continue
        triangle = wave.hit[i]
        face = tables.triangle_face[triangle]
        cosine = 0.0
        for axis in range(3):
            cosine += wave.direction[i, axis] * tables.plane[triangle, axis]
        from_front = cosine < 0.0
        near = tables.face_outside[face] if from_front else tables.face_inside[face]
        beyond = tables.face_inside[face] if from_front else tables.face_outside[face]
        wave.near_side[i] = 1 if from_front else -1
        wave.beyond[i] = wave.medium[i] if beyond < 0 else beyond
        wave.surface[i] = tables.face_surface[face]
        met[tables.surface_kind[wave.surface[i]]] = True
        media[wave.beyond[i]] = True
        wave.n_near[i] = tables.medium_index[wave.medium[i]]
        wave.n_far[i] = tables.medium_index[wave.beyond[i]]
        if near >= 0 and near != wave.medium[i]:
            wave.state[i] = _MISMATCH
        elif not math.isfinite(cosine):
            wave.state[i] = _NUMERICAL
