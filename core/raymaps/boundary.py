# SPDX-License-Identifier: LGPL-2.1-or-later
"""The boundary of all bodies as the tracer sees it: triangles for Embree, exact surfaces behind them, solids."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.exact import ExactTables, Fallback, exact_faces, lower_exact
from raymaps.exact.borders import borders, join
from raymaps.exact.bounding import bounding_corners
from raymaps.frame import Frame
from raymaps.geometry import BodyMesh
from raymaps.kinds import CONTACT
from raymaps.names import Names
from raymaps.scene import Scene
from raymaps.solids import lower_solids
from raymaps.solids.nearby import nearby_triangles

__all__ = ["Boundary", "LoweredBoundary", "SmoothFacets", "lower_boundary"]


class Boundary(NamedTuple):
    """What kernels read to find a crossing. Solids count by rank; lengths in frame units."""

    corners: NDArray[np.float64]  # (n_triangles, 3 corners, 3) of the bounding mesh
    reach: NDArray[np.float64]  # (n_triangles,) how far the exact surface may lie from the facet
    slack: NDArray[np.float64]  # (n_triangles,) how far a facet without one may be off the surface that it stands for
    neighbour: NDArray[np.int32]  # (n_triangles, 4) triangles of other faces of the body next to it, -1 none
    bend: NDArray[np.int8]  # (n_triangles, 4) edge between them: 1 convex, -1 concave, 0 smooth
    beside: NDArray[np.int32]  # (n_triangles, 3) triangle beyond each edge, of whatever face, -1 none
    inner: NDArray[np.bool_]  # (n_triangles,) no corner is at another face
    sharp: NDArray[np.bool_]  # (n_triangles,) all faces at its corners are neighbours over edges that are not smooth
    near_start: NDArray[np.int32]  # (n_triangles + 1,) where the list of each triangle in the next column begins
    near: NDArray[np.int32]  # (n_near,) triangles so near that exact surfaces may have another order than facets
    exact: ExactTables
    solid: NDArray[np.int32]  # (n_faces,) solid that the face bounds, -1 none
    solid_medium: NDArray[np.int16]  # (n_solids,) medium of each solid, -1 none
    has_medium: NDArray[np.uint64]  # (n_words,) solids that have one, a bit each
    far: NDArray[np.uint64]  # (n_words,) solids that reach to infinity


class SmoothFacets(NamedTuple):
    """Facets whose normals are interpolated; lengths in frame units."""

    row: NDArray[np.int32]  # (n_triangles,) row of a facet, -1 none
    corners: NDArray[np.float64]  # (n_rows, 3 corners, 3)
    normals: NDArray[np.float64]  # (n_rows, 3 corners, 3) outward


@dataclass(frozen=True)
class LoweredBoundary:
    """The boundary of a scene.

    Attributes
    ----------
    tables : Boundary
    plane : (n_triangles, 4) float64
        Outward unit normal of each triangle of the bounding mesh, and its dot product with the plane's points.
    close : (n_triangles,) bool
        Whether a triangle may be in contact with one of another body.
    layer : (n_triangles,) int8
        Bodies that may touch are in different layers; -1 of triangles that are not close.
    smooth : SmoothFacets
    fallbacks : tuple of Fallback
        Faces that stay facets though their exact surfaces were asked for.
    """

    tables: Boundary
    plane: NDArray[np.float64]
    close: NDArray[np.bool_]
    layer: NDArray[np.int8]
    smooth: SmoothFacets
    fallbacks: tuple[Fallback, ...]


def lower_boundary(scene: Scene, meshes: tuple[BodyMesh, ...], names: Names, frame: Frame) -> LoweredBoundary:
    """Lower the bodies of a scene to what finds crossings."""
    found = exact_faces(scene, meshes)
    bounds = bounding_corners(meshes, found.surfaces)
    corners = np.ascontiguousarray(frame.to_units(bounds.corners))
    exact = lower_exact(meshes, found, frame, bounds.corners)
    edges = borders(meshes, found.surfaces)
    reach = bounds.reach / frame.unit_mm
    joined = join(meshes)
    solids = lower_solids(scene, meshes, names, frame, exact.face >= 0, corners, reach)
    near = nearby_triangles(
        corners, reach, CONTACT, [len(mesh.triangles) for mesh in meshes], joined.vertex, exact.face[joined.face],
    )  # fmt: skip
    n_words = max(1, -(-len(solids.medium) // 64))
    tables = Boundary(
        corners, reach, solids.slack, edges.neighbour, edges.bend, edges.beside, edges.inner,
        edges.sharp, near.start, near.triangle, exact, solids.face_solid, solids.medium,
        _bits(solids.medium >= 0, n_words), _bits(solids.reaches_far, n_words),
    )  # fmt: skip
    for array in (*tables, *exact):
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    return LoweredBoundary(
        tables,
        _planes(corners),
        solids.close,
        solids.layer,
        _smooth_facets(scene, meshes, corners, exact.face >= 0),
        found.fallbacks,
    )


def _planes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    with np.errstate(invalid="ignore", divide="ignore"):
        normal /= np.linalg.norm(normal, axis=1)[:, None]
    return np.column_stack([normal, np.einsum("ij,ij->i", normal, corners.mean(axis=1))])


def _bits(chosen: NDArray[np.bool_], n_words: int) -> NDArray[np.uint64]:
    bits = np.zeros(n_words, np.uint64)
    for solid in np.flatnonzero(chosen).tolist():
        bits[solid // 64] |= np.uint64(1 << solid % 64)
    return bits


def _smooth_facets(
    scene: Scene, meshes: tuple[BodyMesh, ...], corners: NDArray[np.float64], is_exact: NDArray[np.bool_]
) -> SmoothFacets:
    """Facets whose normals are estimated where that is asked for; faces (n_faces,) with an exact surface need none."""
    row = np.full(len(corners), -1, np.int32)
    normals, first, first_face, n_rows = [np.zeros((0, 3, 3))], 0, 0, 0
    for mesh, body in zip(meshes, scene.bodies.values(), strict=True):
        if body.geometry.smooth_faces:
            from raymaps.exact.smooth import smooth_normals

            faces = mesh.face_indices(body.geometry.smooth_faces, f"Body '{mesh.name}', smooth_faces")
            chosen = np.isin(mesh.triangle_face, faces) & ~is_exact[first_face + mesh.triangle_face]
            smooth = np.flatnonzero(chosen & ~mesh.degenerate)
            row[first + smooth] = np.arange(n_rows, n_rows + len(smooth))
            normals.append(smooth_normals(mesh, faces)[smooth])
            n_rows += len(smooth)
        first += len(mesh.triangles)
        first_face += len(mesh.face_names)
    return SmoothFacets(row, np.ascontiguousarray(corners[row >= 0]), np.concatenate(normals))
