# SPDX-License-Identifier: LGPL-2.1-or-later
"""How a scene is simulated unless a run says otherwise."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator, model_validator

from raymaps.materials.spectrum import LONGEST_NM, SHORTEST_NM
from raymaps.materials.values import Integer, Number, Record

__all__ = ["Settings", "SpectralBands"]


class SpectralBands(Record):
    """Bands of equal width in which spectra are carried; single wavelengths have bands of their own beside these."""

    from_nm: Number = Field(380.0, ge=SHORTEST_NM, description="Shortest wavelength that is simulated.")
    to_nm: Number = Field(780.0, le=LONGEST_NM, description="Longest wavelength that is simulated.")
    bands: Integer = Field(32, ge=1, le=1000, description="Number of bands.")
    observer: Literal["cie_1931_2deg", "cie_1964_10deg"] = Field(
        "cie_1931_2deg", description="Standard observer behind colours."
    )

    @model_validator(mode="after")
    def _is_a_range(self) -> SpectralBands:
        if not self.from_nm < self.to_nm:
            raise ValueError(f"from_nm must be below to_nm, got {self.from_nm:g} and {self.to_nm:g}")
        return self


class Settings(Record):
    """How the scene is simulated unless a run says otherwise."""

    rays: Integer = Field(100_000, ge=1, le=10**12, description="Number of rays.")
    seed: Integer = Field(1, ge=0, lt=2**64, description="Seed of all random numbers.")
    max_events: Integer = Field(
        1000, ge=2, le=100_000, description="A ray with more events is killed, and recorded so."
    )
    roulette_threshold: Number = Field(
        0.1, ge=0, le=1, description="Below this share of its light a ray's losses on surfaces are drawn."
    )
    sampling: Literal["random", "sobol"] = Field(
        "random", description="Whether the first decisions of rays are random, or points of Sobol's sequence."
    )
    surfaces: Literal["exact", "faceted"] = Field(
        "exact", description="Whether light meets the exact surfaces of CAD faces, or their triangles."
    )
    spectrum: SpectralBands = Field(SpectralBands(), description="Bands of a spectral simulation.")
    store: Literal["rgb", "spectral"] = Field("rgb", description="What is stored of a spectral simulation.")
    without: tuple[str, ...] = Field((), description="Effects that are switched off, by name.")

    @field_validator("without")
    @classmethod
    def _named_once(cls, without: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(without))
