# SPDX-License-Identifier: LGPL-2.1-or-later
"""Finer meshes of the same exact surfaces: closed, on the surfaces, four times nearer to them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from raymaps.exact import exact_faces, finer
from raymaps.geometry import load_bodies
from raymaps.scene import load_scene
from tests.physics.lenses import Lens, write_lenses
from tests.physics.sequential import LensFace

RADIUS_MM, THICK_MM = 10.0, 6.0
SPHERES = Lens(LensFace(0, 1 / 40), LensFace(THICK_MM, -1 / 60), RADIUS_MM)
ASPHERE = Lens(LensFace(0, 1 / 40, -1.0, (1e-6,)), LensFace(THICK_MM, -1 / 60), RADIUS_MM)


def meshes_of(folder, lens, rings=5):
    source = {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, -10]}
    scene = load_scene(write_lenses(folder, {"Lens": (lens, rings)}, {"glass": 1.5}, sources={"S": source}))
    (mesh,) = load_bodies(scene)
    surfaces = exact_faces(scene, [mesh]).surfaces
    assert all(surfaces)
    once = finer(mesh, surfaces)
    return surfaces, [mesh, once, finer(once, surfaces)]


def off_mm(mesh, surfaces):
    """How far the middles of triangles lie off their surfaces, by face."""
    return [
        np.linalg.norm((p := mesh.corners_mm[mesh.triangle_face == face].mean(axis=1)) - s.nearest(p), axis=1).max()
        for face, s in enumerate(surfaces)
    ]


@pytest.mark.parametrize("lens", [SPHERES, ASPHERE])
def test_triangles_are_four_times_as_many_and_as_near(tmp_path, lens):
    surfaces, meshes = meshes_of(tmp_path, lens)
    for coarse, fine in zip(meshes, meshes[1:], strict=False):
        assert len(fine.triangles) == 4 * len(coarse.triangles)
        assert fine.is_closed
        assert fine.face_names == coarse.face_names
        for before, after in zip(off_mm(coarse, surfaces), off_mm(fine, surfaces), strict=True):
            assert before / after == pytest.approx(4, rel=0.15)  # to the first power of their size over the radius


def test_corners_lie_on_the_faces_that_meet_there(tmp_path):
    surfaces, meshes = meshes_of(tmp_path, SPHERES)
    fine = meshes[-1]
    for face, surface in enumerate(surfaces):
        corners = fine.corners_mm[fine.triangle_face == face].reshape(-1, 3)
        assert np.linalg.norm(corners - surface.nearest(corners), axis=1).max() < 1e-9  # 1e-12 of the size, each turn


def test_the_volume_nears_that_of_the_lens(tmp_path):
    """A cylinder and what the caps of both spheres add or take: V = pi h² (3 R - h) / 3 of a cap of the height h."""
    _, meshes = meshes_of(tmp_path, SPHERES)

    def cap(radius):
        h = radius - math.sqrt(radius**2 - RADIUS_MM**2)
        return math.pi * h * h * (3 * radius - h) / 3, h

    (front, sag), (rear, other_sag) = cap(40.0), cap(60.0)
    true = math.pi * RADIUS_MM**2 * (THICK_MM - sag - other_sag) + front + rear
    off = [true - mesh.volume_mm3 for mesh in meshes]
    assert off[0] / off[1] == pytest.approx(4, rel=0.05)
    assert off[1] / off[2] == pytest.approx(4, rel=0.02)


def test_faces_without_a_surface_keep_their_shape(tmp_path):
    _, (mesh, *_) = meshes_of(tmp_path, SPHERES)
    flat = finer(mesh, [None] * len(mesh.face_names))
    assert flat.is_closed
    assert flat.volume_mm3 == pytest.approx(mesh.volume_mm3, rel=1e-12)
