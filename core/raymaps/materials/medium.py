# SPDX-License-Identifier: LGPL-2.1-or-later
"""Media: what light travels in, and metals that it is reflected by."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationInfo, model_validator

from raymaps.formats.medium_files import read_medium
from raymaps.formats.phase_csv import read_phase_function
from raymaps.materials.catalogue import catalogue_medium
from raymaps.materials.dispersion import (
    FORMULAS,
    VISIBLE_NM,
    fault_of_formula,
    index_by_formula,
    physical_range,
)
from raymaps.materials.spectrum import (
    LONGEST_NM,
    SHORTEST_NM,
    Outside,
    SpectralNonNegative,
    SpectrumTable,
    check_ascending,
)
from raymaps.materials.values import Angle, Name, NonNegative, Number, Record, file_content

__all__ = [
    "D_LINE_NM",
    "VACUUM",
    "CatalogueMedium",
    "DispersionFormula",
    "DispersionTable",
    "HenyeyGreenstein",
    "IsotropicPhase",
    "Medium",
    "MediumFile",
    "MediumOrCatalogue",
    "Scattering",
    "TabulatedPhase",
]

#: Yellow helium line; the index of a medium where colours are not told apart.
D_LINE_NM = 587.5618


#: Angles of a phase function that are closer are certainly a mistake, and their difference is lost in rounding.
CLOSEST_DEG = 1e-9
#: A mean free path far below the size of an atom.
LARGEST_SCATTERING_PER_MM = 1e12

#: Index below which a clear medium is a mistake; relative to another medium it may well be somewhat below 1.
LEAST_CLEAR_INDEX = 0.5


class DispersionFormula(Record):
    """Refractive index by a formula; coefficients for wavelengths in µm."""

    formula: str = Field(description="One of " + ", ".join(FORMULAS) + ".")
    coefficients: tuple[Number, ...]
    from_nm: Annotated[Number, Field(ge=SHORTEST_NM, le=LONGEST_NM)] | None = Field(
        None, description="Shortest wavelength at which it holds; null: wherever it is physical."
    )
    to_nm: Annotated[Number, Field(ge=SHORTEST_NM, le=LONGEST_NM)] | None = Field(
        None, description="Longest wavelength at which it holds; null: wherever it is physical."
    )
    outside: Outside = Field("refuse", description="What holds beyond: refuse it, or clamp to the index at the border.")

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
        if self.from_nm is not None and self.to_nm is not None and not self.from_nm < self.to_nm:
            raise ValueError(f"from_nm must be below to_nm, got {self.from_nm:g} and {self.to_nm:g}")
        fault = fault_of_formula(self.formula, self.coefficients, *self._checked_nm)
        if fault is not None:
            raise ValueError(f"{fault}; check the coefficients (for wavelengths in µm), or narrow from_nm and to_nm")
        return self

    def at(self, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
        """Index at wavelengths, any shape; NaN where the formula gives none."""
        if self.outside == "clamp":
            wavelength_nm = np.clip(wavelength_nm, *self._formula_range_nm)
        return index_by_formula(self.formula, self.coefficients, wavelength_nm)

    @property
    def range_nm(self) -> tuple[float, float]:
        """Wavelengths at which there is an index."""
        return (SHORTEST_NM, LONGEST_NM) if self.outside == "clamp" else self._formula_range_nm

    @property
    def _formula_range_nm(self) -> tuple[float, float]:
        """Wavelengths at which the formula holds: as given, otherwise all around the visible where it is physical."""
        if self.from_nm is not None and self.to_nm is not None:
            return self.from_nm, self.to_nm
        low, high = physical_range(self.formula, self.coefficients, self._checked_nm, (SHORTEST_NM, LONGEST_NM))
        return (low if self.from_nm is None else self.from_nm), (high if self.to_nm is None else self.to_nm)

    @property
    def _checked_nm(self) -> tuple[float, float]:
        """The range given; without a border that of the visible, or the other border if that is beyond."""
        low = min(VISIBLE_NM[0], self.to_nm or VISIBLE_NM[0]) if self.from_nm is None else self.from_nm
        high = max(VISIBLE_NM[1], self.from_nm or VISIBLE_NM[1]) if self.to_nm is None else self.to_nm
        return low, high


class DispersionTable(Record):
    """Refractive index over wavelength, interpolated linearly."""

    wavelength_nm: tuple[Number, ...] = Field(min_length=1, description="Wavelengths in nm, ascending.")
    n: tuple[Annotated[Number, Field(gt=0, le=1000)], ...] = Field(min_length=1)
    outside: Outside = "refuse"

    @model_validator(mode="after")
    def _is_a_table(self) -> DispersionTable:
        SpectrumTable(wavelength_nm=self.wavelength_nm, value=self.n, outside=self.outside)
        return self

    def at(self, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
        """Index at wavelengths, any shape; the border values outside."""
        return np.interp(np.asarray(wavelength_nm, np.float64), self.wavelength_nm, self.n)

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
            raise ValueError(
                f"{len(self.angle_deg)} angles need as many values of the phase function, got {len(self.value)}"
            )
        if self.angle_deg[0] != 0 or self.angle_deg[-1] != 180:
            raise ValueError(
                "a phase function must reach from 0 to 180 degrees, got "
                f"{self.angle_deg[0]:g} to {self.angle_deg[-1]:g}"
                + (": give the angles in degrees, not in radians" if 3.1 < self.angle_deg[-1] < 3.2 else "")
            )
        for before, after in zip(self.angle_deg, self.angle_deg[1:], strict=False):
            if after - before < CLOSEST_DEG:
                raise ValueError(f"angle_deg: {before!r} and {after!r} are closer than {CLOSEST_DEG:g} degrees")
        if max(self.value) <= 0:
            raise ValueError("a phase function must be above 0 somewhere")
        return self


class PhaseFile(Record):
    """A phase function in a CSV file of two columns, angle in degrees and value; a table when the scene is read."""

    kind: Literal["file"] = "file"
    file: str = Field(min_length=1, description="CSV file, relative to the scene file.")


def _table_of_file(value: Any, info: ValidationInfo) -> Any:
    """The table that a reference to a file stands for; everything else as it is."""
    if not (isinstance(value, dict) and value.get("kind") == "file"):
        return value
    return {"kind": "table", **file_content(PhaseFile.model_validate(value).file, info, read_phase_function)}


PhaseFunction = Annotated[
    Annotated[IsotropicPhase | HenyeyGreenstein | TabulatedPhase, Field(discriminator="kind")],
    BeforeValidator(
        _table_of_file,
        json_schema_input_type=Annotated[
            IsotropicPhase | HenyeyGreenstein | TabulatedPhase | PhaseFile, Field(discriminator="kind")
        ],
    ),
]


class Scattering(Record):
    """One kind of scatterers in a medium; a medium can hold several."""

    coefficient_per_mm: SpectralNonNegative = Field(
        description="Scattering coefficient in 1/mm: one number, one for each of r, g, b, or a table."
    )
    phase: PhaseFunction = Field(IsotropicPhase(), description="In which directions they scatter.")

    @model_validator(mode="after")
    def _is_possible(self) -> Scattering:
        value = self.coefficient_per_mm
        largest = max(value.value if isinstance(value, SpectrumTable) else value)
        if largest > LARGEST_SCATTERING_PER_MM:
            raise ValueError(
                f"coefficient_per_mm must not be above {LARGEST_SCATTERING_PER_MM:g} 1/mm, got {largest:g}: "
                "check its unit"
            )
        return self


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

    @model_validator(mode="after")
    def _is_denser_than_vacuum(self) -> Medium:
        """Refuse a clear medium of an index below 1 in the visible: its units are wrong, or it is a metal."""
        if isinstance(self.refractive_index, float | int):
            lowest = float(self.refractive_index)
        elif isinstance(self.refractive_index, DispersionTable):
            pairs = zip(self.refractive_index.wavelength_nm, self.refractive_index.n, strict=True)
            lowest = min((n for nm, n in pairs if VISIBLE_NM[0] <= nm <= VISIBLE_NM[1]), default=1.0)
        else:
            lowest = 1.0
        if lowest < LEAST_CLEAR_INDEX and not self.is_conductor:
            raise ValueError(
                f"a clear medium can't have a refractive index of {lowest:g}; a metal needs its extinction too, or "
                'take one of the catalogue, such as {"catalogue": "gold"}'
            )
        formula = self.refractive_index
        if isinstance(formula, DispersionFormula) and not self.is_conductor:
            low, high = np.clip(VISIBLE_NM, *formula.range_nm)
            wavelength_nm = np.linspace(low, high, 41)
            index = formula.at(wavelength_nm)
            least = int(np.argmin(index))
            if low < high and index[least] < 1:
                raise ValueError(
                    f"the formula '{formula.formula}' gives the refractive index {index[least]:.6g} at "
                    f"{wavelength_nm[least]:g} nm, below that of vacuum; coefficients must be for wavelengths in µm, "
                    "and a metal needs its extinction"
                )
        return self

    def index_at(self, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
        """Refractive index at wavelengths, any shape."""
        if isinstance(self.refractive_index, float | int):
            return np.full(np.shape(wavelength_nm), float(self.refractive_index))
        return self.refractive_index.at(wavelength_nm)

    @property
    def index_at_d_line(self) -> float:
        """Refractive index where colours are not told apart: at the d line, or as near to it as its data reach."""
        if isinstance(self.refractive_index, float | int):
            return float(self.refractive_index)
        return float(self.index_at(np.clip(D_LINE_NM, *self.refractive_index.range_nm)))

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
    outside: Outside | None = Field(None, description="What holds beyond its tables and formula; null: as they say.")


class MediumFile(Record):
    """A medium in a file: refractiveindex.info's YAML, or a Zemax catalogue (AGF) with the name of a glass in it."""

    file: str = Field(min_length=1, description="YAML or AGF file, relative to the scene file.")
    glass: Name | None = Field(None, description="Glass of a catalogue of several.")
    outside: Outside = Field("refuse", description="What holds beyond its tables and formula.")


def _written_out(value: Any, info: ValidationInfo) -> Any:
    """The medium that a name of the catalogue or a file stands for; everything else as it is."""
    if isinstance(value, dict) and "catalogue" in value:
        named = CatalogueMedium.model_validate(value)
        return _with_outside(catalogue_medium(named.catalogue), named.outside)
    if isinstance(value, dict) and "file" in value:
        reference = MediumFile.model_validate(value)
        medium = file_content(reference.file, info, lambda path: read_medium(path, reference.glass, index_by_formula))
        return _with_outside(medium, reference.outside)
    return value


def _with_outside(medium: dict[str, Any], outside: str | None) -> dict[str, Any]:
    """The data of a medium whose formula and tables, but not its plain numbers, say what holds beyond their range."""
    if outside is None:
        return medium
    return {
        field: {**value, "outside": outside} if isinstance(value, dict) else value for field, value in medium.items()
    }


MediumOrCatalogue = Annotated[
    Medium, BeforeValidator(_written_out, json_schema_input_type=Medium | CatalogueMedium | MediumFile)
]
