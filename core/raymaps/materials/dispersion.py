# SPDX-License-Identifier: LGPL-2.1-or-later
"""Refractive index over wavelength: the formulas of glass makers and data bases.

Wavelengths in the formulas are in µm, in air or vacuum as the source of the coefficients says; coefficients stand in
the order of the equations. Together the formulas express all nine of refractiveindex.info and all thirteen of Zemax
glass catalogues; the readers in `raymaps.formats` convert the coefficients where ours are of another form.

References
----------
M. N. Polyanskiy, Refractiveindex.info database of optical constants, Scientific Data 11 (2024) 94, with the sheet
"Dispersion formulas" of the database: cited as RII. Zemax Optical Design Program, User's Manual (2011), chapter "Using
glass catalogs": cited as Zemax.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "FORMULAS",
    "LARGEST_INDEX",
    "VISIBLE_NM",
    "Formula",
    "fault_of_formula",
    "index_by_formula",
    "physical_range",
]

Float = NDArray[np.float64]

#: Where a formula is checked that does not say where it holds.
VISIBLE_NM = (380.0, 780.0)

#: No medium bends light more at any wavelength that a scene may speak of; more means wrong coefficients.
LARGEST_INDEX = 100.0


@dataclass(frozen=True)
class Formula:
    """A dispersion formula.

    Attributes
    ----------
    equation : str
        For people.
    counts : range
        The numbers of coefficients that it takes.
    index : function of wavelengths in µm, any shape, and (n_coefficients,) coefficients to refractive indices
        NaN or infinite where the formula gives none.
    poles : function of (n_coefficients,) coefficients to a list of wavelengths in µm
        Where the formula goes to infinity.
    source : str
    """

    equation: str
    counts: range
    index: Callable[[Float, Float], Float]
    poles: Callable[[Float], list[float]]
    source: str


def _powers(w: Float, first: float, pairs: Float) -> Float:
    """First + Σ c λ^e of pairs c e c e ..."""
    total = np.full_like(w, first)
    for factor, exponent in zip(pairs[0::2], pairs[1::2], strict=True):
        total += factor * w**exponent
    return total


def _resonances(w: Float, strengths: Float, exponents: Float, places: Float) -> Float:
    """Σ s λ^e / (λ² − p)."""
    total = np.zeros_like(w)
    for strength, exponent, place in zip(strengths, exponents, places, strict=True):
        if strength != 0:
            total += strength * w**exponent / (w**2 - place)
    return total


def _roots(places: Float, strengths: Float) -> list[float]:
    """Wavelengths of the poles of s / (λ² − p)."""
    return [math.sqrt(p) for p, s in zip(places, strengths, strict=True) if p > 0 and s != 0]


def _no_poles(c: Float) -> list[float]:
    return []


def _sellmeier(w: Float, c: Float) -> Float:
    return np.sqrt(1 + _resonances(w, c[0::2], np.full(len(c) // 2, 2.0), c[1::2]))


def _sellmeier_powers(w: Float, c: Float) -> Float:
    return np.sqrt(_powers(w, c[0], c[7:]) + _resonances(w, c[1:7:3], c[2:7:3], c[3:7:3]))


def _schott(w: Float, c: Float) -> Float:
    return np.sqrt(c[0] + c[1] * w**2 + sum((a * w ** (-2.0 * i) for i, a in enumerate(c[2:], 1)), np.zeros_like(w)))


def _cauchy(w: Float, c: Float) -> Float:
    return sum((a * w ** (-2.0 * i) for i, a in enumerate(c)), np.zeros_like(w))


def _conrady(w: Float, c: Float) -> Float:
    return c[0] + c[1] / w + c[2] / w**3.5


def _herzberger(w: Float, c: Float) -> Float:
    pole = 1 / (w**2 - 0.028)
    return sum((a * w ** (2.0 * i) for i, a in enumerate(c[3:], 1)), c[0] + c[1] * pole + c[2] * pole**2)


def _gases(w: Float, c: Float) -> Float:
    return sum((b / (d - w**-2.0) for b, d in zip(c[1::2], c[2::2], strict=True) if b != 0), np.full_like(w, 1 + c[0]))


def _lorentz_lorenz(w: Float, c: Float) -> Float:
    ratio = c[0] + _resonances(w, c[1:2], np.array([2.0]), c[2:3]) + c[3] * w**2
    return np.sqrt((1 + 2 * ratio) / (1 - ratio))


def _damped(w: Float, c: Float) -> Float:
    sharp = _resonances(w, c[1:2], np.array([0.0]), c[2:3])
    return np.sqrt(c[0] + sharp + c[3] * (w - c[4]) / ((w - c[4]) ** 2 + c[5]))


def _poles_of_gases(c: Float) -> list[float]:
    return [1 / root for root in _roots(c[2::2], c[1::2])]


def _poles_of_damped(c: Float) -> list[float]:
    shift = [math.sqrt(-c[5])] if c[3] != 0 and c[5] <= 0 else []
    return _roots(c[2:3], c[1:2]) + [c[4] + sign * s for s in shift for sign in (-1, 1)]


FORMULAS: dict[str, Formula] = {
    "sellmeier": Formula(
        "n² = 1 + Σ Bᵢ λ² / (λ² − Cᵢ), coefficients B₁ C₁ B₂ C₂ ... in µm²",
        range(2, 21, 2),
        _sellmeier,
        lambda c: _roots(c[1::2], c[0::2]),
        "W. Sellmeier, Ann. Phys. 219 (1871) 272; Schott TIE-29, eq. 1",
    ),
    "schott": Formula(
        "n² = a₀ + a₁λ² + a₂λ⁻² + a₃λ⁻⁴ + a₄λ⁻⁶ + a₅λ⁻⁸ ...",
        range(2, 9),
        _schott,
        _no_poles,
        "Schott glass catalogue up to 1992; Zemax, formulas 1 and 10",
    ),
    "cauchy": Formula(
        "n = A + B λ⁻² + C λ⁻⁴ + ...",
        range(1, 9),
        _cauchy,
        _no_poles,
        "A.-L. Cauchy, Bull. sci. math. 14 (1830) 6",
    ),
    "conrady": Formula(
        "n = n₀ + A/λ + B/λ^3.5",
        range(3, 4),
        _conrady,
        _no_poles,
        "A. E. Conrady, Applied Optics and Optical Design II (1960); Zemax, formula 5",
    ),
    "herzberger": Formula(
        "n = A + B L + C L² + D λ² + E λ⁴ + F λ⁶, L = 1 / (λ² − 0.028)",
        range(3, 7),
        _herzberger,
        lambda c: [math.sqrt(0.028)] if c[1:3].any() else [],
        "M. Herzberger and C. D. Salzberg, J. Opt. Soc. Am. 52 (1962) 420; RII, formula 7; Zemax, formula 3",
    ),
    "sellmeier_powers": Formula(
        "n² = c₀ + s₁ λ^e₁ / (λ² − p₁) + s₂ λ^e₂ / (λ² − p₂) + Σ cᵢ λ^eᵢ, coefficients c₀ s₁ e₁ p₁ s₂ e₂ p₂ c₁ e₁ ...",
        range(7, 16, 2),
        _sellmeier_powers,
        lambda c: _roots(c[3:7:3], c[1:7:3]),
        "RII, formula 4; Zemax, formulas 4, 7 and 8",
    ),
    "power_series": Formula(
        "n = c₀ + Σ cᵢ λ^eᵢ, coefficients c₀ c₁ e₁ c₂ e₂ ...",
        range(1, 20, 2),
        lambda w, c: _powers(w, c[0], c[1:]),
        _no_poles,
        "RII, formula 5",
    ),
    "power_series_squared": Formula(
        "n² = c₀ + Σ cᵢ λ^eᵢ, coefficients c₀ c₁ e₁ c₂ e₂ ...",
        range(1, 20, 2),
        lambda w, c: np.sqrt(_powers(w, c[0], c[1:])),
        _no_poles,
        "RII, formula 3; Zemax, formulas 12 and 13",
    ),
    "gases": Formula(
        "n = 1 + c₀ + Σ Bᵢ / (Cᵢ − λ⁻²), coefficients c₀ B₁ C₁ B₂ C₂ ... in µm⁻²",
        range(1, 18, 2),
        _gases,
        _poles_of_gases,
        "P. E. Ciddor, Appl. Opt. 35 (1996) 1566, eq. 1; RII, formula 6",
    ),
    "lorentz_lorenz": Formula(
        "(n² − 1) / (n² + 2) = c₀ + B λ² / (λ² − C) + D λ², coefficients c₀ B C D",
        range(4, 5),
        _lorentz_lorenz,
        lambda c: _roots(c[2:3], c[1:2]),
        "H. A. Lorentz, Ann. Phys. 245 (1880) 641; RII, formula 8",
    ),
    "damped": Formula(
        "n² = c₀ + B / (λ² − C) + D (λ − E) / ((λ − E)² + F), coefficients c₀ B C D E F",
        range(6, 7),
        _damped,
        _poles_of_damped,
        "RII, formula 9",
    ),
}


def index_by_formula(formula: str, coefficients: tuple[float, ...], wavelength_nm: ArrayLike) -> Float:
    """Refractive index at wavelengths, any shape; NaN or infinite where the formula gives none."""
    with np.errstate(all="ignore"):
        wavelength_um = np.asarray(wavelength_nm, np.float64) / 1000.0
        return np.asarray(FORMULAS[formula].index(wavelength_um, np.array(coefficients, np.float64)), np.float64)


def fault_of_formula(formula: str, coefficients: tuple[float, ...], from_nm: float, to_nm: float) -> str | None:
    """What is unphysical in a formula somewhere between two wavelengths, with the wavelength; None if nothing is."""
    poles = [pole for pole in _poles_nm(formula, coefficients) if from_nm <= pole <= to_nm]
    if poles:
        return f"the formula '{formula}' has a pole at {min(poles):.6g} nm, where the index would be infinite"
    wavelength_nm = np.geomspace(from_nm, to_nm, 2001)
    index = index_by_formula(formula, coefficients, wavelength_nm)
    faulty = np.flatnonzero(~_is_physical(index))
    if len(faulty) == 0:
        return None
    found, place = index[faulty[0]], f"at {wavelength_nm[faulty[0]]:.6g} nm"
    if np.isnan(found):
        return f"the formula '{formula}' gives no real index {place}"
    return (
        f"the formula '{formula}' gives the index {found:g} {place}; it must be above 0 and at most {LARGEST_INDEX:g}"
    )


def physical_range(
    formula: str, coefficients: tuple[float, ...], around_nm: tuple[float, float], limits_nm: tuple[float, float]
) -> tuple[float, float]:
    """The range in nm around a sound one, within limits, where a formula is physical; up to 0.1 % too narrow."""
    wavelength_nm = np.geomspace(*limits_nm, 20001)
    faulty = wavelength_nm[~_is_physical(index_by_formula(formula, coefficients, wavelength_nm))]
    faulty = np.concatenate([faulty, _poles_nm(formula, coefficients)])
    below, above = faulty[faulty < around_nm[0]], faulty[faulty > around_nm[1]]
    low = min(around_nm[0], float(below.max()) * 1.001) if len(below) else limits_nm[0]
    high = max(around_nm[1], float(above.min()) / 1.001) if len(above) else limits_nm[1]
    return low, high


def _poles_nm(formula: str, coefficients: tuple[float, ...]) -> list[float]:
    return [1000.0 * pole for pole in FORMULAS[formula].poles(np.array(coefficients, np.float64))]


def _is_physical(index: Float) -> NDArray[np.bool_]:
    return np.isfinite(index) & (index > 0) & (index <= LARGEST_INDEX)
