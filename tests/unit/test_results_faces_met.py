# SPDX-License-Identifier: LGPL-2.1-or-later
"""What `raymaps explain` tells of surfaces: how many faces are exact, how many are facets, and why."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from raymaps.results.explanation import explain
from raymaps.results.faces_met import MOST_REASONS, FacesMet
from raymaps.run import simulate
from tests.face_maps import tube
from tests.store.small_scenes import box, changed, geometry, write_scene

CYLINDER = {"type": "cylinder", "point_mm": [0, 0, 0], "axis": [0, 0, 1], "radius_mm": 4.0}
PLACE = "bodies.Tube.geometry.faces.0.surface"


@pytest.fixture
def scene(tmp_path):
    """A tube with its exact surface in a box of flat faces that name none."""
    bodies = {"Tube": tube("Tube", 4.0, 10.0, 9), "Room": box("Room", (0, 0, 5), 40)}
    data = {
        "format": "raymaps-scene",
        "version": 1,
        "surfaces": {"white": {"kind": "lambertian", "reflectance": 0.5}},
        "bodies": {name: {"geometry": geometry(tmp_path, mesh), "surface": "white"} for name, mesh in bodies.items()},
        "sources": {"Lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 5]}},
        "settings": {"rays": 100},
    }
    return changed(data, PLACE, CYLINDER)


def told(folder: Path, data) -> FacesMet:
    """What is told of a scene; the same of a map of it."""
    file = write_scene(folder, data)
    found = explain(file).surfaces
    assert explain(simulate(file, folder / "one.raymap").path).surfaces == found
    return found


def test_exact_faces_and_flat_ones_without_a_surface(tmp_path, scene):
    found = told(tmp_path, scene)
    assert found == FacesMet(1, 6, ("6 faces of Room name no exact surface, all of them flat",))
    text = explain(tmp_path / "small.scene.json").to_text()
    assert "surfaces    exact (1 face), facets (6 faces)\n" in text
    assert "because 6 faces of Room name no exact surface" in text
    data = explain(tmp_path / "small.scene.json").to_dict()["surfaces"]
    assert data == {"exact": 1, "faceted": 6, "because": list(found.because)}


def test_curved_faces_without_a_surface(tmp_path, scene):
    found = told(tmp_path, changed(scene, PLACE, None))
    assert found == FacesMet(0, 7, ("7 faces of Tube, Room name no exact surface, 6 of them flat",))


def test_faces_that_do_not_fit_their_surface(tmp_path, scene):
    found = told(tmp_path, changed(scene, f"{PLACE}.radius_mm", 4.5))
    assert (found.exact, found.faceted) == (0, 7)
    nameless, fallen_back = found.because
    assert nameless == "6 faces of Room name no exact surface, all of them flat"
    assert fallen_back.startswith("Mantle of Tube keeps its facets, as ")
    assert "0.5 mm off the cylinder" in fallen_back


def test_a_scene_that_asks_for_facets(tmp_path, scene):
    found = told(tmp_path, changed(scene, "settings.surfaces", "faceted"))
    assert found == FacesMet(0, 7, ("settings.surfaces is faceted",))


def test_a_map_of_older_times(tmp_path, scene):
    path = simulate(write_scene(tmp_path, scene), tmp_path / "old.raymap").path
    file = path / "scene.json"
    data = json.loads(file.read_text())
    del data["settings"]["surfaces"]
    file.write_text(json.dumps(data))
    assert explain(path).surfaces == FacesMet(0, 7, ("the map is of a version that met triangles only",))


def test_many_reasons_are_told_in_short(tmp_path, scene):
    one = scene["bodies"]["Tube"]
    for i in range(15):
        scene = changed(scene, f"bodies.Tube{i}", one)
        scene = changed(scene, f"bodies.Tube{i}.geometry.faces.0.surface.radius_mm", 5.0)
    found = explain(write_scene(tmp_path, scene)).surfaces
    assert (found.exact, found.faceted) == (1, 21)
    assert len(found.because) == 1 + MOST_REASONS + 1
    assert found.because[-1] == "of 5 more such reasons"
