# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays that are aimed at a point of a body, and what of them is lost."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from raymaps.compile import compile_scene
from raymaps.formats.ray_file import write_rays
from raymaps.formats.ray_set import RaySet
from raymaps.kinds import EventKind
from raymaps.scene import load_scene
from raymaps.trace import Tracer
from tests.physics.scenes import Histories, Shape
from tests.physics.scenes_exact import ExactShape

Float = NDArray[np.float64]


def rotation(angle_rad: float = 0.7, axis: tuple[float, float, float] = (1.0, 2.0, 3.0)) -> Float:
    """A turn in which no edge lies along an axis."""
    return np.asarray(trimesh.transformations.rotation_matrix(angle_rad, axis)[:3, :3])


def seams(shape: ExactShape | Shape) -> Float:
    """Every vertex and the middle of every edge, (n, 3): where triangles meet."""
    corners = shape.vertices[shape.triangles]
    middles = (corners + np.roll(corners, 1, axis=1)) / 2
    return np.unique(np.concatenate([corners.reshape(-1, 3), middles.reshape(-1, 3)]), axis=0)


def aimed(folder: Path, name: str, origins: Any, directions: Any) -> dict[str, Any]:
    """A source of just these rays, in float64; which of them a ray is, is drawn."""
    origins = np.atleast_2d(np.asarray(origins, float))
    directions = np.broadcast_to(np.atleast_2d(np.asarray(directions, float)), origins.shape)
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    write_rays(folder / f"{name}.rays", RaySet(origins, directions, np.ones(len(origins))))
    return {"kind": "rays", "flux_w": 1.0, "file": f"{name}.rays"}


def towards(targets: Any, directions: Any, distance_mm: float) -> tuple[Float, Float]:
    """Origins and directions of rays that come to each target along each direction, from a distance."""
    targets, directions = np.atleast_2d(np.asarray(targets, float)), np.atleast_2d(np.asarray(directions, float))
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    along = np.tile(directions, (len(targets), 1))
    return np.repeat(targets, len(directions), axis=0) - distance_mm * along, along


def some_directions(n: int, seed: int = 0) -> Float:
    """Unit vectors: along axes, along diagonals, and any."""
    special = [v for v in np.ndindex(3, 3, 3) if v != (1, 1, 1)]
    any_ = np.random.default_rng(seed).normal(size=(n, 3))
    vectors = np.concatenate([np.array(special, float) - 1, any_])
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


class Lost(NamedTuple):
    """Rays that ended in ways that physics does not know."""

    numerical: int
    mismatch: int
    slipped: int  # left the scene while in a body

    @property
    def all(self) -> int:
        return sum(self)


def lost(h: Histories, ambient: str = "vacuum") -> Lost:
    """Count what is lost, and print it."""
    slipped = (h.kind[h.last] == EventKind.LEFT) & (h.medium[h.last] != h.index("media", ambient))
    found = Lost(
        h.count_kind(EventKind.KILLED_NUMERICAL), h.count_kind(EventKind.KILLED_MEDIUM_MISMATCH), int(slipped.sum())
    )
    print(f"  {h.n_rays} rays, {int((h.number > 0).sum())} events: {found}")
    return found


def tracer_of(scene: Path, seed: int = 1) -> Tracer:
    """A tracer without a map."""
    return Tracer(compile_scene(load_scene(scene)), seed)


def clear(n: float = 1.0) -> dict[str, Any]:
    """Sections of a scene: polished bodies of a clear medium called glass."""
    return {"media": {"glass": {"refractive_index": n}}, "surfaces": {"polished": {"kind": "fresnel"}}}
