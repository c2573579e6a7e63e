# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bodies as a CAD program hands them over: triangles of any fineness, and the exact surface of each face.

They stand where `tests.physics.scenes.body` takes a shape; `write_scene` and `traced` here write the exact surfaces
too. Triangles have their corners on the exact surfaces, face outwards, and are closed.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.geometry import BodyMesh
from raymaps.run import simulate
from tests.physics import scenes
from tests.physics.lenses import FACES, Lens
from tests.physics.scenes import Histories, Shape
from tests.physics.sequential import LensFace

Float = NDArray[np.float64]
Record = dict[str, Any]

_POINTS = ("point_mm", "center_mm", "apex_mm", "poles_mm")
_VECTORS = ("normal", "axis")
_LENGTHS = ("radius_mm", "major_radius_mm", "minor_radius_mm")


class ExactShape(NamedTuple):
    """Triangles in the order of their faces, and the exact surface of each face as a scene describes it."""

    vertices: Float
    triangles: NDArray[np.int64]
    faces: tuple[tuple[str, int], ...]
    surfaces: tuple[Record, ...]

    @property
    def plain(self) -> Shape:
        """The triangles alone."""
        return Shape(self.vertices, self.triangles, self.faces)

    @property
    def mesh(self) -> BodyMesh:
        counts = [n for _, n in self.faces]
        face = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
        names = tuple(name for name, _ in self.faces)
        return BodyMesh("Part", self.vertices.copy(), self.triangles.copy(), names, face)

    @property
    def inside_out(self) -> ExactShape:
        """The same surfaces, seen from the other side."""
        surfaces = tuple({**record, "reversed": not record["reversed"]} for record in self.surfaces)
        return self._replace(triangles=self.triangles[:, ::-1], surfaces=surfaces)

    def placed(self, *, turn: Float | None = None, factor: float = 1.0, shift: Any = (0, 0, 0)) -> ExactShape:
        """Turned by a matrix, then scaled, then moved."""
        matrix = np.eye(3) if turn is None else turn

        def placed(record: Record) -> Record:
            changed = dict(record)
            for key, value in record.items():
                if key in _POINTS:
                    changed[key] = (factor * np.asarray(value, float) @ matrix.T + shift).tolist()
                elif key in _VECTORS:
                    changed[key] = (np.asarray(value, float) @ matrix.T).tolist()
                elif key in _LENGTHS:
                    changed[key] = factor * value
            return changed

        vertices = factor * self.vertices @ matrix.T + shift
        return self._replace(vertices=vertices, surfaces=tuple(placed(record) for record in self.surfaces))

    def moved(self, *by: float) -> ExactShape:
        return self.placed(shift=np.array(by))


# ----------------------------------------------------------------------------------------------------- surfaces


def plane(point: Any, normal: Any, *, reverse: bool = False) -> Record:
    return {"type": "plane", "point_mm": _floats(point), "normal": _floats(normal), "reversed": reverse}


def sphere(center: Any, radius: float, *, reverse: bool = False) -> Record:
    return {"type": "sphere", "center_mm": _floats(center), "radius_mm": float(radius), "reversed": reverse}


def cylinder(radius: float, *, reverse: bool = False) -> Record:
    """Around the z axis."""
    around = {"point_mm": [0.0, 0.0, 0.0], "axis": [0.0, 0.0, 1.0]}
    return {"type": "cylinder", **around, "radius_mm": float(radius), "reversed": reverse}


def _floats(values: Any) -> list[float]:
    return [float(x) for x in values]


# ------------------------------------------------------------------------------------------------------- bodies


class Piece(NamedTuple):
    """A face of revolution: its profile of (radius, z), the solid on the left of its way, and its exact surface."""

    name: str
    profile: Sequence[tuple[float, float]]
    surface: Record


def revolved(pieces: Sequence[Piece], segments: int) -> ExactShape:
    """Body of revolution around z; each piece goes on where the one before ends, from axis to axis or all around."""
    angle = 2 * math.pi * np.arange(segments) / segments
    vertices: list[tuple[float, float, float]] = []
    rings: dict[tuple[float, float], NDArray[np.int64]] = {}

    def ring(r: float, z: float) -> NDArray[np.int64]:
        key = (round(r, 12), round(z, 12))
        if key not in rings:
            n = segments if key[0] > 0 else 1
            rings[key] = np.broadcast_to(len(vertices) + np.arange(n), segments)
            vertices.extend((r * math.cos(a), r * math.sin(a), z) for a in angle[:n])
        return rings[key]

    triangles, faces = [], []
    for piece in pieces:
        of_face: list[NDArray[np.int64]] = []
        for low, high in zip(piece.profile, piece.profile[1:], strict=False):
            a, b = ring(*low), ring(*high)
            c, d = np.roll(b, -1), np.roll(a, -1)
            if a[0] != a[-1]:
                of_face.append(np.column_stack([a, d, c]))
            if b[0] != b[-1]:
                of_face.append(np.column_stack([a, c, b]))
        triangles.append(np.concatenate(of_face))
        faces.append((piece.name, len(triangles[-1])))
    surfaces = tuple(piece.surface for piece in pieces)
    return ExactShape(np.array(vertices), np.concatenate(triangles), tuple(faces), surfaces)


def rod(radius: float, length: float, segments: int = 32) -> ExactShape:
    """Cylinder from z = 0; faces Bottom, Side, Top."""
    return revolved(
        [
            Piece("Bottom", [(0, 0), (radius, 0)], plane((0, 0, 0), (0, 0, -1))),
            Piece("Side", [(radius, 0), (radius, length)], cylinder(radius)),
            Piece("Top", [(radius, length), (0, length)], plane((0, 0, length), (0, 0, 1))),
        ],
        segments,
    )


def ring(outer: float, inner: float, thickness: float, segments: int = 32) -> ExactShape:
    """Disc from z = 0 with a hole through it; faces Bottom, Rim, Top, Hole."""
    return revolved(
        [
            Piece("Bottom", [(inner, 0), (outer, 0)], plane((0, 0, 0), (0, 0, -1))),
            Piece("Rim", [(outer, 0), (outer, thickness)], cylinder(outer)),
            Piece("Top", [(outer, thickness), (inner, thickness)], plane((0, 0, thickness), (0, 0, 1))),
            Piece("Hole", [(inner, thickness), (inner, 0)], cylinder(inner, reverse=True)),
        ],
        segments,
    )


def boss(outer: float, inner: float, thickness: float, height: float, segments: int = 32) -> ExactShape:
    """Disc from z = 0 with a pin on it; faces Bottom, Rim, Top, Pin, End. Top and Pin meet at a concave edge."""
    top = thickness + height
    return revolved(
        [
            Piece("Bottom", [(0, 0), (outer, 0)], plane((0, 0, 0), (0, 0, -1))),
            Piece("Rim", [(outer, 0), (outer, thickness)], cylinder(outer)),
            Piece("Top", [(outer, thickness), (inner, thickness)], plane((0, 0, thickness), (0, 0, 1))),
            Piece("Pin", [(inner, thickness), (inner, top)], cylinder(inner)),
            Piece("End", [(inner, top), (0, top)], plane((0, 0, top), (0, 0, 1))),
        ],
        segments,
    )


def cone(radius: float, height: float, segments: int = 32) -> ExactShape:
    """Cone on z = 0 with its apex above; faces Base, Side."""
    apex = {"apex_mm": [0.0, 0.0, float(height)], "axis": [0.0, 0.0, -1.0]}
    surface = {"type": "cone", **apex, "half_angle_deg": math.degrees(math.atan2(radius, height)), "reversed": False}
    return revolved(
        [
            Piece("Base", [(0, 0), (radius, 0)], plane((0, 0, 0), (0, 0, -1))),
            Piece("Side", [(radius, 0), (0, height)], surface),
        ],
        segments,
    )


def torus(major: float, minor: float, segments: int = 48, around: int = 24) -> ExactShape:
    """Torus around z; one face."""
    angle = 2 * math.pi * np.arange(around + 1) / around
    profile = [(major + minor * math.cos(a), minor * math.sin(a)) for a in angle[:-1]]
    surface = {
        "type": "torus",
        "center_mm": [0.0, 0.0, 0.0],
        "axis": [0.0, 0.0, 1.0],
        "major_radius_mm": float(major),
        "minor_radius_mm": float(minor),
        "reversed": False,
    }
    return revolved([Piece("Face1", [*profile, profile[0]], surface)], segments)


def ball(radius: float, segments: int = 32) -> ExactShape:
    """Sphere of meridians and parallels; one face."""
    angle = np.linspace(-math.pi / 2, math.pi / 2, segments // 2 + 1)[1:-1]
    profile = [(0.0, -radius), *((radius * math.cos(a), radius * math.sin(a)) for a in angle), (0.0, radius)]
    return revolved([Piece("Face1", profile, sphere((0, 0, 0), radius))], segments)


def pill(radius: float, length: float, segments: int = 32) -> ExactShape:
    """Cylinder from z = 0 with half a sphere at each end; faces Low, Side, High, which go on into each other."""
    angle = np.linspace(0, math.pi / 2, segments // 4 + 1)
    low = [(0.0, -radius), *((radius * math.sin(a), -radius * math.cos(a)) for a in angle[1:-1]), (radius, 0.0)]
    high = [(r, length - z) for r, z in reversed(low)]
    return revolved(
        [
            Piece("Low", low, sphere((0, 0, 0), radius)),
            Piece("Side", [(radius, 0), (radius, length)], cylinder(radius)),
            Piece("High", high, sphere((0, 0, length), radius)),
        ],
        segments,
    )


def sharp_lens(radius: float, edge_deg: float, segments: int = 32, rings: int = 6) -> ExactShape:
    """Two equal caps of spheres that meet in an edge at z = 0 without a rim; faces Low, High."""
    half = math.radians(edge_deg) / 2
    curvature_radius = radius / math.sin(half)
    depth = curvature_radius * math.cos(half)
    r = np.linspace(0, radius, rings + 1)
    # sqrt(R² - r²) - depth without cancellation
    z = (radius**2 - r**2) / (np.sqrt(curvature_radius**2 - r**2) + depth)
    up = [(float(a), float(b)) for a, b in zip(r, z, strict=True)]
    return revolved(
        [
            Piece("Low", [(a, -b) for a, b in up], sphere((0, 0, depth), curvature_radius)),
            Piece("High", up[::-1], sphere((0, 0, -depth), curvature_radius)),
        ],
        segments,
    )


def lens(front: LensFace, rear: LensFace, radius: float, rings: int = 8) -> ExactShape:
    """Lens on the z axis, spherical or aspherical (then B-splines), ground to a cylinder; faces Front, Edge, Rear."""
    described = Lens(front, rear, radius)
    vertices, triangles, counts = described.mesh(rings)
    return ExactShape(vertices, triangles, tuple(zip(FACES, counts, strict=True)), described.surfaces())


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> ExactShape:
    """Box (or plane-parallel plate) with the faces -x +x -y +y -z +z."""
    shape = scenes.box(low, high)
    surfaces = []
    for axis in range(3):
        for point, sign in ((low, -1.0), (high, 1.0)):
            surfaces.append(plane(point, sign * np.eye(3)[axis]))
    return ExactShape(shape.vertices, shape.triangles, shape.faces, tuple(surfaces))


# ------------------------------------------------------------------------------------------------------- scenes


def write_scene(folder: Path, bodies: dict[str, dict[str, Any]], *, name: str = "scene", **sections: Any) -> Path:
    """Write a scene; bodies of an `ExactShape` with their exact surfaces."""
    path = scenes.write_scene(folder, bodies, name=name, **sections)
    written = json.loads(path.read_text())
    for body, face, record in _records(bodies):
        for group in written["bodies"][body]["geometry"]["faces"]:
            if group["name"] == face:
                group["surface"] = record
    path.write_text(json.dumps(written))
    return path


def _records(bodies: dict[str, dict[str, Any]]) -> Iterator[tuple[str, str, Record]]:
    for body, parts in bodies.items():
        shape = parts["shape"]
        if isinstance(shape, ExactShape):
            for (face, _), record in zip(shape.faces, shape.surfaces, strict=True):
                yield body, face, record


def traced(
    folder: Path, bodies: dict[str, dict[str, Any]], *, rays: int, seed: int = 1, name: str = "scene", **sections: Any
) -> Histories:
    """Write a scene with exact surfaces, simulate it, and return the stored histories."""
    scene = write_scene(folder, bodies, name=name, **sections)
    return Histories(simulate(scene, folder / f"{name}.raymap", rays=rays, seed=seed, threads=2))
