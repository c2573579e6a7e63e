# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tables of measured scattering, as `raymaps.formats` reads them from files."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from raymaps.formats.bsdf_files import read_bsdf
from raymaps.materials.spectrum import check_ascending
from raymaps.materials.values import NonNegative, Number, Record, Share, file_content

__all__ = ["BsdfFile", "BsdfLobe", "BsdfTable", "BsdfTableOrFile"]


class BsdfFile(Record):
    """A file with a BSDF, read when the scene is loaded: own CSV, Klems XML (WINDOW), or ASTM E1392."""

    file: str = Field(min_length=1, description="CSV, XML or ASTM file, relative to the scene file.")


class BsdfLobe(Record):
    """Light that comes from one side and goes on to one side: a specular share, and a table of the diffuse BSDF.

    The BSDF (1/sr) is constant over *cells* of outgoing directions: rings between the polar angles ``ring_deg``, each
    divided evenly into ``cells_in_ring`` sectors, counted from azimuth ``-180/n`` of its n sectors on. Azimuths of outgoing
    directions count from the plane of incidence: 0 is where specular light goes on to. Incoming directions are cells too:
    rings between ``in_ring_deg`` with ``in_cells_in_ring`` sectors each; one sector a ring is an isotropic surface.
    With several incoming sectors azimuths count from the body's own direction instead (``is_isotropic`` false).
    """

    comes_from: Literal["front", "back"]
    goes_to: Literal["reflection", "transmission"]
    in_ring_deg: tuple[Number, ...] = Field(min_length=2)
    in_cells_in_ring: tuple[int, ...] = Field(min_length=1)
    ring_deg: tuple[Number, ...] = Field(min_length=2)
    cells_in_ring: tuple[int, ...] = Field(min_length=1)
    wavelength_nm: tuple[Number, ...] | None = None
    #: (n_wavelengths or 1, n_incoming cells, n_outgoing cells) BSDF in 1/sr
    value: tuple[tuple[tuple[NonNegative, ...], ...], ...]
    #: (n_wavelengths or 1, n_incoming cells) share of the light that goes on specularly
    specular: tuple[tuple[Share, ...], ...] | None = None

    @model_validator(mode="after")
    def _is_a_table(self) -> BsdfLobe:
        check_ascending(self.in_ring_deg, "in_ring_deg")
        check_ascending(self.ring_deg, "ring_deg")
        return self


class BsdfTable(Record):
    """All that a surface does with light, as a table."""

    lobes: tuple[BsdfLobe, ...] = Field(min_length=1, max_length=4)
    reference: str | None = None


def _table_of_file(value: Any, info: ValidationInfo) -> Any:
    """The table that a reference to a file stands for; everything else as it is."""
    if not (isinstance(value, dict) and "file" in value):
        return value
    return file_content(BsdfFile.model_validate(value).file, info, read_bsdf)


BsdfTableOrFile = Annotated[
    BsdfTable, BeforeValidator(_table_of_file, json_schema_input_type=BsdfTable | BsdfFile)
]
