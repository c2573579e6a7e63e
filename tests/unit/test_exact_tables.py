# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which faces use their exact surfaces, why others do not, and which surfaces are shared."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from raymaps.errors import SceneError
from raymaps.exact import ExactTables, exact_faces, lower_exact
from raymaps.frame import Frame
from raymaps.geometry import BodyMesh
from raymaps.kernels.exact import height
from raymaps.kinds import ExactKind
from raymaps.scene import Scene, SphereSurface, scene_from_dict
from tests.exact_surfaces import ball, net

BALL = {"type": "sphere", "center_mm": [1, 2, 3], "radius_mm": 2}
LAMP = {"Lamp": {"kind": "point", "flux_w": 1, "position_mm": [9, 0, 0]}}


def scene(bodies, **settings) -> Scene:
    """Bodies given as name to (surface data of each face, numbers of triangles)."""
    return scene_from_dict(
        {
            "format": "raymaps-scene", "version": 1, "surfaces": {"black": {"kind": "absorber"}}, "sources": LAMP,
            "settings": settings,
            "bodies": {
                name: {
                    "surface": "black",
                    "geometry": {
                        "file": f"{name}.ply",
                        "faces": [
                            {"name": f"Face{i}", "triangles": n, "surface": data}
                            for i, (data, n) in enumerate(faces, 1)
                        ],
                    },
                }
                for name, faces in bodies.items()
            },
        }
    )  # fmt: skip


def mesh(corners, name="Ball", counts=None) -> BodyMesh:
    corners = np.asarray(corners, float)
    counts = counts or [len(corners)]
    return BodyMesh(
        name, corners.reshape(-1, 3).copy(), np.arange(3 * len(corners)).reshape(-1, 3),
        tuple(f"Face{i}" for i in range(1, len(counts) + 1)), np.repeat(np.arange(len(counts), dtype=np.int32), counts),
    )  # fmt: skip


def sphere_corners(center=(1, 2, 3), radius=2.0):
    return np.asarray(trimesh.creation.icosphere(3, radius).triangles) + center


def found(data, corners, **settings):
    return exact_faces(scene({"Ball": [(data, len(corners))]}, **settings), (mesh(corners),))


def lowered(meshes, faces) -> ExactTables:
    corners = np.concatenate([m.corners_mm for m in meshes])
    return lower_exact(meshes, faces, Frame(np.array([1.0, 2.0, 3.0]), 4.0, 2.0**-20), corners)


def test_a_face_on_its_surface_uses_it():
    faces = found(BALL, sphere_corners())
    assert faces.fallbacks == ()
    assert faces.surfaces[0].radius == 2
    tables = lowered((mesh(sphere_corners()),), faces)
    assert tables.face.tolist() == [0]
    assert tables.outward.tolist() == [1]
    assert tables.kind.tolist() == [ExactKind.SPHERE]
    assert height(tables, 0, 0.75, 0.0, 0.0) == pytest.approx(0.25, abs=3e-16)


def test_a_hollow_looks_against_the_own_normal_whatever_the_file_says():
    corners = sphere_corners()[:, ::-1]
    for said in (True, False, None):
        tables = lowered((mesh(corners),), found({**BALL, "reversed": said}, corners))
        assert tables.outward.tolist() == [-1]


def test_without_a_surface_or_faceted_nothing_is_asked_for():
    for faces in (found(None, sphere_corners()), found(BALL, sphere_corners(), surfaces="faceted")):
        assert faces.surfaces == (None,)
        assert faces.fallbacks == ()


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        ({"type": "other", "name": "OffsetSurface"}, "only names it: OffsetSurface"),
        ({"type": "other", "name": "X", "reason": "it has a kink"}, "it has a kink"),
        ({"type": "helicoid", "pitch_mm": 3}, "'helicoid' is not known"),
        ({"type": "sphere", "radius_mm": 2}, "center_mm is missing"),
        ({**BALL, "color": "red"}, "'color' is not known"),
        ({**BALL, "radius_mm": 2.001}, "off the sphere"),
        ({"type": "cone", "apex_mm": [0, 0, 0], "axis": [0, 0, 1], "half_angle_deg": 30}, "off the cone"),
    ],
)
def test_what_can_not_be_used_falls_back_to_facets_with_the_reason(data, reason):
    """Facets of a sphere of radius 2 with edges of about w are up to w² / 8 / 2 off along an edge."""
    faces = found(data, sphere_corners())
    assert faces.surfaces == (None,)
    (fallback,) = faces.fallbacks
    assert (fallback.body, fallback.face) == ("Ball", "Face1")
    assert reason in fallback.reason
    edge = np.linalg.norm(np.diff(sphere_corners()[0], axis=0), axis=1).mean()
    assert 0.3 < fallback.error_mm / (edge * edge / 16) < 3
    assert lowered((mesh(sphere_corners()),), faces).face.tolist() == [-1]


def test_triangles_that_look_to_both_sides_stay_facets():
    corners = sphere_corners().copy()
    corners[::3] = corners[::3, ::-1]
    assert "both sides" in found(BALL, corners).fallbacks[0].reason


def test_vertices_may_be_off_by_a_millionth_of_the_body():
    rng = np.random.default_rng(0)
    for off, n_fallbacks in ((1e-6, 0), (1e-5, 1)):
        corners = sphere_corners() + off * rng.uniform(-1, 1, (1280, 3, 3))
        assert len(found(BALL, corners).fallbacks) == n_fallbacks


def test_a_cone_before_its_apex_is_the_other_nappe():
    angle = np.linspace(0, 2 * math.pi, 33)
    low = np.stack([np.cos(angle), np.sin(angle), np.full(33, -1.0)], axis=1)
    corners = np.stack([low[:-1], low[1:], 0.5 * low[:-1]], axis=1)
    data = {"type": "cone", "apex_mm": [0, 0, 0], "axis": [0, 0, 1], "half_angle_deg": 45}
    faces = found(data, corners)
    assert faces.fallbacks == ()
    np.testing.assert_array_equal(faces.surfaces[0].axis, [0, 0, -1])


def test_equal_surfaces_of_all_bodies_are_one():
    """A plane is the same from both sides, and a ball of another body; a shift of a millionth is another."""
    square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], float)
    planes = [
        ({"type": "plane", "point_mm": [0, 0, 0], "normal": [0, 0, 1]}, square),
        ({"type": "plane", "point_mm": [5, 5, 0], "normal": [0, 0, -2]}, square[:, ::-1] + [3, 0, 0]),
        ({"type": "plane", "point_mm": [0, 0, 1e-6], "normal": [0, 0, 1]}, square + [0, 0, 1e-6]),
        (BALL, sphere_corners()),
        (BALL, sphere_corners()[:, ::-1]),
    ]
    bodies = {f"B{i}": [(data, len(corners))] for i, (data, corners) in enumerate(planes)}
    meshes = tuple(mesh(corners, name) for name, (_, corners) in zip(bodies, planes, strict=True))
    tables = lowered(meshes, exact_faces(scene(bodies), meshes))
    assert tables.face.tolist() == [0, 0, 1, 2, 2]
    assert tables.outward.tolist() == [1, -1, 1, 1, -1]


@pytest.mark.parametrize("kind", ["plane", "sphere", "cylinder", "cone", "torus"])
def test_a_scene_ten_million_sizes_away_has_all_digits(kind):
    """Far away by a power of two, so that all places are exact there: the numbers are those of the scene at home."""
    from raymaps.exact import Cone, Cylinder, ExactFaces, Plane, Sphere, Torus

    axis = np.array([2.0, -1.0, 2.0]) / 3
    rows = []
    for far in (0.0, 2.0**24):
        at = far + np.array([0.25, 0.5, -0.125])
        surface = {
            "plane": Plane(at, axis), "sphere": Sphere(at, 0.75), "cylinder": Cylinder(at, axis, 0.75),
            "cone": Cone(at, axis, 0.5), "torus": Torus(at, axis, 0.5, 0.125),
        }[kind]  # fmt: skip
        corners = far + np.array([[[0.5, 0.25, 0.75], [1.0, 0.5, 0.25], [0.75, 0.125, 1.0]]])
        tables = lower_exact(
            (mesh(corners),), ExactFaces((surface,), ()), Frame(np.full(3, far), 1.0, 2.0**-20), corners
        )
        rows.append(tables.number[0])
    np.testing.assert_allclose(rows[1], rows[0], rtol=0, atol=1e-15)


def test_triangles_of_bsplines_know_the_parameters_of_their_corners():
    from raymaps.exact import exact_surface
    from raymaps.scene import BSplineSurface

    data = ball(2.0)
    surface = exact_surface(BSplineSurface.model_validate(data))
    corners = net(surface, 12, 8)
    meshes = (mesh(sphere_corners(), "A"), mesh(corners, "B"))
    bodies = {"A": [(BALL, 1280)], "B": [(data, len(corners))]}
    tables = lowered(meshes, exact_faces(scene(bodies), meshes))
    assert tables.face.tolist() == [0, 1]
    assert (tables.guess_row[:1280] == -1).all()
    assert tables.guess_row[1280:].tolist() == list(range(len(corners)))
    period = surface.breaks[0][-1]
    for triangle, uv in zip(corners, tables.guess_uv, strict=True):
        assert np.ptp(uv[:, 0]) < period / 11
        away = np.hypot(triangle[:, 0], triangle[:, 1]) > 1e-6
        points = surface.jet(uv[away, 0] % period, uv[away, 1]).point
        np.testing.assert_allclose(points, triangle[away], atol=1e-13)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"radius_mm": -2}, "radius_mm: must be greater than 0, got -2"),
        ({"radius_mm": math.nan}, "radius_mm: must be a finite number"),
        ({"center_mm": [0, 0]}, "center_mm"),
        ({"type": "plane", "point_mm": [0, 0, 0], "normal": [0, 0, 0]}, "a direction must have a length above zero"),
        ({"type": "cone", "apex_mm": [0, 0, 0], "axis": [0, 0, 1], "half_angle_deg": 90}, "must be less than 90"),
        ({"type": "torus", "center_mm": [0, 0, 0], "axis": [1, 0, 0], "major_radius_mm": 0, "minor_radius_mm": 1}, "0"),
        ({**ball(1), "weights": [[1]]}, "weights: there must be one for each of poles_mm"),
        ({**ball(1), "knots": [[0, 1, 1, 3, 4], [0, 1, 2]]}, "knots along u"),
        ({**ball(1), "multiplicities": [[2, 2, 2, 2, 2], [3, 1, 3]]}, "along v the knots call for 4 poles, got 5"),
        ({**ball(1), "degrees": [0, 2]}, "must be greater than or equal to 1"),
    ],
)
def test_numbers_that_no_surface_can_have_are_one_sentence(change, words):
    data = {**BALL, **change} if set(change) <= set(BALL) and "type" not in change else change
    with pytest.raises(SceneError, match=r"bodies 'Ball', geometry, faces\[0\], surface") as caught:
        scene({"Ball": [(data, 1)]})
    assert words in str(caught.value)
    assert str(caught.value).count(". ") == 0


def test_a_surface_is_written_and_read_again():
    for data in (
        BALL,
        ball(1),
        {"type": "sphere", "radius_mm": 2},
        {"type": "other", "name": "X", "reason": "Y"},
        None,
    ):
        first = scene({"Ball": [(data, 1)]})
        again = scene_from_dict(first.model_dump(mode="json"))
        assert again == first
    record = scene({"Ball": [(BALL, 1)]}).bodies["Ball"].geometry.faces[0].surface
    assert isinstance(record, SphereSurface)
