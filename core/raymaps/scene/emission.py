# SPDX-License-Identifier: LGPL-2.1-or-later
"""What colour sources shine in, and how their light is spread over directions."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from raymaps.formats.luminaire_files import read_luminaire
from raymaps.formats.spectrum_csv import read_spectrum
from raymaps.materials.spectrum import LONGEST_NM, SHORTEST_NM, SpectrumTable, check_ascending
from raymaps.materials.values import Angle, NonNegative, Number, Positive, Record, file_content

__all__ = [
    "BlackBody",
    "CosinePower",
    "EmissionFile",
    "EmissionSpectrum",
    "EmissionTable",
    "Illuminant",
    "IntensityFile",
    "IntensityTable",
    "LambertianEmission",
    "SpectralLines",
    "TabulatedEmission",
]


class EmissionTable(Record):
    """Relative spectral flux per nm over wavelength, linear in between and zero outside."""

    kind: Literal["table"] = "table"
    wavelength_nm: tuple[Number, ...] = Field(min_length=2)
    value: tuple[NonNegative, ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _is_a_table(self) -> EmissionTable:
        SpectrumTable(wavelength_nm=self.wavelength_nm, value=self.value)
        if max(self.value) <= 0:
            raise ValueError("a spectrum must be above 0 somewhere")
        return self

    def share_within(self, from_nm: float, to_nm: float) -> float:
        """Share of the flux between two wavelengths, 0 to 1."""
        nm = np.unique(np.clip([*self.wavelength_nm, from_nm, to_nm], self.wavelength_nm[0], self.wavelength_nm[-1]))
        density = np.interp(nm, self.wavelength_nm, self.value)
        steps = (density[1:] + density[:-1]) / 2 * np.diff(nm)
        inside = (nm[:-1] >= from_nm) & (nm[1:] <= to_nm)
        return float(steps[inside].sum() / steps.sum())


class SpectralLines(Record):
    """Light of single wavelengths, such as a laser's or a spectral lamp's."""

    kind: Literal["lines"] = "lines"
    wavelength_nm: tuple[Annotated[Number, Field(ge=SHORTEST_NM, le=LONGEST_NM)], ...] = Field(min_length=1)
    share: tuple[Positive, ...] | None = Field(None, description="Relative flux of the lines; null: all alike.")

    @model_validator(mode="after")
    def _is_a_table(self) -> SpectralLines:
        check_ascending(self.wavelength_nm, "wavelength_nm")
        if self.share is not None and len(self.share) != len(self.wavelength_nm):
            raise ValueError(f"{len(self.wavelength_nm)} lines need as many shares, got {len(self.share)}")
        return self


class BlackBody(Record):
    """Planck's spectrum."""

    kind: Literal["black_body"] = "black_body"
    temperature_k: Number = Field(ge=500, le=100_000)


class Illuminant(Record):
    """A CIE illuminant, such as D65, A, or LED-B3."""

    kind: Literal["illuminant"] = "illuminant"
    name: str


class EmissionFile(Record):
    """Relative spectral flux per nm in a CSV file of two columns; it becomes a table when the scene is read."""

    kind: Literal["file"] = "file"
    file: str = Field(min_length=1, description="CSV file, relative to the scene file.")


def _table_of_file(value: Any, info: ValidationInfo) -> Any:
    """The table that a reference to a file stands for; everything else as it is."""
    if not (isinstance(value, dict) and value.get("kind") == "file"):
        return value
    return {"kind": "table", **file_content(EmissionFile.model_validate(value).file, info, read_spectrum)}


_Spectra = Annotated[EmissionTable | SpectralLines | BlackBody | Illuminant, Field(discriminator="kind")]
EmissionSpectrum = Annotated[
    _Spectra,
    BeforeValidator(
        _table_of_file,
        json_schema_input_type=Annotated[
            EmissionTable | SpectralLines | BlackBody | Illuminant | EmissionFile, Field(discriminator="kind")
        ],
    ),
]


class LambertianEmission(Record):
    """Equally bright from all sides."""

    kind: Literal["lambertian"] = "lambertian"


class CosinePower(Record):
    """Intensity that falls as a power of the cosine of the angle to the normal; 1 is Lambertian."""

    kind: Literal["cosine_power"] = "cosine_power"
    exponent: Number = Field(ge=0, le=1e6)


class TabulatedEmission(Record):
    """Intensity over the angle to the normal, linear in between, zero beyond the last angle; scale does not matter."""

    kind: Literal["table"] = "table"
    angle_deg: tuple[Annotated[Number, Field(ge=0, le=90)], ...] = Field(min_length=2)
    value: tuple[NonNegative, ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _is_a_table(self) -> TabulatedEmission:
        check_ascending(self.angle_deg, "angle_deg")
        if self.angle_deg[0] != 0:
            raise ValueError(f"the first angle must be 0, that along the normal, got {self.angle_deg[0]:g}")
        if len(self.value) != len(self.angle_deg):
            raise ValueError(f"{len(self.angle_deg)} angles need as many values, got {len(self.value)}")
        if max(self.value) <= 0:
            raise ValueError("an intensity must be above 0 somewhere")
        return self


FaceEmission = Annotated[LambertianEmission | CosinePower | TabulatedEmission, Field(discriminator="kind")]


class IntensityFile(Record):
    """A luminaire's file, IES LM-63 or EULUMDAT, read when the scene is loaded."""

    file: str = Field(min_length=1, description="IES or LDT file, relative to the scene file.")


class IntensityTable(Record):
    """Luminous intensity over directions (type C of CIE 121): half planes C, and gamma from the axis; bilinear.

    Half planes go all the way round from 0 to 360 degrees, both given; no light goes beyond the first and last gamma.
    """

    c_deg: tuple[Annotated[Number, Field(ge=0, le=360)], ...] = Field(min_length=2)
    gamma_deg: tuple[Angle, ...] = Field(min_length=2)
    candela: tuple[tuple[NonNegative, ...], ...] = Field(description="A row for each half plane.")

    @model_validator(mode="after")
    def _is_a_table(self) -> IntensityTable:
        check_ascending(self.c_deg, "c_deg")
        check_ascending(self.gamma_deg, "gamma_deg")
        if self.c_deg[0] != 0 or self.c_deg[-1] != 360:
            raise ValueError("half planes must go from 0 to 360 degrees")
        if len(self.candela) != len(self.c_deg) or any(len(row) != len(self.gamma_deg) for row in self.candela):
            raise ValueError(f"{len(self.c_deg)} half planes need as many rows of {len(self.gamma_deg)} values")
        if max(map(max, self.candela)) <= 0:
            raise ValueError("an intensity must be above 0 somewhere")
        return self


def _intensity_of_file(value: Any, info: ValidationInfo) -> Any:
    """The intensities that a luminaire's file holds; everything else as it is."""
    if not (isinstance(value, dict) and "file" in value):
        return value
    return file_content(IntensityFile.model_validate(value).file, info, read_luminaire)


Intensity = Annotated[
    IntensityTable, BeforeValidator(_intensity_of_file, json_schema_input_type=IntensityTable | IntensityFile)
]
