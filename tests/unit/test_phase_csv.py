# SPDX-License-Identifier: LGPL-2.1-or-later
"""Phase functions from files of two columns, sound and damaged."""

from __future__ import annotations

import json

import pytest

from raymaps.errors import FormatError, SceneError
from raymaps.formats.phase_csv import read_phase_function
from raymaps.scene import load_scene

SOUND = "angle,p\n0,10\n20,1.5\n90,0.1\n180,0.3\n"
READ = {"angle_deg": (0, 20, 90, 180), "value": (10, 1.5, 0.1, 0.3)}


@pytest.mark.parametrize(
    "text",
    [
        SOUND,
        "# measured at 550 nm\n" + SOUND.replace("angle,p\n", ""),
        SOUND.replace(",", "\t"),
        SOUND.replace(",", "  "),
        SOUND.replace(",", ";").replace(".", ","),
        SOUND.replace("\n", "\r\n"),
        "\ufeff" + SOUND,
        "180 0.3\n\n90 0.1\n20 1.5\n0 10",
    ],
    ids=["commas", "no title", "tabs", "blanks", "decimal commas", "other lines", "mark", "falling"],
)
def test_sound_files(tmp_path, text):
    (tmp_path / "p.csv").write_text(text, encoding="utf-8", newline="")
    assert read_phase_function(tmp_path / "p.csv") == READ
    (tmp_path / "p.csv").write_text(text, encoding="utf-16", newline="")
    assert read_phase_function(tmp_path / "p.csv") == READ


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "holds no line with an angle in degrees and a value"),
        (b"angle,p\n", "holds no line"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "is not a text file"),
        (b"<?xml version='1.0'?>\n<Phase><p>1</p></Phase>\n", "line 2: an angle in degrees and a value are needed"),
        (b'{"angle_deg": [0, 180]}\n{}', "line 2: an angle in degrees"),
        (SOUND.encode()[:-8], "reaches from 0 to 90 degrees in place of 0 to 180: add what is missing"),
        (SOUND.encode()[:-5], "line 5: an angle in degrees and a value are needed, got '180'"),
        (SOUND.replace("90,0.1", "90,0.1,7").encode(), "line 4: an angle in degrees and a value are needed"),
        (SOUND.replace("0.1", "nan").encode(), "line 4: 'nan' is not a finite number"),
        (SOUND.replace("0.1", "1e999").encode(), "line 4: '1e999' is not a finite number"),
        (SOUND.replace("0.1", "-0.1").encode(), "line 4: a phase function is nowhere below 0, got -0.1"),
        (SOUND.replace("0.1", "low").encode(), "line 4: 'low' is not a number"),
        (SOUND.replace("20", "95").encode(), "line 4: angles must climb from line to line, but 90 degrees follow 95"),
        (SOUND.replace("20", "90").encode(), "line 4: angles must climb"),
        (SOUND.replace("180", "360").encode(), "line 5: the scattering angle must be from 0 to 180 degrees, got 360"),
        (SOUND.replace("\n0,", "\n-5,").encode(), "line 2: the scattering angle must be from 0 to 180 degrees, got -5"),
        (b"0 1\n1.5708 2\n3.14159 1\n", "give the angles in degrees, not in radians"),
        (b"5 1\n180 1\n", "reaches from 5 to 180 degrees"),
        (b"0 0\n180 0\n", "is 0 at all angles"),
        (b"0 1\n", "reaches from 0 to 0 degrees"),
    ],
)
def test_damaged_files(tmp_path, data, message):
    path = tmp_path / "p.csv"
    path.write_bytes(data)
    with pytest.raises(FormatError, match=message) as error:
        read_phase_function(path)
    assert "p.csv" in str(error.value)
    assert str(error.value).endswith(".")
    assert "\n" not in str(error.value)


def test_a_missing_file_and_a_folder(tmp_path):
    with pytest.raises(FormatError, match="there is no such file"):
        read_phase_function(tmp_path / "none.csv")
    with pytest.raises(FormatError, match="can't be read"):
        read_phase_function(tmp_path)


def scene(folder, phase):
    medium = {"refractive_index": 1.3, "scattering": [{"coefficient_per_mm": 1, "phase": phase}]}
    source = {"P": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}}
    data = {"format": "raymaps-scene", "version": 1, "media": {"milk": medium}, "sources": source}
    (folder / "a.scene.json").write_text(json.dumps(data))
    return load_scene(folder / "a.scene.json")


def test_a_scene_holds_what_its_file_holds(tmp_path):
    (tmp_path / "p.csv").write_text(SOUND)
    phase = scene(tmp_path, {"kind": "file", "file": "p.csv"}).media["milk"].scattering[0].phase
    assert phase.model_dump() == {"kind": "table", **READ}


@pytest.mark.parametrize(
    ("phase", "message"),
    [
        ({"kind": "file", "file": "q.csv"}, "there is no such file"),
        ({"kind": "file", "file": ""}, "at least 1 character"),
        ({"kind": "file"}, "this field is missing"),
        ({"kind": "file", "file": "p.csv", "g": 1}, "g"),
    ],
)
def test_a_scene_tells_what_is_wrong_with_its_file(tmp_path, phase, message):
    (tmp_path / "p.csv").write_text(SOUND)
    with pytest.raises(SceneError, match=message):
        scene(tmp_path, phase)
