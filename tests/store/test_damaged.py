# SPDX-License-Identifier: LGPL-2.1-or-later
"""A map that is damaged in any way is told in one sentence; never a traceback, and never a wrong answer."""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from raymaps.check import check_map
from raymaps.criterion import query
from raymaps.errors import MapError, OutputError, RayMapsError
from raymaps.results.info import map_info
from raymaps.run import simulate
from raymaps.store import Manifest, RayMap

TABLES = ("rays.parquet", "signatures.parquet", "events.parquet", "crossings.parquet")
PORTION_FILES = (*TABLES, "portion.json")


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def cut_one_byte(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def overwrite(path: Path) -> None:
    path.write_bytes(b"\xa5" * path.stat().st_size)


def append(path: Path) -> None:
    path.write_bytes(path.read_bytes() + b"\n\n\nmore")


def remove(path: Path) -> None:
    path.unlink()


def become_a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def flip(path: Path, at: int, bit: int = 1) -> None:
    data = bytearray(path.read_bytes())
    data[at] ^= bit
    path.write_bytes(bytes(data))


def read_everything(path: Path) -> None:
    """Open a map and read every column of it."""
    raymap = RayMap.open(path)
    map_info(raymap)
    assert raymap.scene.sources
    assert len(raymap.meshes) == len(raymap.names.bodies)
    for portion in raymap.portions:
        for name in ("event_step", "triangle", "position_mm", "light", "crossing_row", "crossing_xy_mm",
                     "crossing_angle_rad", "crossing_registered"):  # fmt: skip
            getattr(portion, name)
    query(raymap, "hit(Room) & detector(Sensor)")


def faults(path: Path) -> list[str]:
    found = [finding.text for finding in check_map(path) if finding.is_fault]
    for text in found:
        assert "\n" not in text
        assert len(text) < 600
        assert "Traceback" not in text
    return found


def refused(path: Path) -> str:
    with pytest.raises(MapError) as caught:
        read_everything(path)
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < 600
    return text


def test_a_sound_map_has_no_fault(room_map, workshop_map):
    for traced in (room_map, workshop_map):
        assert faults(traced.path) == []
        RayMap.open(traced.path)
    read_everything(room_map.path)


@pytest.mark.parametrize("damage", [truncate, cut_one_byte, empty, overwrite, remove, become_a_folder])
@pytest.mark.parametrize("file", PORTION_FILES)
@pytest.mark.parametrize("portion", ["000000000000", "000000000200"])
def test_a_damaged_file_of_a_portion(room_map, copied, file, damage, portion):
    path = copied(room_map)
    damage(path / "portions" / portion / file)
    sentence = refused(path)
    assert portion in sentence
    assert file in sentence
    assert "--resume" in sentence  # the way out
    assert any(file in text and portion in text for text in faults(path))


@pytest.mark.parametrize("file", TABLES)
def test_any_flipped_byte_of_a_table_is_found(room_map, copied, file):
    """By a page's checksum, the file's footer, or the hash of the content; sixty places, all in turn."""
    path = copied(room_map)
    target = path / "portions" / "000000000100" / file
    whole = target.read_bytes()
    rng = np.random.default_rng(1)
    missed = []
    for at in sorted(rng.choice(len(whole), 60, replace=False)):
        flip(target, int(at), 1 << int(rng.integers(8)))
        if not faults(path) and not harmless(target, whole):
            missed.append(int(at))
        target.write_bytes(whole)
    assert missed == []


def harmless(path: Path, whole: bytes) -> bool:
    """Whether a file still reads as the same table, for instance because only its writer's name has changed."""
    try:
        return pq.read_table(path).equals(pq.read_table(io.BytesIO(whole)))
    except (OSError, pa.ArrowException):
        return False


def test_flipped_bytes_are_refused_or_make_no_difference_to_readers(room_map, copied):
    """A reader that does not check sees a clear error or the very same columns."""
    path = copied(room_map)
    target = path / "portions" / "000000000000" / "events.parquet"
    whole = target.read_bytes()
    expected = RayMap.open(path).portions[0].position_mm.tobytes()
    for at in range(4, len(whole), max(1, len(whole) // 40)):
        flip(target, at)
        try:
            found = RayMap.open(path).portions[0].position_mm.tobytes()
        except RayMapsError:
            found = expected
        assert found == expected, at
        target.write_bytes(whole)


def edited(path: Path, **changes) -> None:
    data = json.loads(path.read_text(encoding="utf-8"))
    for place, value in changes.items():
        at = data
        *way, last = place.split("__")
        for key in way:
            at = at[int(key)] if isinstance(at, list) else at[key]
        last = int(last) if isinstance(at, list) else last
        at[last] = value(at[last]) if callable(value) else value
    path.write_text(json.dumps(data), encoding="utf-8")


SUMMARY_CHANGES = [
    {"first_ray": lambda n: n + 1}, {"n_rays": lambda n: n + 1}, {"n_rays": lambda n: n - 1},
    {"n_events": lambda n: n + 1}, {"n_events": lambda n: n - 1}, {"n_crossings": lambda n: n + 1},
    {"n_crossings": lambda n: n - 1}, {"n_signatures": lambda n: n + 1}, {"n_signatures": lambda n: n - 1},
    {"rays_of_source__0": lambda n: n - 1}, {"rays_of_source": [50, 50]}, {"rays_of_source": []},
    {"content__0": "0" * 16}, {"content__1": lambda word: word[::-1]}, {"content": []},
    {"ledger__0__light": lambda light: light * 1.01}, {"ledger": []}, {"ledger__0__what": "nowhere"},
    {"ledger__0__index": 77}, {"ledger__0__source": 5},
    {"file_bytes__events.parquet": lambda n: n + 1}, {"file_bytes": {}},
]  # fmt: skip


@pytest.mark.parametrize("changes", SUMMARY_CHANGES, ids=lambda c: next(iter(c)))
def test_any_changed_figure_of_a_summary_is_found(room_map, copied, changes):
    """What ``raymaps info`` reports comes from the summaries, so a check compares them with the columns."""
    path = copied(room_map)
    edited(path / "portions" / "000000000100" / "portion.json", **changes)
    assert faults(path)


@pytest.mark.parametrize(
    "text",
    ["[]", "null", "3", "{}", '{"first_ray": []}', '{"first_ray": 0', "[" * 100_000, '{"first_ray": NaN}', "\x00"],
)
@pytest.mark.parametrize("file", ["manifest.json", "portions/000000000000/portion.json", "scene.json"])
def test_json_of_another_form(room_map, copied, file, text):
    path = copied(room_map)
    (path / file).write_text(text, encoding="utf-8")
    assert refused(path) if file != "scene.json" else faults(path)
    assert faults(path)


@pytest.mark.parametrize("file", ["manifest.json", "portions/000000000000/portion.json", "scene.json"])
def test_json_that_is_not_text(room_map, copied, file):
    path = copied(room_map)
    (path / file).write_bytes(b"\xff\xfe\x00{")
    assert faults(path)


@pytest.mark.parametrize("damage", [truncate, empty, remove, become_a_folder])
def test_a_damaged_manifest(room_map, copied, damage):
    path = copied(room_map)
    damage(path / "manifest.json")
    assert str(path) in refused(path)
    assert faults(path)


MANIFEST_CHANGES = [
    {"format": "raymaps-scene"}, {"format": None}, {"version": "1"}, {"version": None}, {"seed": "x"}, {"seed": None},
    {"names": []}, {"names__faces": [[7, "Face1"]]}, {"names__sources": None}, {"rays_asked": "many"}, {"grid_mm": []},
    {"portion_rays": None}, {"portion_rays": 0}, {"portion_rays": -5}, {"version": 0},
]  # fmt: skip


@pytest.mark.parametrize("changes", MANIFEST_CHANGES, ids=str)
def test_a_manifest_that_says_nonsense(room_map, copied, changes):
    path = copied(room_map)
    edited(path / "manifest.json", **changes)
    assert "manifest.json" in refused(path)
    assert faults(path)


def test_names_that_do_not_fit_the_scene(room_map, copied):
    path = copied(room_map)
    edited(path / "manifest.json", names__sources=["Lamp", "Another"])
    assert faults(path)


@pytest.mark.parametrize("more", [{}, {"names": None}, {"new": 1}])
def test_a_newer_version(room_map, copied, more):
    path = copied(room_map)
    edited(path / "manifest.json", version=3, **more)
    sentence = refused(path)
    assert "version 3" in sentence
    assert "up to version 2" in sentence
    assert "update" in sentence
    assert faults(path) == [sentence]


def test_a_map_of_another_format(room_map, copied):
    path = copied(room_map)
    edited(path / "manifest.json", format="something-else")
    refused(path)


@pytest.mark.parametrize("damage", [truncate, empty, remove, become_a_folder])
def test_a_damaged_scene(room_map, copied, damage):
    path = copied(room_map)
    damage(path / "scene.json")
    assert any("scene.json" in text for text in faults(path))
    with pytest.raises(RayMapsError):
        read_everything(path)


@pytest.mark.parametrize(
    "changes",
    [
        {"sources__Lamp__flux_w": 2.0}, {"surfaces__grey__reflectance": [0.6, 0.6, 0.6]},
        {"detectors__Sensor__width_mm": 5.0}, {"settings__max_events": 5},
    ],
)  # fmt: skip
def test_a_scene_that_was_changed_afterwards(room_map, copied, changes):
    """The flux of a source decides every figure in W: a map's scene must be the one that was simulated."""
    path = copied(room_map)
    edited(path / "scene.json", **changes)
    assert any("scene" in text for text in faults(path))


@pytest.mark.parametrize("damage", [truncate, cut_one_byte, empty, overwrite, remove])
def test_damaged_geometry(room_map, copied, damage):
    path = copied(room_map)
    (target,) = (path / "geometry").iterdir()
    damage(target)
    assert faults(path)


def test_geometry_that_was_changed_afterwards(room_map, copied):
    path = copied(room_map)
    (target,) = (path / "geometry").iterdir()
    data = target.read_bytes()
    at = data.index(b"end_header\n") + len(b"end_header\n")
    vertices = np.frombuffer(data[at : at + 8 * 24], "<f8") * 1.5
    target.write_bytes(data[:at] + vertices.tobytes() + data[at + 8 * 24 :])
    assert faults(path)


def test_portions_that_overlap(room_map, copied):
    """Two portions with the same rays would count light twice."""
    path = copied(room_map)
    shutil.copytree(path / "portions" / "000000000000", path / "portions" / "000000000050")
    edited(path / "portions" / "000000000050" / "portion.json", first_ray=50)
    assert faults(path)


def test_a_portion_under_another_portions_name(room_map, copied):
    path = copied(room_map)
    (path / "portions" / "000000000100").rename(path / "portions" / "000000000300")
    assert faults(path)


def test_a_missing_portion_is_only_an_interrupted_run(room_map, copied):
    path = copied(room_map)
    shutil.rmtree(path / "portions" / "000000000100")
    findings = check_map(path)
    assert not any(f.is_fault for f in findings)
    assert any("150 of 250 rays" in f.text for f in findings)
    read_everything(path)


@pytest.mark.parametrize("file", PORTION_FILES)
def test_a_damaged_portion_that_is_deleted_is_made_anew(room_map, copied, file):
    """As the sentence about the damage says."""
    path = copied(room_map)
    truncate(path / "portions" / "000000000100" / file)
    shutil.rmtree(path / "portions" / "000000000100")
    simulate(room_map.scene_file, path, rays=250, resume=True)
    assert RayMap.open(path).content_hash == room_map.raymap.content_hash
    assert faults(path) == []


def test_resuming_a_damaged_map_tells_the_damage(room_map, copied):
    path = copied(room_map)
    truncate(path / "portions" / "000000000100" / "rays.parquet")
    with pytest.raises(MapError, match=r"rays\.parquet"):
        simulate(room_map.scene_file, path, rays=500, resume=True)


def test_no_portions_folder(room_map, copied):
    path = copied(room_map)
    shutil.rmtree(path / "portions")
    assert "portions" in refused(path)
    assert faults(path)


@pytest.mark.parametrize("make", [lambda p: None, Path.mkdir, Path.touch, lambda p: p.symlink_to("nowhere")])
def test_what_is_no_map(tmp_path, make):
    path = tmp_path / "none.raymap"
    make(path)
    with pytest.raises(MapError) as caught:
        RayMap.open(path)
    assert str(path) in str(caught.value)
    assert faults(path)


def test_a_name_too_long_for_any_folder(tmp_path):
    with pytest.raises(MapError):
        RayMap.open(tmp_path / ("x" * 300))
    with pytest.raises((MapError, OutputError)):
        Manifest.read(tmp_path / ("x" * 300))


def test_foreign_things_in_the_portions_folder_are_passed_over(room_map, copied):
    path = copied(room_map)
    (path / "portions" / ".making-000000000300-99999").mkdir()
    (path / "portions" / "notes").mkdir()
    (path / "portions" / ".DS_Store").write_bytes(b"x")
    assert RayMap.open(path).content_hash == room_map.raymap.content_hash
    assert faults(path) == []
