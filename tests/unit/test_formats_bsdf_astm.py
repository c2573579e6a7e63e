# SPDX-License-Identifier: LGPL-2.1-or-later
"""ASTM E1392 files of BSDFs: what they tell, and that damaged files are refused in one sentence."""

import math

import pytest

from raymaps.effects.bsdf import bsdf_per_sr, shares
from tests.bsdf_texts import PHI_S, THETA_S, astm, astm_rows, complaint, is_one_sentence, table_of


def forward(i, s, p):
    """More light on the forward side: azimuth 0, across from the source at 180 degrees."""
    return f"{0.1 if p < 90 and s else 0.05:g}"


@pytest.mark.parametrize("radians", [False, True])
def test_forward_light_is_across_from_the_source(tmp_path, radians):
    """Azimuths are those of positions; angles in radians, as of Cornell's laboratory, or in degrees."""
    table = table_of(astm(astm_rows(forward, radians=radians)), tmp_path)
    for azimuth, expected in ((0, 0.1), (50, 0.1), (-50, 0.1), (100, 0.05), (180, 0.05)):
        value = bsdf_per_sr(table, "front", "reflection", (30, 0), (60, azimuth))
        assert value == pytest.approx(expected), azimuth
    assert table.reference == "a small sample"
    assert table.lobes[0].is_isotropic


def test_radians_reach_the_horizon(tmp_path):
    """1.5708 is more than a right angle by its last digit."""
    rows = [f"0.7854,3.14159,{s},{p},0.1" for s in ("0.5", "1.5708") for p in ("0", "1.5708", "3.1416")]
    table = table_of(astm(rows), tmp_path)
    assert shares(table, "front", (45, 0))["diffuse reflection"] == pytest.approx(0.1 * math.pi)


def test_wavelengths_stand_in_the_names_of_columns(tmp_path):
    rows = astm_rows(lambda i, s, p: "0.05,0.1,0.2")
    table = table_of(astm(rows, "theta_i,phi_i,theta_s,phi_s,400nm,550nm,700nm"), tmp_path)
    assert table.wavelength_nm == (400, 550, 700)
    assert shares(table, "front", (30, 0), layer=2)["diffuse reflection"] == pytest.approx(0.2 * math.pi)
    rows = astm_rows(lambda i, s, p: "0.05,0.1,0.2")
    table = table_of(astm(rows, "theta_i,phi_i,theta_s,phi_s,R,G,B"), tmp_path)
    assert table.wavelength_nm is None
    assert len(table.lobes[0].value) == 3


@pytest.mark.parametrize(
    ("given", "nm"), [("0.6328 um", 632.8), ("632.8 nm", 632.8), ("632.8", 632.8), ("10.6 um", 10600)]
)
def test_the_wavelength_of_the_header(tmp_path, given, nm):
    table = table_of(astm(astm_rows(forward), header=[f"WAVELENGTH {given}"]), tmp_path)
    assert table.wavelength_nm == (pytest.approx(nm),)


def test_light_past_the_horizon_is_transmitted_and_specular_shares_stand_beside(tmp_path):
    """theta_s of E2387 goes to 180 degrees; 180 - theta_s counts from the normal on the far side."""
    rows = astm_rows(lambda i, s, p: "0.05")
    rows += [f"{i},180,{180 - s},{p},{0.1 if p < 90 and s else 0.02}" for i in (0, 60) for s in THETA_S for p in PHI_S]
    header = ["SPECULAR_REFLECTANCE 0.04", "SPECULAR_TRANSMITTANCE 0.5"]
    table = table_of(astm(rows, header=header), tmp_path)
    assert bsdf_per_sr(table, "front", "transmission", (30, 0), (60, 20)) == pytest.approx(0.1)
    assert bsdf_per_sr(table, "front", "transmission", (30, 0), (60, 120)) == pytest.approx(0.02)
    share = shares(table, "front", (30, 0))
    assert share["specular reflection"] == pytest.approx(0.04)
    assert share["specular transmission"] == pytest.approx(0.5)
    assert share["diffuse reflection"] == pytest.approx(0.05 * math.pi)


def test_a_column_btdf_is_transmission(tmp_path):
    table = table_of(astm(astm_rows(forward), "theta_i,phi_i,theta_s,phi_s,BTDF"), tmp_path)
    assert [lobe.goes_to for lobe in table.lobes] == ["transmission"]


def test_anisotropic_samples(tmp_path):
    """A groove: much light goes on forward from sources at azimuth 90 and 270, little from those at 0 and 180."""
    rows = [
        f"45,{i},{s},{p},{0.2 if i in (90, 270) and s and p == (i + 180) % 360 else 0.01}"
        for i in (0, 90, 180, 270) for s in (0, 30, 60, 80) for p in (0, 90, 180, 270)
    ]  # fmt: skip
    table = table_of(astm(rows), tmp_path)
    assert not table.lobes[0].is_isotropic
    # light of the source at azimuth 90 travels towards azimuth 270
    assert bsdf_per_sr(table, "front", "reflection", (45, 270), (60, 270)) == pytest.approx(0.2)
    assert bsdf_per_sr(table, "front", "reflection", (45, 180), (60, 180)) == pytest.approx(0.01)
    assert bsdf_per_sr(table, "front", "reflection", (45, 225), (60, 225)) == pytest.approx(0.105)


ROWS = astm_rows(forward)
DAMAGES = {
    "cut short": ("\n".join(astm(ROWS).splitlines()[:-3]), "it may be cut short"),
    "cut within a row": (astm(ROWS).rstrip().rpartition(",")[0], "VARS names 5 columns, got 4 numbers"),
    "no columns named": ("\n".join(["NUM_POINTS 2", *ROWS]), "a keyword is needed before the rows"),
    "the keyword VARS is missing": ("TITLE x\nNUM_POINTS 0\n", "keyword VARS"),
    "other columns": (astm(ROWS, "theta_s,phi_s,theta_i,phi_i,BRDF"), "VARS must begin with theta_i,phi_i,theta_s"),
    "no values": (astm([row.rpartition(",")[0] for row in ROWS], "theta_i,phi_i,theta_s,phi_s"), "got none"),
    "rows of words": (astm([*ROWS, "the end of it"]), "is not a row of numbers"),
    "negative": (astm([*ROWS[:-1], "60,180,75,180,-1e-4"]), "must be 0 or more, got -0.0001"),
    "not finite": (astm([*ROWS[:-1], "60,180,75,180,inf"]), "not finite"),
    "tristimulus values": (astm([f"{row},1,1" for row in ROWS], "theta_i,phi_i,theta_s,phi_s,X,Y,Z"), "X, Y, Z"),
    "cosine in the values": (astm(ROWS, "theta_i,phi_i,theta_s,phi_s,CCBRDF"), "with the cosine in them"),
    "wavelengths out of order": (
        astm([f"{row},0.1" for row in ROWS], "theta_i,phi_i,theta_s,phi_s,700nm,400nm"), "400 follows 700",
    ),
    "wavelength without unit": (astm(ROWS, header=["WAVELENGTH 0.6328"]), "write nm or um"),
    "wavelength of another unit": (astm(ROWS, header=["WAVELENGTH 6328 angstrom"]), "a number and nm or um"),
    "absurd wavelength": (astm(ROWS, header=["WAVELENGTH 1e9 um"]), "wavelengths must be in nm"),
    "past the horizon": (astm([*ROWS, "60,180,200,0,0.1"]), "theta_s must be at most 180 degrees, got 200"),
    "unknown unit of angle": (astm(ROWS, header=["ANGLE_UNITS gon"]), "deg or rad, got 'gon'"),
    "radians said to be degrees": (astm(astm_rows(forward, radians=True), header=["ANGLE_UNITS deg"]), "only up to"),
    "degrees or radians": (astm([f"0,3,{s},{p},0.1" for s in (0, 0.5) for p in (0, 1, 2)]), "the keyword ANGLE_UNITS"),
    "keyword twice": (astm(ROWS, header=["WAVELENGTH 633 nm", "WAVELENGTH 532 nm"]), "stands twice"),
    "creates light": (astm(astm_rows(lambda i, s, p: "3.1")), "the table creates light"),
    "specular share": (astm(ROWS, header=["SPECULAR_REFLECTANCE 4"]), "from 0 to 1, got 4"),
    "another format": ('{"NUM": 3}', "no known format"),
    "binary": (b"VARS \x00\x00", "not a text file"),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_told_in_one_sentence(tmp_path, damage):
    text, expected = DAMAGES[damage]
    told = complaint(text, tmp_path)
    assert expected in told
    assert is_one_sentence(told), told
