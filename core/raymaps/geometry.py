# SPDX-License-Identifier: LGPL-2.1-or-later
"""Triangles of the bodies, read through trimesh (our own plain PLY without it) and checked once.

A mesh keeps its triangles in the order of the file, so that CAD faces are runs of triangles.
"""

from __future__ import annotations

import hashlib
import os
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import OutputError, SceneError, listed, shortened, unknown_name
from raymaps.scene import Body, Scene

__all__ = ["BodyMesh", "load_bodies", "winding_number", "write_ply"]

FORMATS = (".stl", ".ply", ".obj", ".glb")
#: Triangles at which it is asked whether a body parts space.
PROBES = 24

_PLY_FACE = np.dtype([("n", "u1"), ("v", "<i4", 3)])
_PLAIN_PLY = re.compile(
    rb"ply\nformat binary_little_endian 1\.0\n(?:comment [^\n]*\n)*element vertex (\d{1,12})\n"
    rb"property double x\nproperty double y\nproperty double z\n"
    rb"element face (\d{1,12})\nproperty list uchar int vertex_indices\nend_header\n"
)


@dataclass(frozen=True)
class BodyMesh:
    """Triangles of one body.

    Attributes
    ----------
    name : str
    vertices_mm : (n_vertices, 3) float64
    triangles : (n_triangles, 3) int64
        Vertex indices, counter-clockwise seen from outside.
    face_names : tuple of str
    triangle_face : (n_triangles,) int32
        Index into `face_names`, ascending.
    """

    name: str
    vertices_mm: NDArray[np.float64]
    triangles: NDArray[np.int64]
    face_names: tuple[str, ...]
    triangle_face: NDArray[np.int32]

    def __post_init__(self) -> None:
        for array in (self.vertices_mm, self.triangles, self.triangle_face):
            array.setflags(write=False)

    @cached_property
    def corners_mm(self) -> NDArray[np.float64]:
        """Corners of each triangle, (n_triangles, 3 corners, 3)."""
        return self.vertices_mm[self.triangles]

    @cached_property
    def area_vectors_mm2(self) -> NDArray[np.float64]:
        """Outward normal of each triangle times its area, (n_triangles, 3)."""
        a, b, c = np.moveaxis(self.corners_mm, 1, 0)
        return 0.5 * np.cross(b - a, c - a)

    @cached_property
    def degenerate(self) -> NDArray[np.bool_]:
        """Triangles without an area that float64 can tell from zero, (n_triangles,). Light can't hit them."""
        area = np.linalg.norm(self.area_vectors_mm2, axis=1)
        longest = np.ptp(self.corners_mm, axis=1).max(axis=1)
        return ~(area > 1e-14 * longest**2)

    @cached_property
    def volume_mm3(self) -> float:
        """Signed volume inside the triangles; negative if they are inside out."""
        origin = self.vertices_mm.mean(axis=0)
        return float(np.einsum("ij,ij->", self.corners_mm.mean(axis=1) - origin, self.area_vectors_mm2) / 3)

    @cached_property
    def corner_places(self) -> NDArray[np.int64]:
        """Number of the place of each corner, (n_triangles, 3).

        Vertices that coincide within a ten-millionth of the body's size are in one place.
        """
        size = float(np.ptp(self.vertices_mm, axis=0).max())
        grid = np.round((self.vertices_mm - self.vertices_mm.min(axis=0)) / (size * 1e-7)).astype(np.int64)
        _, place = np.unique(grid, axis=0, return_inverse=True)
        return place.reshape(-1).astype(np.int64)[self.triangles]

    @cached_property
    def open_edges(self) -> NDArray[np.int64]:
        """Triangles (their indices) that have an edge without exactly one opposite partner; empty if closed."""
        corner = self.corner_places
        start, end = corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1)
        real = start != end
        n = int(corner.max()) + 1
        forward, backward = start * n + end, end * n + start
        keys, counts = np.unique(forward[real], return_counts=True)

        def uses(edge: NDArray[np.int64]) -> NDArray[np.int64]:
            at = np.minimum(np.searchsorted(keys, edge), len(keys) - 1)
            return np.where(keys[at] == edge, counts[at], 0)

        bad = real & (uses(forward) != uses(backward))
        return np.unique(np.flatnonzero(bad) // 3)

    @cached_property
    def parts_space(self) -> int:
        """Whether the triangles part what is behind them from what is before them: 1, their normals outwards, -1,
        inwards, 0 not (an open shell, or one that overlaps itself).

        Asked at some points close to the triangles.
        """
        if not self.is_closed or self.degenerate.all():
            return 0
        sound = np.flatnonzero(~self.degenerate)
        some = sound[np.linspace(0, len(sound) - 1, min(len(sound), PROBES)).astype(np.int64)]
        normal = self.area_vectors_mm2[some] / np.linalg.norm(self.area_vectors_mm2[some], axis=1)[:, None]
        off = 1e-6 * float(np.ptp(self.vertices_mm, axis=0).max()) * normal
        middle = self.corners_mm[some].mean(axis=1)
        before = np.array([winding_number(self.corners_mm, point) for point in middle + off])
        behind = np.array([winding_number(self.corners_mm, point) for point in middle - off])
        for outwards, inside in ((1, 1.0), (-1, 0.0)):
            if np.abs(behind - inside).max() < 0.1 and np.abs(before - inside + 1.0).max() < 0.1:
                return outwards
        return 0

    @property
    def is_closed(self) -> bool:
        """Whether the triangles enclose a volume without gaps."""
        return not len(self.open_edges)

    @cached_property
    def edge_uses(self) -> NDArray[np.int64]:
        """How many triangles share each edge, whichever way they go, (n_triangles, 3); 0 for an edge without length."""
        start, end = self.corner_places, np.roll(self.corner_places, -1, axis=1)
        key = np.minimum(start, end) * (int(start.max()) + 1) + np.maximum(start, end)
        real = start != end
        _, edge, count = np.unique(key[real], return_inverse=True, return_counts=True)
        uses = np.zeros(key.shape, np.int64)
        uses[real] = count[edge.reshape(-1)]
        return uses

    @property
    def is_closed_but_for_turns(self) -> bool:
        """Whether each edge has a partner, though it may go the wrong way."""
        return bool((self.edge_uses % 2 == 0).all())

    def face_indices(self, names: tuple[str, ...] | None, where: str) -> NDArray[np.int64]:
        """Indices of named faces (all if None); raises `SceneError` for an unknown name."""
        if names is None:
            return np.arange(len(self.face_names))
        what = f"face of body '{self.name}'"
        for name in names:
            if name not in self.face_names:
                raise SceneError(f"{where}: {unknown_name(what, name, self.face_names)}")
        return np.array([self.face_names.index(name) for name in names], np.int64)


def load_bodies(scene: Scene) -> tuple[BodyMesh, ...]:
    """Read the geometry of all bodies of a scene, in the scene's order.

    Raises
    ------
    SceneError
        If a file is missing, empty or not geometry, has NaN, does not have the faces that the scene counts, or is
        open or inside out although the body has a medium; its ``faults`` hold a sentence for each such body.
    """
    meshes, faults = [], []
    for name, body in scene.bodies.items():
        try:
            meshes.append(_load_body(scene.folder, name, body))
        except SceneError as error:
            faults.append(str(error))
    if faults:
        raise SceneError(faults[0], tuple(faults))
    return tuple(meshes)


def _load_body(folder: Path, name: str, body: Body) -> BodyMesh:
    file = body.geometry.file
    where = f"Body '{name}', geometry '{shortened(file, 100)}'"
    parts = _read_parts(folder / body.geometry.file, where)
    with np.errstate(over="ignore"):
        vertices = np.concatenate([vertices for _, vertices, _ in parts]) * body.geometry.mm_per_unit
    starts = np.cumsum([0, *(len(vertices) for _, vertices, _ in parts[:-1])])
    triangles = np.concatenate([faces + start for (_, _, faces), start in zip(parts, starts, strict=True)])
    if not len(triangles):
        raise SceneError(f"{where}: it holds no triangles; export the body again.")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise SceneError(f"{where}: a triangle names a vertex that does not exist; the file is damaged.")
    if not np.isfinite(vertices[triangles]).all():
        raise SceneError(f"{where}: a vertex is not a finite number (NaN or infinite); export the body again.")

    face_names, counts = _face_groups(body, parts, len(triangles), where)
    triangle_face = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
    mesh = BodyMesh(name, np.ascontiguousarray(vertices, np.float64), triangles, face_names, triangle_face)

    if mesh.degenerate.all():
        raise SceneError(
            f"{where}: none of its {len(triangles)} triangles has an area; check mm_per_unit and the export."
        )
    mesh.face_indices(tuple(body.face_surfaces), f"Body '{name}', face_surfaces")
    if body.medium is not None:
        _check_solid(mesh, body.medium)
    return mesh


def _check_solid(mesh: BodyMesh, medium: str) -> None:
    """A body that is to hold a medium is closed, and its triangles face outward."""
    is_to_hold = f"Body '{mesh.name}' is to hold the medium '{medium}' but"
    if not mesh.is_closed:
        n = len(mesh.open_edges)
        shown = listed([mesh.face_names[i] for i in np.unique(mesh.triangle_face[mesh.open_edges])])
        where = ", ".join(f"{x:.4g}" for x in mesh.corners_mm[mesh.open_edges[0]].mean(axis=0))
        if mesh.is_closed_but_for_turns:
            raise SceneError(
                f"{is_to_hold} its triangles do not agree which side is outside: {n} have a neighbour that is turned "
                f"the other way (faces {shown}; one is near {where} mm); turn them, or give the body no medium."
            )
        raise SceneError(
            f"{is_to_hold} its shell is open: {n} triangles have an edge without a partner (faces {shown}; one is near "
            f"{where} mm); close the shell or give the body no medium."
        )
    if mesh.volume_mm3 < 0:
        raise SceneError(f"{is_to_hold} is inside out (its volume is {mesh.volume_mm3:.4g} mm³); flip its triangles.")


def _read_parts(path: Path, where: str) -> list[tuple[str, NDArray[np.float64], NDArray[np.int64]]]:
    """(name, vertices, triangles) of each sub-mesh of a file, in the order of the file."""
    if path.suffix.lower() not in FORMATS:
        raise SceneError(f"{where}: '{path.suffix}' is not a geometry format that is read; use {', '.join(FORMATS)}.")
    if not os.path.isfile(path):
        raise SceneError(f"{where}: there is no file of that name beside the scene.")
    plain = _read_plain_ply(path) if path.suffix.lower() == ".ply" else None
    if plain is not None:
        return [("", *plain)]
    import trimesh  # takes a second, and brings scipy along

    is_obj = path.suffix.lower() == ".obj"
    options: dict[str, Any] = {"split_objects": True, "group_material": False} if is_obj else {}
    try:
        loaded = trimesh.load_scene(path, process=False, **options)
        placed = [
            (str(name), loaded.geometry[name].copy().apply_transform(loaded.graph[node][0]))
            for name, nodes in _nodes_in_order(loaded, is_obj).items()
            for node in nodes
            if isinstance(loaded.geometry[name], trimesh.Trimesh)
        ]
    except Exception as error:
        raise SceneError(
            f"{where}: the file is damaged or not {path.suffix[1:].upper()} ({_one_line(error)})."
        ) from error
    parts = [(name, np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)) for name, mesh in placed]
    if not parts:
        raise SceneError(f"{where}: it holds no triangles; export the body again.")
    return parts


def _read_plain_ply(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    """Vertices and triangles of a PLY file as `write_ply` and the workbench write it; None of any other."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    found = _PLAIN_PLY.match(data)
    if found is None:
        return None
    n_vertices, n_triangles = int(found[1]), int(found[2])
    if len(data) != found.end() + 24 * n_vertices + _PLY_FACE.itemsize * n_triangles or not n_triangles:
        return None
    vertices = np.frombuffer(data, "<f8", 3 * n_vertices, found.end()).reshape(-1, 3)
    faces = np.frombuffer(data, _PLY_FACE, n_triangles, found.end() + vertices.nbytes)
    if (faces["n"] != 3).any():
        return None
    return vertices.astype(np.float64), faces["v"].astype(np.int64)


def _nodes_in_order(loaded: Any, is_obj: bool) -> dict[str, list[str]]:
    """Where each sub-mesh of a loaded file stands, in the order of the file."""
    names = list(loaded.geometry)
    if is_obj:
        names.reverse()  # trimesh takes the objects of an OBJ file from the end
    nodes: dict[str, list[str]] = {name: [] for name in names}
    for node in sorted(loaded.graph.nodes_geometry):
        nodes[loaded.graph[node][1]].append(node)
    return nodes


def _face_groups(
    body: Body, parts: list[tuple[str, NDArray[np.float64], NDArray[np.int64]]], n_triangles: int, where: str
) -> tuple[tuple[str, ...], list[int]]:
    """Names of the faces and their numbers of triangles."""
    groups = body.geometry.faces
    if groups is None:
        names = [name or f"Face{i}" for i, (name, _, _) in enumerate(parts, 1)] if len(parts) > 1 else ["Face1"]
        if len(set(names)) < len(names):
            names = [f"Face{i}" for i in range(1, len(parts) + 1)]
        return tuple(names), [len(faces) for _, _, faces in parts]
    counts = [group.triangles for group in groups]
    if sum(counts) != n_triangles:
        raise SceneError(
            f"{where}: the faces of the scene count {sum(counts)} triangles, the file holds {n_triangles}; "
            "export again."
        )
    if len({group.name for group in groups}) < len(groups):
        raise SceneError(f"{where}: two faces have the same name; names of faces must differ.")
    return tuple(group.name for group in groups), counts


def winding_number(corners: NDArray[np.float64], point: NDArray[np.float64]) -> float:
    """How often triangles wind around a point: 1 inside a closed outward mesh, 0 outside.

    Parameters
    ----------
    corners : (n_triangles, 3 corners, 3) float64
    point : (3,) float64, in the same unit

    Returns
    -------
    float; 0.5 on a flat face, less on an edge or a corner.

    References
    ----------
    A. Van Oosterom, J. Strackee: The solid angle of a plane triangle, IEEE Trans. Biomed. Eng. 30 (1983), eq. 8.
    """
    a, b, c = np.moveaxis(corners - point, 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
    denominator = (
        la * lb * lc
        + np.einsum("ij,ij->i", a, b) * lc
        + np.einsum("ij,ij->i", b, c) * la
        + np.einsum("ij,ij->i", c, a) * lb
    )
    in_plane = np.abs(numerator) <= 1e-14 * la * lb * lc  # seen edge-on: no solid angle
    return float(2 * np.where(in_plane, 0.0, np.arctan2(numerator, denominator)).sum() / (4 * np.pi))


def write_ply(path: Path, mesh: BodyMesh) -> None:
    """Write a mesh as binary PLY with float64 vertices in mm, its triangles in their order."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(mesh.vertices_mm)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(mesh.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(mesh.triangles), _PLY_FACE)
    faces["n"], faces["v"] = 3, mesh.triangles
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(header.encode() + mesh.vertices_mm.astype("<f8").tobytes() + faces.tobytes())
    except OSError as error:
        raise OutputError(f"Geometry '{path}' can't be written: {error.strerror}.") from error


def mesh_digest(mesh: BodyMesh) -> str:
    """Hash of a mesh's corners and faces: the same for equal triangles, however the file shares its vertices."""
    digest = hashlib.sha256(repr(mesh.face_names).encode())
    digest.update(np.ascontiguousarray(mesh.corners_mm, "<f8").tobytes())
    digest.update(np.ascontiguousarray(mesh.triangle_face, "<i4").tobytes())
    return digest.hexdigest()


def _one_line(error: Exception) -> str:
    return shortened(" ".join(str(error).split()) or type(error).__name__, 100)
