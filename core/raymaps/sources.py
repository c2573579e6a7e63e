# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sources: which source a ray comes from, and how each kind emits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.compile import CompiledScene
from raymaps.scene import ConeSource, DiscSource, FacesSource, PointSource, Scene

__all__ = ["SOURCES", "Emitter", "emitters", "relative_light", "source_of_rays"]

#: 2^64 / golden ratio: the additive recurrence ray * _STEP mod 2^64 fills the unit interval evenly from any start.
_STEP = np.uint64(0x9E3779B97F4A7C15)


def source_of_rays(scene: Scene, first_ray: int, n_rays: int) -> NDArray[np.int16]:
    """Which source each ray comes from, a function of its number alone.

    Sources share the rays by flux: ray numbers run through an additive recurrence with the golden ratio (M. Roberts:
    The unreasonable effectiveness of quasirandom sequences, 2018), so any run of rays has each source's share to
    within a few rays.

    Returns
    -------
    (n_rays,) int16, index of the source
    """
    flux = np.array([source.flux_w for source in scene.sources.values()])
    edges = np.cumsum(flux / flux.sum())[:-1]
    rays = np.arange(n_rays, dtype=np.uint64) + np.uint64(first_ray)
    place = ((rays * _STEP + (_STEP >> np.uint64(1))) >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return np.searchsorted(edges, place, side="right").astype(np.int16)


def relative_light(scene: Scene) -> NDArray[np.float32]:
    """Light of a ray at its emission for each source, (n_sources, 3 bands) float32.

    The bands are multiples of 2^-24, so they are exact in float32 and add up to exactly 1.
    """
    rgb = np.array([source.rgb for source in scene.sources.values()])
    steps = np.round(np.cumsum(rgb / rgb.sum(axis=1, keepdims=True), axis=1) * 2.0**24)
    steps[:, 2] = 2.0**24
    return (np.diff(steps, axis=1, prepend=0.0) * 2.0**-24).astype(np.float32)


@dataclass(frozen=True)
class Emitter:
    """A source ready to emit: its kernel's name in `raymaps.kernels.emission`, and that kernel's own arguments."""

    kernel: str
    arguments: tuple[Any, ...]


def _axis(direction: tuple[float, float, float]) -> NDArray[np.float64]:
    return np.array(direction) / math.hypot(*direction)


def _point(source: PointSource, compiled: CompiledScene) -> Emitter:
    position = compiled.frame.to_units(np.array(source.position_mm))
    return Emitter("emit_point", (position, np.array([0.0, 0.0, 1.0]), 2.0))


def _cone(source: ConeSource, compiled: CompiledScene) -> Emitter:
    position = compiled.frame.to_units(np.array(source.position_mm))
    opening = 2 * math.sin(math.radians(source.half_angle_deg) / 2) ** 2
    return Emitter("emit_point", (position, _axis(source.direction), opening))


def _disc(source: DiscSource, compiled: CompiledScene) -> Emitter:
    position = compiled.frame.to_units(np.array(source.position_mm))
    return Emitter("emit_disc", (position, _axis(source.direction), source.radius_mm / compiled.frame.unit_mm))


def _faces(source: FacesSource, compiled: CompiledScene) -> Emitter:
    body = compiled.names.bodies.index(source.body)
    mesh = compiled.meshes[body]
    chosen = np.isin(mesh.triangle_face, mesh.face_indices(source.faces, f"body '{source.body}'")) & ~mesh.degenerate
    first = sum(len(other.triangles) for other in compiled.meshes[:body])
    triangles = np.flatnonzero(chosen).astype(np.int32)
    area = np.linalg.norm(mesh.area_vectors_mm2[triangles], axis=1)
    corners = compiled.frame.to_units(mesh.corners_mm[triangles])
    cumulated = np.cumsum(area) / area.sum()
    return Emitter("emit_faces", (compiled.tables, (triangles + first).astype(np.int32), cumulated, corners))


#: How each kind of source is made ready.
SOURCES: dict[str, Callable[[Any, CompiledScene], Emitter]] = {
    "point": _point,
    "cone": _cone,
    "disc": _disc,
    "faces": _faces,
}


def emitters(compiled: CompiledScene) -> tuple[Emitter, ...]:
    """All sources of a scene, ready to emit, in its order."""
    return tuple(SOURCES[source.kind](source, compiled) for source in compiled.scene.sources.values())
