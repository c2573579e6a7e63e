# SPDX-License-Identifier: LGPL-2.1-or-later
"""Facets that stand for a smooth surface: normals interpolated between corners, and rays kept on their side."""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kernels.transport import PENDING

__all__ = ["keep_on_side", "turn_normals"]


@kernel
def turn_normals(active, wave, tables, smooth):
    """Replace the normals at which rays arrive by those interpolated between the corners of their facets.

    A normal that would send the mirror image of a ray into the facet is turned towards the facet's own until it does
    not.

    Parameters
    ----------
    smooth : see `raymaps.boundary.SmoothFacets`
    """
    for k in range(len(active)):
        i = active[k]
        if wave.state[i] != PENDING or smooth.row[wave.hit[i]] < 0:
            continue
        row, plane = smooth.row[wave.hit[i]], tables.plane[wave.hit[i]]
        u, v, w = _weights(wave.end[i], smooth.corners[row])
        normals = smooth.normals[row]
        x, y, z = (
            u * normals[0, 0] + v * normals[1, 0] + w * normals[2, 0],
            u * normals[0, 1] + v * normals[1, 1] + w * normals[2, 1],
            u * normals[0, 2] + v * normals[1, 2] + w * normals[2, 2],
        )
        length = math.sqrt(x * x + y * y + z * z)
        if not length > 0.0:
            continue
        x, y, z = x / length, y / length, z / length
        d = wave.direction[i]
        along = d[0] * plane[0] + d[1] * plane[1] + d[2] * plane[2]
        share = 1.0
        for _ in range(8):
            nx, ny, nz = (
                share * x + (1.0 - share) * plane[0],
                share * y + (1.0 - share) * plane[1],
                share * z + (1.0 - share) * plane[2],
            )
            length = math.sqrt(nx * nx + ny * ny + nz * nz)
            nx, ny, nz = nx / length, ny / length, nz / length
            turned = d[0] * nx + d[1] * ny + d[2] * nz
            mirrored = along - 2.0 * turned * (nx * plane[0] + ny * plane[1] + nz * plane[2])
            if turned * along > 0.0 and mirrored * along < 0.0:
                wave.normal[i, 0], wave.normal[i, 1], wave.normal[i, 2] = nx, ny, nz
                break
            share *= 0.5


@kernel
def _weights(point, corners):
    """Barycentric coordinates of a point of a triangle."""
    e, f, g = corners[1], corners[2], corners[0]
    ax, ay, az = e[0] - g[0], e[1] - g[1], e[2] - g[2]
    bx, by, bz = f[0] - g[0], f[1] - g[1], f[2] - g[2]
    px, py, pz = point[0] - g[0], point[1] - g[1], point[2] - g[2]
    aa, ab, bb = ax * ax + ay * ay + az * az, ax * bx + ay * by + az * bz, bx * bx + by * by + bz * bz
    pa, pb = px * ax + py * ay + pz * az, px * bx + py * by + pz * bz
    scale = aa * bb - ab * ab
    v, w = (bb * pa - ab * pb) / scale, (aa * pb - ab * pa) / scale
    v = min(max(v, 0.0), 1.0)
    w = min(max(w, 0.0), 1.0 - v)
    return 1.0 - v - w, v, w


@kernel
def keep_on_side(active, wave, tables, smooth, is_end):
    """Mirror at the facet the rays that a smooth normal has sent to the other side of it."""
    for k in range(len(active)):
        i = active[k]
        if wave.hit[i] < 0 or smooth.row[wave.hit[i]] < 0 or is_end[wave.state[i]]:
            continue
        plane = tables.plane[wave.hit[i]]
        along = wave.direction[i, 0] * plane[0] + wave.direction[i, 1] * plane[1] + wave.direction[i, 2] * plane[2]
        if along * wave.side[i] < 0.0:
            for axis in range(3):
                wave.direction[i, axis] -= 2.0 * along * plane[axis]
