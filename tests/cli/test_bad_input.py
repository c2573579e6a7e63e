# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bad input gets one clear sentence, exit code 3, and nothing is lost or left behind.

Each case is a scene that a person or a program might write; `raymaps trace` must refuse it as `raymaps check` does.
"""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from raymaps import open_map
from tests.store.small_scenes import BOX_FACES, box, changed, geometry, mesh, workshop, write_scene


def block(folder: Path, body) -> dict:
    """The workshop with another block."""
    data = workshop(folder)
    return changed(data, "bodies.Block.geometry", geometry(folder, body, "geometry/other.ply"))


def holed(folder: Path) -> dict:
    whole = box("Block", (0, 0, 0), 10)
    return block(
        folder,
        mesh("Block", whole.vertices_mm, whole.triangles[:-1], dict(zip(BOX_FACES, (2, 2, 2, 2, 2, 1), strict=True))),
    )


def turned(folder: Path) -> dict:
    whole = box("Block", (0, 0, 0), 10)
    return block(folder, mesh("Block", whole.vertices_mm, whole.triangles[:, ::-1], dict.fromkeys(BOX_FACES, 2)))


def with_nan(folder: Path) -> dict:
    vertices = box("Block", (0, 0, 0), 10).vertices_mm.copy()
    vertices[3, 2] = math.nan
    return block(folder, mesh("Block", vertices, box("Block", (0, 0, 0), 10).triangles, dict.fromkeys(BOX_FACES, 2)))


def flat(folder: Path) -> dict:
    whole = box("Block", (0, 0, 0), 10)
    return block(folder, mesh("Block", whole.vertices_mm * 0, whole.triangles, dict.fromkeys(BOX_FACES, 2)))


def cut(folder: Path) -> dict:
    data = workshop(folder)
    path = folder / data["bodies"]["Block"]["geometry"]["file"]
    path.write_bytes(path.read_bytes()[:-20])
    return data


def emptied(folder: Path) -> dict:
    data = workshop(folder)
    (folder / data["bodies"]["Block"]["geometry"]["file"]).write_bytes(b"")
    return data


def missing(folder: Path) -> dict:
    data = workshop(folder)
    (folder / data["bodies"]["Block"]["geometry"]["file"]).unlink()
    return data


def lamp_in_the_stop(folder: Path) -> dict:
    return changed(workshop(folder), "sources.Lamp.position_mm", [25, 0, 0])


def changed_to(place: str, value):
    return lambda folder: changed(workshop(folder), place, value)


CASES = {
    "missing geometry": (missing, ["'Block'", "no file", "Block.ply"]),
    "empty geometry": (emptied, ["'Block'", "Block.ply"]),
    "truncated geometry": (cut, ["'Block'", "Block.ply"]),
    "open shell as a medium": (holed, ["'Block'", "'glass'", "open"]),
    "inside out": (turned, ["'Block'", "inside out"]),
    "NaN": (with_nan, ["'Block'", "finite"]),
    "no area": (flat, ["'Block'", "area"]),
    "wrong count of triangles": (changed_to("bodies.Block.geometry.faces.0.triangles", 3), ["'Block'", "13", "12"]),
    "unknown medium": (changed_to("bodies.Block.medium", "diamond"), ["'Block'", "'diamond'", "'glass'"]),
    "unknown surface": (changed_to("bodies.Block.surface", "gold"), ["'Block'", "'gold'", "'polished'"]),
    "unknown face": (changed_to("bodies.Block.face_surfaces", {"lid": "black"}), ["'Block'", "'lid'", "'top'"]),
    "unknown surface of a face": (changed_to("bodies.Block.face_surfaces", {"top": "gold"}), ["'top'", "'gold'"]),
    "unknown body of a source": (changed_to("sources.LED.body", "Chips"), ["'LED'", "'Chips'", "'Chip'"]),
    "unknown face of a source": (changed_to("sources.LED.faces", ["lid"]), ["'LED'", "'lid'", "'top'"]),
    "unknown ambient": (changed_to("ambient", "water"), ["'water'", "'air'"]),
    "unknown part of a mixture": (changed_to("surfaces.satin.parts.0.surface", "gold"), ["'satin'", "'gold'"]),
    "negative coefficient": (changed_to("surfaces.mirror.reflectance", -0.1), ["'mirror'", "-0.1", "0"]),
    "coefficient above one": (changed_to("surfaces.mirror.reflectance", 1.1), ["'mirror'", "1.1", "1"]),
    "coefficients that add up to more": (changed_to("surfaces.screen.reflectance", 0.6), ["'screen'", "1.1 in band r"]),
    "negative absorption": (changed_to("media.glass.absorption_per_mm", -1), ["'glass'", "-1"]),
    "negative refractive index": (changed_to("media.glass.refractive_index", -1.5), ["'glass'", "-1.5"]),
    "NaN in the scene": (changed_to("media.glass.refractive_index", math.nan), ["NaN"]),
    "source in an absorber": (lamp_in_the_stop, ["'Lamp'", "'Stop'", "absorbs"]),
    "Fresnel without a medium": (changed_to("bodies.Chip.surface", "polished"), ["'polished'", "'Chip'", "medium"]),
    "no flux": (changed_to("sources.Lamp.flux_w", 0), ["'Lamp'", "flux_w", "0"]),
    "no light": (changed_to("sources.Lamp.rgb", [0, 0, 0]), ["'Lamp'", "rgb"]),
    "no direction": (changed_to("sources.Beam.direction", [0, 0, 0]), ["'Beam'", "direction"]),
    "no source": (changed_to("sources", {}), ["sources"]),
    "newer version": (changed_to("version", 2), ["version 2", "up to version 1"]),
    "another format": (changed_to("format", "obj"), ["format"]),
    "unknown field": (changed_to("detectors.Above.colour", "red"), ["'Above'", "colour"]),
    "geometry name too long": (changed_to("bodies.Block.geometry.file", "x" * 300 + ".ply"), ["'Block'"]),
    "geometry is a folder": (changed_to("bodies.Block.geometry.file", "geometry"), ["'Block'"]),
    "another kind of geometry": (changed_to("bodies.Block.geometry.file", "Block.step"), ["'Block'", ".stl"]),
    "a free value that JSON can't hold": (changed_to("origin", {"x": math.inf}), ["Infinity"]),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_bad_scene(raymaps, tmp_path, case):
    make, fragments = CASES[case]
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    scene = write_scene(tmp_path / "in", make(tmp_path / "in"))
    sentence = raymaps("trace", scene, "-o", tmp_path / "out" / "m.raymap", "--rays", 10).sentence
    for fragment in fragments:
        assert fragment in sentence
    assert list((tmp_path / "out").iterdir()) == []
    check = raymaps("check", scene)
    assert check.code == 3
    assert sentence in check.err


def test_a_few_degenerate_triangles_are_a_note(raymaps, tmp_path):
    whole = box("Block", (0, 0, 0), 10)
    triangles = [*whole.triangles.tolist(), [0, 0, 1]]
    body = mesh("Block", whole.vertices_mm, triangles, {**dict.fromkeys(BOX_FACES, 2), "seam": 1})
    scene = write_scene(tmp_path, block(tmp_path, body))
    done = raymaps("check", scene)
    assert done.code == 0
    assert "1 of 13 triangles have no area" in done.out
    assert raymaps("trace", scene, "-o", tmp_path / "m.raymap", "--rays", 100).code == 0


@pytest.mark.parametrize("damage", ["newer", "truncated", "removed", "emptied", "no manifest"])
def test_bad_map(raymaps, small_map, tmp_path, damage):
    path = tmp_path / "hurt.raymap"
    shutil.copytree(small_map, path)
    target = path / "portions" / "000000000000" / "rays.parquet"
    if damage == "newer":
        manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))
        (path / "manifest.json").write_text(json.dumps({**manifest, "version": 3}), encoding="utf-8")
    elif damage == "truncated":
        target.write_bytes(target.read_bytes()[: target.stat().st_size // 2])
    elif damage == "removed":
        target.unlink()
    elif damage == "emptied":
        target.write_bytes(b"")
    else:
        (path / "manifest.json").unlink()
    fragment = {"newer": "version 3", "no manifest": "manifest.json"}.get(damage, "rays.parquet")
    commands = (["info"], ["query", "true"], ["paths"], ["report"], ["detector", "Around"], ["serve"], ["check"])
    for command, *rest in commands:
        assert fragment in raymaps(command, path, *rest).sentence


def test_an_output_that_exists_is_kept(raymaps, small_scene, small_map):
    before = open_map(small_map).content_hash
    assert "exists already" in raymaps("trace", small_scene, "-o", small_map, "--rays", 5).sentence
    assert open_map(small_map).content_hash == before


def test_a_result_that_can_not_be_written_leaves_the_old_file(raymaps, small_map, tmp_path):
    """A file is replaced only once the new one is whole."""
    old = tmp_path / "r.csv"
    assert raymaps("report", small_map, "-o", old).code == 0
    before = old.read_bytes()
    assert raymaps("report", small_map, "--where", "hit(Nothing)", "-o", old).sentence
    assert old.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["r.csv"]


def test_a_folder_in_the_place_of_a_result(raymaps, small_map, tmp_path):
    (tmp_path / "r.html").mkdir()
    assert "r.html" in raymaps("report", small_map, "-o", tmp_path / "r.html").sentence
    assert list((tmp_path / "r.html").iterdir()) == []


def test_a_missing_folder_of_a_result(raymaps, small_map, tmp_path):
    assert "none" in raymaps("detector", small_map, "Around", "-o", tmp_path / "none" / "d.csv").sentence


def test_extreme_but_good_scenes_are_traced(raymaps, tmp_path):
    """Tiny, huge and far away: nothing is lost to numbers."""
    for i, (size, place) in enumerate(((1e-4, 0.0), (1e5, 0.0), (1.0, 1e6))):
        folder = tmp_path / str(i)
        folder.mkdir()
        data = {
            "format": "raymaps-scene",
            "version": 1,
            "surfaces": {"grey": {"kind": "lambertian", "reflectance": 0.5}},
            "bodies": {"Room": {"geometry": geometry(folder, box("Room", (place, 0, 0), size)), "surface": "grey"}},
            "sources": {"Lamp": {"kind": "point", "flux_w": 1, "position_mm": [place, 0.1 * size, 0]}},
        }
        path = folder / "m.raymap"
        assert raymaps("trace", write_scene(folder, data), "-o", path, "--rays", 2000).code == 0
        ledger = raymaps("info", path, "--json").data["ledger"]
        assert ledger["absorbed_w"] == pytest.approx(1, rel=1e-12), (size, place)
        corners = np.concatenate([p.position_mm for p in open_map(path).portions])
        assert np.abs(corners[:, 1:]).max() <= size / 2 * (1 + 1e-5)
