# SPDX-License-Identifier: LGPL-2.1-or-later
"""Dispersion formulas give the published indices, and refuse what no medium has."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError

from raymaps.materials import DispersionFormula, DispersionTable, Medium
from raymaps.materials.dispersion import FORMULAS, index_by_formula

#: Lines F, d and C in nm, by which n_d and the Abbe number V_d are defined; the sodium line D.
F_NM, D_NM, C_NM = 486.1327, 587.5618, 656.2725
SODIUM_NM = 589.3

N_BK7 = (1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653)


def n_and_v(formula: str, coefficients: tuple[float, ...]) -> tuple[float, float]:
    n_f, n_d, n_c = index_by_formula(formula, coefficients, [F_NM, D_NM, C_NM])
    return float(n_d), float((n_d - 1) / (n_f - n_c))


#: formula, coefficients, wavelength in nm, published index, tolerance; what and where published.
PUBLISHED = [
    # Schott data sheet of N-BK7: n at the lines t, C, d, F, h, i
    ("sellmeier", N_BK7, 1013.98, 1.50731, 1e-5),
    ("sellmeier", N_BK7, 656.2725, 1.51432, 1e-5),
    ("sellmeier", N_BK7, 587.5618, 1.51680, 1e-5),
    ("sellmeier", N_BK7, 486.1327, 1.52238, 1e-5),
    ("sellmeier", N_BK7, 404.6561, 1.53024, 1e-5),
    ("sellmeier", N_BK7, 365.0146, 1.53627, 1e-5),
    # Schott catalogue of 1980, BK7 by the old formula
    (
        "schott",
        (2.2718929, -1.0108077e-2, 1.0592509e-2, 2.0816965e-4, -7.6472538e-6, 4.9240991e-7),
        D_NM,
        1.51680,
        1e-5,
    ),
    # Ethanol by J. Rheims et al., Meas. Sci. Technol. 8 (1997) 601; n_D at 20 °C is 1.3614 in the CRC Handbook
    ("cauchy", (1.35265, 0.00306, 0.00002), SODIUM_NM, 1.3614, 3e-4),
    ("power_series", (1.35265, 0.00306, -2, 0.00002, -4), SODIUM_NM, 1.3614, 3e-4),
    # BASF5 as Laikin, Lens Design, gives it; n_d 1.60323, V_d 42.5
    ("conrady", (1.57410327, 0.0139786149, 0.00083004511), D_NM, 1.60323, 1e-5),
    # Silicon: D. F. Edwards and E. Ochoa, Appl. Opt. 19 (1980) 4130; measured by Salzberg and Villa (1957) as 3.4223
    ("herzberger", (3.41983, 0.159906, -0.123109, 1.26878e-6, -1.95104e-9), 5000, 3.4223, 5e-3),
    # ZnS: M. Debenham, Appl. Opt. 23 (1984) 2238, by C. A. Klein; data sheets of Cleartran give 2.3505 and 2.192
    ("sellmeier_powers", (8.393, 0.14383, 0, 0.2421**2, 4430.99, 0, 36.71**2), 632.8, 2.3505, 5e-4),
    ("sellmeier_powers", (8.393, 0.14383, 0, 0.2421**2, 4430.99, 0, 36.71**2), 10600, 2.192, 1e-3),
    # Rutile: J. R. DeVore, J. Opt. Soc. Am. 41 (1951) 416; the ordinary n_D is 2.616 in the CRC Handbook
    ("sellmeier_powers", (5.913, 0.2441, 0, 0.0803, 0, 0, 0), SODIUM_NM, 2.616, 5e-3),
    # PMMA: G. Beadie et al., Appl. Opt. 54 (2015) F139, against the table of Lytle, Handbook of Optics II, chapter 34
    (
        "power_series_squared",
        (2.1778, 6.1209e-3, 2, -1.5004e-3, 4, 2.3678e-2, -2, -4.2137e-3, -4, 7.3417e-4, -6, -4.5042e-5, -8),
        D_NM,
        1.4918,
        1e-3,
    ),
    # Silver bromide: H. Schröter, Z. Phys. 67 (1931) 24; n_D is 2.253 in the CRC Handbook
    ("lorentz_lorenz", (0.452505, 0.09939, 0.070537, -0.000150), SODIUM_NM, 2.253, 6e-3),
    # Air at 0 °C has n_D 1.000292 (Kaye and Laby); at 15 °C by the law of gases 1.000277
    ("gases", (0, 0.05792105, 238.0185, 0.00167917, 57.362), SODIUM_NM, 1 + 2.92e-4 * 273.15 / 288.15, 1e-6),
    # Urea: M. J. Rosker et al., IEEE J. Quantum Electron. 21 (1985) 1600; n_o and n_e at 1064 nm by its equations
    ("damped", (2.1823, 0.0125, 0.0300, 0, 0, 0.5), 1064, math.sqrt(2.1823 + 0.0125 / (1.132096 - 0.03)), 1e-9),
    (
        "damped",
        (2.51527, 0.0240, 0.0300, 0.020, 1.52, 0.8771),
        1064,
        math.sqrt(2.51527 + 0.024 / (1.132096 - 0.03) + 0.02 * -0.456 / (0.207936 + 0.8771)),
        1e-9,
    ),
]


@pytest.mark.parametrize(("formula", "coefficients", "wavelength_nm", "index", "tolerance"), PUBLISHED)
def test_a_formula_gives_the_published_index(formula, coefficients, wavelength_nm, index, tolerance):
    assert float(index_by_formula(formula, coefficients, wavelength_nm)) == pytest.approx(index, abs=tolerance)


def test_every_formula_is_compared_with_something_published():
    assert {row[0] for row in PUBLISHED} == set(FORMULAS)


@pytest.mark.parametrize(
    ("formula", "coefficients"),
    [("sellmeier", N_BK7), ("schott", PUBLISHED[6][1])],
)
def test_abbe_number_of_bk7(formula, coefficients):
    """Schott: n_d 1.51680, V_d 64.17."""
    n_d, v_d = n_and_v(formula, coefficients)
    assert n_d == pytest.approx(1.51680, abs=5e-6)
    assert v_d == pytest.approx(64.17, abs=0.01)


def test_forms_that_can_express_the_same_agree():
    """A constant is a resonance at 0; even powers are a series of powers."""
    wavelength_nm = np.linspace(350, 1000, 27)
    a, *rest = (2.2718929, -1.0108077e-2, 1.0592509e-2, 2.0816965e-4)
    schott = index_by_formula("schott", (a, *rest), wavelength_nm)
    series = index_by_formula("power_series_squared", (a, rest[0], 2, rest[1], -2, rest[2], -4), wavelength_nm)
    powers = index_by_formula(
        "sellmeier_powers", (a, 0, 0, 0, 0, 0, 0, rest[0], 2, rest[1], -2, rest[2], -4), wavelength_nm
    )
    np.testing.assert_allclose(series, schott, rtol=1e-14)
    np.testing.assert_allclose(powers, schott, rtol=1e-14)
    one = index_by_formula("sellmeier", (0.5, 0.0, 0.7, 0.01), wavelength_nm)
    two = index_by_formula("sellmeier_powers", (1.5, 0.7, 2, 0.01, 0, 0, 0), wavelength_nm)
    np.testing.assert_allclose(one, two, rtol=1e-14)


@pytest.mark.parametrize(
    ("formula", "coefficients"),
    [
        ("sellmeier", (1.0, 0.04, 0.5, 0.25, -0.3, 9.0)),
        ("sellmeier_powers", (2.0, 0.3, 2, 0.09, -0.2, 0, 16.0)),
        ("herzberger", (1.5, 0.1, 0.02)),
        ("gases", (0.0, 0.05, 20.0, 0.002, 4.0)),
        ("lorentz_lorenz", (0.3, 0.1, 0.3, 0.0)),
        ("damped", (2.0, 0.1, 0.16, 0.02, 1.5, -0.01)),
    ],
)
def test_poles_are_where_the_formula_blows_up(formula, coefficients):
    poles_nm = [1000 * pole for pole in FORMULAS[formula].poles(np.array(coefficients))]
    assert poles_nm
    for pole_nm in poles_nm:
        around = index_by_formula(formula, coefficients, [pole_nm * (1 - 1e-9), pole_nm * (1 + 1e-9)])
        if formula == "lorentz_lorenz":  # the ratio is infinite there, so n² is -2: no real index on either side
            assert np.isnan(around).all()
        else:
            assert np.nanmax(np.abs(around)) > 1e3


def fault(**data) -> str:
    with pytest.raises(ValidationError) as raised:
        DispersionFormula.model_validate(data)
    assert len(raised.value.errors()) == 1
    return raised.value.errors()[0]["msg"].removeprefix("Value error, ")


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        ({"formula": "cauchy", "coefficients": [-1.5]}, "gives the index -1.5 at 380 nm; it must be above 0"),
        ({"formula": "cauchy", "coefficients": [0.0]}, "gives the index 0 at 380 nm"),
        ({"formula": "cauchy", "coefficients": [1.5, 4000.0]}, "gives the index 27702.3 at 380 nm"),
        ({"formula": "cauchy", "coefficients": [1.5], "from_nm": 500, "to_nm": 400}, "from_nm must be below to_nm"),
        ({"formula": "cauchy", "coefficients": [1.5], "from_nm": 500, "to_nm": 500}, "from_nm must be below to_nm"),
        ({"formula": "cauchy", "coefficients": [1.5], "from_nm": 0.4, "to_nm": 780}, "greater than or equal to 10"),
        ({"formula": "schott", "coefficients": [-0.5, 1.0]}, "gives no real index at 380 nm"),
        ({"formula": "schott", "coefficients": [1.0, -2.0]}, "gives no real index at 707"),
        ({"formula": "sellmeier", "coefficients": [1.0, 0.25]}, "has a pole at 500 nm"),
        ({"formula": "sellmeier", "coefficients": [1e-9, 0.25]}, "has a pole at 500 nm"),
        ({"formula": "gases", "coefficients": [0, 1e-5, 4.0]}, "has a pole at 500 nm"),
        ({"formula": "herzberger", "coefficients": [1.5, 0.1, 0], "from_nm": 100, "to_nm": 900}, "pole at 167.332 nm"),
        ({"formula": "power_series", "coefficients": [1.0, 1e300, 300]}, "gives the index"),
        (
            {"formula": "sellmeyer", "coefficients": [1.0, 0.01]},
            "unknown formula 'sellmeyer'; known: sellmeier, schott",
        ),
        ({"formula": "sellmeier", "coefficients": [1.0]}, "takes 2, 4, 6"),
        ({"formula": "conrady", "coefficients": [1.5, 0.1]}, "takes 3 coefficients, got 2: n = n₀"),
        ({"formula": "cauchy", "coefficients": [float("nan")]}, "finite number"),
    ],
)
def test_what_no_medium_has_is_refused_in_one_sentence(data, sentence):
    told = fault(**data)
    assert sentence in told
    assert "\n" not in told


def test_a_pole_outside_the_range_that_is_given_does_not_matter():
    data = {"formula": "sellmeier", "coefficients": [1.0, 0.25], "from_nm": 520, "to_nm": 900}
    assert DispersionFormula.model_validate(data).range_nm == (520, 900)


def test_without_a_range_a_formula_holds_between_its_poles():
    """N-BK7's poles are at the square roots of 0.0200 and 103.56 µm²; near the second n² falls below 0 first."""
    low, high = DispersionFormula(formula="sellmeier", coefficients=N_BK7).range_nm
    assert low == pytest.approx(1000 * math.sqrt(0.0200179144), rel=2e-3)
    assert low > 1000 * math.sqrt(0.0200179144)
    assert 8000 < high < 1000 * math.sqrt(103.560653)
    assert (index_by_formula("sellmeier", N_BK7, np.geomspace(low, high, 999)) > 0).all()
    lower = DispersionFormula(formula="sellmeier", coefficients=N_BK7, to_nm=700)
    assert lower.range_nm == (low, 700)
    assert DispersionFormula(formula="sellmeier", coefficients=N_BK7, from_nm=900).range_nm[0] == 900
    assert DispersionFormula(formula="cauchy", coefficients=(1.5,)).range_nm == (10, 1e6)


def test_clamped_formula_holds_its_border_values():
    formula = DispersionFormula(formula="sellmeier", coefficients=N_BK7, from_nm=400, to_nm=700, outside="clamp")
    np.testing.assert_array_equal(formula.at([100, 400, 700, 9000]), formula.at([400, 400, 700, 700]))
    assert formula.at(400) > formula.at(700)
    assert formula.range_nm == (10, 1e6)


def test_coefficients_for_nanometres_are_noticed():
    """With resonances in nm² instead of µm² a glass would be thinner than vacuum."""
    wrong = tuple(c * 1e6 if i % 2 else c for i, c in enumerate(N_BK7))
    with pytest.raises(ValidationError, match="below that of vacuum; coefficients must be for wavelengths in µm"):
        Medium.model_validate({"refractive_index": {"formula": "sellmeier", "coefficients": wrong}})


def test_a_metal_may_have_an_index_below_that_of_vacuum():
    medium = Medium.model_validate(
        {"refractive_index": {"formula": "cauchy", "coefficients": [0.2]}, "extinction": 3.0}
    )
    assert medium.is_conductor


def test_a_table_is_refused_with_its_fault():
    for data, sentence in (
        ({"wavelength_nm": [500, 400], "n": [1.5, 1.6]}, "must climb"),
        ({"wavelength_nm": [0.5, 0.6], "n": [1.5, 1.6]}, "must be in nm"),
        ({"wavelength_nm": [500, 600], "n": [1.5]}, "2 wavelengths need as many values"),
        ({"wavelength_nm": [500, 600], "n": [1.5, 0.0]}, "greater than 0"),
        ({"wavelength_nm": [500, 600], "n": [1.5, math.inf]}, "finite"),
    ):
        with pytest.raises(ValidationError, match=sentence):
            DispersionTable.model_validate(data)
