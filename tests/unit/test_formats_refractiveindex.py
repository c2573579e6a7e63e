# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of refractiveindex.info become media; damaged ones are refused in one sentence."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from raymaps.errors import FormatError, SceneError
from raymaps.formats.medium_files import read_medium
from raymaps.formats.refractiveindex import read_refractiveindex
from raymaps.materials import Medium
from raymaps.scene import scene_from_dict

HEAD = """# this file is part of refractiveindex.info database
REFERENCES: "<a href=\\"a.pdf\\">SCHOTT Zemax catalog</a> &amp; data sheets, <i>J.</i> <b>5</b>, 2&ndash;3"
COMMENTS: "step 0.5 available"
DATA:
"""
N_BK7 = """  - type: formula 2
    wavelength_range: 0.3 2.5
    coefficients: 0 1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653
"""
K_BK7 = """  - type: tabulated k
    data: |
        0.300 2.8607E-06
        0.400 1.0227E-08
        0.500 9.5781E-09
        0.700 8.9305E-09
        2.500 8.1300E-06
"""
SILVER = """  - type: tabulated nk
    data: |
        0.1879 1.07 1.212
        0.4133 0.05 2.275
        0.6168 0.06 4.152
        1.937 0.24 14.08
"""


@pytest.fixture
def write(tmp_path):
    def write(text: str | bytes, name: str = "glass.yml") -> Path:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def medium_of(path: Path) -> Medium:
    return Medium.model_validate(read_refractiveindex(path))


def test_a_glass_with_its_absorption(write):
    """Schott's N-BK7: n_d 1.5168; its internal transmittance at 400 nm is 0.997 for 10 mm."""
    medium = medium_of(write(HEAD + N_BK7 + K_BK7))
    assert float(medium.index_at(587.5618)) == pytest.approx(1.51680, abs=5e-6)
    assert medium.refractive_index.range_nm == (300, 2500)
    assert not medium.is_conductor
    assert medium.absorption_per_mm.wavelength_nm == (300, 400, 500, 700, 2500)
    assert float(medium.absorption_per_mm.at(400)) == pytest.approx(4 * math.pi * 1.0227e-8 / 400e-6, rel=1e-5)
    assert math.exp(-10 * float(medium.absorption_per_mm.at(400))) == pytest.approx(0.997, abs=5e-4)
    assert medium.reference == "SCHOTT Zemax catalog & data sheets, J. 5 , 2–3 step 0.5 available"


def test_a_metal_is_a_conductor(write):
    """P. B. Johnson and R. W. Christy, Phys. Rev. B 6 (1972) 4370."""
    medium = medium_of(write("DATA:\n" + SILVER, "silver.yml"))
    assert medium.is_conductor
    assert medium.absorption_per_mm == (0, 0, 0)
    assert float(medium.index_at(616.8)) == 0.06
    assert float(medium.extinction.at(616.8)) == 4.152
    assert medium.reference == "refractiveindex.info, silver.yml"


def formula(number: int, coefficients: str, limits: str = "0.3 2.5") -> str:
    return f"{HEAD}  - type: formula {number}\n    wavelength_range: {limits}\n    coefficients: {coefficients}\n"


#: Formula, coefficients, and n at the wavelength w in µm as the data base's sheet "Dispersion formulas" states it.
FORMULAS = [
    (1, "0.1 0.6 0.1 0.4 0.2", lambda w: math.sqrt(1.1 + 0.6 * w**2 / (w**2 - 0.01) + 0.4 * w**2 / (w**2 - 0.04))),
    (1, "0 1.2 0.1", lambda w: math.sqrt(1 + 1.2 * w**2 / (w**2 - 0.01))),
    (2, "0.1 0.6 0.01 0.4 0.04", lambda w: math.sqrt(1.1 + 0.6 * w**2 / (w**2 - 0.01) + 0.4 * w**2 / (w**2 - 0.04))),
    (2, "1.25", lambda w: 1.5),
    (3, "2.2 -0.01 2 0.02 -2", lambda w: math.sqrt(2.2 - 0.01 * w**2 + 0.02 / w**2)),
    (
        4,
        "2.1 0.3 2 0.1 2 -0.05 1 0.02 1 0.003 -2 -0.004 2",
        lambda w: math.sqrt(
            2.1 + 0.3 * w**2 / (w**2 - 0.1**2) - 0.05 * w / (w**2 - 0.02) + 0.003 / w**2 - 0.004 * w**2
        ),
    ),
    (4, "5.913 0.2441 0 0.0803 1", lambda w: math.sqrt(5.913 + 0.2441 / (w**2 - 0.0803))),
    (4, "2.5 0 0 0 0 0 0 0 0 -0.01 2", lambda w: math.sqrt(2.5 - 0.01 * w**2)),
    (5, "1.35265 0.00306 -2 0.00002 -4", lambda w: 1.35265 + 0.00306 / w**2 + 0.00002 / w**4),
    (6, "1e-5 0.05792105 238.0185", lambda w: 1 + 1e-5 + 0.05792105 / (238.0185 - w**-2)),
    (7, "1.5 0.01 0.002 -0.003", lambda w: 1.5 + 0.01 / (w**2 - 0.028) + 0.002 / (w**2 - 0.028) ** 2 - 0.003 * w**2),
    (
        8,
        "0.3 0.05 0.02 -0.001",
        lambda w: math.sqrt(
            (1 + 2 * (x := 0.3 + 0.05 * w**2 / (w**2 - 0.02) - 0.001 * w**2)) / (1 - x)
        ),
    ),
    (
        9,
        "2.51527 0.0240 0.0300 0.020 1.52 0.8771",
        lambda w: math.sqrt(2.51527 + 0.024 / (w**2 - 0.03) + 0.02 * (w - 1.52) / ((w - 1.52) ** 2 + 0.8771)),
    ),
]  # fmt: skip


@pytest.mark.parametrize(("number", "coefficients", "expected"), FORMULAS)
def test_every_formula_of_the_data_base(write, number, coefficients, expected):
    medium = medium_of(write(formula(number, coefficients)))
    for w in (0.3, 0.55, 1.0, 1.7, 2.5):
        assert float(medium.index_at(1000 * w)) == pytest.approx(expected(w), rel=1e-12)


def test_all_nine_formulas_are_tried():
    assert {row[0] for row in FORMULAS} == set(range(1, 10))


@pytest.mark.parametrize(
    ("rows", "conducts"),
    [
        ("0.4 1.5 0.0099\n        0.8 1.5 0.0099", False),
        ("0.4 1.5 0.0101\n        0.8 1.5 0.001", True),
        ("0.2 1.5 0.5\n        0.37 1.5 0.009\n        0.8 1.5 0", False),  # ultraviolet only: an absorption
        ("0.2 1.5 0.5\n        0.5 1.5 0.001", True),  # reaches 0.2 at 380 nm, between its rows
        ("3.0 1.3 0.5\n        4.0 1.3 0.001", True),  # says nothing of the visible
        ("3.0 1.3 0.005\n        4.0 1.3 0.001", False),
    ],
)
def test_what_is_a_conductor(write, rows, conducts):
    medium = medium_of(write(f"DATA:\n  - type: tabulated nk\n    data: |\n        {rows}\n"))
    assert medium.is_conductor == conducts
    assert conducts == (medium.absorption_per_mm == (0, 0, 0))


def test_tables_are_put_in_order_and_cut_to_light(write):
    """A falling table is turned round, a row that stands twice is one, and what lies beyond 10 nm and 1 mm goes."""
    rows = "\n        ".join(("2000 9", "1.0 1.4", "0.5 1.5", "0.5 1.5", "0.4 1.6", "1E-4 0.999"))
    for text in (
        rows,
        "\n        ".join(rows.replace("0.5 1.5\n        0.5 1.5", "0.5 1.5").split("\n        ")[::-1]),
    ):
        if text == rows:
            text = text.replace("0.5 1.5\n        0.5 1.5", "0.5 1.5")
        medium = medium_of(write(f"DATA:\n  - type: tabulated n\n    data: |\n        {text}\n"))
        assert medium.refractive_index.wavelength_nm == (400, 500, 1000)
        assert medium.refractive_index.n == (1.6, 1.5, 1.4)
    twice = "0.4 1.6\n        0.5 1.5\n        0.5 1.5\n        1.0 1.4"
    medium = medium_of(write(f"DATA:\n  - type: tabulated n\n    data: |\n        {twice}\n"))
    assert medium.refractive_index.wavelength_nm == (400, 500, 1000)


def test_no_extinction_at_all_is_no_absorption(write):
    medium = medium_of(write("DATA:\n  - type: tabulated nk\n    data: |\n        0.4 1.5 0\n        0.8 1.5 0\n"))
    assert medium.absorption_per_mm == medium.extinction == (0, 0, 0)


DAMAGE = {
    "empty": ("", "holds no list DATA"),
    "words": ("This is a letter, not data.", "holds no list DATA"),
    "no data": ("REFERENCES: a\nCOMMENTS: b\n", "holds no list DATA"),
    "data is a text": ("DATA: formula 2\n", "holds no list DATA"),
    "json": ('{"format": "raymaps-scene", "version": 1}', "holds no list DATA"),
    "xml": ("<?xml version='1.0'?>\n<a>\n<b>1</b></a>", "holds no list DATA"),
    "tabs": ("DATA:\n\t- type: formula 2\n", "line 2 is not YAML"),
    "cut short in a text": ('REFERENCES: "A. Author, unfinis', "is not YAML"),
    "binary": (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", "is not a text file"),
    "control characters": (b"DATA:\n - \x01\x02\x03", "is not YAML"),
    "key twice": (HEAD + N_BK7 + "    coefficients: 0 1 0.01\n", "'coefficients' stands twice"),
    "no type": (HEAD + "  - wavelength_range: 0.3 2.5\n", "DATA 1: its type is missing"),
    "unknown type": (HEAD + "  - type: tabulated n2\n    data: |\n      1 2\n", "unknown type 'tabulated n2'"),
    "unknown formula": (formula(10, "0 1"), "known are formula 1 to formula 9"),
    "no coefficients": (HEAD + N_BK7.rpartition("    coef")[0], "formula 2: coefficients is missing"),
    "cut short in the coefficients": ((HEAD + N_BK7)[:-40], "come in pairs"),
    "too many coefficients": (formula(8, "1 2 3 4 5"), "takes 1 to 4 coefficients, got 5"),
    "not a number": (formula(2, "0 1.03961212 0.006OOO69867"), "'0.006OOO69867' is not a number"),
    "decimal commas": (formula(2, "0 1,03961212 0,00600069867"), "decimals follow a point, not a comma"),
    "nan": (formula(2, "0 nan 0.01"), "'nan' is not a finite number"),
    "overflow": (formula(2, "0 1e999 0.01"), "'1e999' is not a finite number"),
    "complex power": (formula(4, "2 1 2 -0.3 0.5"), "give no real number"),
    "no range": (HEAD + N_BK7.replace("    wavelength_range: 0.3 2.5\n", ""), "wavelength_range is missing"),
    "range out of order": (formula(2, "0 1 0.01", "2.5 0.3"), "must be two wavelengths in µm that climb"),
    "range in nm": (formula(2, "0 1 0.01", "300 2500"), "divide those in nm by 1000"),
    "table in nm": (
        "DATA:\n  - type: tabulated n\n    data: |\n        400 1.5\n        700 1.5\n",
        "divide those in nm",
    ),
    "empty table": ("DATA:\n  - type: tabulated nk\n    data: |\n", "the table 'data' is missing or empty"),
    "row cut short": (HEAD + SILVER[:-8], "row 4: 3 numbers are needed, got '1.937 0.2'"),
    "too few columns": (HEAD + SILVER.replace("nk", "n"), "row 1: 2 numbers are needed"),
    "out of order": (HEAD + SILVER.replace("0.4133", "0.7133"), "0.6168 follows 0.7133 µm"),
    "wavelength twice": (HEAD + SILVER.replace("0.4133", "0.6168"), "0.6168 follows 0.6168 µm"),
    "negative index": (HEAD + SILVER.replace("0.05 2", "-0.05 2"), "nothing may be negative, got -0.05 at 0.4133 µm"),
    "negative extinction": (HEAD + N_BK7 + K_BK7.replace("9.57", "-9.57"), "nothing may be negative"),
    "index zero": (HEAD + SILVER.replace("0.05 2", "0 2"), "n must be above 0"),
    "absurd index": (HEAD + SILVER.replace("0.05 2", "5e4 2"), "n must be above 0 and at most 1000, got 50000"),
    "absurd extinction": (HEAD + SILVER.replace("4.152", "4152"), "k must be at most 1000, got 4152"),
    "wavelength zero": (HEAD + SILVER.replace("0.1879", "0"), "wavelengths must be above 0"),
    "no index": (HEAD + K_BK7, "gives no refractive index n"),
    "two indices": (HEAD + N_BK7 + SILVER, "gives the refractive index n 2 times"),
    "two extinctions": (HEAD + SILVER + K_BK7, "gives the extinction k 2 times"),
    "nested without end": ("DATA: " + "[" * 2000, "is nested too deeply"),
    "alias of itself": ("DATA: &a [*a]\n", ""),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_is_told_in_one_sentence(write, damage):
    text, sentence = DAMAGE[damage]
    path = write(text)
    with pytest.raises(FormatError) as raised:
        read_medium(path)
    told = str(raised.value)
    assert sentence in told
    assert str(path) in told
    assert "\n" not in told
    assert told.endswith(".")


def test_missing_folder_and_too_large_files(tmp_path, write):
    with pytest.raises(FormatError, match="there is no such file"):
        read_medium(tmp_path / "nothing.yml")
    (tmp_path / "folder.yml").mkdir()
    with pytest.raises(FormatError, match="can't be read"):
        read_medium(tmp_path / "folder.yml")
    with pytest.raises(FormatError, match="is larger than 4 MiB"):
        read_medium(write("#" * (4 * 2**20 + 1)))


def scene(medium: dict) -> dict:
    return {
        "format": "raymaps-scene",
        "version": 1,
        "media": {"lens": medium},
        "sources": {"lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 0]}},
    }


def test_a_scene_reads_the_file_beside_it_and_then_holds_all_of_it(write, tmp_path):
    write(HEAD + N_BK7 + K_BK7, "N-BK7.yml")
    loaded = scene_from_dict(scene({"file": "N-BK7.yml"}), folder=tmp_path)
    lens = loaded.media["lens"]
    assert float(lens.index_at(587.5618)) == pytest.approx(1.51680, abs=5e-6)
    assert "file" not in loaded.model_dump()["media"]["lens"]
    clamped = scene_from_dict(scene({"file": "N-BK7.yml", "outside": "clamp"}), folder=tmp_path).media["lens"]
    np.testing.assert_array_equal(clamped.index_at([100.0, 300.0]), clamped.index_at([300.0, 300.0]))


@pytest.mark.parametrize(
    ("medium", "sentence"),
    [
        ({"file": "N-BK7.yml", "glass": "N-BK7"}, "holds a single medium: leave out the glass"),
        ({"file": "N-BK7.txt"}, "allowed are YAML files of refractiveindex.info (.yml, .yaml) and Zemax glass"),
        ({"file": ""}, "media 'lens', file: "),
        ({"file": "N-BK7.yml", "wavelength": 5}, "media 'lens', wavelength: there is no such field"),
        ({"file": "N-BK8.yml"}, "there is no such file"),
        ({"file": "pole.yml"}, "the formula 'sellmeier' has a pole at 500 nm"),
    ],
)
def test_a_scene_tells_what_is_wrong_with_the_reference(write, tmp_path, medium, sentence):
    write(HEAD + N_BK7, "N-BK7.yml")
    write(formula(1, "0 1 0.5"), "pole.yml")
    with pytest.raises(SceneError) as raised:
        scene_from_dict(scene(medium), folder=tmp_path)
    assert sentence in str(raised.value)
    assert "\n" not in str(raised.value)
