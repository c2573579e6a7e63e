# SPDX-License-Identifier: LGPL-2.1-or-later
"""Last resort: what a ray crosses, told by the solids that are around the clear places of its line.

Within a rounding of an edge or a corner no test of single triangles tells for sure what is crossed first, or at all.
But between two crossings far enough from each other there is a place that is clearly inside or outside of each solid
(Tilove's classification of points, IEEE Trans. Computers C-29, 1980): where that is not as the ray has it, what lies in
between was crossed.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import inlined_kernel, kernel
from raymaps.kernels.crossing import (
    AT_EDGE,
    ROUNDING,
    along,
    height_over_face,
    is_over,
    normal_at,
    over_face,
    passes_over,
)
from raymaps.kernels.inside import is_in
from raymaps.kernels.interface import keep, settle, sort

__all__ = ["CLEAR", "classify", "gather", "mark_clear"]

#: Crossings further apart along a ray have a clear place between them, in frame units.
CLEAR = 2.0 * AT_EDGE
#: So far behind a ray there may be one that it should have met, in frame units.
BEHIND = 64.0 * AT_EDGE
#: Crossings at a lower cosine are not looked for any further off.
FLATTEST = 2.0**-8


@kernel
def gather(rays, wave, tables, boundary, hits, ways, guesses, found, count, clear):
    """List the crossings of lines of rays with faces, whatever the solids are, and clear places between them.

    Parameters
    ----------
    hits, ways, guesses : (n, n_places)
        As `raymaps.kernels.transport.propose` lists them.
    found : `raymaps.wave.Found`, (n, n_places) filled, in the order of distances
    count : (n,) int64, filled
    clear : (n, n_places + 1) float64, filled
        Distance of a clear place before each crossing, last behind all of them; NaN where there is none, or none known.
    """
    for k in range(len(rays)):
        i = rays[k]
        n = 0
        for place in range(hits.shape[1]):
            triangle = hits[k, place]
            if triangle < 0:
                continue
            here = wave.passed[i]
            t, nx, ny, nz, triangle = over_face(i, triangle, guesses[k, place], ways[k, place], wave, tables, boundary)
            if not math.isfinite(t) and abs(height_over_face(i, triangle, here, wave, tables, boundary)) <= ROUNDING:
                t = here  # it stands on the surface, or touches it there
                nx, ny, nz = normal_at(i, triangle, here, wave, tables, boundary)
            steep = abs(along(wave, i, (nx, ny, nz)))  # the less, the further off along the ray
            leeway = 2.0 * boundary.reach[triangle] + AT_EDGE / max(steep, FLATTEST)
            if t > here - BEHIND and passes_over(i, triangle, t, leeway, wave, boundary):
                keep(found, k, n, max(t, here), nx, ny, nz, triangle)
                n += 1
        count[k] = n
        sort(k, n, found)
        before = wave.passed[i]
        for c in range(n):
            clear[k, c] = 0.5 * (before + found.t[k, c]) if found.t[k, c] > before + CLEAR else np.nan
            before = found.t[k, c]
        is_listed = hits[k, hits.shape[1] - 1] < 0  # all that may be crossed
        clear[k, n] = before + 0.5 if is_listed else np.nan


@kernel
def mark_clear(points, corners, reach, clear):
    """Tell which points are not so near to triangles that an exact surface may lie between.

    Parameters
    ----------
    points : (n, 3) float64
    corners : (m, 3 corners, 3) float64
    reach : (m,) float64
        How far the exact surface may lie from each triangle.
    clear : (n,) bool, filled
    """
    for k in range(len(points)):
        clear[k] = True
        for triangle in range(len(corners)):
            x, y, z = points[k, 0], points[k, 1], points[k, 2]
            if reach[triangle] > 0.0 and is_over(x, y, z, corners[triangle], 2.0 * reach[triangle] + AT_EDGE):
                clear[k] = False
                break


@kernel
def classify(rays, wave, tables, boundary, found, count, clear, inside, known, chosen, verdict):
    """Let each ray arrive where the solids around it, or a surface that is none's, call for it.

    Parameters
    ----------
    found, count, clear : as `gather` fills them
    inside, known : (n, n_places + 1, n_words) uint64
        Solids that each clear place is in, and those of which that is certain.
    chosen : `raymaps.wave.Found`, (n, n_places), room for work
    verdict : (n,) int8, filled
        1 the ray arrives, 0 nothing is ahead, -1 no crossing explains what is around a clear place, or not all are
        known.
    """
    for k in range(len(rays)):
        i = rays[k]
        verdict[k], first = 0, 0
        for gap in range(count[k] + 1):
            if math.isnan(clear[k, gap]):
                continue
            n = 0
            for attempt in range(2):
                for c in range(first, gap):
                    if _explains(i, k, c, gap, attempt == 1, wave, tables, boundary, found, inside, known):
                        nx, ny, nz = found.normal[k, c]
                        if attempt == 1:  # no normal can be told: it goes straight through
                            nx, ny, nz = wave.direction[i]
                            if not is_in(wave.inside[i], boundary.solid[tables.triangle_face[found.triangle[k, c]]]):
                                nx, ny, nz = -nx, -ny, -nz
                        keep(chosen, k, n, found.t[k, c], nx, ny, nz, found.triangle[k, c])
                        n += 1
                if n > 0:
                    break
            if settle(i, k, n, chosen, wave, tables, boundary):
                verdict[k] = 1
                break
            for word in range(inside.shape[2]):
                if (inside[k, gap, word] ^ wave.inside[i, word]) & known[k, gap, word] != np.uint64(0):
                    verdict[k] = -1
            if verdict[k] < 0:
                break
            first = gap
        if verdict[k] == 0 and math.isnan(clear[k, count[k]]):
            verdict[k] = -1


@inlined_kernel
def _explains(i, k, c, gap, anyhow, wave, tables, boundary, found, inside, known):
    """Whether a crossing that was found is one of a change of solids up to a clear place, or of a surface of no solid.

    One where the ray stands may do so ``anyhow``, however its normal is: it touches a surface, or is at an apex.
    """
    solid = boundary.solid[tables.triangle_face[found.triangle[k, c]]]
    if solid < 0:
        return not anyhow and found.t[k, c] > wave.passed[i]
    is_inside = is_in(wave.inside[i], solid)
    if not is_in(known[k, gap], solid) or is_in(inside[k, gap], solid) == is_inside:
        return False
    if anyhow:
        return found.t[k, c] <= wave.passed[i]
    return is_inside == (along(wave, i, found.normal[k, c]) > 0.0)
