# SPDX-License-Identifier: LGPL-2.1-or-later
"""Refractive index over wavelength: the formulas of glass makers and data bases.

Wavelengths in the formulas are in µm and in air or vacuum as the data's source says; coefficients stand in the order of
the equations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["FORMULAS", "Formula"]

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Formula:
    """A dispersion formula.

    Attributes
    ----------
    equation : str
        For people.
    counts : tuple of (int, int)
        Smallest and largest number of coefficients, and the step between allowed numbers in ``step``.
    index : function of (wavelength_um, coefficients) to the refractive index
    source : str
    """

    equation: str
    counts: range
    index: Callable[[Float, Float], Float]
    source: str


def _sellmeier(w: Float, c: Float) -> Float:
    terms = sum(b * w**2 / (w**2 - d) for b, d in zip(c[0::2], c[1::2], strict=True))
    return np.sqrt(1 + terms)


def _schott(w: Float, c: Float) -> Float:
    return np.sqrt(c[0] + c[1] * w**2 + sum(a * w ** (-2.0 * (i + 1)) for i, a in enumerate(c[2:])))


def _cauchy(w: Float, c: Float) -> Float:
    return sum((a * w ** (-2.0 * i) for i, a in enumerate(c)), np.zeros_like(w))


def _conrady(w: Float, c: Float) -> Float:
    return c[0] + c[1] / w + c[2] / w**3.5


def _power_series(w: Float, c: Float) -> Float:
    return c[0] + sum((a * w**e for a, e in zip(c[1::2], c[2::2], strict=True)), np.zeros_like(w))


FORMULAS: dict[str, Formula] = {
    "sellmeier": Formula(
        "n² = 1 + Σ Bᵢ λ² / (λ² − Cᵢ), coefficients B₁ C₁ B₂ C₂ ...",
        range(2, 21, 2),
        _sellmeier,
        "W. Sellmeier, Ann. Phys. 219 (1871) 272; Schott TIE-29, eq. 1",
    ),
    "schott": Formula(
        "n² = a₀ + a₁λ² + a₂λ⁻² + a₃λ⁻⁴ + a₄λ⁻⁶ + a₅λ⁻⁸", range(2, 7), _schott, "Schott glass catalogue up to 1992"
    ),
    "cauchy": Formula("n = A + B λ⁻² + C λ⁻⁴ + ...", range(1, 9), _cauchy, "A.-L. Cauchy, Bull. sci. math. 14 (1830) 6"),
    "conrady": Formula(
        "n = n₀ + A/λ + B/λ^3.5", range(3, 4), _conrady, "A. E. Conrady, Applied Optics and Optical Design II (1960)"
    ),
    "power_series": Formula(
        "n = c₀ + Σ cᵢ λ^eᵢ, coefficients c₀ c₁ e₁ c₂ e₂ ...", range(1, 18, 2), _power_series, "refractiveindex.info, formula 5"
    ),
    "power_series_squared": Formula(
        "n² = c₀ + Σ cᵢ λ^eᵢ, coefficients c₀ c₁ e₁ c₂ e₂ ...",
        range(1, 18, 2),
        lambda w, c: np.sqrt(_power_series(w, c)),
        "refractiveindex.info, formula 3",
    ),
}


def index_by_formula(formula: str, coefficients: tuple[float, ...], wavelength_nm: ArrayLike) -> Float:
    """Refractive index at wavelengths, any shape; NaN where the formula gives none."""
    with np.errstate(all="ignore"):
        wavelength_um = np.asarray(wavelength_nm, np.float64) / 1000.0
        return np.asarray(FORMULAS[formula].index(wavelength_um, np.array(coefficients)), np.float64)
