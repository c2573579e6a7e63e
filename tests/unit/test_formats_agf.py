# SPDX-License-Identifier: LGPL-2.1-or-later
"""Glasses of Zemax catalogues become media; damaged catalogues are refused in one sentence."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from raymaps.errors import FormatError, SceneError
from raymaps.formats.agf import glass_names
from raymaps.formats.medium_files import read_medium
from raymaps.materials import Medium
from raymaps.materials.dispersion import index_by_formula
from raymaps.scene import scene_from_dict

D_NM = 587.5618

#: Two glasses as Schott's catalogue prints them.
CATALOGUE = """CC Zemax catalogue of Schott glasses
NM N-BK7 2 517642.251 1.51680 64.17 0 1 1
GC step 0.5 available
ED 7.100000 8.300000 2.510000 -0.000900 0
CD 1.039612120E+00 6.000698670E-03 2.317923440E-01 2.001791440E-02 1.010469450E+00 1.035606530E+02 0.0 0.0 0.0 0.0
TD 1.860000E-06 1.310000E-08 -1.370000E-11 4.340000E-07 6.270000E-10 1.700000E-01 2.000000E+01
OD 1.0000 2.0000 0.0000 1.0000 2.3000 2.3000
LD 3.00000E-01 2.50000E+00
IT 3.00000E-01 5.00000E-02 2.50000E+01
IT 3.50000E-01 9.20000E-01 2.50000E+01
IT 4.00000E-01 9.92000E-01 2.50000E+01
IT 5.46000E-01 9.96000E-01 2.50000E+01
IT 7.00000E-01 9.96000E-01 2.50000E+01
IT 2.50000E+00 3.60000E-01 2.50000E+01
NM F2 2 620364.360 1.62004 36.37 0 1 -
CD 1.345333590E+00 9.977438710E-03 2.090731760E-01 4.704507670E-02 9.373571620E-01 1.118867640E+02
LD 3.20000E-01 2.50000E+00
"""


@pytest.fixture
def write(tmp_path):
    def write(text: str | bytes, name: str = "schott.agf") -> Path:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def medium_of(path: Path, glass: str | None = None) -> Medium:
    return Medium.model_validate(read_medium(path, glass, index_by_formula))


def test_a_glass_by_its_name(write):
    path = write(CATALOGUE)
    assert glass_names(path) == ("N-BK7", "F2")
    medium = medium_of(path, "N-BK7")
    n_f, n_d, n_c = medium.index_at([486.1327, D_NM, 656.2725])
    assert n_d == pytest.approx(1.51680, abs=5e-6)
    assert (n_d - 1) / (n_f - n_c) == pytest.approx(64.17, abs=0.01)
    assert medium.refractive_index.range_nm == (300, 2500)
    assert medium.reference == "Glass N-BK7 of the catalogue schott.agf; index relative to air"
    assert float(medium_of(path, "F2").index_at(D_NM)) == pytest.approx(1.62004, abs=5e-6)
    assert medium_of(path, "f2") == medium_of(path, "F2")


def test_internal_transmittance_becomes_absorption(write):
    absorption = medium_of(write(CATALOGUE), "N-BK7").absorption_per_mm
    assert absorption.wavelength_nm == (300, 350, 400, 546, 700, 2500)
    for wavelength_nm, transmittance in ((300, 0.05), (400, 0.992), (2500, 0.36)):
        assert math.exp(-25 * float(absorption.at(wavelength_nm))) == pytest.approx(transmittance, rel=1e-5)


def with_rows(*rows: str) -> str:
    head = CATALOGUE.partition("IT ")[0]
    return head + "\n".join(f"IT {row}" for row in rows) + "\n"


@pytest.mark.parametrize(
    ("rows", "wavelength_nm", "per_mm"),
    [
        # of several thicknesses the row that tells most: T nearest to 1/e
        (("0.4 0.998 5", "0.4 0.960 100", "0.4 0.990 25"), 400, -math.log(0.96) / 100),
        (("0.4 0.001 25", "0.4 0.350 4", "0.4 0.9 1"), 400, -math.log(0.35) / 4),
        # nothing measured: an optical density of 5
        (("0.4 0 25", "0.5 0.9 25"), 400, 5 * math.log(10) / 25),
        (("0.4 0 25", "0.4 0 5", "0.5 0.9 25"), 400, math.log(1e5) / 5),
        # rows out of order, and rows that say nothing
        (("0.5 0.9 25", "0.4 0.8 25"), 400, -math.log(0.8) / 25),
        (("0.4 0.8 25", "0.45 -999 25", "0.5 0.8 25"), 450, -math.log(0.8) / 25),
        (("0.4 0.8 25", "0.45 0.9 0", "0.5 0.8 25"), 450, -math.log(0.8) / 25),
        (("0.4 0.8 25", "0.45 25", "0.5 0.8 25"), 450, -math.log(0.8) / 25),
    ],
)
def test_rows_of_transmittance(write, rows, wavelength_nm, per_mm):
    absorption = medium_of(write(with_rows(*rows)), "N-BK7").absorption_per_mm
    assert float(absorption.at(wavelength_nm)) == pytest.approx(per_mm, rel=1e-5)


def test_a_glass_that_lets_all_through_absorbs_nothing(write):
    assert medium_of(write(with_rows("0.4 1 25", "0.7 1.0 25")), "N-BK7").absorption_per_mm == (0, 0, 0)
    assert medium_of(write(CATALOGUE), "F2").absorption_per_mm == (0, 0, 0)


#: Number of the formula, coefficients, and the n_d that a real catalogue states for them, where there is one.
FORMULAS = [
    # old BK7: n_d 1.51680
    (1, (2.2718929, -1.0108077e-2, 1.0592509e-2, 2.0816965e-4, -7.6472538e-6, 4.9240991e-7), 1.51680),
    (2, (1.34533359, 0.00997743871, 0.209073176, 0.0470450767, 0.937357162, 111.886764), 1.62004),
    (3, (1.5, 0.01, 0.002, -0.003, 1e-4, 1e-5), None),
    (4, (0.2, 1.0, 0.1, -0.05, 0.2), None),
    # BASF5: 1.603233
    (5, (1.57410327, 0.0139786149, 0.00083004511), 1.603233),
    # Nikon 4786: 1.474099
    (6, (0.795944286, 0.00371401467, 0.356650937, 0.0125884185, 0.98008113, 190.314843, 0, 0), 1.474099),
    (7, (2.6, 0.02, 0.03, 0.01), None),
    # zinc oxide: 2.003385
    (8, (2.81418, 0.87968, 0.09253764, 0.00711), 2.003385),
    (9, (1.3, 0.9, 0.01, 1.1, 100.0), None),
    (10, (2.27, -0.01, 0.0106, 2e-4, -7.6e-6, 4.9e-7, 1e-8, -1e-9), None),
    (11, (0.6, 0.005, 0.4, 0.01, 0.1, 0.02, 0.05, 0.03, 0.9, 100.0), None),
    # E-KZFH1: 1.612660
    (
        12,
        (2.54662904, -1.22972332e-2, 1.87464623e-2, 4.60296583e-4, 7.85351066e-7, 1.72720972e-6, -1.33476806e-4, 0),
        1.61266,
    ),
    # J-FK5: 1.487490
    (
        13,
        (2.18826855, -9.19044724e-3, -1.11621071e-4, 9.26372815e-3, 7.34900733e-5, 4.19724242e-6, -1.15412203e-7, 0, 0),
        1.48749,
    ),
]  # fmt: skip


def by_the_manual(number: int, c: tuple[float, ...], w: float) -> float:
    """Index at the wavelength w in µm, each formula written out."""
    s = w * w
    herzberger = 1 / (s - 0.028)
    if number == 3:
        return c[0] + c[1] * herzberger + c[2] * herzberger**2 + c[3] * s + c[4] * s**2 + c[5] * s**3
    if number == 5:
        return c[0] + c[1] / w + c[2] / w**3.5

    def sellmeier() -> float:
        return sum(b * s / (s - d) for b, d in zip(c[0::2], c[1::2], strict=True))

    squared = {
        1: lambda: c[0] + c[1] * s + c[2] / s + c[3] / s**2 + c[4] / s**3 + c[5] / s**4,
        2: lambda: 1 + sellmeier(),
        4: lambda: 1 + c[0] + c[1] * s / (s - c[2] ** 2) + c[3] / (s - c[4] ** 2),
        6: lambda: 1 + sellmeier(),
        7: lambda: c[0] + c[1] / (s - c[2]) - c[3] * s,
        8: lambda: c[0] + c[1] * s / (s - c[2]) - c[3] * s,
        9: lambda: c[0] + c[1] * s / (s - c[2]) + c[3] * s / (s - c[4]),
        10: lambda: c[0] + c[1] * s + sum(a / s**i for i, a in enumerate(c[2:], 1)),
        11: lambda: 1 + sellmeier(),
        12: lambda: c[0] + c[1] * s + c[2] / s + c[3] / s**2 + c[4] / s**3 + c[5] / s**4 + c[6] * s**2 + c[7] * s**3,
        13: lambda: c[0] + c[1] * s + c[2] * s**2 + sum(a / s**i for i, a in enumerate(c[3:], 1)),
    }
    return math.sqrt(squared[number]())


@pytest.mark.parametrize(("number", "coefficients", "n_d"), FORMULAS)
def test_every_formula_of_zemax(write, number, coefficients, n_d):
    stated = f"{n_d or by_the_manual(number, coefficients, 0.5875618):.6f}"
    text = f"NM GLASS {number} 0 {stated} 50 0 0\nCD {' '.join(map(repr, coefficients))} 0.0\nLD 0.35 2.5\n"
    medium = medium_of(write(text))
    if n_d:
        assert float(medium.index_at(D_NM)) == pytest.approx(n_d, abs=6e-6)
    for w in (0.4, 0.5875618, 1.0, 2.0):
        assert float(medium.index_at(1000 * w)) == pytest.approx(by_the_manual(number, coefficients, w), rel=1e-12)


def test_all_thirteen_formulas_are_tried():
    assert [row[0] for row in FORMULAS] == list(range(1, 14))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"])
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_encodings(write, encoding, ending):
    """Catalogues come in all of these; what is not of an encoding stands only in comments."""
    text = CATALOGUE if encoding == "utf-16-le" else CATALOGUE.replace("GC step", "GC 25 °C/h, step")
    medium = medium_of(write(text.replace("\n", ending).encode(encoding)), "N-BK7")
    assert float(medium.index_at(D_NM)) == pytest.approx(1.51680, abs=5e-6)


def test_lines_that_run_on(write):
    """Nikon's catalogue breaks the coefficients into lines of four."""
    text = CATALOGUE.replace(" 1.010469450E+00", "\n1.010469450E+00").replace(" 2.001", "\n2.001")
    assert medium_of(write(text), "N-BK7") == medium_of(write(CATALOGUE), "N-BK7")


def test_a_catalogue_of_one_glass_needs_no_name(write):
    text = CATALOGUE.partition("NM F2")[0]
    assert float(medium_of(write(text)).index_at(D_NM)) == pytest.approx(1.51680, abs=5e-6)


def test_without_a_range_the_formula_holds_where_it_is_physical(write):
    text = "".join(line for line in CATALOGUE.splitlines(keepends=True) if not line.startswith("LD"))
    low, high = medium_of(write(text), "F2").refractive_index.range_nm
    assert 200 < low < 230
    assert 8000 < high < 11000


def test_a_glass_that_stands_twice(write):
    """The same data twice are one glass; other data are a question that the file must answer."""
    twice = CATALOGUE + CATALOGUE.partition("\n")[2]
    assert medium_of(write(twice), "F2") == medium_of(write(CATALOGUE), "F2")
    with pytest.raises(FormatError, match="glass 'F2' stands in lines 15 and 31 with different data"):
        medium_of(write(twice[:-30] + " 0.1 0.2\nLD 3.2E-01 2.5\n"), "F2")


def changed(old: str, new: str) -> str:
    assert old in CATALOGUE
    return CATALOGUE.replace(old, new, 1)


DAMAGE = {
    "empty": ("", "is no Zemax glass catalogue: none of its lines begins with NM"),
    "another format": ("DATA:\n  - type: formula 2\n", "is no Zemax glass catalogue"),
    "binary": (b"\x00\x01\x02\x03\xff\xfe\x00\x00" * 50, "is not a text file"),
    "utf-16 cut within a character": (CATALOGUE.encode("utf-16")[:-1], "is not a text file, or was cut short"),
    "cut short after the name": ("NM N-BK7", "line 1: NM needs a name and the number of a formula, got 'NM N-BK7'"),
    "cut short before the coefficients": (CATALOGUE.partition("CD ")[0], "one line CD must follow NM, found 0"),
    "cut short in the coefficients": (CATALOGUE.partition(" 2.0017")[0], "Sellmeier 1 needs 6 coefficients, got 3"),
    "coefficients twice": (changed("TD 1.86", "CD 1.86"), "one line CD must follow NM, found 2"),
    "unknown formula": (changed("N-BK7 2", "N-BK7 14"), "formula 14 is unknown; known are the numbers 1 to 13"),
    "formula of letters": (changed("N-BK7 2", "N-BK7 II"), "line 2: 'II' is not a number"),
    "formula of another glass": (
        changed("N-BK7 2", "N-BK7 5"),
        "Conrady has 3 coefficients, but further ones are not 0",
    ),
    "a wrong digit": (changed("1.039", "1.139"), "states the index n_d 1.5168, but its formula Sellmeier 1"),
    "coefficients in nm": (changed("6.000698670E-03", "6.000698670E+03"), "one of them is wrong"),
    "letters": (changed("1.039612120E+00", "1.039612120EE0"), "line 5: '1.039612120EE0' is not a number"),
    "decimal commas": (changed("1.039612120E+00", "1,0396"), "'1,0396' is not a number (decimals follow a point"),
    "nan": (changed("1.039612120E+00", "NaN"), "'NaN' is not a finite number"),
    "range in nm": (changed("LD 3.00000E-01 2.50000E+00", "LD 300 2500"), "wavelength of 300 can't be in µm"),
    "range out of order": (changed("LD 3.00000E-01", "LD 3.00000E+01"), "must be two wavelengths in µm that climb"),
    "range cut short": (changed("LD 3.00000E-01 2.50000E+00", "LD 3.00000E-01"), "must be two wavelengths in µm"),
    "transmittance above 1": (changed("9.20000E-01", "9.20000E+01"), "must be from 0 to 1, got 92"),
    "negative transmittance": (changed("9.20000E-01", "-9.2"), "must be from 0 to 1, got -9.2"),
    "negative thickness": (changed("9.20000E-01 2.5", "9.20000E-01 -2.5"), "the thickness must be above 0"),
    "thickness in µm": (changed("9.20000E-01 2.50000E+01", "0.92 25000"), "at most 1000 mm, got 25000"),
    "transmittance of a wavelength in nm": (changed("IT 3.50000E-01", "IT 350"), "350 can't be in µm"),
    "row cut short": (changed("IT 3.50000E-01 9.20000E-01 2.50000E+01", "IT 3.5E-01"), "IT must be wavelength"),
    "unknown glass": (CATALOGUE.replace("N-BK7", "N-BK9"), "unknown glass 'N-BK7'; known: 'N-BK9', 'F2'"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_is_told_in_one_sentence(write, damage):
    text, sentence = DAMAGE[damage]
    path = write(text)
    with pytest.raises(FormatError) as raised:
        read_medium(path, "N-BK7", index_by_formula)
    told = str(raised.value)
    assert sentence in told
    assert str(path) in told
    assert "\n" not in told
    assert told.endswith(".")


def test_which_glass_must_be_said(write):
    with pytest.raises(FormatError, match="holds 2 glasses: say which one by 'glass'"):
        read_medium(write(CATALOGUE))


def scene(medium: dict) -> dict:
    return {
        "format": "raymaps-scene",
        "version": 1,
        "media": {"lens": medium},
        "sources": {"lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 0]}},
    }


def test_a_scene_names_a_glass_of_a_catalogue(write, tmp_path):
    write(CATALOGUE)
    loaded = scene_from_dict(scene({"file": "schott.agf", "glass": "N-BK7"}), folder=tmp_path)
    assert float(loaded.media["lens"].index_at(D_NM)) == pytest.approx(1.51680, abs=5e-6)
    assert scene_from_dict(loaded.model_dump(mode="json")).media == loaded.media
    with pytest.raises(
        SceneError, match=r"media 'lens': glass catalogue '.*': unknown glass 'N-BK9'; known: 'N-BK7', 'F2'"
    ):
        scene_from_dict(scene({"file": "schott.agf", "glass": "N-BK9"}), folder=tmp_path)
    write(changed("1.039", "1.139"))
    with pytest.raises(SceneError, match="states the index n_d"):  # a scene compares n_d, too
        scene_from_dict(scene({"file": "schott.agf", "glass": "N-BK7"}), folder=tmp_path)
