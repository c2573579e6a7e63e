# SPDX-License-Identifier: LGPL-2.1-or-later
"""Normals at events: of exact surfaces, of facets, and interpolated over smooth facets."""

from __future__ import annotations

import json

import numpy as np
import pytest

from raymaps.compile import compile_scene
from raymaps.results.incidence import normals
from raymaps.run import simulate
from raymaps.scene import load_scene
from raymaps.store import RayMap
from tests.face_maps import ball, corner_mesh, map_of, tube
from tests.store.small_scenes import geometry, write_scene

SPHERE = {"type": "sphere", "center_mm": [0, 0, 0], "radius_mm": 5.0}


def places_on(mesh, triangles, seed=3):
    """A random place on each triangle."""
    shares = np.random.default_rng(seed).dirichlet((1, 1, 1), len(triangles))
    return np.einsum("nc,ncx->nx", shares, mesh.corners_mm[triangles])


def black_tube(folder, body, **of_geometry):
    """A scene of a black tube with a lamp in it."""
    return {
        "format": "raymaps-scene",
        "version": 1,
        "surfaces": {"black": {"kind": "absorber"}},
        "bodies": {"Tube": {"geometry": {**geometry(folder, body), **of_geometry}, "surface": "black"}},
        "sources": {"Lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 5]}},
        "settings": {"rays": 100},
    }


def test_normals_of_facets_of_all_bodies():
    raymap = map_of(corner_mesh("A", 0), corner_mesh("B", 1), corner_mesh("C", 2))
    found = normals(raymap, np.array([2, 0, 1], np.int32), np.zeros((3, 3)))
    assert found.tolist() == [[0, 0, 1], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize("hollow", [False, True])
def test_an_exact_surface_has_its_normal_where_the_event_was(hollow):
    """Outward as the triangles say: of a hollow ball towards its middle; bodies before it have facets of their own."""
    skin = ball("Ball", 5.0, 6, hollow)
    raymap = map_of(corner_mesh("First", 1), skin, surfaces={"Skin": SPHERE})
    triangles = np.arange(len(skin.triangles))
    radial = places_on(skin, triangles)
    radial /= np.linalg.norm(radial, axis=1)[:, None]
    found = normals(raymap, (triangles + 1).astype(np.int32), 5.0 * radial)
    assert found == pytest.approx(-radial if hollow else radial, abs=1e-12)
    facets = normals(map_of(skin), triangles.astype(np.int32), 5.0 * radial)
    assert np.abs(facets - found).max() > 0.05  # so the test can tell them apart


def test_a_surface_that_its_triangles_do_not_stand_on_is_not_used():
    skin = ball("Ball", 5.0, 6)
    raymap = map_of(skin, surfaces={"Skin": {**SPHERE, "radius_mm": 5.001}})
    triangles = np.arange(len(skin.triangles), dtype=np.int32)
    own = skin.area_vectors_mm2 / np.linalg.norm(skin.area_vectors_mm2, axis=1)[:, None]
    assert normals(raymap, triangles, places_on(skin, triangles)) == pytest.approx(own, abs=1e-12)


def test_facets_of_a_smooth_face_have_interpolated_normals():
    """Exact at the vertices of a sphere; between them no more than a hundredth of what facets are off."""
    skin = ball("Ball", 5.0, 12)
    raymap = map_of(skin, smooth_faces=["Skin"])
    triangles = np.arange(len(skin.triangles), dtype=np.int32)
    for corner in range(3):
        at = skin.corners_mm[:, corner]
        assert normals(raymap, triangles, at) == pytest.approx(at / 5.0, abs=1e-9)
    places = places_on(skin, triangles)
    radial = places / np.linalg.norm(places, axis=1)[:, None]
    off = np.linalg.norm(normals(raymap, triangles, places) - radial, axis=1)
    facets = np.linalg.norm(normals(map_of(skin), triangles, places) - radial, axis=1)
    assert off.max() < 0.02
    assert off.mean() < 0.1 * facets.mean()
    assert np.linalg.norm(normals(raymap, triangles, places), axis=1) == pytest.approx(1, abs=1e-12)


def test_a_map_has_the_surfaces_that_were_simulated(tmp_path):
    """Exact as its scene says; none where the scene asked for facets, or comes from before there was a choice."""
    body = tube("Tube", 4.0, 10.0, 9)
    data = black_tube(tmp_path, body)
    record = {"type": "cylinder", "point_mm": [0, 0, 0], "axis": [0, 0, 1], "radius_mm": 4.0}
    data["bodies"]["Tube"]["geometry"]["faces"][0]["surface"] = record
    exact = simulate(write_scene(tmp_path, data), tmp_path / "exact.raymap")
    assert [type(surface).__name__ for surface in exact.exact_faces.surfaces] == ["Cylinder"]
    data["settings"]["surfaces"] = "faceted"
    faceted = simulate(write_scene(tmp_path, data), tmp_path / "faceted.raymap")
    assert faceted.exact_faces.surfaces == (None,)
    scene_file = tmp_path / "exact.raymap" / "scene.json"
    old = json.loads(scene_file.read_text())
    del old["settings"]["surfaces"]
    scene_file.write_text(json.dumps(old))
    assert RayMap.open(tmp_path / "exact.raymap").exact_faces.surfaces == (None,)


def test_a_map_keeps_which_faces_are_smooth(tmp_path):
    body = tube("Tube", 4.0, 10.0, 9)
    data = black_tube(tmp_path, body, smooth_faces=["Mantle"])
    raymap = simulate(write_scene(tmp_path, data), tmp_path / "smooth.raymap")
    assert RayMap.open(raymap.path).scene.bodies["Tube"].geometry.smooth_faces == ("Mantle",)


def test_a_smooth_face_with_an_exact_surface_is_exact(tmp_path):
    """Rays are turned by the surface's own normals, not by those that are estimated from its facets as well."""
    body = tube("Tube", 4.0, 10.0, 9)
    data = black_tube(tmp_path, body, smooth_faces=["Mantle"])
    facets = compile_scene(load_scene(write_scene(tmp_path, data))).boundary.smooth.row
    assert (facets >= 0).sum() == len(body.triangles)
    record = {"type": "cylinder", "point_mm": [0, 0, 0], "axis": [0, 0, 1], "radius_mm": 4.0}
    data["bodies"]["Tube"]["geometry"]["faces"][0]["surface"] = record
    assert (compile_scene(load_scene(write_scene(tmp_path, data))).boundary.smooth.row == -1).all()
