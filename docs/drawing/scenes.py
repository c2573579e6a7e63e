# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small scenes: written to a folder, traced, and their rays as columns."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from raymaps.run import simulate
from raymaps.store import RayMap

Float = NDArray[np.float64]

__all__ = ["Rays", "beam", "block", "far_field", "sheet", "trace", "unit"]


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> trimesh.Trimesh:
    """A box."""
    return trimesh.creation.box(bounds=(low, high))


def sheet(half_size: float, z: float = 0.0) -> trimesh.Trimesh:
    """An open square across z, its front up."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * half_size + (0, 0, z)
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)


def beam(angle_deg: float, *, radius_mm: float = 0.01, distance_mm: float = 20.0, **more: Any) -> dict[str, Any]:
    """A thin parallel beam onto the origin from above, in the plane of x and z, at an angle to z."""
    sine, cosine = math.sin(math.radians(angle_deg)), math.cos(math.radians(angle_deg))
    return {
        "kind": "disc", "flux_w": 1.0, "radius_mm": radius_mm, "direction": [sine, 0.0, -cosine],
        "position_mm": [-distance_mm * sine, 0.0, distance_mm * cosine], **more,
    }  # fmt: skip


def far_field(**more: Any) -> dict[str, Any]:
    """A detector of all light that leaves, its axis up."""
    return {"kind": "far_field", "axis": [0, 0, 1], **more}


def trace(folder: Path, name: str, bodies: dict[str, dict[str, Any]], *, rays: int, **sections: Any) -> Rays:
    """Write a scene, trace it, and return its rays.

    Parameters
    ----------
    bodies : dict of str to a body of a scene, with a mesh under ``shape`` in place of its geometry
    sections : those of the scene file
    """
    described = {}
    for body, parts in bodies.items():
        file = f"{name}-{body}.ply"
        parts["shape"].export(folder / file)
        described[body] = {"geometry": {"file": file}, **{key: parts[key] for key in parts if key != "shape"}}
    path = folder / f"{name}.scene.json"
    path.write_text(json.dumps({"format": "raymaps-scene", "version": 1, "bodies": described, **sections}))
    return Rays(simulate(path, folder / f"{name}.raymap", rays=rays))


@dataclass(frozen=True)
class Rays:
    """Rays of a map as columns, a row an event in the order of the rays."""

    raymap: RayMap

    def _joined(self, column: Any) -> NDArray[Any]:
        return np.concatenate([column(portion) for portion in self.raymap.portions])

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """Row of each ray's emission, and the number of rows at the end."""
        counts = self._joined(lambda portion: np.diff(portion.event_offsets))
        return np.concatenate([[0], np.cumsum(counts)])

    @cached_property
    def kind(self) -> NDArray[np.uint8]:
        """EventKind of each event."""
        return self._joined(lambda portion: portion.signatures.kind[portion.event_step])

    @cached_property
    def source(self) -> NDArray[np.int16]:
        """Source of each ray."""
        return self._joined(lambda portion: portion.signatures.ray_source[portion.ray_signature])

    @cached_property
    def place_mm(self) -> Float:
        """(n_events, 3)."""
        return self._joined(lambda portion: portion.position_mm).astype(np.float64)

    @cached_property
    def power(self) -> Float:
        """Light after each event, relative to the emission."""
        return self._joined(lambda portion: portion.power)

    @cached_property
    def wavelength_nm(self) -> Float:
        """Of each ray, 0 where it has not been narrowed to one."""
        return self._joined(lambda portion: portion.ray_wavelength_nm).astype(np.float64)

    def direction_after(self, rows: NDArray[np.int64]) -> Float:
        """Unit vectors of the segments that start at events, (n, 3)."""
        return unit(self.place_mm[rows + 1] - self.place_mm[rows])

    def ways_mm(self, rays: range) -> list[Float]:
        """Places of the events of some rays, (n_events, 3) each."""
        return [self.place_mm[self.first[ray] : self.first[ray + 1]] for ray in rays]


def unit(vectors: Float) -> Float:
    """Vectors of length one."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
