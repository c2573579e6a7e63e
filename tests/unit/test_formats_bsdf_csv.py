# SPDX-License-Identifier: LGPL-2.1-or-later
"""Own CSV format of BSDFs: what it tells, and that damaged files are refused in one sentence."""

import math

import numpy as np
import pytest

from raymaps.effects.bsdf import bsdf_per_sr, shares
from raymaps.materials.bsdf_directions import BsdfAngles
from tests.bsdf_texts import complaint, csv, grid_rows, is_one_sentence, table_of

FLAT = [f"{i},{s},0.2" for i in (0, 60) for s in (0, 30, 60, 80)]


def test_a_flat_table_has_the_reflectance_of_lamberts_law(tmp_path):
    """BSDF rho/pi in all directions reflects rho (F. Nicodemus et al.: NBS Monograph 160 (1977), section V.A)."""
    table = table_of(csv(FLAT, "theta_i,theta_s,bsdf"), tmp_path)
    for polar in (0, 30, 85):
        assert shares(table, "front", (polar, 0))["diffuse reflection"] == pytest.approx(0.2 * math.pi, rel=1e-12)
    assert table.wavelength_nm is None
    assert table.lobes[0].is_isotropic


def test_each_value_stands_for_the_directions_nearest_to_it(tmp_path):
    """Borders midway between polar angles and between azimuths; one side of the plane of incidence is mirrored."""
    table = table_of(csv(grid_rows(lambda i, s, p: f"{(s + p) / 1e4:.6f}")), tmp_path)
    for polar_s, azimuth_s, expected in (
        (0, 0, 0), (7, 100, 0), (8, 20, 15), (8, 25, 60), (50, 44, 45 + 45), (50, -44, 45 + 45), (80, 158, 75 + 180),
        (80, 200, 75 + 180), (80, 203, 75 + 135), (89.9, 359, 75),
    ):  # fmt: skip
        for incoming in ((0, 0), (35, 0), (60, 0)):
            assert bsdf_per_sr(table, "front", "reflection", incoming, (polar_s, azimuth_s)) == pytest.approx(
                expected / 1e4, abs=1e-12
            )


def test_azimuths_count_from_the_plane_of_incidence_and_values_are_linear_between_angles(tmp_path):
    table = table_of(csv(grid_rows(lambda i, s, p: f"{(i + p) / 2000:.6f}", (0, 40, 60))), tmp_path)
    for azimuth in (0, 77, 200):
        value = bsdf_per_sr(table, "front", "reflection", (50, azimuth), (45, azimuth + 90))
        assert value == pytest.approx((50 + 90) / 2000, rel=1e-9)
    assert bsdf_per_sr(table, "front", "reflection", (80, 0), (45, 0)) == pytest.approx(60 / 2000)


def test_both_halves_may_be_given_and_negative_angles_lie_across_the_normal(tmp_path):
    rows = [
        f"0,{s},{p},{0.1 + (0.05 if math.copysign(1, s) < 0 else 0):g}"
        for s in (-80, -40, 0, 40, 80)
        for p in (0, 60, 120)
    ]
    table = table_of(
        csv(row for row in rows if not (row.startswith("0,0,") and not row.startswith("0,0,0,"))), tmp_path
    )
    for azimuth, expected in ((0, 0.1), (60, 0.1), (120, 0.1), (180, 0.15), (240, 0.15), (300, 0.15)):
        assert bsdf_per_sr(table, "front", "reflection", (0, 0), (70, azimuth)) == pytest.approx(expected)


def test_tables_of_both_ways_wavelengths_and_specular_shares(tmp_path):
    text = (
        "# raymaps-bsdf\n# reference: sample 12: polished\n# from: back\n"
        "theta_i;theta_s;450nm;650nm\n0;specular;0,1;0,2\n0;0;0,05;0,06\n0;80;0,05;0,06\n"
        "80;specular;0,3;0,4\n80;0;0,05;0,06\n80;80;0,05;0,06\n"
        "# to: transmission\ntheta_i;theta_s;450nm;650nm\n0;specular;0,4;0,3\n"
    )
    table = table_of(text, tmp_path, outside="clamp")
    assert table.wavelength_nm == (450, 650)
    assert table.outside == "clamp"
    assert table.reference == "sample 12: polished"
    assert [(lobe.comes_from, lobe.goes_to) for lobe in table.lobes] == [
        ("back", "reflection"),
        ("back", "transmission"),
    ]
    at_20 = shares(table, "back", (20, 0), layer=1)
    assert at_20["specular reflection"] == pytest.approx(0.25)
    assert at_20["diffuse reflection"] == pytest.approx(0.06 * math.pi)
    assert at_20["specular transmission"] == pytest.approx(0.3)
    assert at_20["diffuse transmission"] == 0
    assert shares(table, "front", (20, 0), layer=1) == at_20  # nothing is told of the front: both sides act alike


def test_anisotropic_tables_interpolate_in_azimuth_too(tmp_path):
    """At 60 degrees four azimuths; along the normal azimuth has no meaning, so one pattern is turned against it."""
    rows = [f"0,0,{s},{p},{0.1 + p / 3600:.6f}" for s in (20, 80) for p in (0, 90, 180, 270)]
    rows += [
        f"60,{i},{s},{(i + p) % 360},{0.01 * (1 + i / 90) + p * 1e-5:.6f}"
        for i in (0, 90, 180, 270)
        for s in (20, 80)
        for p in (0, 90, 180, 270)
    ]
    table = table_of(csv(rows, "theta_i,phi_i,theta_s,phi_s,bsdf"), tmp_path)
    lobe = table.lobes[0]
    assert isinstance(lobe.incoming, BsdfAngles)
    assert lobe.incoming.azimuth_deg == ((0, 90, 180, 270),) * 2
    assert not lobe.is_isotropic
    value = bsdf_per_sr(table, "front", "reflection", (60, 45), (80, 45 + 90))
    assert value == pytest.approx(0.01 * 1.5 + 90e-5, rel=1e-9)
    value = bsdf_per_sr(table, "front", "reflection", (60, 315), (80, 315))
    assert value == pytest.approx(0.01 * (4 + 1) / 2, rel=1e-9)
    for azimuth in (0, 90, 180, 270):  # the pattern along the normal stays where it is on the body
        value = bsdf_per_sr(table, "front", "reflection", (0, azimuth), (80, 90))
        assert value == pytest.approx(0.1 + 90 / 3600, rel=1e-4)


def test_directions_without_rings_are_taken_to_fixed_cells(tmp_path):
    """A spiral of directions about 6 degrees apart, with the value sin(polar angle): each cell takes the nearest."""
    n = 1500
    k = np.arange(n) + 0.5
    polar, azimuth = np.degrees(np.arccos(1 - k / n)), np.degrees(k * math.pi * (1 + math.sqrt(5))) % 360
    rows = [f"30,{s:.4f},{p:.4f},{0.2 * math.sin(math.radians(s)):.6f}" for s, p in zip(polar, azimuth, strict=True)]
    table = table_of(csv(rows), tmp_path)
    exact = 0.2 * 2 * math.pi / 3  # integral of 0.2 sin cos over the hemisphere
    assert shares(table, "front", (30, 0))["diffuse reflection"] == pytest.approx(exact, rel=2e-3)
    for s, p in ((5, 10), (40, 100), (70, 250)):
        value = bsdf_per_sr(table, "front", "reflection", (30, 0), (s, p))
        assert value == pytest.approx(0.2 * math.sin(math.radians(s)), abs=0.2 * math.radians(7))


ROWS = grid_rows(lambda i, s, p: "0.1")
DAMAGES = {
    "empty": ("", "is empty"),
    "binary": (b"# raymaps-bsdf\ntheta_i,theta_s,bsdf\n\x00\x01\x02", "not a text file"),
    "another format": ("wavelength,value\n400,0.5\n", "no known format"),
    "no column names": ("# raymaps-bsdf\n0,0,0,0.1\n", "line 2: a line of column names"),
    "only a header": (csv([]), "no rows follow"),
    "a column is missing": (csv(ROWS, "theta_i,theta_x,phi_s,bsdf"), "'theta_s' is missing"),
    "no values": (csv(ROWS, "theta_i,theta_s,phi_s,brightness"), "'brightness'"),
    "a row is cut short": (csv([*ROWS, "60,75"]), "4 cells are needed"),
    "not a number": (csv([*ROWS[:-1], "60,75,180,dark"]), "'dark' is not a number"),
    "not finite": (csv([*ROWS[:-1], "60,75,180,nan"]), "not a finite number"),
    "negative": (csv([*ROWS[:-1], "60,75,180,-0.1"]), "must be 0 or more, got -0.1"),
    "wavelengths out of order": (
        csv([f"{row},0.1" for row in ROWS], "theta_i,theta_s,phi_s,650nm,450nm"), "450 follows 650",
    ),
    "wavelengths in micrometres": (csv(ROWS, "theta_i,theta_s,phi_s,0.55nm"), "1 µm is 1000 nm"),
    "past the horizon": (csv([*ROWS, "60,105,0,0.1"]), "theta_s must be from -90 to 90 degrees from"),
    "incidence past the horizon": (csv([*ROWS, "100,0,0,0.1"]), "theta_i must be from 0 to 90 degrees from"),
    "radians": (
        csv([f"1,{s / 57.29578:.4f},{p / 57.29578:.4f},0.1" for s in range(0, 90, 15) for p in (0, 90, 180)]),
        "only up to 1.309 degrees",
    ),
    "one plane only": (csv([f"45,{s},0,0.1" for s in range(-80, 90, 20) if s] + ["45,0,0,0.1"]), "a scan in one plane"),
    "two values": (csv([*ROWS, "60,75,180,0.2"]), "two values stand for the same direction"),
    "azimuth left out": (
        csv([f"0,{s},{v}" for s, v in ((0, 0.1), (40, 0.1), (40, 0.2), (80, 0.1))], "theta_i,theta_s,bsdf"),
        "two values stand for the same direction, 40 degrees",
    ),
    "a gap among loose directions": (
        csv([f"10,{s},{37 * s % 360},0.1" for s in range(1, 90, 11)] + ["10,45,0,0.1", "10,45,3,0.1"]),
        "gaps of 20 degrees",
    ),
    "unknown side": (csv(ROWS, header=("from: left",)), "'from' must be front or back, got 'left'"),
    "two tables of a kind": (csv(ROWS) + csv(ROWS), "given twice"),
    "other columns in the second table": (
        csv(ROWS) + csv([f"{row},0.1,0.1" for row in ROWS], "theta_i,theta_s,phi_s,r,g,b", ("to: transmission",)),
        "must have the same columns",
    ),
    "specular share above one": (csv(["0,specular,,1.5", *ROWS]), "at most 1, got 1.5"),
    "specular share left out": (csv(["0,specular,,0.1", *ROWS]), "not for 60 degrees"),
    "in percent": (csv(grid_rows(lambda i, s, p: "31.8")), "the table creates light"),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_told_in_one_sentence(tmp_path, damage):
    text, expected = DAMAGES[damage]
    told = complaint(text, tmp_path)
    assert expected in told
    assert is_one_sentence(told), told


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(Exception, match="there is no such file"):
        table_of("", tmp_path, file="other.csv")
