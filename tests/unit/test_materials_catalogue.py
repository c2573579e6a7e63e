# SPDX-License-Identifier: LGPL-2.1-or-later
"""The catalogue of media: all of it is valid, names its source, and agrees with figures published elsewhere."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from raymaps.errors import SceneError
from raymaps.materials import Medium
from raymaps.materials.catalogue import CATALOGUE_FOLDER, catalogue, catalogue_medium
from raymaps.scene import scene_from_dict

F_NM, D_NM, C_NM = 486.1327, 587.5618, 656.2725
SODIUM_NM = 589.3


@pytest.fixture(scope="module")
def media() -> dict[str, Medium]:
    return {name: Medium.model_validate(data) for name, data in catalogue().items()}


def test_no_name_stands_in_two_files():
    names = [
        name
        for file in CATALOGUE_FOLDER.glob("*.json")
        for name in json.loads(file.read_text(encoding="utf-8"))["media"]
    ]
    assert len(names) == len(set(names)) == len(catalogue()) > 40


def test_every_medium_names_where_its_figures_come_from(media):
    for name, medium in media.items():
        assert medium.reference is not None
        assert len(medium.reference) > 30, name
        assert re.search(r"\b(19|20)\d\d\b", medium.reference) or "Zemax catalogue" in medium.reference, name


#: Known only where they are measured: outside of it a scene is told so.
NARROWER = {"ZnSe": 540, "Zeonex E48R": 400, "diamond": 226, "germanium (infrared)": 2000, "silicon (infrared)": 1357}


def test_media_hold_over_the_visible(media):
    for name, medium in media.items():
        low, high = medium.refractive_index.range_nm
        if name in NARROWER:
            assert low == NARROWER[name], name
            continue
        for table in (medium.refractive_index, medium.absorption_per_mm, medium.extinction):
            if not isinstance(table, tuple):
                low, high = table.range_nm
                assert low <= 380, name
                assert high >= 780, name


#: n_d and V_d as Schott's data sheets give them.
GLASSES = {
    "N-FK51A": (1.48656, 84.47),
    "N-K5": (1.52249, 59.48),
    "N-BK7": (1.51680, 64.17),
    "N-BAK4": (1.56883, 55.98),
    "N-SK16": (1.62041, 60.32),
    "N-SSK5": (1.65844, 50.88),
    "N-KZFS4": (1.61336, 44.49),
    "N-BAF10": (1.67003, 47.11),
    "N-LAK8": (1.71300, 53.83),
    "N-LAK22": (1.65113, 55.89),
    "N-LASF44": (1.80420, 46.50),
    "N-LASF9": (1.85025, 32.17),
    "LF5": (1.58144, 40.85),
    "F2": (1.62004, 36.37),
    "N-F2": (1.62005, 36.43),
    "N-SF5": (1.67271, 32.25),
    "N-SF1": (1.71736, 29.62),
    "N-SF10": (1.72828, 28.53),
    "N-SF11": (1.78472, 25.68),
    "N-SF6": (1.80518, 25.36),
    "N-SF57": (1.84666, 23.78),
}


@pytest.mark.parametrize("name", GLASSES)
def test_glasses_have_the_n_d_and_v_d_of_their_maker(media, name):
    n_f, n_d, n_c = media[name].index_at([F_NM, D_NM, C_NM])
    assert n_d == pytest.approx(GLASSES[name][0], abs=6e-6)
    assert (n_d - 1) / (n_f - n_c) == pytest.approx(GLASSES[name][1], abs=6e-3)


#: Internal transmittance of 10 mm by Schott's data sheets, to three digits.
TRANSMITTANCE = [
    ("N-BK7", 400, 0.997), ("N-BK7", 546, 0.998), ("N-BK7", 365, 0.988), ("N-BK7", 320, 0.770), ("N-BK7", 300, 0.302),
    ("N-SF11", 400, 0.815), ("N-SF11", 436, 0.946), ("N-SF6", 400, 0.821), ("F2", 365, 0.967), ("N-LAK22", 400, 0.985),
]  # fmt: skip


@pytest.mark.parametrize(("name", "wavelength_nm", "transmittance"), TRANSMITTANCE)
def test_glasses_have_the_internal_transmittance_of_their_maker(media, name, wavelength_nm, transmittance):
    per_mm = float(media[name].absorption_per_mm.at(wavelength_nm))
    assert np.exp(-10 * per_mm) == pytest.approx(transmittance, abs=2e-3)


#: medium, wavelength in nm, index, tolerance; where it is published.
INDICES = [
    # I. H. Malitson, J. Opt. Soc. Am. 55 (1965) 1205, table of measured indices
    ("fused silica", 404.656, 1.46962, 2e-5), ("fused silica", 546.074, 1.46008, 2e-5),
    ("fused silica", 587.561, 1.45846, 2e-5), ("fused silica", 1013.98, 1.45024, 2e-5),
    # Schott, data sheet of Lithotec CaF2: n_d 1.43385
    ("CaF2", D_NM, 1.43385, 2e-5),
    # CRC Handbook of Chemistry and Physics, indices of crystals at 589 nm
    ("LiF", SODIUM_NM, 1.3921, 2e-4), ("BaF2", SODIUM_NM, 1.4744, 3e-4), ("MgF2", SODIUM_NM, 1.3777, 3e-4),
    ("sapphire", SODIUM_NM, 1.768, 5e-4), ("diamond", SODIUM_NM, 2.4173, 1e-3),
    # Data sheets of II-VI and of Crystran: ZnSe at the lines of He-Ne and CO2 lasers
    ("ZnSe", 632.8, 2.5907, 2e-3), ("ZnSe", 10600, 2.4028, 1e-4),
    # C. D. Salzberg and J. J. Villa, J. Opt. Soc. Am. 47 (1957) 244, measured
    ("silicon (infrared)", 1357.0, 3.4975, 2e-3), ("silicon (infrared)", 2437.3, 3.4408, 5e-4),
    ("silicon (infrared)", 5000, 3.4223, 5e-4), ("silicon (infrared)", 10000, 3.4179, 1e-3),
    # The same paper for germanium at 27 °C: 4.0571 at 2.998 µm; Icenogle et al. (1976) 4.0034 at 9.99 µm
    ("germanium (infrared)", 9990, 4.0034, 2e-3),
    # J. D. Lytle, Handbook of Optics II, chapter 34, table of polymers
    ("PMMA", 365.0, 1.5136, 1e-4), ("PMMA", 404.7, 1.5066, 1e-4), ("PMMA", 486.1, 1.4978, 1e-4),
    ("PMMA", 587.6, 1.4918, 1e-4), ("PMMA", 656.3, 1.4892, 1e-4), ("PMMA", 1014.0, 1.4831, 1e-4),
    ("polycarbonate", 404.7, 1.6224, 1e-4), ("polycarbonate", 587.6, 1.5855, 1e-4),
    ("polycarbonate", 1014.0, 1.5672, 1e-4), ("polystyrene", 404.7, 1.6253, 1e-4),
    ("polystyrene", 587.6, 1.5905, 1e-4), ("polystyrene", 1014.0, 1.5726, 1e-4),
    # N. Sultanova et al., Acta Phys. Pol. A 116 (2009) 585, measured to 0.001 on other makes
    ("PMMA", 486.1, 1.497, 3e-3), ("PMMA", 587.6, 1.491, 3e-3), ("PMMA", 833, 1.484, 3e-3),
    ("polycarbonate", 486.1, 1.599, 3e-3), ("polycarbonate", 587.6, 1.585, 3e-3), ("polycarbonate", 833, 1.569, 3e-3),
    ("polystyrene", 486.1, 1.606, 3e-3), ("polystyrene", 587.6, 1.592, 3e-3), ("polystyrene", 833, 1.577, 3e-3),
    ("SAN", 486.1, 1.578, 3e-3), ("SAN", 587.6, 1.567, 3e-3), ("SAN", 833, 1.554, 3e-3),
    # Zeon Corporation, data sheet of Zeonex
    ("Zeonex E48R", D_NM, 1.531, 5e-4),
    # CRC Handbook: water at 20 °C 1.33299 relative to air, so 1.33335 to vacuum; ethanol 1.3611
    ("water", SODIUM_NM, 1.33299 * 1.000272, 3e-5), ("ethanol", SODIUM_NM, 1.3611, 1e-3),
    # Kaye and Laby: air at 0 °C 1.000292, at 15 °C by the law of gases 1.000277
    ("air", SODIUM_NM, 1 + 2.92e-4 * 273.15 / 288.15, 1e-6),
    # Window glass: n_D of soda-lime glass by the CRC Handbook 1.51 to 1.52
    ("soda-lime glass", SODIUM_NM, 1.52, 5e-3),
]  # fmt: skip


@pytest.mark.parametrize(("name", "wavelength_nm", "index", "tolerance"), INDICES)
def test_indices_agree_with_those_published(media, name, wavelength_nm, index, tolerance):
    assert float(media[name].index_at(wavelength_nm)) == pytest.approx(index, abs=tolerance)


#: V_d as published with the sources above.
ABBE = [
    ("fused silica", 67.8, 0.1), ("CaF2", 95.1, 0.3), ("LiF", 97.3, 0.3), ("BaF2", 81.6, 0.3), ("sapphire", 72.2, 0.3),
    ("PMMA", 57.4, 0.5), ("polycarbonate", 29.9, 0.8), ("polystyrene", 30.8, 0.5), ("SAN", 35.4, 0.8),
    ("Zeonex E48R", 56.0, 0.2), ("water", 55.8, 0.3),
]  # fmt: skip


@pytest.mark.parametrize(("name", "v_d", "tolerance"), ABBE)
def test_abbe_numbers_agree_with_those_published(media, name, v_d, tolerance):
    n_f, n_d, n_c = media[name].index_at([F_NM, D_NM, C_NM])
    assert (n_d - 1) / (n_f - n_c) == pytest.approx(v_d, abs=tolerance)


#: Normal reflectance of evaporated mirrors, G. Hass in the American Institute of Physics Handbook (1972), section 6; of
#: chromium and nickel by A. D. Rakić et al., Appl. Opt. 37 (1998) 5271; of silicon by D. E. Aspnes and A. A. Studna,
#: Phys. Rev. B 27 (1983) 985.
REFLECTANCE = [
    ("aluminium", 450, 0.922, 0.01), ("aluminium", 550, 0.915, 0.01), ("aluminium", 650, 0.905, 0.01),
    ("silver", 450, 0.971, 0.015), ("silver", 550, 0.983, 0.01), ("silver", 650, 0.988, 0.01),
    ("gold", 450, 0.387, 0.03), ("gold", 550, 0.815, 0.03), ("gold", 650, 0.955, 0.01), ("gold", 700, 0.970, 0.01),
    ("copper", 450, 0.552, 0.03), ("copper", 500, 0.600, 0.03), ("copper", 650, 0.966, 0.035),
    ("chromium", 632.8, 0.640, 0.1), ("nickel", 550, 0.610, 0.05), ("nickel", 632.8, 0.644, 0.06),
    ("silicon", 550, 0.368, 0.005), ("silicon", 632.8, 0.3486, 0.005),
]  # fmt: skip


@pytest.mark.parametrize(("name", "wavelength_nm", "reflectance", "tolerance"), REFLECTANCE)
def test_metals_reflect_as_published(media, name, wavelength_nm, reflectance, tolerance):
    medium = media[name]
    assert medium.is_conductor
    n, k = float(medium.index_at(wavelength_nm)), float(medium.extinction.at(wavelength_nm))
    assert ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2) == pytest.approx(reflectance, abs=tolerance)


def test_water_absorbs_as_published(media):
    """R. M. Pope and E. S. Fry, Appl. Opt. 36 (1997) 8710: 0.2224 1/m at 600 nm, 0.624 at 700 nm; 0.0204 at 500 nm."""
    for wavelength_nm, per_m, tolerance in ((500, 0.0204, 0.25), (600, 0.2224, 0.05), (700, 0.624, 0.05)):
        assert 1000 * float(media["water"].absorption_per_mm.at(wavelength_nm)) == pytest.approx(per_m, rel=tolerance)


def test_only_metals_and_silicon_are_conductors(media):
    conductors = {name for name, medium in media.items() if medium.is_conductor}
    assert conductors == {"aluminium", "silver", "gold", "copper", "chromium", "nickel", "silicon"}


def test_every_medium_is_compared_with_something_published(media):
    compared = {*GLASSES, *(row[0] for row in INDICES), *(row[0] for row in REFLECTANCE)}
    assert compared == set(media)


def scene(medium: dict) -> dict:
    return {
        "format": "raymaps-scene",
        "version": 1,
        "media": {"lens": medium},
        "sources": {"lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 0]}},
    }


def test_a_scene_takes_a_medium_by_name_and_holds_all_of_it():
    loaded = scene_from_dict(scene({"catalogue": "N-BK7"}))
    assert loaded.media["lens"] == Medium.model_validate(catalogue_medium("N-BK7"))
    written = json.loads(loaded.model_dump_json())
    assert written["media"]["lens"]["refractive_index"]["coefficients"][0] == 1.03961212
    assert scene_from_dict(written) == loaded


def test_a_scene_may_clamp_what_the_catalogue_says_nothing_of():
    lens = scene_from_dict(scene({"catalogue": "N-BK7", "outside": "clamp"})).media["lens"]
    assert lens.refractive_index.range_nm == lens.absorption_per_mm.range_nm == (10, 1e6)
    assert float(lens.index_at(5000)) == float(lens.index_at(2500))
    assert scene_from_dict(scene({"catalogue": "N-BK7"})).media["lens"].refractive_index.range_nm == (300, 2500)


@pytest.mark.parametrize(
    ("medium", "sentence"),
    [
        ({"catalogue": "nbk7"}, "media 'lens': unknown medium of the catalogue 'nbk7'; known: 'N-BK7', "),
        ({"catalogue": ""}, "media 'lens', catalogue: string should have at least 1 character"),
        ({"catalogue": 7}, "media 'lens', catalogue: must be a valid string"),
        ({"catalogue": "gold", "colour": "red"}, "media 'lens', colour: there is no such field"),
        ({"catalogue": "gold", "outside": "guess"}, "media 'lens', outside: must be 'refuse' or 'clamp'"),
    ],
)
def test_a_wrong_reference_is_told(medium, sentence):
    with pytest.raises(SceneError) as raised:
        scene_from_dict(scene(medium))
    assert sentence in str(raised.value)


def test_one_index_for_all_wavelengths_is_one_that_the_data_give(media):
    """The formula of germanium gives 5.3 at the d line, far from where it was measured."""
    assert media["N-BK7"].index_at_d_line == pytest.approx(1.51680, abs=6e-6)
    assert media["germanium (infrared)"].index_at_d_line == float(media["germanium (infrared)"].index_at(2000))
    assert Medium(refractive_index=1.5).index_at_d_line == 1.5


def test_the_catalogue_can_not_be_changed_by_who_reads_it():
    first = catalogue_medium("N-BK7")
    first["refractive_index"]["coefficients"][0] = 0
    assert catalogue_medium("N-BK7")["refractive_index"]["coefficients"][0] == 1.03961212
