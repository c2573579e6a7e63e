# SPDX-License-Identifier: LGPL-2.1-or-later
"""Media: what light travels in, and metals that it is reflected by."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from raymaps.materials.catalogue import catalogue_medium
from raymaps.materials.dispersion import FORMULAS, index_by_formula
from raymaps.materials.spectrum import (
    LONGEST_NM,
    SHORTEST_NM,
    SpectralNonNegative,
    SpectrumTable,
    check_ascending,
)
from raymaps.materials.values import Angle, Name, NonNegative, Number, Record

__all__ = [
    "D_LINE_NM",
    "VACUUM",
    "CatalogueMedium",
    "DispersionFormula",
    "DispersionTable",
    "HenyeyGreenstein",
    "IsotropicPhase",
    "Medium",
    "MediumOrCatalogue",
    "Scattering",
    "TabulatedPhase",
]

#: Yellow helium line; the index of a medium where colours are not told apart.
D_LINE_NM = 587.5618


class DispersionFormula(Record):
    """Refractive index by a formula; coefficients for wavelengths in µm."""

    formula: str = Field(description="One of " + ", ".join(FORMULAS) + ".")
    coefficients: tuple[Number, ...]
    from_nm: Number = Field(SHORTEST_NM, ge=SHORTEST_NM, description="Shortest wavelength at which it holds.")
    to_nm: Number = Field(LONGEST_NM, le=LONGEST_NM, description="Longest wavelength at which it holds.")

    @model_validator(mode="after")
    def _is_known(self) -> DispersionFormula:
        if self.formula not in FORMULAS:
            raise ValueError(f"unknown formula '{self.formula}'; known: {', '.join(FORMULAS)}")
        if len(self.coefficients) not in FORMULAS[self.formula].counts:
            counts = ", ".join(map(str, FORMULAS[self.formula].counts))
            raise ValueError(
                f"the formula '{self.formula}' takes {counts} coefficients, got {len(self.coefficients)}: "
                f"{FORMULAS[self.formula].equation}"
            )
        if not self.from_nm < self.to_nm:
            raise ValueError(f"from_nm must be below to_nm, got {self.from_nm:g} and {self.to_nm:g}")
        return self

    def at(self, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
        """Index at wavelengths, any shape; NaN where the formula gives none."""
        return index_by_formula(self.formula, self.coefficients, wavelength_nm)

    @property
    def range_nm(self) -> tuple[float, float]:
        """Wavelengths at which the formula holds."""
        return self.from_nm, self.to_nm


class DispersionTable(Record):
    """Refractive index over wavelength, interpolated linearly."""

    wavelength_nm: tuple[Number, ...] = Field(min_length=1, description="Wavelengths in nm, ascending.")
    n: tuple[Annotated[Number, Field(gt=0, le=100)], ...] = Field(min_length=1)
    outside: Literal["refuse", "clamp"] = "refuse"

    @model_validator(mode="after")
    def _is_a_table(self) -> DispersionTable:
        SpectrumTable(wavelength_nm=self.wavelength_nm, value=self.n, outside=self.outside)
        return self

    def at(self, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
        """Index at wavelengths, any shape; the border values outside."""
        return np.interp(wavelength_nm, self.wavelength_nm, self.n)

    @property
    def range_nm(self) -> tuple[float, float]:
        """Wavelengths at which the table holds."""
        return (SHORTEST_NM, LONGEST_NM) if self.outside == "clamp" else (self.wavelength_nm[0], self.wavelength_nm[-1])


def _index_form(value: Any) -> str:
    if isinstance(value, DispersionFormula) or (isinstance(value, dict) and "formula" in value):
        return "formula"
    return "table" if isinstance(value, dict | DispersionTable) else "number"


RefractiveIndex = Annotated[
    Annotated[Number, Field(gt=0, le=10), Tag("number")]
    | Annotated[DispersionFormula, Tag("formula")]
    | Annotated[DispersionTable, Tag("table")],
    Discriminator(_index_form),
]


class IsotropicPhase(Record):
    """Scatters alike in all directions."""

    kind: Literal["isotropic"] = "isotropic"


class HenyeyGreenstein(Record):
    """Scatters with the phase function of Henyey and Greenstein; g is the mean cosine of the scattering angle."""

    kind: Literal["henyey_greenstein"] = "henyey_greenstein"
    g: Number = Field(gt=-1, lt=1, description="Mean cosine: 0 isotropic, towards 1 forward, towards -1 backward.")


class TabulatedPhase(Record):
    """Scatters with a phase function given over the scattering angle, linear in between; its scale does not matter."""

    kind: Literal["table"] = "table"
    angle_deg: tuple[Angle, ...] = Field(min_length=2, description="Scattering angles from 0 (straight on) to 180.")
    value: tuple[NonNegative, ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _is_a_table(self) -> TabulatedPhase:
        check_ascending(self.angle_deg, "angle_deg")
        if len(self.value) != len(self.angle_deg):
            raise ValueError(f"{len(self.angle_deg)} angles need as many values, got {len(self.value)}")
        if self.angle_deg[0] != 0 or self.angle_deg[-1] != 180:
            raise ValueError("a phase function must reach from 0 to 180 degrees")
        if max(self.value) <= 0:
            raise ValueError("a phase function must be above 0 somewhere")
        return self


PhaseFunction = Annotated[IsotropicPhase | HenyeyGreenstein | TabulatedPhase, Field(discriminator="kind")]


class Scattering(Record):
    """One kind of scatterers in a medium; a medium can hold several."""

    coefficient_per_mm: SpectralNonNegative = Field(description="Scattering coefficient in 1/mm, over wavelength.")
    phase: PhaseFunction = IsotropicPhase()


class Medium(Record):
    """A homogeneous, isotropic medium: clear, absorbing, scattering, or a metal.

    ``absorption_per_mm`` is the coefficient a of Beer-Lambert's law: a share exp(-a d) of the light is left after d mm.
    A medium with an ``extinction`` above zero is a conductor: light is reflected or absorbed at its surface.
    """

    refractive_index: RefractiveIndex = Field(description="Real refractive index: a number, a formula or a table.")
    absorption_per_mm: SpectralNonNegative = Field(
        (0.0, 0.0, 0.0), description="Absorption coefficient in 1/mm: one number, one for each of r, g, b, or a table."
    )
    scattering: tuple[Scattering, ...] = Field((), max_length=16, description="Scatterers, side by side.")
    extinction: SpectralNonNegative = Field(
        (0.0, 0.0, 0.0), description="Imaginary part k of the index n + ik of a conductor."
    )
    reference: str | None = Field(None, description="Where the figures come from.")

    def index_at(self, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
        """Refractive index at wavelengths, any shape."""
        if isinstance(self.refractive_index, float | int):
            return np.full(np.shape(wavelength_nm), float(self.refractive_index))
        return self.refractive_index.at(wavelength_nm)

    @property
    def is_dispersive(self) -> bool:
        """Whether the refractive index depends on wavelength."""
        return not isinstance(self.refractive_index, float | int)

    @property
    def is_conductor(self) -> bool:
        """Whether light can't travel in it."""
        k = self.extinction
        return any(k.value if isinstance(k, SpectrumTable) else k)


VACUUM = Medium(refractive_index=1.0)


class CatalogueMedium(Record):
    """A medium of the catalogue that comes with Ray Maps, by its name; it becomes the medium when the scene is read."""

    catalogue: Name


def _of_catalogue(value: Any) -> Any:
    """The medium that a name of the catalogue stands for; everything else as it is."""
    if not (isinstance(value, dict) and "catalogue" in value):
        return value
    return catalogue_medium(CatalogueMedium.model_validate(value).catalogue)


MediumOrCatalogue = Annotated[
    Medium, BeforeValidator(_of_catalogue, json_schema_input_type=Medium | CatalogueMedium)
]
