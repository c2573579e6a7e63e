# SPDX-License-Identifier: LGPL-2.1-or-later
"""The mesh that Embree is shown: the triangles of the file, moved outwards until the exact surfaces lie within them.

Facets with their corners on a curved surface cut it off: light between a facet and the surface would never meet the
facet. So corners move to the side to which the surface bulges, until each facet stands beyond the piece of surface for
which it stands. The facets of each face reach up to those of the faces around it or past them, so that together they
have no gap, and each covers its face up to the exact borders:

- where a neighbour lies on the side away from which a face bulges (the two faces of a biconvex lens and its rim), both
  move together and go on sharing their corners;
- where it lies on the side to which the face bulges (a plate and the hole in it), the neighbour stays where it is, or
  the rim of the hole would be cut off from the plate.

Planes move only within themselves; faces without an exact surface keep their corners if they are not plane.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.exact.borders import (
    SAME_PLACE,
    Borders,
    ExactSurface,
    Index,
    Joined,
    Places,
    borders,
    join,
    outward_signs,
    places,
    runs_of_faces,
    sum_at,
    unit,
)
from raymaps.exact.surfaces import Plane
from raymaps.geometry import BodyMesh

__all__ = ["Borders", "Bounds", "borders", "bounding_corners"]

Float = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: Facets stand beyond the surface by this factor more than the four places that are looked at call for.
MARGIN = 1.2
#: A surface nearer to its facets than this times its body's size is plane.
FLAT = 1e-7
#: Normals of planes that differ less, in radians, are those of one plane.
SAME_PLANE_RAD = 1e-5
#: Faces whose outward normals differ less go on into each other: they move as one.
TANGENT_COSINE = math.cos(math.radians(2.0))
#: At sharp edges facets meet far outside. Corners follow them as long as they move by less than this part of the edges
#: there; beyond, by some displacements of the faces.
MOST_OF_EDGE = 0.25
SHARP, BLUNT = 0.003, 0.1
SOLVING_STEPS = 3
#: Rounding of Embree's single precision, relative to the scene: what facets that end on others overlap by.
OVERLAP = 2.0**-21
#: Rounds of evening out what folds triangles over, and of halving it where that does not help.
EVENING_ROUNDS, HALVING_ROUNDS = 12, 12


class Bounds(NamedTuple):
    """The bounding mesh.

    ``corners`` (n_triangles, 3 corners, 3), mm; ``reach`` (n_triangles,), mm, how far a facet is from its exact
    surface at most, 0 for planes and for faces without one.
    """

    corners: Float
    reach: Float


class _Bulges(NamedTuple):
    """How far an exact surface stands outside (``up``) and inside (``down``) of triangles or places, >= 0, mm."""

    up: Float
    down: Float

    @property
    def most(self) -> Float:
        return np.maximum(self.up, self.down)

    @property
    def side(self) -> Float:
        """+1 where it bulges outwards, -1 inwards."""
        return np.where(self.up >= self.down, 1.0, -1.0)


class _Heights(NamedTuple):
    """Heights outside the exact surface of the middles of edges (n_triangles, 3) and triangles (n_triangles,), mm."""

    edges: Float
    middle: Float


def bounding_corners(meshes: Sequence[BodyMesh], surfaces: Sequence[ExactSurface | None]) -> Bounds:
    """Corners of the bounding mesh.

    Parameters
    ----------
    meshes : bodies
    surfaces : exact surface of each face of all bodies, None for facets
    """
    joined = join(meshes)
    if all(surface is None for surface in surfaces):
        return Bounds(joined.corners, np.zeros(len(joined.corners)))
    at = places(joined)
    normal, stays, sign = _normals(joined, at, surfaces)
    heights = _heights(joined, at, surfaces, sign)
    facets = _bulges_of_facets(joined, heights)
    bulges = _bulges_at(joined, at, normal, facets)
    toward = _toward_face(joined, at, normal)
    limit = MOST_OF_EDGE * _shortest_edges(joined, at)
    overlap = OVERLAP * float(np.ptp(joined.corners.reshape(-1, 3), axis=0).max())

    moved = np.zeros_like(normal)
    for _ in range(EVENING_ROUNDS):
        moved = _displacements(at, normal, bulges, stays, toward, limit, overlap)
        moved = _lift_inner(joined, at, normal, facets, moved)
        folded = _folded(joined, at, moved)
        if not len(folded):
            break
        bulges = _evened(at, bulges, folded)
    moved = _unfolded(joined, at, moved)
    return Bounds(joined.corners + moved[at.of_corner], _reach(joined, at, normal, facets, heights, moved, surfaces))


# ------------------------------------------------------------------------------------------ what the surfaces are like


def _normals(joined: Joined, at: Places, surfaces: Sequence[ExactSurface | None]) -> tuple[Float, Flags, Float]:
    """Outward normals of the faces at their places, which places stay since no plane or surface is known, and the signs
    of the faces: outward = sign times own normal.
    """
    fan = _fan_normals(joined, at)
    own = fan.copy()
    curved = np.zeros(len(at.face), bool)
    known = np.zeros(len(at.face), bool)
    for face, chosen in runs_of_faces(at.face):
        surface = surfaces[face]
        if surface is not None:
            value, ok = unit(surface.normal(at.point[chosen]))
            own[chosen[ok]] = value[ok]
            known[chosen] = True
            curved[chosen] = ok
    sign = outward_signs(joined, surfaces, np.where(curved[:, None], own, 0.0)[at.of_corner])
    outward = own * sign[at.face][:, None]
    # the apex of a cone has no normal of its own
    askew = np.einsum("ij,ij->i", outward, fan) < np.where(_is_border(at), 0.5, 0.9)
    normal = np.where((askew | ~curved)[:, None], fan, outward)

    along = joined.corners[:, [1, 2, 0]] - joined.corners, joined.corners[:, [2, 0, 1]] - joined.corners
    off = np.maximum(*(np.abs(np.einsum("tcj,tcj->tc", normal[at.of_corner], edge)) for edge in along))
    is_bent = np.bincount(at.of_corner.reshape(-1), (off > 1e-7 * joined.size[:, None]).reshape(-1), len(at.face)) > 0
    return normal, (~known & is_bent) | ~normal.any(axis=1), sign


def _fan_normals(joined: Joined, at: Places) -> Float:
    """Normals of the faces at their places by the triangles around them, weighted by their angles; 0 without any."""
    turn = joined.normal[:, None] * _angles(joined)[..., None]
    return unit(sum_at(at, turn))[0]


def _angles(joined: Joined) -> Float:
    """(n_triangles, 3 corners), 0 where an edge has no length."""
    to_next, ok = unit(np.roll(joined.corners, -1, axis=1) - joined.corners)
    to_last, ok_too = unit(np.roll(joined.corners, 1, axis=1) - joined.corners)
    cosine = np.einsum("tcj,tcj->tc", to_next, to_last)
    return np.where(ok & ok_too, np.arccos(np.clip(cosine, -1, 1)), 0.0)


def _heights(joined: Joined, at: Places, surfaces: Sequence[ExactSurface | None], sign: Float) -> _Heights:
    """Heights of the facets outside of their exact surfaces, 0 where there is none."""
    start, end = at.of_corner.reshape(-1), np.roll(at.of_corner, -1, axis=1).reshape(-1)
    keys, of_edge = np.unique(np.minimum(start, end) * len(at.face) + np.maximum(start, end), return_inverse=True)
    low, high = np.divmod(keys, len(at.face))
    on_edges = _height_of(surfaces, sign, at.face[low], 0.5 * (at.point[low] + at.point[high]))
    in_middle = _height_of(surfaces, sign, joined.face, joined.corners.mean(axis=1))
    return _Heights(on_edges[of_edge].reshape(-1, 3), in_middle)


def _height_of(surfaces: Sequence[ExactSurface | None], sign: Float, face: Index, points: Float) -> Float:
    height = np.zeros(len(face))
    for this, chosen in runs_of_faces(face):
        surface = surfaces[this]
        if surface is not None and not isinstance(surface, Plane):
            height[chosen] = sign[this] * np.nan_to_num(surface.height(points[chosen]), posinf=0.0, neginf=0.0)
    return height


def _bulges_of_facets(joined: Joined, heights: _Heights) -> _Bulges:
    low = np.minimum(heights.edges.min(axis=1), heights.middle)
    high = np.maximum(heights.edges.max(axis=1), heights.middle)
    noise = FLAT * joined.size
    return _Bulges(np.where(low < -noise, -low, 0.0), np.where(high > noise, high, 0.0))


def _bulges_at(joined: Joined, at: Places, normal: Float, facets: _Bulges) -> _Bulges:
    """The largest of the facets around each place, grown as facets that turn away from its normal call for."""
    middle, _ = unit(normal[at.of_corner].mean(axis=1))
    cosine = np.maximum(np.einsum("tj,tcj->tc", middle, normal[at.of_corner]), 0.3)

    def largest(value: Float) -> Float:
        most = np.zeros(len(at.face))
        np.maximum.at(most, at.of_corner.reshape(-1), (MARGIN * value[:, None] / cosine).reshape(-1))
        return most

    return _Bulges(largest(facets.up), largest(facets.down))


def _shortest_edges(joined: Joined, at: Places) -> Float:
    """Length of the shortest edge at each place, mm."""
    length = np.linalg.norm(np.roll(joined.corners, -1, axis=1) - joined.corners, axis=2)
    length = np.where(length > SAME_PLACE * joined.size[:, None], length, np.inf)
    shortest = np.full(len(at.face), np.inf)
    np.minimum.at(shortest, at.of_corner.reshape(-1), np.minimum(length, np.roll(length, 1, axis=1)).reshape(-1))
    return np.where(np.isfinite(shortest), shortest, 0.0)


def _toward_face(joined: Joined, at: Places, normal: Float) -> Float:
    """Unit vector from each place into its face, along the exact surface; 0 where the face lies all around."""
    halfway, _ = unit(
        unit(np.roll(joined.corners, -1, axis=1) - joined.corners)[0]
        + unit(np.roll(joined.corners, 1, axis=1) - joined.corners)[0]
    )
    into = sum_at(at, halfway * _angles(joined)[..., None])
    return unit(into - np.einsum("ij,ij->i", into, normal)[:, None] * normal)[0]


# ---------------------------------------------------------------------------------------------------- how corners move


def _displacements(
    at: Places, normal: Float, bulges: _Bulges, stays: Flags, toward: Float, limit: Float, overlap: float
) -> Float:
    """Displacement of each face's corner at each place, (n_places, 3)."""
    moved = (bulges.side * bulges.most)[:, None] * normal
    moved[stays] = 0.0
    for group in _groups(at):
        moved[group] = _at_borders(
            normal[group], bulges.up[group], bulges.down[group], stays[group], toward[group], limit[group], overlap
        )
    return moved


def _groups(at: Places) -> Iterator[Index]:
    """Places at vertices where several faces meet: (n, k) for each number k of faces."""
    order = np.argsort(at.vertex, kind="stable")
    begins = np.flatnonzero(np.diff(at.vertex[order], prepend=-1))
    counts = np.diff(begins, append=len(order))
    for k in np.unique(counts[counts > 1]):
        yield order[begins[counts == k][:, None] + np.arange(k)]


def _at_borders(
    normal: Float, up: Float, down: Float, stays: Flags, toward: Float, limit: Float, overlap: float
) -> Float:
    """Displacements of k faces' corners at n vertices, (n, k, 3).

    Face i's corner is to lie on the facets of face j, moved along its normal by r[i, j]. If i lies inside of j, these
    are where j bulges outwards to, if outside, where it bulges inwards to: the farther from i. Faces that go on
    smoothly move as one. Planes are kept exactly; the others in the sense of least squares, damped where there is no
    such place near by.
    """
    cosine = np.einsum("nij,nkj->nik", normal, normal)
    outside = np.einsum("nij,nkj->nik", toward, normal) > 0
    side = np.where(up >= down, 1.0, -1.0) * np.maximum(up, down)
    family = cosine > TANGENT_COSINE
    strongest = np.argmax(np.where(family, np.abs(side)[:, None, :], -1.0), axis=2)
    own = np.take_along_axis(side, strongest, axis=1)
    wanted = np.where(family, own[:, None, :], np.where(outside, -down[:, None, :], up[:, None, :]))

    flat = (up == 0) & (down == 0)
    free = _across(np.where(flat[..., None], normal, 0.0))
    soft = np.where(flat[..., None], 0.0, normal) @ free
    moved = _least_squares(soft, wanted, BLUNT)
    rest = _least_squares(soft, wanted, SHARP) - moved
    longest = np.linalg.norm(rest, axis=2).max(axis=1)
    share = np.minimum(1.0, limit.min(axis=1) / np.where(longest > 0, longest, 1.0))
    moved = (moved + share[:, None, None] * rest) @ free

    # where others do not follow a face, it ends on their facets: past them by what Embree rounds
    alone = (~family & (np.abs(wanted - own[:, None, :]) > 0)).any(axis=1) & ~flat
    moved -= np.where(alone[..., None], overlap * toward, 0.0)
    moved[stays.any(axis=1)] = 0.0
    return moved


def _least_squares(normal: Float, wanted: Float, damping: float) -> Float:
    """Vectors x[i] (n, k, 3) with normal[j] x[i] = wanted[i, j]; Tikhonov's damping, some rounds of correction."""
    square = np.einsum("nij,nik->njk", normal, normal) + damping**2 * np.eye(3)
    inverse = np.linalg.solve(square, np.swapaxes(normal, 1, 2))
    found = np.zeros_like(normal)
    for _ in range(SOLVING_STEPS):
        short = wanted - np.einsum("nij,nkj->nik", found, normal)
        found += np.einsum("njk,nik->nij", inverse, short)
    return found


def _across(normals: Float) -> Float:
    """Projections (n, 3, 3) onto what is perpendicular to k normals each."""
    value, vector = np.linalg.eigh(np.einsum("nij,nik->njk", normals, normals))
    kept = vector * (value < SAME_PLANE_RAD**2)[:, None, :]
    return kept @ np.swapaxes(kept, 1, 2)


def _lift_inner(joined: Joined, at: Places, normal: Float, facets: _Bulges, moved: Float) -> Float:
    """Move inner corners farther where those at the border could not: a facet then touches the surface beside them.

    Over an edge with a rise h in its middle, offsets a and b at its ends suffice if sqrt(a) + sqrt(b) >= 2 sqrt(h).
    """
    inner = ~_is_border(at)[at.of_corner]
    bulge, side = facets.most[:, None], facets.side[:, None]
    offset = np.maximum(side * np.einsum("tcj,tcj->tc", moved[at.of_corner], normal[at.of_corner]), 0.0)
    lowest = np.where(inner, bulge, offset).min(axis=1, keepdims=True)
    needed = np.maximum(2 * np.sqrt(bulge) - np.sqrt(np.minimum(lowest, bulge)), 0.0) ** 2
    lift = np.where(inner & (lowest < bulge) & (needed > offset), MARGIN * needed - offset, 0.0)
    most = np.zeros(len(at.face))
    signed = np.zeros(len(at.face))
    np.maximum.at(most, at.of_corner.reshape(-1), lift.reshape(-1))
    chosen = (lift > 0) & (lift == most[at.of_corner])
    signed[at.of_corner[chosen]] = (side * lift)[chosen]
    return moved + signed[:, None] * normal


# -------------------------------------------------------------------------------------------------- against folding


def _folded(joined: Joined, at: Places, moved: Float) -> Index:
    """Triangles that are turned over, or nearly, by a displacement of their corners."""
    a, b, c = np.moveaxis(joined.corners + moved[at.of_corner], 1, 0)
    before = joined.corners
    area = np.einsum("ij,ij->i", np.cross(before[:, 1] - before[:, 0], before[:, 2] - before[:, 0]), joined.normal)
    return np.flatnonzero(np.einsum("ij,ij->i", np.cross(b - a, c - a), joined.normal) < 0.1 * area)


def _evened(at: Places, bulges: _Bulges, folded: Index) -> _Bulges:
    """Let the three corners of triangles that fold over move equally far, as far as the one that moves farthest."""
    n = int(at.vertex.max()) + 1
    at_vertex = np.zeros(n)
    np.maximum.at(at_vertex, at.vertex, bulges.most)
    vertex = at.vertex[at.of_corner[folded]]
    target = at_vertex.copy()
    np.maximum.at(target, vertex.reshape(-1), np.repeat(at_vertex[vertex].max(axis=1), 3))
    factor = np.where(at_vertex > 0, target / np.where(at_vertex > 0, at_vertex, 1.0), 1.0)[at.vertex]
    return _Bulges(bulges.up * factor, bulges.down * factor)


def _unfolded(joined: Joined, at: Places, moved: Float) -> Float:
    """Halve the displacements of triangles that still fold over; give them up in the end."""
    for i in range(HALVING_ROUNDS):
        folded = _folded(joined, at, moved)
        if not len(folded):
            break
        touched = np.isin(at.vertex, joined.vertex[folded])
        moved = np.where(touched[:, None], 0.5 * moved if i < HALVING_ROUNDS - 1 else 0.0, moved)
    return moved


# -------------------------------------------------------------------------------------------------------------- reach


def _reach(
    joined: Joined,
    at: Places,
    normal: Float,
    facets: _Bulges,
    heights: _Heights,
    moved: Float,
    surfaces: Sequence[ExactSurface | None],
) -> Float:
    """Largest distance of each facet from its exact surface."""
    offset = np.einsum("tcj,tcj->tc", moved[at.of_corner], normal[at.of_corner])
    edges = heights.edges + 0.5 * (offset + np.roll(offset, -1, axis=1))
    middle = heights.middle + offset.mean(axis=1)
    # past a border the surface goes on curving
    border = np.flatnonzero(_is_border(at) & moved.any(axis=1))
    past = np.einsum("ij,ij->i", moved, normal)
    past[border] = _height_of(surfaces, np.ones(len(surfaces)), at.face[border], (at.point + moved)[border])
    most = np.maximum(np.abs(edges).max(axis=1), np.abs(middle))
    most = np.maximum(most, np.abs(past)[at.of_corner].max(axis=1))
    return np.where(facets.most > 0, 1.25 * most, 0.0)


def _is_border(at: Places) -> Flags:
    """Which places are at vertices where several faces meet."""
    return np.bincount(at.vertex)[at.vertex] > 1
