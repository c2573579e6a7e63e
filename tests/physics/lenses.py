# SPDX-License-Identifier: LGPL-2.1-or-later
"""Lenses as a CAD program hands them over: triangles of any fineness, and the exact surface of each face.

A lens is described by the faces of the sequential trace, so that the two can be compared. What is no sphere or plane is
written as the rational B-spline that equals it, as a CAD program does with a surface of revolution.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.geometry import BodyMesh, write_ply
from raymaps.trace import Tracer
from raymaps.wave import Wave
from tests.physics.sequential import LensFace

Float = NDArray[np.float64]

FACES = ("Front", "Edge", "Rear")


class Placement(NamedTuple):
    """Where a lens stands in a scene: a turn, a factor and a shift."""

    turn: Float  # (3, 3)
    factor: float
    shift_mm: Float  # (3,)

    def points(self, points_mm: Any) -> Float:
        return self.factor * np.asarray(points_mm, float) @ self.turn.T + self.shift_mm

    def vectors(self, vectors: Any) -> Float:
        return np.asarray(vectors, float) @ self.turn.T

    def points_back(self, points_mm: Float) -> Float:
        return (points_mm - self.shift_mm) @ self.turn / self.factor

    def vectors_back(self, vectors: Float) -> Float:
        return vectors @ self.turn

    def record(self, surface: dict[str, Any]) -> dict[str, Any]:
        """The exact surface of a face, placed."""
        placed = dict(surface)
        for key, value in surface.items():
            if key in ("point_mm", "center_mm", "poles_mm"):
                placed[key] = self.points(value).tolist()
            elif key in ("normal", "axis"):
                placed[key] = self.vectors(value).tolist()
            elif key == "radius_mm":
                placed[key] = self.factor * value
        return placed


HERE = Placement(np.eye(3), 1.0, np.zeros(3))


class Lens(NamedTuple):
    """A round lens on the z axis between two faces, ground to a cylinder."""

    front: LensFace
    rear: LensFace
    radius_mm: float
    medium: str = "glass"

    def mesh(self, rings: int) -> tuple[Float, NDArray[np.int64], tuple[int, ...]]:
        """Vertices, triangles, and the number of triangles of each of `FACES`.

        Each face is a net of so many rings around the axis, with six vertices more on each than on the one within.
        """
        disc, inner = _disc_net(rings)
        n, on_rim = len(disc), 6 * rings
        r2 = (self.radius_mm**2) * (disc**2).sum(axis=1)
        xy = self.radius_mm * disc
        front = np.column_stack([xy, self.front.vertex_mm + self.front.sag_mm(r2)])
        rear = np.column_stack([xy, self.rear.vertex_mm + self.rear.sag_mm(r2)])
        a = n - on_rim + np.arange(on_rim)
        b = np.roll(a, -1)
        edge = np.concatenate([np.column_stack([a, b, n + b]), np.column_stack([a, n + b, n + a])])
        triangles = np.concatenate([inner[:, ::-1], edge, n + inner])
        return np.concatenate([front, rear]), triangles, (len(inner), len(edge), len(inner))

    def surfaces(self) -> tuple[dict[str, Any], ...]:
        """Exact surfaces of `FACES`."""
        edge = {"type": "cylinder", "point_mm": [0.0, 0.0, 0.0], "axis": [0.0, 0.0, 1.0], "radius_mm": self.radius_mm}
        return (
            exact_record(self.front, self.radius_mm, is_front=True),
            {**edge, "reversed": False},
            exact_record(self.rear, self.radius_mm, is_front=False),
        )


def _disc_net(rings: int) -> tuple[Float, NDArray[np.int64]]:
    """Points of a unit disc, from the middle outwards, and triangles that face +z."""
    points, triangles = [np.zeros((1, 2))], []
    inner, inner_start = 1, 0
    for ring in range(1, rings + 1):
        n, start = 6 * ring, inner_start + inner
        angle = 2 * math.pi * np.arange(n) / n
        points.append(ring / rings * np.column_stack([np.cos(angle), np.sin(angle)]))
        out = np.arange(n)
        # the inner vertex that is nearest to each outer one; where it goes on, a triangle fills the gap
        below = np.round(np.arange(n + 1) * (ring - 1) / ring).astype(np.int64)
        triangles.append(np.column_stack([start + out, start + (out + 1) % n, inner_start + below[1:] % inner]))
        steps = np.flatnonzero(np.diff(below))
        triangles.append(
            np.column_stack([start + steps, inner_start + below[steps + 1] % inner, inner_start + below[steps] % inner])
        )
        inner, inner_start = n, start
    return np.concatenate(points), np.concatenate(triangles)


def exact_record(face: LensFace, radius_mm: float, *, is_front: bool) -> dict[str, Any]:
    """The exact surface of a face, as in a scene file."""
    c, vertex = face.curvature_per_mm, [0.0, 0.0, face.vertex_mm]
    if face.even or face.conic:
        return {**revolved(*_profile(face, radius_mm)), "reversed": not is_front}
    if c == 0:
        return {"type": "plane", "point_mm": vertex, "normal": [0.0, 0.0, 1.0], "reversed": is_front}
    center = [0.0, 0.0, face.vertex_mm + 1 / c]
    return {"type": "sphere", "center_mm": center, "radius_mm": 1 / abs(c), "reversed": (c < 0) == is_front}


def _profile(face: LensFace, radius_mm: float) -> tuple[Float, Float, Float]:
    """Radius, height and weight of the poles of a face's profile, from the axis to a radius.

    With s from 0 to S = 2 R / (1 + sqrt(1 - (1 + k) c² R²)), a conic is r = s / w, z = (c s² / 2) / w, where
    w = 1 + (1 + k) c² s² / 4. With powers of r up to m, everything is a polynomial over w^m.
    """
    c, k = face.curvature_per_mm, face.conic
    powers = [4 + 2 * i for i in range(len(face.even))]
    m = max(powers, default=1)
    longest = 2 * radius_mm / (1 + math.sqrt(1 - (1 + k) * (c * radius_mm) ** 2))
    s = np.polynomial.Polynomial([0.0, longest])  # of the parameter from 0 to 1
    w = 1 + (1 + k) * c * c / 4 * s**2
    r, z = s * w ** (m - 1), c / 2 * s**2 * w ** (m - 1)
    for a, p in zip(face.even, powers, strict=True):
        z = z + a * s**p * w ** (m - p)
    weight = w**m
    degree = max(len(p.trim().coef) for p in (r, z, weight)) - 1
    r_pole, z_pole, w_pole = (_bernstein(p.coef, degree) for p in (r, z, weight))
    return r_pole / w_pole, face.vertex_mm + z_pole / w_pole, w_pole


def _bernstein(coefficients: Float, degree: int) -> Float:
    """Coefficients of a polynomial over 0 to 1 in Bernstein's basis."""
    a = np.zeros(degree + 1)
    a[: min(len(coefficients), degree + 1)] = coefficients[: degree + 1]
    return np.array([
        sum(math.comb(i, j) / math.comb(degree, j) * a[j] for j in range(i + 1)) for i in range(degree + 1)
    ])  # fmt: skip


def revolved(radius_mm: Float, height_mm: Float, weight: Float) -> dict[str, Any]:
    """B-spline of a Bezier profile turned around z: four quarter circles along u, the profile along v."""
    corner = math.sqrt(0.5)
    around = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)], float)
    of_circle = np.array([1, corner] * 4 + [1])
    degree = len(weight) - 1
    poles = [[[r * x, r * y, z] for r, z in zip(radius_mm, height_mm, strict=True)] for x, y in around]
    return {
        "type": "bspline",
        "degrees": [2, degree],
        "knots": [[0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0]],
        "multiplicities": [[3, 2, 2, 2, 3], [degree + 1, degree + 1]],
        "periodic": [False, False],
        "poles_mm": poles,
        "weights": np.outer(of_circle, weight).tolist(),
    }


def write_lenses(
    folder: Path,
    lenses: Mapping[str, tuple[Lens, int]],
    media: Mapping[str, float],
    *,
    placement: Placement = HERE,
    name: str = "lens",
    **sections: Any,
) -> Path:
    """Write a scene of polished lenses with black edges.

    Parameters
    ----------
    lenses : dict of str to lens and its number of rings
    media : refractive index by name
    sections : further ones of the scene file, in coordinates of the scene
    """
    folder.mkdir(parents=True, exist_ok=True)
    bodies = {}
    for body, (lens, rings) in lenses.items():
        vertices, triangles, counts = lens.mesh(rings)
        faces = np.repeat(np.arange(len(FACES), dtype=np.int32), counts)
        file = f"{name}-{body}.ply"
        write_ply(folder / file, BodyMesh(body, placement.points(vertices), triangles, FACES, faces))
        groups = [
            {"name": face, "triangles": n, "surface": placement.record(surface)}
            for face, n, surface in zip(FACES, counts, lens.surfaces(), strict=True)
        ]
        bodies[body] = {
            "geometry": {"file": file, "faces": groups},
            "medium": lens.medium,
            "surface": "polished",
            "face_surfaces": {"Edge": "black"},
        }
    scene = {
        "format": "raymaps-scene",
        "version": 1,
        "name": name,
        "media": {medium: {"refractive_index": index} for medium, index in media.items()},
        "surfaces": {"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}},
        "bodies": bodies,
        **sections,
    }
    path = folder / f"{name}.scene.json"
    path.write_text(json.dumps(scene), encoding="utf-8")
    return path


class Step(NamedTuple):
    """The rays of a depth, as the tracer has them in float64: at their emission, then after each event."""

    rays: NDArray[np.int32]  # (n,)
    points_mm: Float  # (n, 3)
    directions: Float  # (n, 3) in which they go on
    kind: NDArray[np.uint8]  # (n,) EventKind
    triangle: NDArray[np.int32]  # (n,)


def follow(tracer: Tracer, n_rays: int) -> list[Step]:
    """Trace rays and return all their steps; stored places would be rounded to a millionth of the scene."""
    steps = []

    def watch(depth: int, active: NDArray[np.int32], wave: Wave) -> None:
        points = tracer.compiled.frame.to_mm(wave.end[active])
        steps.append(Step(active.copy(), points, wave.direction[active], wave.state[active], wave.hit[active]))

    tracer.trace_portion(0, n_rays, watch=watch)
    return steps
