# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scene to arrays: media on both sides of every face, media of sources, the frame, and what the scene's hash covers."""

from __future__ import annotations

import copy
import itertools
import json
import math
import struct
from pathlib import Path

import numpy as np
import pytest

from raymaps.compile import CompiledScene, compile_scene
from raymaps.errors import SceneError
from raymaps.scene import Scene, load_scene
from raymaps.solids import medium_at
from tests.store.small_scenes import BOX_FACES, box, changed, geometry, mesh, sheet, workshop, write_scene

MEDIA = {"glass": {"refractive_index": 1.5}, "water": {"refractive_index": 1.33}, "air": {"refractive_index": 1.0003}}
SURFACES = {
    "polished": {"kind": "fresnel"},
    "black": {"kind": "absorber"},
    "grey": {"kind": "lambertian", "reflectance": 0.5},
    "mirror": {"kind": "mirror"},
}


def scene_with(folder: Path, bodies: dict, sources: dict | None = None, **more) -> Scene:
    """``bodies`` maps a name to (mesh, medium, surface[, face_surfaces])."""
    data = {
        "format": "raymaps-scene",
        "version": 1,
        "media": MEDIA,
        "surfaces": SURFACES,
        "bodies": {
            name: {
                "geometry": geometry(folder, body, f"{name}.ply"),
                "medium": medium,
                "surface": surface,
                "face_surfaces": dict(*faces),
            }
            for name, (body, medium, surface, *faces) in bodies.items()
        },
        "sources": sources or {"P": {"kind": "point", "flux_w": 1, "position_mm": [40, 0, 0]}},
        **more,
    }
    return Scene.model_validate(data).with_folder(folder)


def outside(compiled: CompiledScene, body: str) -> set[str]:
    """Media just before a body's triangles."""
    mesh = compiled.meshes[compiled.names.bodies.index(body)]
    normal = mesh.area_vectors_mm2 / np.linalg.norm(mesh.area_vectors_mm2, axis=1)[:, None]
    points = mesh.corners_mm.mean(axis=1) + 1e-3 * normal
    names = compiled.names.media
    found = medium_at(compiled.scene, compiled.meshes, names, int(compiled.tables.ambient[0]), points)
    return {names[medium] for medium in found}


def inside(compiled: CompiledScene, body: str) -> set[str]:
    """Media of the solid behind a body's faces, "-" for none."""
    mine = compiled.tables.face_body == compiled.names.bodies.index(body)
    solids, medium = compiled.boundary.tables.solid[mine], compiled.boundary.tables.solid_medium
    return {compiled.names.media[medium[k]] if k >= 0 and medium[k] >= 0 else "-" for k in solids}


def refused(scene: Scene) -> str:
    with pytest.raises(SceneError) as caught:
        compile_scene(scene)
    assert "\n" not in str(caught.value)
    return str(caught.value)


# ---------------------------------------------------------------------------------------------------------------------
# Media


@pytest.mark.parametrize("order", list(itertools.permutations(["Outer", "Middle", "Core"])))
def test_nested_bodies_stand_in_the_smallest_body_around_them(tmp_path, order):
    bodies = {
        "Outer": (box("o", (0, 0, 0), 10), "glass", "polished"),
        "Middle": (box("m", (1, 0, 0), 6), "water", "polished"),
        "Core": (box("c", (1, 1, 0), 2), "air", "polished"),
    }
    compiled = compile_scene(scene_with(tmp_path, {name: bodies[name] for name in order}))
    assert {name: (inside(compiled, name), outside(compiled, name)) for name in bodies} == {
        "Outer": ({"glass"}, {"vacuum"}),
        "Middle": ({"water"}, {"glass"}),
        "Core": ({"air"}, {"water"}),
    }


def test_bodies_side_by_side_stand_in_the_ambient_medium(tmp_path):
    bodies = {
        "A": (box("a", (0, 0, 0), 2), "glass", "polished"),
        "B": (box("b", (2.1, 0, 0), 2), "water", "polished"),
        "C": (box("c", (1.05, 2.5, 0), 2), "glass", "polished"),
    }
    compiled = compile_scene(scene_with(tmp_path, bodies, ambient="air"))
    assert all(outside(compiled, name) == {"air"} for name in bodies)


def test_a_body_without_a_medium_has_no_media_and_counts_for_no_other(tmp_path):
    bodies = {
        "Housing": (box("h", (0, 0, 0), 10), None, "grey"),
        "Lens": (box("l", (0, 0, 0), 2), "glass", "polished"),
        "Sheet": (sheet("s", (0, 0, 0.2), 1, 1), None, "mirror"),
    }
    compiled = compile_scene(scene_with(tmp_path, bodies, ambient="water"))
    assert inside(compiled, "Housing") == inside(compiled, "Sheet") == {"-"}
    assert (inside(compiled, "Lens"), outside(compiled, "Lens")) == ({"glass"}, {"water"})


def test_ambient_medium_of_a_scene_that_names_none_is_vacuum(tmp_path):
    compiled = compile_scene(scene_with(tmp_path, {"A": (box("a", (0, 0, 0), 2), "glass", "polished")}))
    assert compiled.names.media == ("glass", "water", "air", "vacuum")
    assert compiled.tables.medium_index.tolist() == [1.5, 1.33, 1.0003, 1.0]
    named = compile_scene(scene_with(tmp_path, {"A": (box("a", (0, 0, 0), 2), "glass", "polished")}, ambient="air"))
    assert "vacuum" not in named.names.media


def test_a_medium_called_vacuum_that_is_none(tmp_path):
    media = {**MEDIA, "vacuum": {"refractive_index": 1.1}}
    scene = scene_with(tmp_path, {}, media=media)
    assert "vacuum" in refused(scene)
    compile_scene(scene_with(tmp_path, {}, media=media, ambient="vacuum"))
    compile_scene(scene_with(tmp_path, {}, media={**MEDIA, "vacuum": {"refractive_index": 1}}))


@pytest.mark.parametrize(
    ("position_mm", "medium"),
    [([0, 0, 0], "water"), ([4, 0, 0], "glass"), ([6, 0, 0], "vacuum"), ([0, 0, -20], "vacuum")],
)
def test_medium_that_a_source_emits_into(tmp_path, position_mm, medium):
    bodies = {
        "Outer": (box("o", (0, 0, 0), 10), "glass", "polished"),
        "Inner": (box("i", (0, 0, 0), 6), "water", "polished"),
    }
    at = {"flux_w": 1, "position_mm": position_mm, "direction": [0, 0, 1]}
    sources = {
        "P": {"kind": "point", "flux_w": 1, "position_mm": position_mm},
        "C": {"kind": "cone", "half_angle_deg": 5, **at},
        "D": {"kind": "disc", "radius_mm": 0.1, **at},
    }
    compiled = compile_scene(scene_with(tmp_path, bodies, sources))
    assert [compiled.names.media[m] for m in compiled.source_media] == [medium] * 3


def test_medium_that_faces_emit_into_is_outside_of_their_body(tmp_path):
    bodies = {
        "Epoxy": (box("e", (0, 0, 0), 10), "glass", "polished"),
        "Chip": (box("c", (0, 0, 0), 2), None, "grey"),
        "Free": (box("f", (20, 0, 0), 2), None, "grey"),
    }
    source = {"kind": "faces", "flux_w": 1}
    sources = {"In": {**source, "body": "Chip", "faces": ["top"]}, "Out": {**source, "body": "Free"}}
    compiled = compile_scene(scene_with(tmp_path, bodies, sources))
    assert [compiled.names.media[m] for m in compiled.source_media] == ["glass", "vacuum"]


# ---------------------------------------------------------------------------------------------------------------------
# What can't be simulated


def test_a_source_on_an_unknown_face(tmp_path):
    scene = scene_with(
        tmp_path, {"A": (box("a", (0, 0, 0), 2), None, "grey")},
        {"S": {"kind": "faces", "flux_w": 1, "body": "A", "faces": ["lid"]}},
    )  # fmt: skip
    text = refused(scene)
    assert "'S'" in text
    assert "'lid'" in text
    assert "'top'" in text


def test_a_source_on_a_face_without_area(tmp_path):
    """Nothing can be emitted from a face whose triangles are all degenerate."""
    whole = box("a", (0, 0, 0), 2)
    triangles = [*whole.triangles.tolist(), [0, 0, 1]]
    flat = mesh("a", whole.vertices_mm, triangles, {"all": 12, "seam": 1})
    source = {"S": {"kind": "faces", "flux_w": 1, "body": "A", "faces": ["seam"]}}
    text = refused(scene_with(tmp_path, {"A": (flat, None, "grey")}, source))
    assert "'S'" in text
    assert "'seam'" in text


@pytest.mark.parametrize("kind", ["point", "cone", "disc"])
def test_a_source_inside_an_absorber(tmp_path, kind):
    more = {"cone": {"half_angle_deg": 5}, "disc": {"radius_mm": 0.1}, "point": {}}[kind]
    more |= {} if kind == "point" else {"direction": [0, 0, 1]}
    source = {"Lamp": {"kind": kind, "flux_w": 1, "position_mm": [0, 0, 0.3], **more}}
    text = refused(scene_with(tmp_path, {"Stop": (box("s", (0, 0, 0), 2), None, "black")}, source))
    assert "'Lamp'" in text
    assert "'Stop'" in text
    assert "absorbs" in text


def test_a_source_inside_what_is_not_wholly_an_absorber(tmp_path):
    source = {"Lamp": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0.3]}}
    closed, lid = box("s", (0, 0, 0), 2), {"top": "mirror"}
    compile_scene(scene_with(tmp_path, {"Stop": (closed, None, "black", lid)}, source))
    compile_scene(scene_with(tmp_path, {"Stop": (closed, None, "grey")}, source))
    holed = mesh("s", closed.vertices_mm, closed.triangles[:-2], dict.fromkeys(BOX_FACES[:-1], 2))
    compile_scene(scene_with(tmp_path, {"Stop": (holed, None, "black")}, source))


def test_a_source_inside_a_face_by_face_absorber(tmp_path):
    """Black on every face, though the body's own property is another one."""
    source = {"Lamp": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0.3]}}
    faces = dict.fromkeys(BOX_FACES, "black")
    text = refused(scene_with(tmp_path, {"Stop": (box("s", (0, 0, 0), 2), None, "grey", faces)}, source))
    assert "'Stop'" in text


@pytest.mark.parametrize("where", ["body", "face", "mixture"])
def test_a_fresnel_interface_needs_a_medium(tmp_path, where):
    part, surfaces = box("a", (0, 0, 0), 2), copy.deepcopy(SURFACES)
    surfaces["mixed"] = {
        "kind": "mixture",
        "parts": [{"weight": 0.5, "surface": "polished"}, {"weight": 0.5, "surface": "black"}],
    }
    body = {"body": (part, None, "polished"), "face": (part, None, "grey", {"top": "polished"}),
            "mixture": (part, None, "mixed")}[where]  # fmt: skip
    text = refused(scene_with(tmp_path, {"A": body}, surfaces=surfaces))
    assert "interface between two media" in text
    assert "'A" in text
    assert "medium" in text
    with_medium = (body[0], "glass", *body[2:])
    compile_scene(scene_with(tmp_path, {"A": with_medium}, surfaces=surfaces))


METAL = {"gold": {"refractive_index": 0.2, "extinction": 3.0}, "glass": {"refractive_index": 1.5}}
OPEN = {
    "polished": {"kind": "fresnel"},
    "milky": {"kind": "lambertian", "reflectance": 0.5, "transmittance": 0.4},
    "grey": {"kind": "absorber"},
}


def test_no_metal_fills_the_space_around(tmp_path):
    bodies = {"A": (box("a", (0, 0, 0), 2), "glass", "polished")}
    assert "ambient medium is 'gold', a metal" in refused(
        scene_with(tmp_path, bodies, media=METAL, surfaces=OPEN, ambient="gold")
    )


@pytest.mark.parametrize("kind", ["point", "faces"])
def test_no_source_shines_into_a_metal(tmp_path, kind):
    """From a place inside it, or from the faces of a body that stands in it."""
    source = {"kind": "point", "flux_w": 1, "position_mm": [0.9, 0, 0]}
    if kind == "faces":
        source = {"kind": "faces", "flux_w": 1, "body": "B"}
    bodies = {
        "A": (box("a", (0, 0, 0), 4), "gold", "polished"), "B": (box("b", (0, 0, 0), 0.5), "glass", "polished")
    }  # fmt: skip
    words = refused(scene_with(tmp_path, bodies, {"P": source}, media=METAL, surfaces=OPEN))
    assert "Source 'P'" in words
    assert "'gold', a metal" in words


@pytest.mark.parametrize("media", [("gold", "glass"), ("glass", "gold")])
def test_nothing_is_scattered_into_a_metal(tmp_path, media):
    """From either side of its surface: the body is of metal, or stands in one."""
    bodies = {
        "A": (box("a", (0, 0, 0), 4), media[0], "polished"), "B": (box("b", (0, 0, 0), 1), media[1], "milky")
    }  # fmt: skip
    words = refused(scene_with(tmp_path, bodies, media=METAL, surfaces=OPEN))
    assert "Surface 'milky' of body 'B' transmits light" in words


@pytest.mark.parametrize("coordinate", [1e150, -1e200])
def test_a_scene_of_absurd_size(tmp_path, coordinate):
    source = {"P": {"kind": "point", "flux_w": 1, "position_mm": [coordinate, 0, 0]}}
    assert "mm" in refused(scene_with(tmp_path, {"A": (box("a", (0, 0, 0), 2), None, "grey")}, source))


# ---------------------------------------------------------------------------------------------------------------------
# The frame and the tables


@pytest.mark.parametrize("size_mm", [1e-3, 1.0, 3e5])
@pytest.mark.parametrize("place_mm", [0.0, 1e4])
def test_the_frame_holds_the_scene_in_a_cube_from_minus_one_to_one(tmp_path, size_mm, place_mm):
    part = box("a", (place_mm * size_mm, 0, 0), (size_mm, 0.2 * size_mm, 0.5 * size_mm))
    source = {"P": {"kind": "point", "flux_w": 1, "position_mm": [place_mm * size_mm, 0, 0.4 * size_mm]}}
    compiled = compile_scene(scene_with(tmp_path, {"A": (part, None, "grey")}, source))
    frame, corners = compiled.frame, compiled.boundary.tables.corners
    assert math.frexp(frame.unit_mm)[0] == math.frexp(frame.grid_mm)[0] == 0.5  # powers of two
    assert np.abs(corners).max() <= 1
    assert np.abs(corners).max() > 0.4  # at most one factor of two is given away
    assert 0.4e-6 * size_mm < frame.grid_mm <= 1e-6 * size_mm
    low, high = compiled.tables.box
    assert (corners > low).all()
    assert (corners < high).all()
    assert np.abs(compiled.tables.box).max() <= 1
    back = frame.to_mm(corners)
    assert np.abs(back - compiled.meshes[0].corners_mm).max() <= 1e-12 * size_mm * max(place_mm, 1)


def test_the_box_holds_sources_and_detectors_too(tmp_path):
    sources = {
        "P": {"kind": "point", "flux_w": 1, "position_mm": [0, 50, 0]},
        "D": {"kind": "disc", "flux_w": 1, "position_mm": [0, 0, -70], "direction": [1, 0, 0], "radius_mm": 5},
    }
    detector = {"kind": "rectangle", "center_mm": [30, 0, 0], "normal": [1, 0, 0], "x_axis": [0, 1, 0]}
    detectors = {"W": {**detector, "width_mm": 4, "height_mm": 200}}
    compiled = compile_scene(
        scene_with(tmp_path, {"A": (box("a", (0, 0, 0), 2), None, "grey")}, sources, detectors=detectors)
    )
    low, high = compiled.frame.to_mm(compiled.tables.box)
    assert high[0] > 30
    assert high[1] > 50
    assert low[2] < -100
    assert high[2] > 100


def test_a_scene_of_one_point_source_has_a_box(tmp_path):
    compiled = compile_scene(scene_with(tmp_path, {}))
    low, high = compiled.frame.to_mm(compiled.tables.box)
    assert (low < [40, 0, 0]).all()
    assert (high > [40, 0, 0]).all()
    assert len(compiled.boundary.tables.corners) == 0


def test_tables_say_what_the_scene_says(tmp_path):
    data = workshop(tmp_path)
    scene = load_scene(write_scene(tmp_path, data))
    compiled = compile_scene(scene)
    tables, names = compiled.tables, compiled.names
    for i, (body, face) in enumerate(names.faces):
        entry = scene.bodies[names.bodies[body]]
        assert names.surfaces[tables.face_surface[i]] == entry.face_surfaces.get(face, entry.surface)
        assert tables.face_body[i] == body
    assert tables.triangle_face.tolist() == sorted(tables.triangle_face)
    assert len(tables.triangle_face) == 12 * 4 + 2 * 2 == len(tables.plane) == len(compiled.boundary.tables.corners)
    normal, offset = tables.plane[:, :3], tables.plane[:, 3]
    assert np.linalg.norm(normal, axis=1) == pytest.approx(1)
    assert np.einsum("ij,ikj->ik", normal, compiled.boundary.tables.corners) == pytest.approx(
        offset[:, None].repeat(3, 1), abs=1e-14
    )
    satin = names.surfaces.index("satin")
    mixture = compiled.effect_data["mixture"]
    parts = slice(mixture.start[satin], mixture.start[satin + 1])
    assert [names.surfaces[p] for p in mixture.part[parts]] == ["polished", "screen", "black"]
    assert mixture.edge[parts] == pytest.approx([0.5, 0.8, 1.0])
    assert mixture.edge[parts][-1] == 1.0
    mirror = names.surfaces.index("mirror")
    assert compiled.effect_data["mirror"].reflectance[mirror].tolist() == [0.9, 0.8, 0.7]
    glass = names.media.index("glass")
    absorption = compiled.effect_data["medium_absorption"].absorption[glass]
    assert absorption / compiled.frame.unit_mm == pytest.approx([0.05, 0.02, 0.0])
    for axes in compiled.effect_data["crossings"].axes:
        assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-14)
        assert np.linalg.det(axes) == pytest.approx(1)


def test_tables_are_read_only(tmp_path):
    compiled = compile_scene(load_scene(write_scene(tmp_path, workshop(tmp_path))))
    for data in (compiled.tables, *compiled.effect_data.values()):
        for array in data:
            assert not array.flags.writeable


def test_degenerate_triangles_keep_their_number(tmp_path):
    whole = box("a", (0, 0, 0), 2)
    part = mesh("a", whole.vertices_mm, [[0, 0, 1], *whole.triangles.tolist()], {"seam": 1, "rest": 12})
    compiled = compile_scene(scene_with(tmp_path, {"A": (part, "glass", "polished")}))
    assert compiled.tables.triangle_face.tolist() == [0] + [1] * 12


# ---------------------------------------------------------------------------------------------------------------------
# The hash


@pytest.fixture(scope="module")
def hashed(tmp_path_factory):
    """The workshop's data, and a function that hashes changed data."""
    folder = tmp_path_factory.mktemp("hashed")
    data = workshop(folder)

    def hash_of(changed_data: dict) -> str:
        return compile_scene(Scene.model_validate(changed_data).with_folder(folder)).scene_hash

    return data, hash_of, folder


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("name", "another"),
        ("settings.rays", 7),
        ("settings.seed", 99),
        ("origin", {"document": "x.FCStd"}),
        ("origin", None),
    ],
)
def test_hash_does_not_depend_on(hashed, place, value):
    data, hash_of, _ = hashed
    assert hash_of(changed(data, place, value)) == hash_of(data)


def test_hash_does_not_depend_on_names_formats_and_units_of_files(hashed):
    data, hash_of, folder = hashed
    block = box("Block", (0, 0, 0), 10)
    (folder / "elsewhere").mkdir(exist_ok=True)
    renamed = changed(data, "bodies.Block.geometry", geometry(folder, block, "elsewhere/b.ply"))
    assert hash_of(renamed) == hash_of(data)
    facets = b"".join(struct.pack("<12fH", 0, 0, 0, *t.reshape(-1), 0) for t in block.corners_mm)
    (folder / "b.stl").write_bytes(b"\0" * 80 + struct.pack("<I", 12) + facets)
    assert hash_of(changed(data, "bodies.Block.geometry.file", "b.stl")) == hash_of(data)
    halved = mesh("Block", block.vertices_mm / 2, block.triangles, dict.fromkeys(BOX_FACES, 2))
    in_other_units = {**geometry(folder, halved, "half.ply"), "mm_per_unit": 2}
    assert hash_of(changed(data, "bodies.Block.geometry", in_other_units)) == hash_of(data)


def test_hash_does_not_depend_on_how_numbers_are_written(hashed):
    data, hash_of, _ = hashed
    assert hash_of(changed(data, "surfaces.white.reflectance", [0.8, 0.8, 0.8])) == hash_of(data)
    assert hash_of(changed(data, "sources.Lamp.rgb", [1, 1, 1])) == hash_of(data)
    assert hash_of(changed(data, "sources.LED.flux_w", 2)) == hash_of(data)


def test_hash_of_a_map_is_that_of_the_scene_in_it(hashed, tmp_path):
    """So a map's own scene file can be checked, and simulated again."""
    from raymaps.run import simulate

    data, hash_of, folder = hashed
    raymap = simulate(Scene.model_validate(data).with_folder(folder), tmp_path / "m.raymap", rays=20)
    assert raymap.manifest.scene_hash == hash_of(data) == compile_scene(raymap.scene).scene_hash


def test_hash_depends_on_the_name_of_an_illuminant(hashed):
    """A field that is called as one that does not count: a scene's own name."""
    data, hash_of, _ = hashed
    one, other = (changed(data, "sources.Lamp.spectrum", {"kind": "illuminant", "name": name}) for name in ("D65", "A"))
    assert hash_of(one) != hash_of(other)


CHANGES = [
    ("ambient", None), ("media.glass.refractive_index", 1.5000001),
    ("media.glass.absorption_per_mm", [0.05, 0.02, 1e-9]),
    ("surfaces.mirror.reflectance", [0.9, 0.8, 0.7000001]), ("surfaces.white.transmittance", 0.01),
    ("surfaces.black.kind", "fresnel_mirror"), ("surfaces.satin.parts.0.surface", "black"),
    ("bodies.Block.medium", "air"), ("bodies.Block.face_surfaces", {}), ("bodies.Mirror.surface", "black"),
    ("sources.LED.flux_w", 2.1), ("sources.LED.rgb", [1, 1, 1]), ("sources.LED.faces", ["bottom"]),
    ("sources.Lamp.position_mm", [-12, 3, 2.0001]), ("sources.Spot.half_angle_deg", 21),
    ("sources.Spot.direction", [1, 0, 0.21]), ("sources.Beam.radius_mm", 2.1), ("detectors.Above.width_mm", 25),
    ("detectors.Above.max_angle_deg", 36), ("detectors.Above.side", "back"), ("settings.max_events", 13),
    ("settings.roulette_threshold", 0.2),
]  # fmt: skip


@pytest.mark.parametrize(("place", "value"), CHANGES, ids=lambda x: str(x)[:30])
def test_hash_depends_on(hashed, place, value):
    data, hash_of, _ = hashed
    other = changed(data, place, value)
    if value == "fresnel_mirror":
        other = changed(data, "surfaces.black", {"kind": "mirror"})
    assert hash_of(other) != hash_of(data)


def test_hash_depends_on_triangles_and_faces(hashed):
    data, hash_of, folder = hashed
    block = box("Block", (0, 0, 0), 10)
    moved = block.vertices_mm.copy()
    moved[0, 0] = np.nextafter(moved[0, 0], 0)
    nudged = mesh("Block", moved, block.triangles, dict.fromkeys(BOX_FACES, 2))
    assert hash_of(changed(data, "bodies.Block.geometry", geometry(folder, nudged, "n.ply"))) != hash_of(data)
    other_faces = mesh("Block", block.vertices_mm, block.triangles, {"left": 4, "top": 8})
    assert hash_of(changed(data, "bodies.Block.geometry", geometry(folder, other_faces, "f.ply"))) != hash_of(data)


def test_hash_depends_on_what_there_is(hashed):
    data, hash_of, _ = hashed
    for section, name in (("bodies", "Stop"), ("sources", "Beam"), ("detectors", "Above")):
        fewer = copy.deepcopy(data)
        del fewer[section][name]
        assert hash_of(fewer) != hash_of(data)


def test_hash_is_stable_through_a_file(hashed, tmp_path):
    data, hash_of, _ = hashed
    assert hash_of(json.loads(json.dumps(data))) == hash_of(data)
    assert len(hash_of(data)) == 64
