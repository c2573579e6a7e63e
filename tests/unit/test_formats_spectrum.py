# SPDX-License-Identifier: LGPL-2.1-or-later
"""Spectra in CSV files become tables of a scene; damaged ones are refused in one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from raymaps.errors import FormatError, SceneError
from raymaps.formats.spectrum_csv import read_spectrum
from raymaps.scene import scene_from_dict

TABLE = {"wavelength_nm": (400.0, 500.0, 700.0), "value": (0.25, 0.5, 0.125)}


@pytest.fixture
def write(tmp_path):
    def write(text: str | bytes) -> Path:
        path = tmp_path / "spectrum.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.mark.parametrize(
    "text",
    [
        "400,0.25\n500,0.5\n700,0.125\n",
        "400, 0.25\r\n500, 0.5\r\n700, 0.125",
        "400;0,25\n500;0,5\n700;0,125\n",
        "400\t.25\n500\t5e-1\n700\t1.25E-1\n",
        "  400   0.25\n\n500 0.5\n  700 0.125  \n",
        "wavelength (nm),reflectance\n# measured at 8 degrees\n400,0.25\n500,0.5\n700,0.125\n",
        "700,0.125\n500,0.5\n400,0.25\n",
        b"\xef\xbb\xbf400,0.25\n500,0.5\n700,0.125\n",
        "λ;R\n400;0.25\n500;0.5\n700;0.125\n".encode("utf-16"),
        b"Wellenl\xe4nge\tR\n400\t0,25\n500\t0,5\n700\t0,125\n",
    ],
)
def test_ways_to_write_a_spectrum(write, text):
    assert read_spectrum(write(text)) == TABLE


def test_a_single_line_is_a_spectrum(write):
    assert read_spectrum(write("632.8 1")) == {"wavelength_nm": (632.8,), "value": (1.0,)}


DAMAGE = {
    "empty": ("", "holds no line with a wavelength in nm and a value"),
    "only a heading": ("wavelength,value\n", "holds no line with a wavelength in nm and a value"),
    "only remarks": ("# 400,1\n", "holds no line"),
    "binary": (b"\x7fELF\x02\x01\x01\x00\x00\x00", "is not a text file"),
    "json": ('{\n"wavelength_nm": [400, 500]\n}', "line 2: "),
    "xml": ("<spectrum>\n<value>1</value>\n</spectrum>", "line 2: "),
    "cut short": ("400,0.25\n500,0.5\n70", "line 3: a wavelength in nm and a value are needed, got '70'"),
    "cut short within the number": ("400,0.25\n500,5e-", "line 2: '5e-' is not a number"),
    "three columns": ("400,0.25,0.3\n", "line 1: a wavelength in nm and a value are needed"),
    "missing cell": ("400,0.25\n500,\n", "line 2: a wavelength in nm and a value are needed, got '500,'"),
    "decimal commas between commas": ("400,0,25\n", "line 1: a wavelength in nm and a value are needed"),
    "decimal comma among blanks": ("400 0,25\n", "line 1: a wavelength in nm and a value are needed"),
    "words among numbers": ("400,0.25\n500,n/a\n", "line 2: 'n/a' is not a number"),
    "words at first": ("400,none\n500,0.5\n", "line 1: 'none' is not a number"),
    "two headings": ("wavelength,R\nnm,1\n400,0.25\n", "line 2: 'nm' is not a number"),
    "nan": ("400,nan\n", "line 1: 'nan' is not a finite number"),
    "infinite": ("400,1\n500,inf\n", "line 2: 'inf' is not a finite number"),
    "overflow": ("400,1e400\n", "line 1: '1e400' is not a finite number"),
    "out of order": (
        "400,1\n600,1\n500,1\n",
        "line 3: wavelengths must climb from line to line, but 500 nm follow 600",
    ),
    "wavelength twice": (
        "400,1\n\n400,0.5\n",
        "line 3: wavelengths must climb from line to line, but 400 nm follow 400",
    ),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_is_told_in_one_sentence(write, damage):
    text, sentence = DAMAGE[damage]
    path = write(text)
    with pytest.raises(FormatError) as raised:
        read_spectrum(path)
    told = str(raised.value)
    assert sentence in told
    assert str(path) in told
    assert "\n" not in told
    assert told.endswith(".")


def test_missing_folder_and_too_large_files(tmp_path, write):
    with pytest.raises(FormatError, match="there is no such file"):
        read_spectrum(tmp_path / "nothing.csv")
    with pytest.raises(FormatError, match="there is no such file"):
        read_spectrum(tmp_path / "a\0b.csv")
    with pytest.raises(FormatError, match="can't be read"):
        read_spectrum(tmp_path)
    with pytest.raises(FormatError, match="is larger than 16 MiB"):
        read_spectrum(write("#" * (16 * 2**20 + 1)))


def scene(reflectance: object) -> dict:
    return {
        "format": "raymaps-scene",
        "version": 1,
        "surfaces": {"paint": {"kind": "lambertian", "reflectance": reflectance}},
        "sources": {"lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 0]}},
    }


def test_a_scene_reads_the_file_beside_it_and_then_holds_the_table(write, tmp_path):
    write("400,0.25\n500,0.5\n700,0.125\n")
    paint = scene_from_dict(scene({"file": "spectrum.csv", "outside": "clamp"}), folder=tmp_path).surfaces["paint"]
    assert paint.reflectance.model_dump() == {**TABLE, "outside": "clamp"}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("0.4,0.25\n0.7,0.5\n", "wavelengths must be in nm, from 10 to 1e+06; got 0.4 (1 µm is 1000 nm)"),
        ("4e6,0.25\n7e6,0.5\n", "wavelengths must be in nm, from 10 to 1e+06; got 4e+06"),
        ("-400,0.25\n700,0.5\n", "wavelengths must be in nm"),
        ("400,-0.25\n700,0.5\n", "must be greater than or equal to 0"),
        ("400,25\n700,50\n", "must be less than or equal to 1"),
    ],
)
def test_values_that_can_not_be_are_told_by_the_scene(write, tmp_path, text, sentence):
    write(text)
    with pytest.raises(SceneError) as raised:
        scene_from_dict(scene({"file": "spectrum.csv"}), folder=tmp_path)
    assert sentence in str(raised.value)
    assert "surfaces 'paint', reflectance" in str(raised.value)
    assert "\n" not in str(raised.value)
