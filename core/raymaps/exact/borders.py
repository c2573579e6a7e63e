# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which triangles of a mesh meet where: vertices that are one, and the faces beyond the edges of each triangle.

Triangles, vertices and faces are counted through all bodies, in their order.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from raymaps.geometry import BodyMesh

__all__ = ["Borders", "ExactSurface", "Joined", "Places", "borders", "join"]

Float = NDArray[np.float64]
Index = NDArray[np.int64]

#: Vertices of a body closer than this times its size are one.
SAME_PLACE = 1e-7
#: Places for other faces next to a triangle.
PLACES = 4
#: Faces that bend less at their border go on smoothly: nothing lies on a wrong side there.
SMOOTH_RAD = math.radians(0.5)


class ExactSurface(Protocol):
    """What is asked of a surface of `raymaps.exact.surfaces`."""

    def normal(self, points: Float, /) -> Float:
        """Own unit normals at points on it, (n, 3)."""
        ...

    def height(self, points: Float, /) -> Float:
        """Signed distances of points along the own normal, (n,)."""
        ...


class Joined(NamedTuple):
    """The triangles of all bodies.

    ``corners`` (n_triangles, 3 corners, 3), mm; ``vertex`` (n_triangles, 3), equal for corners in one place of a body;
    ``face`` (n_triangles,); ``size`` (n_triangles,), that of the body, mm; ``normal`` (n_triangles, 3), outward of
    length one, 0 for triangles without an area.
    """

    corners: Float
    vertex: Index
    face: Index
    size: Float
    normal: Float

    @property
    def n_vertices(self) -> int:
        """How many there are."""
        return int(self.vertex.max()) + 1 if self.vertex.size else 0


class Borders(NamedTuple):
    """The other faces at each triangle's edges, from corner i to corner i + 1, and at its corners.

    ``neighbour`` (n_triangles, 4) int32 is a triangle of the face beyond an edge, -1 where the face goes on or ends.
    ``bend`` (n_triangles, 4) int8 is +1 where the body is convex there, -1 where it is concave, 0 where it is smooth.
    A face that the triangle only touches with a corner stands in the fourth place, or in that of an edge that is no
    border: at the corners of a box a triangle meets four faces. ``beside`` (n_triangles, 3) int32 is the triangle
    beyond each edge, of whatever face, -1 where there is none or more than one. ``inner`` (n_triangles,) bool tells
    whether no corner is at another face, ``sharp`` (n_triangles,) bool whether all other faces at its corners are
    neighbours over edges that are not smooth.
    """

    neighbour: NDArray[np.int32]
    bend: NDArray[np.int8]
    beside: NDArray[np.int32]
    inner: NDArray[np.bool_]
    sharp: NDArray[np.bool_]


class Places(NamedTuple):
    """A place for each face at each vertex: ``of_corner`` (n_triangles, 3) its index, ascending with the face.

    ``face``, ``vertex`` (n_places,); ``point`` (n_places, 3), mm.
    """

    of_corner: Index
    face: Index
    vertex: Index
    point: Float


def join(meshes: Sequence[BodyMesh]) -> Joined:
    """Put the triangles of all bodies together and find the vertices that are one."""
    corners, vertex, face, size = [], [], [], []
    first_vertex = first_face = 0
    for mesh in meshes:
        used, index = np.unique(mesh.triangles, return_inverse=True)
        points = mesh.vertices_mm[used]
        extent = float(np.ptp(points, axis=0).max(initial=0.0))
        same = _same_place(points, SAME_PLACE * extent)
        corners.append(mesh.corners_mm)
        vertex.append(same[index].reshape(-1, 3) + first_vertex)
        face.append(mesh.triangle_face.astype(np.int64) + first_face)
        size.append(np.full(len(mesh.triangles), extent))
        first_vertex += int(same.max(initial=-1)) + 1
        first_face += len(mesh.face_names)
    all_corners = np.concatenate(corners) if corners else np.zeros((0, 3, 3))
    normal, _ = unit(_area_vectors(all_corners))
    whole = np.concatenate([np.zeros(0, bool), *(~mesh.degenerate for mesh in meshes)])
    normal[~whole] = 0.0
    if not corners:
        return Joined(all_corners, np.zeros((0, 3), np.int64), np.zeros(0, np.int64), np.zeros(0), normal)
    return Joined(all_corners, np.concatenate(vertex), np.concatenate(face), np.concatenate(size), normal)


def places(joined: Joined) -> Places:
    """List what faces meet at what vertices."""
    n = joined.n_vertices
    keys, first, of_corner = np.unique(
        (joined.face[:, None] * n + joined.vertex).reshape(-1), return_index=True, return_inverse=True
    )
    face, vertex = np.divmod(keys, max(n, 1))
    return Places(of_corner.reshape(-1, 3), face, vertex, joined.corners.reshape(-1, 3)[first])


def outward_signs(joined: Joined, surfaces: Sequence[ExactSurface | None], own_normal: Float) -> Float:
    """+1 or -1 for each face, (n_faces,): outward = sign times own normal; 1 for faces without an exact surface.

    ``own_normal`` (n_triangles, 3 corners, 3) is that of the exact surfaces.
    """
    agree = np.einsum("tj,tcj->t", _area_vectors(joined.corners), np.nan_to_num(own_normal))
    return np.where(np.bincount(joined.face, agree, minlength=len(surfaces)) < 0, -1.0, 1.0)


def borders(meshes: Sequence[BodyMesh], surfaces: Sequence[ExactSurface | None]) -> Borders:
    """Find the faces at each triangle's edges and corners, and how the body bends there.

    Parameters
    ----------
    meshes : bodies
    surfaces : exact surface of each face of all bodies, None for facets
    """
    joined = join(meshes)
    n = len(joined.face)
    neighbour, bend = np.full((n, PLACES), -1, np.int32), np.zeros((n, PLACES), np.int8)
    beside = np.full((n, 3), -1, np.int32)
    here, there = _partners(joined)
    beside[here // 3, here % 3] = there // 3
    at_border = joined.face[there // 3] != joined.face[here // 3]
    here, there = here[at_border], there[at_border]
    of_border = np.zeros(joined.n_vertices, np.bool_)
    of_border[joined.vertex[here // 3, here % 3]] = True
    if len(here):
        bends = _bends(joined, surfaces, here, there)
        neighbour[here // 3, here % 3] = there // 3
        bend[here // 3, here % 3] = bends
        _add_corners(joined, here, there // 3, bends, neighbour, bend)
    inner = np.logical_not(of_border[joined.vertex].any(axis=1))
    return Borders(neighbour, bend, beside, inner, _all_sharp(joined, neighbour, bend, inner))


def _partners(joined: Joined) -> tuple[Index, Index]:
    """Pairs of half-edges (3 triangle + edge) that are one edge of a body with two triangles."""
    start, end = joined.vertex.reshape(-1), np.roll(joined.vertex, -1, axis=1).reshape(-1)
    real = np.flatnonzero(start != end)
    low, high = np.minimum(start[real], end[real]), np.maximum(start[real], end[real])
    order = np.argsort(low * joined.n_vertices + high, kind="stable")
    key = (low * joined.n_vertices + high)[order]
    begins = np.flatnonzero(np.diff(key, prepend=-1))
    two = begins[np.diff(begins, append=len(key)) == 2]
    a, b = real[order[two]], real[order[two + 1]]
    opposite = start[a] == end[b]
    a, b = a[opposite], b[opposite]
    return np.concatenate([a, b]), np.concatenate([b, a])


def _bends(joined: Joined, surfaces: Sequence[ExactSurface | None], here: Index, there: Index) -> NDArray[np.int8]:
    """+1, 0, -1 for each border half-edge."""
    triangle, edge = np.divmod(here, 3)
    start, end = joined.corners[triangle, edge], joined.corners[triangle, (edge + 1) % 3]
    middle = 0.5 * (start + end)
    along, _ = unit(end - start)
    mine = _outward(joined, surfaces, triangle, middle)
    others = _outward(joined, surfaces, there // 3, middle)
    sine = np.einsum("ij,ij->i", np.cross(mine, others), along)
    angle = np.arctan2(sine, np.einsum("ij,ij->i", mine, others))
    return np.where(np.abs(angle) < SMOOTH_RAD, 0, np.sign(angle)).astype(np.int8)


def _outward(joined: Joined, surfaces: Sequence[ExactSurface | None], triangle: Index, points: Float) -> Float:
    """Outward normal of the face of each triangle near a point."""
    normals = joined.normal[triangle].copy()
    for face, chosen in runs_of_faces(joined.face[triangle]):
        surface = surfaces[face]
        if surface is None:
            continue
        own, ok = unit(surface.normal(points[chosen]))
        own = np.where(np.einsum("ij,ij->i", own, normals[chosen])[:, None] < 0, -own, own)
        normals[chosen[ok]] = own[ok]
    return normals


def _add_corners(
    joined: Joined,
    here: Index,
    other: Index,
    bends: NDArray[np.int8],
    neighbour: NDArray[np.int32],
    bend: NDArray[np.int8],
) -> None:
    """Enter faces that a triangle only touches with a corner, where the edges there agree how the two faces bend."""
    n_faces = int(joined.face.max()) + 1
    ends = np.concatenate([joined.vertex.reshape(-1)[here], np.roll(joined.vertex, -1, axis=1).reshape(-1)[here]])
    key, beyond, bent = ends * n_faces + joined.face[np.tile(here // 3, 2)], np.tile(other, 2), np.tile(bends, 2)
    order = np.lexsort((joined.face[beyond], key))
    key, beyond, bent = key[order], beyond[order], bent[order]
    starts = np.flatnonzero((np.diff(key, prepend=-1) != 0) | (np.diff(joined.face[beyond], prepend=-1) != 0))
    least, most = np.minimum.reduceat(bent, starts), np.maximum.reduceat(bent, starts)
    told = (least == most) & (least != 0)
    key, beyond, bent = key[starts][told], beyond[starts][told], least[told]

    # at each corner, all faces of which something is told
    keys = (joined.vertex * n_faces + joined.face[:, None]).reshape(-1)
    first = np.searchsorted(key, keys)
    counts = np.searchsorted(key, keys, "right") - first
    triangle = np.repeat(np.arange(len(keys)) // 3, counts)
    row = np.repeat(first - (np.cumsum(counts) - counts), counts) + np.arange(len(triangle))
    beside = np.where(neighbour >= 0, joined.face[neighbour], -1)
    row, triangle = (x[(beside[triangle] != joined.face[beyond[row], None]).all(axis=1)] for x in (row, triangle))
    _, once = np.unique(triangle * n_faces + joined.face[beyond[row]], return_index=True)
    row, triangle = row[once], triangle[once]
    for slot in range(PLACES):  # one face of each triangle at a time, into the first place that is free
        free = (neighbour[triangle, slot] < 0) & (np.diff(triangle, prepend=-1) != 0)
        neighbour[triangle[free], slot], bend[triangle[free], slot] = beyond[row[free]], bent[row[free]]
        row, triangle = row[~free], triangle[~free]


def _all_sharp(
    joined: Joined, neighbour: NDArray[np.int32], bend: NDArray[np.int8], inner: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Whether all other faces at the corners of each triangle are neighbours over sharp edges, (n_triangles,)."""
    n_faces, rows = int(joined.face.max(initial=-1)) + 1, np.flatnonzero(~inner)
    vertex, face = np.divmod(np.unique((joined.vertex * n_faces + joined.face[:, None]).reshape(-1)), max(n_faces, 1))
    corner = joined.vertex[rows].reshape(-1)
    first = np.searchsorted(vertex, corner)
    counts = np.searchsorted(vertex, corner, "right") - first
    of_row = np.repeat(np.arange(len(corner)) // 3, counts)
    at = np.repeat(first - (np.cumsum(counts) - counts), counts) + np.arange(len(of_row))
    there = np.unique(of_row * n_faces + face[at])
    told = np.where(bend[rows] != 0, joined.face[neighbour[rows]], joined.face[rows, None])
    told = np.column_stack([joined.face[rows], told]) + np.arange(len(rows))[:, None] * n_faces
    untold = there[~np.isin(there, told)] // max(n_faces, 1)
    sharp = np.ones(len(joined.face), bool)
    sharp[rows[untold]] = False
    return sharp


def runs_of_faces(face: Index) -> Iterator[tuple[int, Index]]:
    """Each face that occurs, with where it occurs."""
    order = np.argsort(face, kind="stable")
    begins = np.flatnonzero(np.diff(face[order], prepend=-1))
    for begin, end in zip(begins, np.append(begins, len(face))[1:], strict=True):
        yield int(face[order[begin]]), order[begin:end]


def sum_at(at: Places, vectors: Float) -> Float:
    """Sums at each place, (n_places, 3), of vectors at the corners of triangles, (n_triangles, 3 corners, 3)."""
    corner = at.of_corner.reshape(-1)
    return np.stack([np.bincount(corner, vectors[..., i].reshape(-1), len(at.face)) for i in range(3)], axis=1)


def unit(vectors: Float) -> tuple[Float, NDArray[np.bool_]]:
    """Vectors of length one, and which those are; the others, of no length or not finite, become 0."""
    length = np.sqrt(np.einsum("...j,...j->...", vectors, vectors))
    ok = np.isfinite(length) & (length > 0)
    return np.where(ok[..., None], vectors, 0.0) / np.where(ok, length, 1.0)[..., None], ok


def _area_vectors(corners: Float) -> Float:
    a, b, c = np.moveaxis(corners, 1, 0)
    return 0.5 * np.cross(b - a, c - a)


def _same_place(points: Float, tolerance: float) -> Index:
    """A number for each point, equal for points that are closer than a tolerance to each other along each axis.

    Points are split where there is a gap along x, each lot where there is one along y, and so on: twice, since the
    first split sees all points in a row.
    """
    label = np.zeros(len(points), np.int64)
    for axis in (0, 1, 2, 0, 1, 2):
        order = np.lexsort((points[:, axis], label))
        gap = (np.diff(points[order, axis]) > tolerance) | (np.diff(label[order]) != 0)
        label[order] = np.concatenate([[0], np.cumsum(gap)])
    return label
