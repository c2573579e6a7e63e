# SPDX-License-Identifier: LGPL-2.1-or-later
"""Triangles from files: order and faces kept, and everything that can't be used refused in one sentence."""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path

import numpy as np
import pytest

from raymaps.errors import OutputError, SceneError
from raymaps.geometry import BodyMesh, load_bodies, mesh_digest, winding_number, write_ply
from raymaps.scene import Scene
from raymaps.scene.bodies import Geometry
from tests.store.small_scenes import BOX_FACES, box, mesh, read_ply, sheet

CORNERS = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 5]], float)
TRIANGLES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]  # a closed tetrahedron, outward


def scene_of(folder: Path, file: str, medium: str | None = None, **geometry) -> Scene:
    body = {
        "geometry": {"file": file, **geometry.pop("geometry", {})},
        "medium": medium,
        "surface": "black",
        **geometry,
    }
    data = {
        "format": "raymaps-scene",
        "version": 1,
        "media": {"glass": {"refractive_index": 1.5}},
        "surfaces": {"black": {"kind": "absorber"}},
        "bodies": {"Part": body},
        "sources": {"P": {"kind": "point", "flux_w": 1, "position_mm": [9, 9, 9]}},
    }
    return Scene.model_validate(data).with_folder(folder)


def load(folder: Path, file: str, medium: str | None = None, **geometry) -> BodyMesh:
    return load_bodies(scene_of(folder, file, medium, **geometry))[0]


def refused(folder: Path, file: str, medium: str | None = None, **geometry) -> str:
    with pytest.raises(SceneError) as caught:
        load(folder, file, medium, **geometry)
    text = str(caught.value)
    assert "'Part'" in text
    assert "\n" not in text
    assert len(text) < 500
    return text


# ---------------------------------------------------------------------------------------------------------------------
# Writers of the formats, as simple as their descriptions


def ascii_stl(corners, triangles, name: str = "part") -> bytes:
    lines = [f"solid {name}"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {} {} {}".format(*map(float, corners[i])) for i in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, f"endsolid {name}", ""]).encode()


def binary_stl(corners, triangles) -> bytes:
    facets = b"".join(
        struct.pack("<12fH", 0, 0, 0, *(float(x) for i in triangle for x in corners[i]), 0) for triangle in triangles
    )
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + facets


def ascii_ply(corners, triangles, kind: str = "float") -> bytes:
    head = (
        f"ply\nformat ascii 1.0\nelement vertex {len(corners)}\n"
        f"property {kind} x\nproperty {kind} y\nproperty {kind} z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = ["{!r} {!r} {!r}".format(*map(float, c)) for c in corners] + ["3 {} {} {}".format(*t) for t in triangles]
    return (head + "\n".join(rows) + "\n").encode()


def binary_ply(corners, triangles, kind: str = "float") -> bytes:
    head = ascii_ply([], [], kind).decode().replace("ascii", "binary_little_endian")
    head = (
        head.replace("vertex 0", f"vertex {len(corners)}").replace("face 0", f"face {len(triangles)}").rstrip("\n")
        + "\n"
    )
    code = {"float": "f4", "double": "f8"}[kind]
    return (
        head.encode()
        + np.asarray(corners, f"<{code}").tobytes()
        + b"".join(struct.pack("<B3i", 3, *t) for t in triangles)
    )


def obj(groups: dict[str, list]) -> bytes:
    lines = ["v {!r} {!r} {!r}".format(*map(float, c)) for c in CORNERS]
    for name, triangles in groups.items():
        lines += [f"o {name}"] + ["f {} {} {}".format(*(i + 1 for i in t)) for t in triangles]
    return "\n".join([*lines, ""]).encode()


def glb(parts: dict[str, tuple[np.ndarray, list]]) -> bytes:
    blob, views, accessors, meshes, nodes = b"", [], [], [], []
    for i, (name, (corners, triangles)) in enumerate(parts.items()):
        for data, kind, code, n in (
            (np.asarray(corners, "<f4"), "VEC3", 5126, len(corners)),
            (np.asarray(triangles, "<u4").reshape(-1), "SCALAR", 5125, 3 * len(triangles)),
        ):
            views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": data.nbytes})
            accessor = {"bufferView": len(views) - 1, "componentType": code, "count": n, "type": kind}
            if kind == "VEC3":
                accessor |= {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()}
            accessors.append(accessor)
            blob += data.tobytes()
        primitive = {"attributes": {"POSITION": 2 * i}, "indices": 2 * i + 1, "mode": 4}
        meshes.append({"name": name, "primitives": [primitive]})
        nodes.append({"name": name, "mesh": i})
    head = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes,
        "meshes": meshes, "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(blob)}],
    }  # fmt: skip
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


FILES = {
    "ascii.stl": ascii_stl(CORNERS, TRIANGLES),
    "binary.stl": binary_stl(CORNERS, TRIANGLES),
    "ascii_float.ply": ascii_ply(CORNERS, TRIANGLES),
    "binary_float.ply": binary_ply(CORNERS, TRIANGLES),
    "binary_double.ply": binary_ply(CORNERS, TRIANGLES, "double"),
    "one.obj": obj({"only": TRIANGLES}),
    "one.glb": glb({"only": (CORNERS, TRIANGLES)}),
}


@pytest.mark.parametrize("file", FILES)
def test_every_format_gives_the_same_triangles_in_order(tmp_path, file):
    (tmp_path / file).write_bytes(FILES[file])
    part = load(tmp_path, file, "glass")
    assert part.corners_mm.tolist() == CORNERS[np.array(TRIANGLES)].tolist()
    assert part.face_names == ("Face1",)
    assert part.is_closed
    assert part.volume_mm3 == pytest.approx(2 * 3 * 5 / 6)


@pytest.mark.parametrize("file", ["PART.STL", "part.Ply"])
def test_the_suffix_may_be_in_capitals(tmp_path, file):
    (tmp_path / file).write_bytes(FILES["binary.stl" if "STL" in file else "binary_double.ply"])
    assert len(load(tmp_path, file).triangles) == 4


def test_order_of_many_triangles_is_kept(tmp_path):
    rng = np.random.default_rng(8)
    corners, triangles = (
        rng.normal(size=(500, 3)),
        [tuple(int(i) for i in rng.permutation(500)[:3]) for _ in range(900)],
    )
    for file, data in {
        "a.ply": binary_ply(corners, triangles, "double"),
        "b.ply": ascii_ply(corners, triangles, "double"),
    }.items():
        (tmp_path / file).write_bytes(data)
        assert load(tmp_path, file).corners_mm.tolist() == corners[np.array(triangles)].tolist()
    (tmp_path / "c.stl").write_bytes(binary_stl(corners, triangles))
    assert load(tmp_path, "c.stl").corners_mm.tolist() == corners[np.array(triangles)].astype("f4").tolist()


def test_doubles_of_a_ply_lose_no_bit(tmp_path):
    corners = CORNERS + np.array([1 / 3, 1e6 / 7, 1e-9 / 3])
    (tmp_path / "a.ply").write_bytes(binary_ply(corners, TRIANGLES, "double"))
    assert load(tmp_path, "a.ply").corners_mm.tobytes() == corners[np.array(TRIANGLES)].tobytes()


def test_a_ply_with_double_vertices_in_big_endian(tmp_path):
    head = binary_ply([], [], "double").decode().replace("little", "big").replace("vertex 0", "vertex 4")
    head = head.replace("face 0", "face 4")
    data = head.encode() + CORNERS.astype(">f8").tobytes() + b"".join(struct.pack(">B3i", 3, *t) for t in TRIANGLES)
    (tmp_path / "a.ply").write_bytes(data)
    assert load(tmp_path, "a.ply", "glass").corners_mm.tolist() == CORNERS[np.array(TRIANGLES)].tolist()


def test_groups_of_an_obj_are_faces_in_order(tmp_path):
    (tmp_path / "a.obj").write_bytes(obj({"zeta": TRIANGLES[:1], "alpha": TRIANGLES[1:3], "mid": TRIANGLES[3:]}))
    part = load(tmp_path, "a.obj", "glass")
    assert part.face_names == ("zeta", "alpha", "mid")
    assert part.triangle_face.tolist() == [0, 1, 1, 2]
    assert part.corners_mm.tolist() == CORNERS[np.array(TRIANGLES)].tolist()


def test_meshes_of_a_glb_are_faces_in_order(tmp_path):
    (tmp_path / "a.glb").write_bytes(glb({"lower": (CORNERS, TRIANGLES[:1]), "around": (CORNERS, TRIANGLES[1:])}))
    part = load(tmp_path, "a.glb", "glass")
    assert part.face_names == ("lower", "around")
    assert part.triangle_face.tolist() == [0, 1, 1, 1]
    assert part.corners_mm.tolist() == CORNERS[np.array(TRIANGLES)].tolist()


def test_named_meshes_can_be_given_properties(tmp_path):
    (tmp_path / "a.glb").write_bytes(glb({"lower": (CORNERS, TRIANGLES[:1]), "around": (CORNERS, TRIANGLES[1:])}))
    load(tmp_path, "a.glb", face_surfaces={"around": "black"})
    assert "'lower', 'around'" in refused(tmp_path, "a.glb", face_surfaces={"upper": "black"})


def test_unit_of_the_file(tmp_path):
    (tmp_path / "a.stl").write_bytes(binary_stl(CORNERS, TRIANGLES))
    part = load(tmp_path, "a.stl", "glass", geometry={"mm_per_unit": 25.4})
    assert part.volume_mm3 == pytest.approx(5 * 25.4**3)


# ---------------------------------------------------------------------------------------------------------------------
# Faces of the scene


def faces(**counts: int) -> dict:
    return {"faces": [{"name": name, "triangles": n} for name, n in counts.items()]}


def test_faces_are_runs_of_triangles(tmp_path):
    write_ply(tmp_path / "a.ply", box("x", (0, 0, 0), 2))
    part = load(tmp_path, "a.ply", "glass", geometry=faces(A=2, B=7, C=3))
    assert part.face_names == ("A", "B", "C")
    assert part.triangle_face.tolist() == [0] * 2 + [1] * 7 + [2] * 3
    assert part.face_indices(("C", "A"), "here").tolist() == [2, 0]
    assert part.face_indices(None, "here").tolist() == [0, 1, 2]


@pytest.mark.parametrize("counts", [{"A": 11}, {"A": 12, "B": 1}, {"A": 2**31}])
def test_counts_of_faces_must_add_up(tmp_path, counts):
    write_ply(tmp_path / "a.ply", box("x", (0, 0, 0), 2))
    text = refused(tmp_path, "a.ply", geometry=faces(**counts))
    assert str(sum(counts.values())) in text
    assert "12" in text


def test_names_of_faces_must_differ(tmp_path):
    write_ply(tmp_path / "a.ply", box("x", (0, 0, 0), 2))
    same = {"faces": [{"name": "A", "triangles": 6}, {"name": "A", "triangles": 6}]}
    assert "same name" in refused(tmp_path, "a.ply", geometry=same)


def test_a_property_of_an_unknown_face(tmp_path):
    write_ply(tmp_path / "a.ply", box("x", (0, 0, 0), 2))
    text = refused(tmp_path, "a.ply", geometry=faces(A=12), face_surfaces={"B": "black"})
    assert "nknown face" in text
    assert "'B'" in text
    assert "'A'" in text


# ---------------------------------------------------------------------------------------------------------------------
# What can't be used


def test_a_missing_file(tmp_path):
    text = refused(tmp_path, "none.stl")
    assert "none.stl" in text
    assert "no file" in text


def test_a_folder_in_place_of_a_file(tmp_path):
    (tmp_path / "a.stl").mkdir()
    assert "no file" in refused(tmp_path, "a.stl")


@pytest.mark.parametrize("file", ["a.step", "a", "a.txt", "a.gltf"])
def test_another_format(tmp_path, file):
    (tmp_path / file).write_bytes(b"ISO-10303-21;")
    text = refused(tmp_path, file)
    assert ".stl" in text
    assert ".glb" in text


@pytest.mark.parametrize("file", ["x" * 300 + ".stl", "\0.stl", "a\0b.ply"])
def test_a_name_that_no_file_can_have(tmp_path, file):
    refused(tmp_path, file)


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj", "glb"])
@pytest.mark.parametrize(
    "data", [b"", b"\0" * 200, b"nonsense\n" * 20, bytes(range(256)) * 4], ids=["empty", "0", "text", "bytes"]
)
def test_damaged_files(tmp_path, suffix, data):
    (tmp_path / f"a.{suffix}").write_bytes(data)
    refused(tmp_path, f"a.{suffix}")


@pytest.mark.parametrize("file", [f for f in FILES if not f.startswith("ascii") and not f.endswith("obj")])
@pytest.mark.parametrize("part", [0.2, 0.5, 0.9, 0.98])
def test_a_file_cut_short_is_never_a_smaller_body(tmp_path, file, part):
    data = FILES[file]
    (tmp_path / file).write_bytes(data[: int(len(data) * part)])
    refused(tmp_path, file)


def test_a_text_file_cut_short_is_an_open_shell(tmp_path):
    """ASCII STL and OBJ don't say how long they are; but a shell with a missing triangle can't hold a medium."""
    (tmp_path / "a.stl").write_bytes(ascii_stl(CORNERS, TRIANGLES[:3]))
    assert "open" in refused(tmp_path, "a.stl", "glass")


@pytest.mark.parametrize("index", [4, 1000, -1, 2**31 - 1])
def test_a_triangle_of_a_vertex_that_does_not_exist(tmp_path, index):
    (tmp_path / "a.ply").write_bytes(binary_ply(CORNERS, [*TRIANGLES[:3], (0, 1, index)], "double"))
    refused(tmp_path, "a.ply")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("suffix", ["stl", "ply"])
def test_vertices_that_are_no_numbers(tmp_path, value, suffix):
    corners = CORNERS.copy()
    corners[2, 1] = value
    data = binary_stl(corners, TRIANGLES) if suffix == "stl" else binary_ply(corners, TRIANGLES, "double")
    (tmp_path / f"a.{suffix}").write_bytes(data)
    assert "finite" in refused(tmp_path, f"a.{suffix}")


@pytest.mark.parametrize("mm_per_unit", [1e308])
def test_a_unit_that_makes_lengths_infinite(tmp_path, mm_per_unit):
    (tmp_path / "a.ply").write_bytes(FILES["binary_double.ply"])
    assert "finite" in refused(tmp_path, "a.ply", geometry={"mm_per_unit": mm_per_unit})


def test_a_file_without_triangles(tmp_path):
    (tmp_path / "a.ply").write_bytes(binary_ply(CORNERS, [], "double"))
    (tmp_path / "b.stl").write_bytes(binary_stl(CORNERS, []))
    assert "no triangles" in refused(tmp_path, "a.ply")
    assert "no triangles" in refused(tmp_path, "b.stl")


@pytest.mark.parametrize(
    "triangles", [[(0, 0, 0)], [(0, 1, 1), (2, 2, 3)]], ids=["one point", "lines"]
)  # fmt: skip
def test_a_body_of_degenerate_triangles_only(tmp_path, triangles):
    (tmp_path / "a.ply").write_bytes(binary_ply(CORNERS, triangles, "double"))
    assert "area" in refused(tmp_path, "a.ply")


def test_some_degenerate_triangles_are_borne(tmp_path):
    """A collapsed triangle and a needle on an edge leave a shell closed."""
    triangles = [*TRIANGLES, (1, 1, 1), (0, 1, 0)]
    (tmp_path / "a.ply").write_bytes(binary_ply(CORNERS, triangles, "double"))
    part = load(tmp_path, "a.ply", "glass")
    assert part.degenerate.tolist() == [False] * 4 + [True, True]
    assert part.is_closed


@pytest.mark.parametrize("size_mm", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("place_mm", [0.0, 1e5])
def test_what_is_degenerate_does_not_depend_on_scale(size_mm, place_mm):
    small = box("a", (place_mm, 0, 0), 1.0)
    part = mesh("a", small.vertices_mm * size_mm, small.triangles)
    assert not part.degenerate.any()
    assert part.is_closed


def beside(triangle: int) -> set[str]:
    """Faces of a box on which neighbours of a triangle lie."""
    corners = box("x", (0, 0, 0), 1).triangles
    shared = [len(set(corners[triangle]) & set(other)) for other in corners]
    return {BOX_FACES[i // 2] for i, n in enumerate(shared) if n == 2}


@pytest.mark.parametrize("missing", range(12))
def test_an_open_shell_with_a_medium(tmp_path, missing):
    whole = box("x", (3, 2, 1), 2)
    kept = [i for i in range(12) if i != missing]
    counts = {name: sum(i // 2 == f for i in kept) for f, name in enumerate(BOX_FACES)}
    write_ply(tmp_path / "a.ply", mesh("x", whole.vertices_mm, whole.triangles[kept]))
    text = refused(tmp_path, "a.ply", "glass", geometry=faces(**counts))
    assert "open" in text
    assert "'glass'" in text
    assert "3 triangles" in text  # the neighbours of the hole
    assert all(name in text for name in beside(missing))
    assert load(tmp_path, "a.ply").is_closed is False  # without a medium it may be open


def test_a_sheet_is_open():
    assert not sheet("s", (0, 0, 0), 1, 1).is_closed


def test_a_triangle_turned_round_opens_a_shell(tmp_path):
    whole = box("x", (0, 0, 0), 2)
    triangles = whole.triangles.copy()
    triangles[5] = triangles[5][::-1]
    write_ply(tmp_path / "a.ply", mesh("x", whole.vertices_mm, triangles))
    text = refused(tmp_path, "a.ply", "glass", geometry=faces(**dict.fromkeys(BOX_FACES, 2)))
    assert "do not agree" in text
    assert "bottom" not in text  # across from the triangle, which is of "front"
    assert "front" in text
    assert not load(tmp_path, "a.ply").is_closed


def test_a_shell_of_triangles_that_share_no_vertices_is_closed(tmp_path):
    """An STL repeats every corner."""
    (tmp_path / "a.stl").write_bytes(binary_stl(CORNERS, TRIANGLES))
    assert load(tmp_path, "a.stl", "glass").is_closed


def test_all_faulty_bodies_are_told(tmp_path):
    """The error's sentence is of the first, its faults are of all."""
    whole = box("x", (0, 0, 0), 2)
    write_ply(tmp_path / "open.ply", mesh("x", whole.vertices_mm, whole.triangles[1:]))
    write_ply(tmp_path / "turned.ply", mesh("x", whole.vertices_mm, whole.triangles[:, ::-1]))
    scene = scene_of(tmp_path, "open.ply", "glass")
    other = scene.bodies["Part"].model_copy(update={"geometry": Geometry(file="turned.ply")})
    with pytest.raises(SceneError) as caught:
        load_bodies(scene.model_copy(update={"bodies": {**scene.bodies, "Other": other}}))
    first, second = caught.value.faults
    assert str(caught.value) == first
    assert "'Part'" in first
    assert "open" in first
    assert "'Other'" in second
    assert "inside out" in second


def test_inside_out(tmp_path):
    whole = box("x", (0, 0, 50), 2)
    write_ply(tmp_path / "a.ply", mesh("x", whole.vertices_mm, whole.triangles[:, ::-1]))
    text = refused(tmp_path, "a.ply", "glass")
    assert "inside out" in text
    assert "-8" in text
    load(tmp_path, "a.ply")  # without a medium there is no inside


def test_order_of_bodies_is_the_scenes(tmp_path):
    write_ply(tmp_path / "a.ply", box("x", (0, 0, 0), 2))
    scene = scene_of(tmp_path, "a.ply")
    bodies = dict.fromkeys(("Zeta", "Alpha"), scene.bodies["Part"])
    assert [m.name for m in load_bodies(scene.model_copy(update={"bodies": bodies}).with_folder(tmp_path))] == [
        "Zeta",
        "Alpha",
    ]


# ---------------------------------------------------------------------------------------------------------------------
# Figures


def test_volume_and_areas_of_a_box():
    part = box("b", (100, -50, 7), (2, 3, 4))
    assert part.volume_mm3 == pytest.approx(24)
    areas = np.linalg.norm(part.area_vectors_mm2, axis=1)
    assert areas.sum() == pytest.approx(2 * (2 * 3 + 3 * 4 + 2 * 4))
    top = part.triangle_face == BOX_FACES.index("top")
    assert part.area_vectors_mm2[top].sum(axis=0) == pytest.approx([0, 0, 6])
    assert part.area_vectors_mm2.sum(axis=0) == pytest.approx([0, 0, 0])


def test_meshes_are_read_only():
    part = box("b", (0, 0, 0), 1)
    for array in (part.vertices_mm, part.triangles, part.triangle_face):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((0, 0, 0), 1.0), ((0.9, -0.9, 0.9), 1.0), ((0.999999, 0, 0), 1.0), ((1.000001, 0, 0), 0.0), ((5, 5, 5), 0.0),
        ((1, 0.2, 0.3), 0.5), ((1e6, 0, 0), 0.0),
    ],
)  # fmt: skip
def test_winding_number_of_a_box(point, expected):
    """1 inside, 0 outside, a half on a flat face."""
    assert winding_number(box("b", (0, 0, 0), 2).corners_mm, np.array(point, float)) == pytest.approx(
        expected, abs=1e-9
    )


def test_winding_number_of_one_triangle_is_its_solid_angle():
    """A square seen from the centre of its cube fills a sixth of the sphere."""
    square = sheet("s", (0, 0, 1), 2, 2)
    assert winding_number(square.corners_mm, np.zeros(3)) == pytest.approx(1 / 6)
    assert winding_number(square.corners_mm[:, ::-1], np.zeros(3)) == pytest.approx(-1 / 6)


def test_winding_number_of_a_nested_pair():
    outer, inner = box("a", (0, 0, 0), 4).corners_mm, box("b", (0, 0, 0), 2).corners_mm
    both = np.concatenate([outer, inner])
    assert winding_number(both, np.zeros(3)) == pytest.approx(2)
    assert winding_number(both, np.array([1.5, 0, 0])) == pytest.approx(1)
    hollow = np.concatenate([outer, inner[:, ::-1]])
    assert winding_number(hollow, np.zeros(3)) == pytest.approx(0, abs=1e-12)


# ---------------------------------------------------------------------------------------------------------------------
# Writing


def test_write_and_read_are_bit_exact(tmp_path):
    rng = np.random.default_rng(4)
    vertices = rng.normal(size=(40, 3)) * 10.0 ** rng.integers(-12, 12, (40, 1))
    part = mesh("p", vertices, [rng.permutation(40)[:3] for _ in range(70)])
    write_ply(tmp_path / "deep" / "er" / "p.ply", part)
    assert read_ply(tmp_path / "deep" / "er" / "p.ply").tobytes() == part.corners_mm.tobytes()
    again = load(tmp_path, "deep/er/p.ply")
    assert again.vertices_mm.tobytes() == part.vertices_mm.tobytes()
    assert again.triangles.tolist() == part.triangles.tolist()
    assert mesh_digest(again) == mesh_digest(part)


def test_writing_where_nothing_can_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="can't be written"):
        write_ply(tmp_path / "file" / "p.ply", box("b", (0, 0, 0), 1))


def test_digest_tells_triangles_apart_and_not_how_vertices_are_shared():
    part = box("b", (0, 0, 0), 1)
    loose = mesh("other name", part.corners_mm.reshape(-1, 3), np.arange(36), dict.fromkeys(BOX_FACES, 2))
    assert mesh_digest(loose) == mesh_digest(part)
    moved = part.vertices_mm.copy()
    moved[3, 1] = np.nextafter(moved[3, 1], 9)
    assert mesh_digest(mesh("b", moved, part.triangles, dict.fromkeys(BOX_FACES, 2))) != mesh_digest(part)
    assert mesh_digest(mesh("b", part.vertices_mm, part.triangles, {"A": 6, "B": 6})) != mesh_digest(part)
    assert mesh_digest(mesh("b", part.vertices_mm, part.triangles[::-1], dict.fromkeys(BOX_FACES, 2))) != mesh_digest(
        part
    )
