# SPDX-License-Identifier: LGPL-2.1-or-later
"""Maps that several tests look at; a test that damages one works on a copy."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from raymaps.compile import CompiledScene, compile_scene
from raymaps.run import simulate
from raymaps.scene import load_scene
from raymaps.store import RayMap
from raymaps.trace import Tracer
from tests.store.small_scenes import lamp_in_a_room, workshop, write_scene


@dataclass(frozen=True)
class Traced:
    """A simulated scene: its file, the map, and the scene compiled anew."""

    scene_file: Path
    path: Path
    compiled: CompiledScene
    rays: int
    portion_rays: int

    @property
    def raymap(self) -> RayMap:
        """The map, freshly opened."""
        return RayMap.open(self.path)

    def tracer(self) -> Tracer:
        """A tracer of the same scene and seed."""
        return Tracer(self.compiled, self.raymap.manifest.seed)


def _traced(folder: Path, data: dict, rays: int, portion_rays: int) -> Traced:
    scene_file = write_scene(folder, data)
    path = folder / "small.raymap"
    simulate(scene_file, path, rays=rays, portion_rays=portion_rays, threads=2)
    return Traced(scene_file, path, compile_scene(load_scene(scene_file)), rays, portion_rays)


@pytest.fixture(scope="session")
def workshop_map(tmp_path_factory) -> Traced:
    """The workshop, 3000 rays in portions of 1000."""
    folder = tmp_path_factory.mktemp("workshop")
    return _traced(folder, workshop(folder), 3000, 1000)


@pytest.fixture(scope="session")
def room_map(tmp_path_factory) -> Traced:
    """The grey room, 250 rays in portions of 100: small enough to be damaged in a hundred ways."""
    folder = tmp_path_factory.mktemp("room")
    return _traced(folder, lamp_in_a_room(folder), 250, 100)


@pytest.fixture
def copied(tmp_path) -> Callable[[Traced], Path]:
    """A function that copies a map to where it may be damaged."""

    def copy(traced: Traced) -> Path:
        return Path(shutil.copytree(traced.path, tmp_path / "copy.raymap"))

    return copy
