# SPDX-License-Identifier: LGPL-2.1-or-later
"""Crossings that are one interface: which comes first, what it changes, and whose surface acts there.

Crossings closer than a contact are one interface, between the medium before all of them and that behind all. Where the
same solid rules on both sides nothing changes, and the ray passes.
"""

from __future__ import annotations

from raymaps.jit import inlined_kernel
from raymaps.kernels.crossing import along
from raymaps.kernels.inside import is_in, medium_of, ruling, toggle, toggle_all
from raymaps.kinds import CONTACT, SurfaceKind

__all__ = ["MAX_PASSES", "end_at", "keep", "settle", "sort", "undo_passes"]

#: Silent passes into and out of overlapped solids that are kept for each ray, should it be scattered before them; one
#: that has passed more is lost then, and counted.
MAX_PASSES = 16
#: Cosine between normals of facets that run alongside each other.
ALONGSIDE = 0.94

_FRESNEL = int(SurfaceKind.FRESNEL)


@inlined_kernel
def keep(found, k, place, t, nx, ny, nz, triangle):
    """Put a crossing of ray k to a place of `raymaps.wave.Found`."""
    found.t[k, place], found.triangle[k, place] = t, triangle
    found.normal[k, place, 0], found.normal[k, place, 1], found.normal[k, place, 2] = nx, ny, nz


@inlined_kernel
def end_at(wave, i, distance):
    """Let the segment of ray i end at a distance."""
    wave.distance[i] = distance
    for axis in range(3):
        wave.end[i, axis] = wave.position[i, axis] + distance * wave.direction[i, axis]


@inlined_kernel
def settle(i, k, count, found, wave, tables, boundary):
    """Let ray i arrive at the first of the crossings found at which something changes.

    Parameters
    ----------
    count : int
        Crossings in row k of ``found``; they are put in the order of their distances.

    Returns
    -------
    bool, whether there is one; if not, the solids of ray i are those behind all of them
    """
    sort(k, count, found)
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
            outwards = along(wave, i, found.normal[k, c]) > 0.0
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
            end_at(wave, i, found.t[k, chosen])
            return True
        wave.passed[i] = found.t[k, first]
        for c in range(first, end):
            solid = boundary.solid[tables.triangle_face[found.triangle[k, c]]]
            if is_in(wave.across[i], solid):
                toggle(wave.across[i], solid)
                _note_pass(wave, i, found.t[k, first], solid)
        first = end
    return False


@inlined_kernel
def sort(k, count, found):
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
    apart = (found.t[k, c] - found.t[k, first]) * abs(along(wave, i, other))
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
def _note_pass(wave, i, t, solid):
    if wave.n_passes[i] < MAX_PASSES:
        wave.pass_t[i, wave.n_passes[i]] = t
        wave.pass_solid[i, wave.n_passes[i]] = solid
    wave.n_passes[i] = min(wave.n_passes[i] + 1, MAX_PASSES + 1)


@inlined_kernel
def undo_passes(wave, i, distance):
    """Take back what ray i passed beyond a distance, where it is scattered before it gets there.

    Returns
    -------
    bool, whether all that it passed is known
    """
    for k in range(min(wave.n_passes[i], MAX_PASSES)):
        if wave.pass_t[i, k] > distance:
            toggle(wave.inside[i], wave.pass_solid[i, k])
    return wave.n_passes[i] <= MAX_PASSES
