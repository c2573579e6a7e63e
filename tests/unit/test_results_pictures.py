# SPDX-License-Identifier: LGPL-2.1-or-later
import base64
import json
import re

import numpy as np
import pytest

from raymaps.errors import CriterionError, MapError, OutputError, SceneError
from raymaps.geometry import BodyMesh
from raymaps.results.camera import fit_camera
from raymaps.results.detector import evaluate_detector
from raymaps.results.edges import feature_edges_mm
from raymaps.results.model_view import ModelView, Shape, build_view
from raymaps.results.pictures import view
from raymaps.results.view_page import view_to_html
from raymaps.run import simulate
from raymaps.scene import load_scene


@pytest.fixture(scope="module")
def scene_path(repository):
    return repository / "examples" / "led_collimator.scene.json"


@pytest.fixture(scope="module")
def traced(scene_path, tmp_path_factory):
    return simulate(scene_path, tmp_path_factory.mktemp("view") / "led.raymap", rays=3000, seed=2, threads=1)


def box_mesh(one_face):
    """A unit cube without shared vertices, as an STL file holds it; a CAD face a side, or one in all."""
    triangles = []
    for axis in range(3):
        for level in (0.0, 1.0):
            square = np.insert(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), axis, level, axis=1)
            triangles += [square[[0, 1, 2]], square[[0, 2, 3]]]
    face = np.zeros(12, np.int32) if one_face else np.repeat(np.arange(6, dtype=np.int32), 2)
    names = ("Face1",) if one_face else tuple(f"Face{i}" for i in range(1, 7))
    return BodyMesh("Box", np.concatenate(triangles), np.arange(36).reshape(12, 3), names, face)


@pytest.mark.parametrize("one_face", [True, False])
def test_a_cube_has_twelve_edges_and_no_diagonals(one_face):
    edges = feature_edges_mm(box_mesh(one_face))
    assert len(edges) == 12
    lengths = np.linalg.norm(edges[:, 3:] - edges[:, :3], axis=1)
    assert lengths == pytest.approx(np.ones(12), abs=1e-12)
    assert len({tuple(sorted([tuple(edge[:3]), tuple(edge[3:])])) for edge in edges.tolist()}) == 12


def test_the_border_of_an_open_sheet_is_drawn():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    mesh = BodyMesh("Sheet", square, np.array([[0, 1, 2], [0, 2, 3]]), ("Face1",), np.zeros(2, np.int32))
    assert len(feature_edges_mm(mesh)) == 4


def test_borders_between_smooth_cad_faces_are_drawn():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    mesh = BodyMesh("Sheet", square, np.array([[0, 1, 2], [0, 2, 3]]), ("A", "B"), np.array([0, 1], np.int32))
    assert len(feature_edges_mm(mesh)) == 5


def test_a_view_holds_everything_that_the_scene_holds(traced):
    content = build_view(traced, "hit(Collimator)", rays=12)
    scene = traced.scene
    for kind, names in (("body", scene.bodies), ("source", scene.sources), ("detector", scene.detectors)):
        assert [shape.name for shape in content.shapes if shape.kind == kind] == list(names)
    assert content.rays.rays == 12
    assert "hit(Collimator)" in content.subtitle


def test_a_scene_alone_has_no_rays(scene_path):
    content = build_view(load_scene(scene_path))
    assert content.rays is None
    assert build_view(scene_path).shapes[0].name == content.shapes[0].name
    with pytest.raises(SceneError, match="no rays yet"):
        build_view(scene_path, "true")


def test_every_kind_of_source_can_be_seen(scene_path):
    base = load_scene(scene_path).model_dump(mode="json", exclude_none=True)
    common = {"flux_w": 1.0, "position_mm": [0, 0, 50]}
    base["sources"] = {
        "P": {"kind": "point", **common},
        "C": {"kind": "cone", "direction": [0, 0, -1], "half_angle_deg": 170, **common},
        "D": {"kind": "disc", "direction": [0, 1, 0], "radius_mm": 3, **common},
        "F": {"kind": "faces", "flux_w": 1.0, "body": "ChipRed"},
        "G": {"kind": "gaussian_beam", "direction": [1, 0, 0], "waist_radius_mm": 0.01, **common},
        "S": {"kind": "sun", "direction": [0, 0, -2], "radius_mm": 4, **common},
        "L": {"kind": "luminaire", "direction": [0, 3, 0], **common,
              "intensity": {"c_deg": [0, 360], "gamma_deg": [0, 90], "candela": [[1, 1], [1, 1]]}},
        "R": {"kind": "rays", "file": "none.dat", "z_axis": [0, 1, 1], **common},
        "X": {"kind": "crossings", "map": "none.raymap", "detector": "D", **common},
        "Laser": {"kind": "point", "spectrum": {"kind": "lines", "wavelength_nm": [632.8]}, **common},
        "Infrared": {"kind": "point", "spectrum": {"kind": "lines", "wavelength_nm": [1550]}, **common},
    }  # fmt: skip
    scene = type(load_scene(scene_path)).model_validate(base).with_folder(scene_path.parent)
    shapes = {shape.name: shape for shape in build_view(scene).shapes if shape.kind == "source"}
    assert all(len(shape.triangles_mm) for shape in shapes.values())
    assert list(shapes) == list(base["sources"])
    for name, middle in (("P", 50), ("D", 50), ("L", 50), ("R", 50), ("X", 50)):
        assert shapes[name].triangles_mm[..., 2].mean() == pytest.approx(middle, abs=1e-9)
    disc = np.linalg.norm(shapes["D"].triangles_mm[:, 1:] - [0, 0, 50], axis=-1)
    assert disc == pytest.approx(np.full(disc.shape, 3.0), rel=1e-12)
    # an arrow shows where a source is aimed
    for name, way in (("G", (1, 0, 0)), ("S", (0, 0, -1)), ("L", (0, 1, 0)), ("R", (0, 0.5**0.5, 0.5**0.5))):
        arrow = shapes[name].lines_mm[0, 3:] - shapes[name].lines_mm[0, :3]
        assert arrow / np.linalg.norm(arrow) == pytest.approx(way, abs=1e-12)
    red, green, blue = shapes["Laser"].rgb
    assert red > 2 * max(green, blue)
    assert len(set(shapes["Infrared"].rgb)) == 1  # no eye sees it: white


@pytest.fixture(scope="module")
def with_all_detectors(scene_path, tmp_path_factory):
    """A map of the example with detectors on faces and of the far field, without absorption in plastic."""
    data = load_scene(scene_path).model_dump(mode="json", exclude_none=True)
    data["detectors"] |= {
        "Skin": {"kind": "face", "body": "Diffuser"},
        "Floor": {"kind": "face", "body": "WorkPlane", "measure": "absorbed"},
        "Sky": {"kind": "far_field"},
    }
    data["settings"] |= {"without": ["medium_absorption"]}
    scene = type(load_scene(scene_path)).model_validate(data).with_folder(scene_path.parent)
    return simulate(scene, tmp_path_factory.mktemp("kinds") / "led.raymap", rays=3000, seed=2, threads=1)


def test_every_kind_of_detector_can_be_seen_and_painted(with_all_detectors):
    content = build_view(with_all_detectors, paint=["Skin", "Sky", "Target"])
    shapes = {shape.name: shape for shape in content.shapes if shape.kind == "detector"}
    assert list(shapes) == ["Beam", "Target", "Skin", "Floor"]  # the far field is nowhere
    assert len(shapes["Floor"].triangles_mm) > 0
    assert len(shapes["Skin"].triangles_mm) == 0  # painted
    assert len(shapes["Floor"].lines_mm) > 0
    assert [painting.detector for painting in content.paintings] == ["Skin", "Target"]
    lit = evaluate_detector(with_all_detectors, "Skin")
    assert np.array_equal(content.paintings[0].triangles_mm, lit.cells.corners_mm)
    assert "without medium_absorption" in content.subtitle
    assert "without medium_absorption" in build_view(with_all_detectors.scene).subtitle


@pytest.mark.parametrize("name", ["Skin", "Floor"])
def test_faces_are_a_picture(with_all_detectors, tmp_path, name):
    pytest.importorskip("pyvista")
    imread = pytest.importorskip("matplotlib.image").imread
    lit = evaluate_detector(with_all_detectors, name)
    picture = imread(lit.write(tmp_path / "faces.png"))
    assert min(picture.shape[:2]) > 500
    assert len(np.unique(picture.reshape(-1, picture.shape[2]), axis=0)) > 200


def shapes_of(points):
    return ModelView("t", "s", (Shape("b", "body", (0, 0, 0), 1.0, np.asarray(points, float), np.zeros((0, 6))),), None)


@pytest.mark.parametrize("stretch", [(1, 1, 1), (1, 1, 9), (9, 1, 1), (1, 7, 0), (0, 0, 0)])
def test_the_camera_holds_all_of_the_model(stretch):
    points = np.random.default_rng(1).normal(0, 1, (50, 3, 3)) * stretch + [100, -50, 20]
    camera = fit_camera(shapes_of(points))
    axes = np.stack([camera.right, camera.up, camera.toward])
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    seen = (points.reshape(-1, 3) - camera.middle_mm) @ axes.T
    assert np.abs(seen[:, 0]).max() <= camera.width_mm / 2 * (1 + 1e-9)
    assert np.abs(seen[:, 1]).max() <= camera.height_mm / 2 * (1 + 1e-9)
    assert (camera.right[2] > 0.8) == (stretch == (1, 1, 9))  # a long tube lies, z to the right
    assert camera.up[2] > 0.5 or stretch == (1, 1, 9)


def page_data(html):
    text = re.search(r'<script id="scene" type="application/json">(.*?)</script>', html, re.S)[1]
    return json.loads(text)


def unpacked(group, key):
    return np.frombuffer(base64.b64decode(group[key]), "<f4")


def test_page_holds_the_geometry(traced):
    content = build_view(traced, rays=9)
    data = page_data(view_to_html(content))
    groups = {group["name"]: group for group in data["groups"]}
    middle = fit_camera(content).middle_mm
    for shape in content.shapes:
        expected = (shape.triangles_mm - middle).astype(np.float32).ravel()
        assert np.array_equal(unpacked(groups[shape.name], "triangles"), expected)
    lines = unpacked(groups["rays"], "lines").reshape(-1, 6)
    assert len(lines) == content.rays.n_segments
    assert len(base64.b64decode(groups["rays"]["line_rgba_each"])) == 4 * len(lines)


def test_page_needs_nothing_from_outside(traced, tmp_path):
    html = view(traced, tmp_path / "v.html", rays=3).read_text(encoding="utf-8")
    assert "@SCENE@" not in html
    assert not re.search(r"(src|href)\s*=|https?:|import\s|url\(", html)


def test_names_cannot_break_the_page():
    evil = "</script><script>alert(1)</script>"
    shape = Shape(evil, "body", (1, 2, 3), 0.5, np.zeros((1, 3, 3)), np.zeros((0, 6)))
    html = view_to_html(ModelView(evil, evil, (shape,), None))
    assert html.count("</script>") == 2
    assert page_data(html)["groups"][0]["name"] == evil


@pytest.fixture(scope="module")
def pictures(traced, scene_path, tmp_path_factory):
    """PNGs of the scene alone, of few rays, of many rays, and with light painted on a detector."""
    pytest.importorskip("pyvista")
    from matplotlib.image import imread

    folder = tmp_path_factory.mktemp("png")
    made = {
        "scene": view(scene_path, folder / "scene.png"),
        "few": view(traced, folder / "few.png", "from(LED_red)", rays=20),
        "many": view(traced, folder / "many.png", "from(LED_red)", rays=200),
        "painted": view(traced, folder / "painted.png", "~true", paint=["Target"]),
    }
    return {name: imread(path)[..., :3] for name, path in made.items()}


def red_pixels(picture):
    red, green, blue = np.moveaxis(picture, 2, 0)
    return int(np.count_nonzero((red > 0.7) & (green < 0.45) & (blue < 0.45)))


def test_rays_are_seen_in_their_colour_and_more_rays_are_more(pictures):
    assert red_pixels(pictures["few"]) > 3 * red_pixels(pictures["scene"])
    assert red_pixels(pictures["many"]) > 2 * red_pixels(pictures["few"])


def test_the_model_is_seen_on_white(pictures):
    scene = pictures["scene"]
    assert (scene[5, 5] == 1).all()
    inked = np.count_nonzero((scene < 0.97).any(axis=2)) / scene[..., 0].size
    assert 0.1 < inked < 0.9


def test_light_is_painted_on_a_detector(pictures):
    dark = {name: np.count_nonzero((picture < 0.15).all(axis=2)) for name, picture in pictures.items()}
    assert dark["painted"] > 5 * dark["scene"]


def test_what_cannot_be_shown_is_refused(traced, tmp_path):
    with pytest.raises(OutputError, match=r"must end in \.png, \.html"):
        view(traced, tmp_path / "v.jpg")
    with pytest.raises(CriterionError, match="Unknown body 'Nothing'"):
        view(traced, tmp_path / "v.html", "hit(Nothing)")
    with pytest.raises(CriterionError, match="Unknown detector 'Eye'"):
        view(traced, tmp_path / "v.html", paint=["Eye"])
    with pytest.raises(SceneError, match="no such file"):
        view(tmp_path / "none.scene.json", tmp_path / "v.html")
    with pytest.raises(MapError):
        view(tmp_path, tmp_path / "v.html")
    assert list(tmp_path.iterdir()) == []


def test_painted_cells_lie_in_their_place_in_false_colours(traced):
    pytest.importorskip("matplotlib")
    content = build_view(traced, rays=0, paint=["Target"])
    lit, detector = evaluate_detector(traced, "Target"), traced.scene.detectors["Target"]
    (painting,) = content.paintings
    cells = painting.triangles_mm.reshape(*lit.cell_flux_w.shape, 2, 3, 3)
    assert cells[..., 2] == pytest.approx(np.full(cells.shape[:-1], detector.center_mm[2]), abs=1e-12)
    row, column = np.unravel_index(np.argmax(lit.cell_flux_w), lit.cell_flux_w.shape)
    x_mm, y_mm = cells[row, column].reshape(-1, 3)[:, 0], cells[row, column].reshape(-1, 3)[:, 1]
    assert (x_mm.min(), x_mm.max()) == pytest.approx(lit.x_edges_mm[[column, column + 1]], abs=1e-9)
    assert (y_mm.min(), y_mm.max()) == pytest.approx(lit.y_edges_mm[[row, row + 1]], abs=1e-9)
    colours = painting.rgb.reshape(*lit.cell_flux_w.shape, 2, 3).astype(int).sum(axis=3)[..., 0]
    assert colours[row, column] == colours.max()
    # a painted detector has no tint of its own that would lie in the same plane
    triangles = {shape.name: len(shape.triangles_mm) for shape in content.shapes if shape.kind == "detector"}
    assert triangles == {"Beam": 2, "Target": 0}
