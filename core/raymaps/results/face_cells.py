# SPDX-License-Identifier: LGPL-2.1-or-later
"""Faces divided into cells for pictures and tables, and into patches for extremes.

A large triangle is divided into k² equal ones that have its shape, a small one stays whole. Cells that lie side by side
on one face are put together to patches of about equal area, so that no extreme is that of a sliver.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from raymaps.geometry import BodyMesh

__all__ = ["CELLS", "CELLS_OF_A_PATCH", "FaceCells", "barycentric", "divided"]

Float = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Into how many cells faces are divided, about; how many cells a patch has, and how many patches there are at most.
CELLS, CELLS_OF_A_PATCH, MOST_PATCHES = 1000, 10, 1000
#: How many triangles further a place may lie than the one through which light came to it.
MOST_STEPS = 8


@dataclass(frozen=True)
class FaceCells:
    """Cells of some faces of a body; they are counted triangle by triangle.

    Attributes
    ----------
    triangle : (n_cells,) int64
        Triangle of the body that each cell belongs to.
    corners_mm : (n_cells, 3 corners, 3) float64
    area_mm2 : (n_cells,) float64
    patch : (n_cells,) int64
        Patch that each cell belongs to.
    patch_area_mm2 : (n_patches,) float64
    is_whole : (n_patches,) bool
        Whether a patch has about the common area; smaller ones are those of small faces.
    first, parts : (n_triangles of the body,) int64
        First cell of each triangle, -1 where it is on no chosen face, and into how many parts its sides are divided.
    beyond : (n_triangles of the body, 3 edges) int64
        Triangle of the same face beyond the edges from corner to corner, -1 where there is none.
    """

    triangle: Indices
    corners_mm: Float = field(repr=False)
    area_mm2: Float = field(repr=False)
    patch: Indices = field(repr=False)
    patch_area_mm2: Float = field(repr=False)
    is_whole: NDArray[np.bool_] = field(repr=False)
    first: Indices = field(repr=False)
    parts: Indices = field(repr=False)
    beyond: Indices = field(repr=False)

    def cell_of(self, mesh: BodyMesh, triangle: Indices, place_mm: Float) -> Indices:
        """Cell of places at triangles, (n,); places beside their face count to its border."""
        triangle, u, v = self._below(mesh, triangle, place_mm)
        k = self.parts[triangle]
        i = np.clip(np.floor(u * k), 0, k - 1).astype(np.int64)
        j = np.clip(np.floor(v * k), 0, k - 1 - i).astype(np.int64)
        upper = (u * k - i + v * k - j > 1.0) & (i + j < k - 1)
        return self.first[triangle] + i * (2 * k - i) + 2 * j + upper

    def _below(self, mesh: BodyMesh, triangle: Indices, place_mm: Float) -> tuple[Indices, Float, Float]:
        """Triangles below places, (n,), and the shares of their second and third corners there.

        A place on an exact surface can lie beside the triangle through which light came to it: then it belongs to one
        of those next to it.
        """
        triangle = triangle.copy()
        u, v = barycentric(mesh.corners_mm[triangle], place_mm)
        moving = np.flatnonzero((u < 0) | (v < 0) | (u + v > 1))
        for _ in range(MOST_STEPS):
            behind = np.stack([v[moving], 1 - u[moving] - v[moving], u[moving]], axis=1)  # of each edge, if negative
            beyond = self.beyond[triangle[moving]]
            behind[beyond < 0] = 0.0
            edge = np.argmin(behind, axis=1)[:, None]
            on = np.take_along_axis(behind, edge, axis=1)[:, 0] < 0
            moving, target = moving[on], np.take_along_axis(beyond, edge, axis=1)[on, 0]
            if not len(moving):
                break
            triangle[moving] = target
            u[moving], v[moving] = barycentric(mesh.corners_mm[target], place_mm[moving])
        return triangle, u, v


def barycentric(corners_mm: Float, place_mm: Float) -> tuple[Float, Float]:
    """Shares of the second and third corner of triangles, (n, 3, 3), at the feet of perpendiculars from places, (n, 3).

    By least squares, (n,) each; 0 in triangles without an area.
    """
    a, b, c = np.moveaxis(corners_mm, 1, 0)
    p, e, f = place_mm - a, b - a, c - a
    ee, ff, ef = (np.einsum("ij,ij->i", x, y) for x, y in ((e, e), (f, f), (e, f)))
    pe, pf = (np.einsum("ij,ij->i", p, x) for x in (e, f))
    determinant = ee * ff - ef * ef
    sound = determinant > 0
    scale = np.divide(1.0, determinant, np.zeros_like(determinant), where=sound)
    return (pe * ff - pf * ef) * scale, (pf * ee - pe * ef) * scale


def divided(mesh: BodyMesh, faces: NDArray[np.int64], n_cells: int = CELLS) -> FaceCells:
    """Divide faces of a body.

    Parameters
    ----------
    mesh : BodyMesh
    faces : (n_faces,) int
        Chosen faces, as indices into the mesh's face names.
    n_cells : int
        About how many cells are wanted; there are more where the mesh is finer.
    """
    triangles = np.flatnonzero(np.isin(mesh.triangle_face, faces))
    area = np.linalg.norm(mesh.area_vectors_mm2[triangles], axis=1)
    whole = float(area.sum())
    k = np.maximum(1, np.ceil(np.sqrt(area * (n_cells / whole if whole > 0 else 0.0)) - 1e-9)).astype(np.int64)
    first, parts = np.full(len(mesh.triangles), -1, np.int64), np.ones(len(mesh.triangles), np.int64)
    first[triangles] = np.cumsum(k * k) - k * k
    parts[triangles] = k
    corners = np.empty((int((k * k).sum()), 3, 3))
    for size in np.unique(k):
        these = triangles[k == size]
        shares = _corner_shares(int(size))  # (size², 3 corners, 3 shares)
        cells = first[these, None] + np.arange(size * size)
        corners[cells] = np.einsum("qcs,tsx->tqcx", shares, mesh.corners_mm[these])
    cell_area = np.repeat(area / (k * k), k * k)
    triangle = np.repeat(triangles, k * k)
    target = whole / min(max(n_cells // CELLS_OF_A_PATCH, 1), MOST_PATCHES)
    patch = _patches(corners.mean(axis=1), cell_area, mesh.triangle_face[triangle], target)
    patch_area: Float = np.bincount(patch, cell_area).astype(np.float64)
    is_whole = patch_area >= min(0.5 * target, float(patch_area.max()))
    return FaceCells(
        triangle, corners, cell_area, patch, patch_area, is_whole & (patch_area > 0), first, parts,
        _neighbours(mesh, triangles),
    )  # fmt: skip


def _neighbours(mesh: BodyMesh, triangles: Indices) -> Indices:
    """Triangle of the same face beyond each edge of some triangles; see `FaceCells.beyond`."""
    beyond = np.full((len(mesh.triangles), 3), -1, np.int64)
    start = mesh.corner_places[triangles]
    end = np.roll(start, -1, axis=1)
    n = int(start.max(initial=0)) + 1
    face = mesh.triangle_face[triangles].astype(np.int64)[:, None]
    edge = ((face * n + np.minimum(start, end)) * n + np.maximum(start, end)).ravel()
    order = np.argsort(edge, kind="stable")
    shared = edge[order[1:]] == edge[order[:-1]]
    here, there = order[:-1][shared], order[1:][shared]
    of_edge = np.full(len(edge), -1, np.int64)
    of_edge[here], of_edge[there] = triangles[there // 3], triangles[here // 3]
    beyond[triangles] = of_edge.reshape(-1, 3)
    return beyond


def _corner_shares(k: int) -> Float:
    """Corners of the k² parts of a triangle as shares of its own corners, (k², 3, 3)."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(k), np.arange(k), indexing="ij"))
    i, j = i[i + j < k], j[i + j < k]
    at = i * (2 * k - i) + 2 * j

    def points(*corners: tuple[NDArray[np.int64], NDArray[np.int64]]) -> Float:
        return np.stack([np.stack([k - u - v, u, v], axis=1) for u, v in corners], axis=1) / k

    shares = np.empty((k * k, 3, 3))
    shares[at] = points((i, j), (i + 1, j), (i, j + 1))
    inner = i + j < k - 1
    i, j = i[inner], j[inner]
    shares[at[inner] + 1] = points((i + 1, j), (i + 1, j + 1), (i, j + 1))
    return shares


def _patches(centre: Float, area: Float, face: NDArray[np.int32], target: float) -> Indices:
    """Patch of each cell: each face is halved along its longest extent until its parts have about the target area."""
    patch = np.zeros(len(area), np.int64)
    count = 0
    left = [np.flatnonzero(face == one) for one in np.unique(face)]
    while left:
        cells = left.pop()
        total = float(area[cells].sum())
        n = int(total / target + 1e-9) if target > 0 else 1
        if n < 2 or len(cells) < 2:
            patch[cells] = count
            count += 1
            continue
        axis = int(np.argmax(np.ptp(centre[cells], axis=0)))
        cells = cells[np.argsort(centre[cells, axis], kind="stable")]
        cut = int(np.searchsorted(np.cumsum(area[cells]), total * (n // 2) / n * (1 - 1e-9))) + 1
        cut = min(max(cut, 1), len(cells) - 1)
        left += [cells[cut:], cells[:cut]]
    return patch
