# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the tests of physics share: shapes, scenes written and traced, histories as columns, tolerances.

Results of a run are compared within five standard errors, computed from the run's own rays.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from raymaps.geometry import BodyMesh, write_ply
from raymaps.kinds import EventKind
from raymaps.run import simulate
from raymaps.store import RayMap

SIGMAS = 5.0


# ----------------------------------------------------------------------------------------------------- shapes


class Shape(NamedTuple):
    """Triangles in the order of their faces."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    faces: tuple[tuple[str, int], ...]

    @property
    def areas(self) -> NDArray[np.float64]:
        """(n_triangles,)."""
        a, b, c = np.moveaxis(self.vertices[self.triangles], 1, 0)
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)

    @property
    def area(self) -> float:
        return float(self.areas.sum())

    @property
    def inside_out(self) -> Shape:
        return self._replace(triangles=self.triangles[:, ::-1])

    def moved(self, *by: float) -> Shape:
        return self._replace(vertices=self.vertices + np.array(by))

    def scaled(self, factor: float) -> Shape:
        return self._replace(vertices=self.vertices * factor)

    def turned(self, angle_rad: float, axis: tuple[float, float, float]) -> Shape:
        matrix = trimesh.transformations.rotation_matrix(angle_rad, axis)[:3, :3]
        return self._replace(vertices=self.vertices @ matrix.T)

    def grouped(self, face_of_triangle: NDArray[np.int64], names: tuple[str, ...]) -> Shape:
        """The same triangles sorted into faces."""
        order = np.argsort(face_of_triangle, kind="stable")
        counts = np.bincount(face_of_triangle, minlength=len(names))
        faces = tuple((name, int(n)) for name, n in zip(names, counts, strict=True))
        return Shape(self.vertices, self.triangles[order], faces)


def shape_of(mesh: trimesh.Trimesh) -> Shape:
    """A mesh of trimesh as one face."""
    return Shape(np.array(mesh.vertices, float), np.array(mesh.faces, np.int64), (("Face1", len(mesh.faces)),))


def ball(radius: float, subdivisions: int = 4) -> Shape:
    """Icosphere whose vertices lie on the sphere."""
    return shape_of(trimesh.creation.icosphere(subdivisions, radius))


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Shape:
    """Box with the faces -x +x -y +y -z +z, two triangles each."""
    mesh = trimesh.creation.box(bounds=(low, high))
    axis = np.abs(mesh.face_normals).argmax(axis=1)
    positive = mesh.face_normals[np.arange(12), axis] > 0
    return shape_of(mesh).grouped(2 * axis + positive, ("-x", "+x", "-y", "+y", "-z", "+z"))


def disc(radius: float, segments: int = 256, *, up: bool = True) -> Shape:
    """Flat regular polygon of the area of a disc of the radius, at z = 0, its front up or down."""
    step = 2 * math.pi / segments
    corner_radius = radius * math.sqrt(step / math.sin(step))
    angle = step * np.arange(segments)
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(segments)], axis=1) * corner_radius
    i = np.arange(segments)
    triangles = np.stack([np.full(segments, segments), i, (i + 1) % segments], axis=1)
    shape = Shape(np.vstack([rim, np.zeros((1, 3))]), triangles, (("Face1", segments),))
    return shape if up else shape.inside_out


def revolved(profile: NDArray[np.float64], segments: int) -> Shape:
    """Solid of revolution around z of a profile of (radius, z), from the axis to the axis, z falling outside."""
    mesh = trimesh.creation.revolve(profile, sections=segments)
    shape = shape_of(mesh)
    return shape if mesh.volume > 0 else shape.inside_out


def prism(apex_rad: float, side: float, length: float) -> Shape:
    """Isosceles prism along y with its apex up at z = 0; faces left, right and the rest."""
    half, low = side * math.sin(apex_rad / 2), -side * math.cos(apex_rad / 2)
    section = np.array([[0, 0], [-half, low], [half, low]], float)
    vertices = np.array([[x, y, z] for y in (-length / 2, length / 2) for x, z in section])
    quads = ((0, 3, 4, 1), (0, 2, 5, 3), (1, 4, 5, 2))
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))] + [(0, 1, 2), (3, 5, 4)]
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    if mesh.volume < 0:
        mesh.invert()
    x, z = mesh.face_normals[:, 0], mesh.face_normals[:, 2]
    which = np.where((z > 1e-6) & (x < 0), 0, np.where((z > 1e-6) & (x > 0), 1, 2))
    return shape_of(mesh).grouped(which, ("left", "right", "rest"))


# ----------------------------------------------------------------------------------------------------- scenes


def body(shape: Shape, surface: str, medium: str | None = None, **face_surfaces: str) -> dict[str, Any]:
    """A body of a scene; keys ``plus_z`` and the like of face_surfaces stand for the faces ``+z``."""
    named = {name.replace("plus_", "+").replace("minus_", "-"): prop for name, prop in face_surfaces.items()}
    return {"shape": shape, "surface": surface, "medium": medium, "face_surfaces": named}


def write_scene(folder: Path, bodies: dict[str, dict[str, Any]], *, name: str = "scene", **sections: Any) -> Path:
    """Write a scene file with its geometry; ``sections`` are those of the file."""
    folder.mkdir(parents=True, exist_ok=True)
    described = {}
    for body_name, parts in bodies.items():
        shape: Shape = parts["shape"]
        counts = [n for _, n in shape.faces]
        faces = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
        file = f"{name}-{body_name}.ply"
        names = tuple(face for face, _ in shape.faces)
        write_ply(folder / file, BodyMesh(body_name, shape.vertices.copy(), shape.triangles.copy(), names, faces))
        geometry = {"file": file, "faces": [{"name": face, "triangles": n} for face, n in shape.faces if n]}
        described[body_name] = {"geometry": geometry, **{key: parts[key] for key in parts if key != "shape"}}
    path = folder / f"{name}.scene.json"
    path.write_text(json.dumps({"format": "raymaps-scene", "version": 1, "bodies": described, **sections}))
    return path


def traced(
    folder: Path, bodies: dict[str, dict[str, Any]], *, rays: int, seed: int = 1, name: str = "scene", **sections: Any
) -> Histories:
    """Write a scene, simulate it, and return the stored histories."""
    scene = write_scene(folder, bodies, name=name, **sections)
    return Histories(simulate(scene, folder / f"{name}.raymap", rays=rays, seed=seed, threads=2))


def disc_source(
    position: Any, direction: Any, radius: float, flux_w: float = 1.0, rgb: tuple[float, float, float] = (1, 1, 1)
) -> dict[str, Any]:
    """A collimated beam."""
    return {
        "kind": "disc",
        "flux_w": flux_w,
        "rgb": list(rgb),
        "radius_mm": radius,
        "position_mm": [float(x) for x in position],
        "direction": [float(x) for x in direction],
    }


def rectangle(center: Any, width: float, height: float, **more: Any) -> dict[str, Any]:
    """A detector that faces up unless ``more`` says otherwise."""
    axes = {"normal": [0, 0, 1], "x_axis": [1, 0, 0]}
    return {"center_mm": [float(x) for x in center], "width_mm": width, "height_mm": height, **axes, **more}


# -------------------------------------------------------------------------------------------------- histories


@dataclass(frozen=True)
class Histories:
    """All stored rays of a map as columns, one row an event (or a crossing), in the order of the rays."""

    raymap: RayMap

    def _joined(self, column: Any) -> NDArray[Any]:
        return np.concatenate([column(portion) for portion in self.raymap.portions])

    def _step(self, name: str) -> NDArray[Any]:
        return self._joined(lambda p: getattr(p.signatures, name)[p.event_step])

    def index(self, section: str, name: str) -> int:
        """Index of a named source, body, medium or detector."""
        return getattr(self.raymap.names, section).index(name)

    def face_index(self, body_name: str, face: str) -> int:
        return self.raymap.names.faces.index((self.index("bodies", body_name), face))

    @cached_property
    def n_rays(self) -> int:
        return self.raymap.n_rays

    @cached_property
    def ray_source(self) -> NDArray[np.int16]:
        """(n_rays,)."""
        return self._joined(lambda p: p.signatures.ray_source[p.ray_signature])

    @cached_property
    def offsets(self) -> NDArray[np.int64]:
        """(n_rays + 1,)."""
        counts = self._joined(lambda p: np.diff(p.event_offsets))
        return np.concatenate([[0], np.cumsum(counts)])

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """Row of each ray's emission."""
        return self.offsets[:-1]

    @cached_property
    def last(self) -> NDArray[np.int64]:
        """Row of each ray's last event."""
        return self.offsets[1:] - 1

    @cached_property
    def ray(self) -> NDArray[np.int64]:
        """Ray of each event."""
        return np.repeat(np.arange(self.n_rays), np.diff(self.offsets))

    @cached_property
    def number(self) -> NDArray[np.int64]:
        """0 for a ray's emission, 1 for its next event and so on."""
        return np.arange(len(self.ray)) - self.first[self.ray]

    @cached_property
    def kind(self) -> NDArray[np.uint8]:
        return self._step("kind")

    @cached_property
    def face(self) -> NDArray[np.int32]:
        return self._step("face")

    @cached_property
    def body(self) -> NDArray[np.int32]:
        return self._step("body")

    @cached_property
    def medium(self) -> NDArray[np.int16]:
        return self._step("medium")

    @cached_property
    def triangle(self) -> NDArray[np.int32]:
        return self._joined(lambda p: p.triangle)

    @cached_property
    def position(self) -> NDArray[np.float64]:
        return self._joined(lambda p: p.position_mm).astype(np.float64)

    @cached_property
    def light(self) -> NDArray[np.float64]:
        """(n_events, 3) after the event, relative to the emission."""
        return self._joined(lambda p: p.light).astype(np.float64)

    @cached_property
    def light_before(self) -> NDArray[np.float64]:
        """(n_events, 3) with which the segment to the event started; 0 for the emission."""
        before = np.roll(self.light, 1, axis=0)
        before[self.first] = 0
        return before

    @cached_property
    def way(self) -> NDArray[np.float64]:
        """(n_events, 3) from the ray's event before to this one; NaN for the emission."""
        way = self.position - np.roll(self.position, 1, axis=0)
        way[self.first] = np.nan
        return way

    def on_body(self, name: str) -> NDArray[np.bool_]:
        return self.body == self.index("bodies", name)

    def count_kind(self, *kinds: EventKind) -> int:
        return int(np.isin(self.kind, kinds).sum())

    @cached_property
    def crossing_row(self) -> NDArray[np.int64]:
        """Row of the event that starts each crossing segment."""
        starts = np.cumsum([0, *(p.n_events for p in self.raymap.portions)])
        return np.concatenate([p.crossing_row + s for p, s in zip(self.raymap.portions, starts, strict=False)])

    @cached_property
    def crossing_ray(self) -> NDArray[np.int64]:
        return self.ray[self.crossing_row]

    @cached_property
    def crossing_detector(self) -> NDArray[np.int16]:
        return self._joined(lambda p: p.crossing_detector)

    @cached_property
    def crossing_xy(self) -> NDArray[np.float64]:
        return self._joined(lambda p: p.crossing_xy_mm).astype(np.float64)

    @cached_property
    def crossing_angle(self) -> NDArray[np.float64]:
        return self._joined(lambda p: p.crossing_angle_rad).astype(np.float64)

    @cached_property
    def crossing_registered(self) -> NDArray[np.bool_]:
        return self._joined(lambda p: p.crossing_registered)

    def through(self, detector: str) -> NDArray[np.bool_]:
        """Which crossings are of a detector."""
        return self.crossing_detector == self.index("detectors", detector)

    def per_ray(self, rows: NDArray[np.bool_] | NDArray[np.int64], values: Any = 1.0) -> NDArray[np.float64]:
        """Sum of values at some events for each ray, (n_rays,) or (n_rays, 3)."""
        rays = self.ray[rows]
        values = np.broadcast_to(values, (len(rays), *np.shape(values)[1:]))
        total = np.zeros((self.n_rays, *values.shape[1:]))
        np.add.at(total, rays, values)
        return total

    def crossings_per_ray(self, rows: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Relative light through some crossings for each ray, all bands."""
        return np.bincount(
            self.crossing_ray[rows], self.light[self.crossing_row[rows]].sum(axis=1), minlength=self.n_rays
        )

    def flux_w(self, per_ray: NDArray[np.float64]) -> tuple[Any, Any]:
        """Flux of what each ray brings relative to its emission, and its standard error; rays of a source are equal."""
        watts = self.raymap.ray_flux_w
        mean, variance = 0.0, 0.0
        for source in range(len(watts)):
            values = per_ray[self.ray_source == source]
            n = len(values)
            mean = mean + watts[source] * values.sum(axis=0)
            variance = variance + watts[source] ** 2 * n * values.var(axis=0, ddof=1)
        return mean, np.sqrt(variance)


# ------------------------------------------------------------------------------------------------- tolerances


def agrees(what: str, measured: Any, stderr: Any, expected: Any, *, rounding: float = 1e-6) -> None:
    """Assert that each value lies within five standard errors of what is expected.

    ``rounding`` is what is allowed besides, relative to the expectation: light is kept in float32.
    """
    measured, stderr, expected = np.broadcast_arrays(*(np.asarray(x, float) for x in (measured, stderr, expected)))
    assert np.isfinite(measured).all(), what
    off = np.abs(measured - expected)
    worst = float(np.max(np.maximum(off - rounding * np.abs(expected), 0) / np.maximum(stderr, 1e-300)))
    print(f"  {what}: {worst:.2f} sigma at most of {measured.size}")
    bad = off > SIGMAS * stderr + rounding * np.abs(expected)
    assert not bad.any(), f"{what}: {measured[bad][:5]} ± {stderr[bad][:5]}, expected {expected[bad][:5]}"


def share_agrees(what: str, count: Any, n: Any, expected: Any) -> None:
    """Assert that counts are those of a binomial distribution: the standard error is that of the expected share."""
    n, expected = np.asarray(n, float), np.asarray(expected, float)
    agrees(what, np.asarray(count) / n, np.sqrt(expected * (1 - expected) / n), expected, rounding=1e-12)


def follows(what: str, uniform: NDArray[np.float64], bins: int = 40, slack: float = 1e-6) -> None:
    """Assert by a chi-square test that numbers are uniform over 0 to 1 (values of a cumulated density).

    ``slack`` is how far rounding may carry a number past the ends.
    The statistic is turned into a normal deviate by E. Wilson, M. Hilferty: The distribution of chi-square, Proc. Natl.
    Acad. Sci. 17 (1931), p. 684.
    """
    assert uniform.min() >= -slack, what
    assert uniform.max() <= 1 + slack, what
    counts = np.histogram(np.clip(uniform, 0, 1), bins, (0, 1))[0]
    chi_square_agrees(what, counts, np.full(bins, len(uniform) / bins))


def chi_square_agrees(what: str, counts: NDArray[Any], expected: NDArray[Any]) -> None:
    """Assert that counts of a fixed number of draws follow expected counts."""
    k = counts.size - 1
    chi_square = float(((counts - expected) ** 2 / expected).sum())
    deviate = ((chi_square / k) ** (1 / 3) - (1 - 2 / (9 * k))) / math.sqrt(2 / (9 * k))
    print(f"  {what}: chi-square {chi_square:.1f} of {k}, {deviate:+.2f} sigma")
    assert abs(deviate) < SIGMAS, f"{what}: chi-square {chi_square:.1f} with {k} degrees of freedom"


def unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors of length one."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
