# SPDX-License-Identifier: LGPL-2.1-or-later
"""Klems XML files of BSDFs: bases, order and azimuths of patches, and damaged files, refused in one sentence."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from raymaps.effects.bsdf import bsdf_per_sr, shares
from raymaps.formats.klems import KLEMS_BASES
from raymaps.materials.bsdf_directions import BsdfCells
from tests.bsdf_texts import complaint, is_one_sentence, klems, klems_matrix, klems_of, table_of

QUARTER = "LBNL/Klems Quarter"


@pytest.mark.parametrize(("basis", "patches"), [("LBNL/Klems Full", 145), ("LBNL/Klems Half", 73), (QUARTER, 41)])
def test_bases_cover_the_hemisphere(tmp_path, basis, patches):
    """145, 73 and 41 patches (J. Klems: ASHRAE Transactions 100 (1994)); their projected solid angles add up to pi."""
    text = klems({"Reflection Front": klems_matrix(basis, 0.25)}, basis)
    table = table_of(text, tmp_path)
    cells = table.lobes[0].outgoing[0]
    assert len(cells) == patches
    assert cells.projected_sr.sum() == pytest.approx(math.pi, rel=1e-12)
    for polar, azimuth in ((0, 0), (40, 10), (85, 300)):
        assert shares(table, "front", (polar, azimuth))["diffuse reflection"] == pytest.approx(0.25 * math.pi, rel=1e-9)
    assert table.reference == "small blind"


def test_projected_solid_angles_are_integrals_of_the_cosine():
    """Of the first patch of each ring of the full basis, by quadrature over its solid angle."""
    basis = KLEMS_BASES["LBNL/Klems Full"]
    cells = BsdfCells.model_validate(basis.cells)
    first = np.cumsum([0, *basis.patches[:-1]])
    for low, high, n, index in zip(basis.ring_deg, basis.ring_deg[1:], basis.patches, first, strict=False):
        integral = quad(lambda t: math.cos(t) * math.sin(t), math.radians(low), math.radians(high))[0]
        assert cells.projected_sr[index] == pytest.approx(integral * 2 * math.pi / n, rel=1e-9)


def test_the_diagonal_goes_straight_on_and_is_reflected_specularly(tmp_path):
    """An incoming patch's light keeps its patch: azimuths are those in which light travels, in both hemispheres."""
    basis = KLEMS_BASES[QUARTER]
    projected = BsdfCells.model_validate(basis.cells).projected_sr
    straight = klems_matrix(QUARTER, 0.0, 0.5 / projected)
    table = table_of(klems({"Transmission Front": straight, "Reflection Front": straight}), tmp_path)
    for polar in (0, 18, 40, 70):
        for azimuth in (0, 50, 110, 185, 293):
            for way in ("reflection", "transmission"):
                assert bsdf_per_sr(table, "front", way, (polar, azimuth), (polar, azimuth)) > 0.1
                if polar:
                    assert bsdf_per_sr(table, "front", way, (polar, azimuth), (polar, azimuth + 180)) == 0
    assert shares(table, "front", (40, 50))["diffuse transmission"] == pytest.approx(0.5)


@pytest.mark.parametrize("structure", ["Columns", "Rows"])
def test_columns_are_incoming_unless_rows_are(tmp_path, structure):
    """Light of incoming patch 0 (along the normal) goes to outgoing patch 9, the first of the third ring."""
    matrix = klems_matrix(QUARTER)
    matrix[9, 0] = 0.3
    text = klems({"Transmission Front": matrix if structure == "Columns" else matrix.T}, structure=structure)
    table = table_of(text, tmp_path)
    assert bsdf_per_sr(table, "front", "transmission", (0, 0), (30, 0)) == pytest.approx(0.3)
    assert bsdf_per_sr(table, "front", "transmission", (30, 0), (0, 0)) == 0
    assert shares(table, "front", (30, 0))["diffuse transmission"] == 0


def test_patches_follow_counter_clockwise_as_seen_from_the_back(tmp_path):
    """The second of 8 patches is at +45 degrees from the back, so at -45 degrees from the front."""
    matrix = klems_matrix(QUARTER)
    matrix[2, 0] = 0.3
    table = table_of(klems({"Transmission Front": matrix}), tmp_path)
    assert bsdf_per_sr(table, "front", "transmission", (0, 0), (18, -45)) == pytest.approx(0.3)
    assert bsdf_per_sr(table, "front", "transmission", (0, 0), (18, 45)) == 0


def test_all_four_directions_and_spectra(tmp_path):
    names = ("Transmission Front", "Transmission Back", "Reflection Front", "Reflection Back")
    visible = {name: klems_matrix(QUARTER, 0.01 * (k + 1)) for k, name in enumerate(names)}
    solar = {name: klems_matrix(QUARTER, 0.02 * (k + 1)) for k, name in enumerate(names)}
    text = klems_of(
        [
            ('<Wavelength unit="Integral">Solar</Wavelength>', solar),
            ('<Wavelength unit="Integral">Visible</Wavelength>', visible),
        ]
    )
    for spectrum, unit in (("visible", 0.01), ("solar", 0.02)):
        table = table_of(text, tmp_path, spectrum=spectrum)
        assert table.wavelength_nm is None
        for k, (side, way) in enumerate(
            (("front", "transmission"), ("back", "transmission"), ("front", "reflection"), ("back", "reflection"))
        ):
            assert bsdf_per_sr(table, side, way, (40, 20), (10, 90)) == pytest.approx(unit * (k + 1))


def test_single_wavelengths(tmp_path):
    spectra = [
        (f'<Wavelength unit="{unit}">{value}</Wavelength>', {"Reflection Front": klems_matrix(QUARTER, bsdf)})
        for unit, value, bsdf in (("Micrometer", "0.65", 0.2), ("Nanometer", "450", 0.1))
    ]
    table = table_of(klems_of(spectra), tmp_path)
    assert table.wavelength_nm == (450, 650)
    assert [layer[0][0] for layer in table.lobes[0].value] == [0.1, 0.2]


def test_a_file_may_describe_its_own_basis(tmp_path):
    blocks = "".join(
        f"<AngleBasisBlock><Theta>{(low + high) / 2}</Theta><nPhis>{n}</nPhis><ThetaBounds>"
        f"<LowerTheta>{low}</LowerTheta><UpperTheta>{high}</UpperTheta></ThetaBounds></AngleBasisBlock>"
        for low, high, n in ((0, 30, 1), (30, 90, 4))
    )
    definition = f"<AngleBasis><AngleBasisName>mine</AngleBasisName>{blocks}</AngleBasis>"
    matrix = np.full((5, 5), 0.2)
    table = table_of(klems({"Reflection Front": matrix}, "mine", definition=definition), tmp_path)
    assert table.lobes[0].outgoing[0].ring_deg == (0, 30, 90)
    assert shares(table, "front", (60, 20))["diffuse reflection"] == pytest.approx(0.2 * math.pi)


GOOD = klems({"Transmission Front": klems_matrix(QUARTER, 0.1)})
OWN = "<AngleBasis><AngleBasisName>mine</AngleBasisName>{}</AngleBasis>"
RING = (
    "<AngleBasisBlock><nPhis>{}</nPhis><ThetaBounds><LowerTheta>{}</LowerTheta><UpperTheta>{}</UpperTheta></ThetaBounds>"
    "</AngleBasisBlock>"
)
ONE = {"Reflection Front": np.full((1, 1), 0.1)}
DAMAGES = {
    "cut short": (GOOD[: len(GOOD) // 2], "it may be cut short"),
    "another XML": ("<html><body>Not found</body></html>", "the root element must be WindowElement, got 'html'"),
    "entities": ('<!DOCTYPE x [<!ENTITY a "aaaa">]>' + GOOD.partition("?>")[2], "document type declarations"),
    "numbers are missing": (GOOD.replace("0.1,", "", 5), "must hold 41 x 41 = 1681 numbers, got 1676"),
    "of another basis": (GOOD.replace("LBNL/Klems Quarter", "LBNL/Klems Half"), "73 x 73 = 5329 numbers, got 1681"),
    "unknown basis": (GOOD.replace("LBNL/Klems Quarter", "my basis"), "'my basis' is unknown"),
    "basis of a block not described": (
        GOOD.replace("<RowAngleBasis>LBNL/Klems Quarter", "<RowAngleBasis>mine"),
        "RowAngleBasis 'mine' is not described",
    ),
    "tensor tree": (GOOD.replace("Columns", "TensorTree4"), "tensor trees (TensorTree4) can't be read"),
    "unknown structure": (GOOD.replace("Columns", "Diagonals"), "must be Columns or Rows"),
    "no structure": (GOOD.replace("IncidentDataStructure", "Something"), "IncidentDataStructure is missing"),
    "unknown direction": (GOOD.replace("Transmission Front", "Emission Front"), "'Emission Front' is unknown"),
    "negative": (GOOD.replace("0.1,", "-0.1,", 1), "must be 0 or more, got -0.1 as number 1"),
    "not finite": (GOOD.replace("0.1,", "nan,", 1), "number 1 of ScatteringData is not finite"),
    "words": (GOOD.replace("0.1,", "bright,", 1), "'bright' in ScatteringData is not a number"),
    "no spectrum of that name": (GOOD.replace("Visible", "NIR"), "no data for the visible spectrum, but for: NIR"),
    "wavelength without unit": (GOOD.replace('unit="Integral">Visible', ">0.55"), "Nanometer or Micrometer"),
    "nothing measured": (GOOD.replace("WavelengthData", "Other"), "but for: nothing"),
    "twice": (
        GOOD.replace("</Layer>", GOOD[GOOD.index("<WavelengthData>") : GOOD.index("</Layer>")] + "</Layer>"),
        "Transmission Front is given twice",
    ),
    "not light but reflectance": (GOOD.replace("BTDF", "Emissivity"), "must be BTDF or BRDF"),
    "creates light": (
        klems({"Transmission Front": klems_matrix(QUARTER, 0.2), "Reflection Front": klems_matrix(QUARTER, 0.2)}),
        "1.256637 times as much goes on (0.628319 transmission + 0.628319 reflection)",
    ),
    "rings with a gap": (
        klems(ONE, "mine", definition=OWN.format(RING.format(1, 0, 30) + RING.format(4, 40, 90))), "without gaps",
    ),
    "rings that end early": (klems(ONE, "mine", definition=OWN.format(RING.format(1, 0, 80))), "must reach 90 degrees"),
    "half a patch": (
        klems(ONE, "mine", definition=OWN.format(RING.format(0.5, 0, 90))), "nPhis must be a whole number",
    ),
    "binary": (b"<\x00\x01", "not a text file"),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_told_in_one_sentence(tmp_path, damage):
    text, expected = DAMAGES[damage]
    told = complaint(text, tmp_path)
    assert expected in told
    assert is_one_sentence(told), told
