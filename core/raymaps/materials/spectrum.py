# SPDX-License-Identifier: LGPL-2.1-or-later
"""Values that may depend on wavelength, and on the angle of incidence.

A *spectral value* is one number, a value for each of red, green and blue, or a table over wavelength; a table may
stand in a file of its own. Tables are interpolated linearly. What a table says nothing of is refused, or takes its
border value if ``outside`` is "clamp".
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationInfo, model_validator

from raymaps.formats.spectrum_csv import read_spectrum
from raymaps.materials.values import NonNegative, Number, Record, RgbNonNegative, RgbShare, Share, file_content

__all__ = [
    "LONGEST_NM",
    "SHORTEST_NM",
    "AngularShare",
    "AngularTable",
    "SpectralNonNegative",
    "SpectralShare",
    "SpectrumFile",
    "SpectrumTable",
    "check_ascending",
    "is_spectral",
]

#: Wavelengths that a scene may speak of: soft X-rays and millimetre waves are certainly a mistake of unit.
SHORTEST_NM, LONGEST_NM = 10.0, 1e6

Outside = Literal["refuse", "clamp"]


def check_ascending(values: tuple[float, ...], what: str) -> None:
    """Refuse numbers that do not climb; raises `ValueError` with the place."""
    for before, after in zip(values, values[1:], strict=False):
        if not after > before:
            raise ValueError(f"{what} must climb from each entry to the next, but {after:g} follows {before:g}")


def _check_wavelengths(wavelength_nm: tuple[float, ...]) -> None:
    check_ascending(wavelength_nm, "wavelength_nm")
    for wavelength in (wavelength_nm[0], wavelength_nm[-1]):
        if not SHORTEST_NM <= wavelength <= LONGEST_NM:
            raise ValueError(
                f"wavelengths must be in nm, from {SHORTEST_NM:g} to {LONGEST_NM:g}; got {wavelength:g}"
                + (" (1 µm is 1000 nm)" if wavelength < SHORTEST_NM else "")
            )


class SpectrumTable(Record):
    """A value over wavelength, interpolated linearly."""

    wavelength_nm: tuple[Number, ...] = Field(min_length=1, description="Wavelengths in nm, ascending.")
    value: tuple[Number, ...] = Field(min_length=1, description="A value for each wavelength.")
    outside: Outside = Field("refuse", description="What holds outside the table: refuse it, or clamp to its borders.")

    @model_validator(mode="after")
    def _is_a_table(self) -> SpectrumTable:
        if len(self.value) != len(self.wavelength_nm):
            raise ValueError(f"{len(self.wavelength_nm)} wavelengths need as many values, got {len(self.value)}")
        _check_wavelengths(self.wavelength_nm)
        return self

    def at(self, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
        """Values at wavelengths, any shape; the border values outside."""
        return np.interp(np.asarray(wavelength_nm, np.float64), self.wavelength_nm, self.value)

    @property
    def range_nm(self) -> tuple[float, float]:
        """First and last wavelength that the table speaks of."""
        if self.outside == "clamp":
            return SHORTEST_NM, LONGEST_NM
        return self.wavelength_nm[0], self.wavelength_nm[-1]


class ShareTable(SpectrumTable):
    """Shares of light over wavelength."""

    value: tuple[Share, ...] = Field(min_length=1, description="A share from 0 to 1 for each wavelength.")


class NonNegativeTable(SpectrumTable):
    """Values of 0 or more over wavelength."""

    value: tuple[NonNegative, ...] = Field(min_length=1, description="A value of 0 or more for each wavelength.")


class SpectrumFile(Record):
    """A spectrum in a CSV file of two columns, wavelength in nm and value; a table once the scene is read."""

    file: str = Field(min_length=1, description="CSV file, relative to the scene file.")
    outside: Outside = "refuse"


def _table_of_file(value: Any, info: ValidationInfo) -> Any:
    """The table that a reference to a file stands for; everything else as it is."""
    if not (isinstance(value, dict) and "file" in value):
        return value
    reference = SpectrumFile.model_validate(value)
    return {**file_content(reference.file, info, read_spectrum), "outside": reference.outside}


class AngularTable(Record):
    """A share of light over the angle of incidence and, if wavelengths are given, over wavelength; bilinear.

    Angles that the table says nothing of take its border values, so a table up to 85 degrees is enough.
    """

    angle_deg: tuple[Number, ...] = Field(min_length=1, description="Angles of incidence, 0 head-on, ascending.")
    wavelength_nm: tuple[Number, ...] | None = Field(None, min_length=1, description="Wavelengths in nm, ascending.")
    value: tuple[tuple[Share, ...], ...] = Field(
        min_length=1, description="A row for each angle, with a value for each wavelength, or one without wavelengths."
    )
    outside: Outside = "refuse"

    @model_validator(mode="after")
    def _is_a_table(self) -> AngularTable:
        check_ascending(self.angle_deg, "angle_deg")
        if self.angle_deg[0] < 0 or self.angle_deg[-1] > 90:
            raise ValueError(
                f"angles of incidence must be from 0 to 90 degrees, got {self.angle_deg[0]:g} to {self.angle_deg[-1]:g}"
            )
        if self.wavelength_nm is not None:
            _check_wavelengths(self.wavelength_nm)
        columns = 1 if self.wavelength_nm is None else len(self.wavelength_nm)
        if len(self.value) != len(self.angle_deg) or any(len(row) != columns for row in self.value):
            raise ValueError(f"{len(self.angle_deg)} angles need as many rows of {columns} value{'s' * (columns > 1)}")
        return self

    def at_angles(self, angle_deg: ArrayLike) -> tuple[SpectrumTable, ...] | tuple[float, ...]:
        """The table's spectrum at each of the angles, (n_angles,): tables over wavelength, or numbers without them."""
        values = np.array(self.value)
        rows = np.stack(
            [np.interp(np.asarray(angle_deg, np.float64), self.angle_deg, column) for column in values.T], axis=-1
        )
        if self.wavelength_nm is None:
            return tuple(float(row[0]) for row in rows)
        return tuple(
            SpectrumTable(wavelength_nm=self.wavelength_nm, value=tuple(map(float, row)), outside=self.outside)
            for row in rows
        )


def _form(value: Any) -> str:
    """Which form of a spectral value the data have."""
    if isinstance(value, AngularTable) or (isinstance(value, dict) and "angle_deg" in value):
        return "angles"
    return "table" if isinstance(value, dict | SpectrumTable) else "bands"


def _reads(*forms: Any) -> BeforeValidator:
    """Reads the file that stands for a table, and tells the published schema what may stand there."""
    return BeforeValidator(_table_of_file, json_schema_input_type=Union[(*forms, SpectrumFile)])


SpectralShare = Annotated[
    Annotated[Annotated[RgbShare, Tag("bands")] | Annotated[ShareTable, Tag("table")], Discriminator(_form)],
    _reads(RgbShare, ShareTable),
]
SpectralNonNegative = Annotated[
    Annotated[
        Annotated[RgbNonNegative, Tag("bands")] | Annotated[NonNegativeTable, Tag("table")], Discriminator(_form)
    ],
    _reads(RgbNonNegative, NonNegativeTable),
]
AngularShare = Annotated[
    Annotated[
        Annotated[RgbShare, Tag("bands")]
        | Annotated[ShareTable, Tag("table")]
        | Annotated[AngularTable, Tag("angles")],
        Discriminator(_form),
    ],
    _reads(RgbShare, ShareTable, AngularTable),
]


def is_spectral(value: Any) -> bool:
    """Whether a spectral value is a table over wavelength."""
    return isinstance(value, SpectrumTable) or (isinstance(value, AngularTable) and value.wavelength_nm is not None)
