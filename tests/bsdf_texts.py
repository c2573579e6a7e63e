# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small BSDF files as instruments and programs write them, for tests of formats and of scattering."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from raymaps.formats.klems import KLEMS_BASES
from raymaps.materials.bsdf import BsdfTable, BsdfTableOrFile

#: Polar angles and azimuths of a coarse goniometer.
THETA_S = (0, 15, 30, 45, 60, 75)
PHI_S = (0, 45, 90, 135, 180)


def table_of(text: str, folder: Path, name: str = "table.txt", **fields: object) -> BsdfTable:
    """The table that a file with a text stands for in a scene."""
    (folder / name).write_text(text, encoding="utf-8")
    adapter: TypeAdapter[BsdfTable] = TypeAdapter(BsdfTableOrFile)
    return adapter.validate_python({"file": name, **fields}, context={"folder": folder})


def complaint(text: str | bytes, folder: Path, name: str = "table.txt", **fields: object) -> str:
    """The sentence with which a file is refused."""
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    adapter: TypeAdapter[BsdfTable] = TypeAdapter(BsdfTableOrFile)
    try:
        adapter.validate_python({"file": name, **fields}, context={"folder": folder})
    except ValidationError as error:
        faults = error.errors(include_url=False)
        assert len(faults) == 1, faults
        return str(faults[0]["msg"]).removeprefix("Value error, ")
    raise AssertionError("the file is read")


def is_one_sentence(text: str) -> bool:
    """Whether a text is short, on one line, and free of words of the program."""
    words = ("Traceback", "Error", "Exception", "numpy", "object", "None", "dtype")
    return "\n" not in text and 20 < len(text) < 400 and not any(word in text for word in words)


# ------------------------------------------------------------------------------------------------ own CSV


def csv(
    rows: Iterable[str],
    columns: str = "theta_i,theta_s,phi_s,bsdf",
    header: Iterable[str] = ("from: front", "to: reflection"),
) -> str:
    return "\n".join(["# raymaps-bsdf", *(f"# {line}" for line in header), columns, *rows, ""])


def grid_rows(value: Callable[[float, float, float], str], theta_i: Iterable[float] = (0, 60)) -> list[str]:
    """Rows of a full isotropic grid; value(theta_i, theta_s, phi_s) gives the cells after the angles."""
    return [f"{i},{s},{p},{value(i, s, p)}" for i in theta_i for s in THETA_S for p in (PHI_S if s else (0,))]


# ------------------------------------------------------------------------------------------------ ASTM


def astm(rows: Iterable[str], columns: str = "theta_i,phi_i,theta_s,phi_s,BRDF", header: Iterable[str] = ()) -> str:
    rows = list(rows)
    return "\n".join(["TITLE a small sample", *header, f"NUM_POINTS {len(rows)}", f"VARS {columns}", *rows, ""])


def astm_rows(
    value: Callable[[float, float, float], str], theta_i: Iterable[float] = (0, 60), *, radians: bool = False
) -> list[str]:
    """Rows of a full grid with the source at azimuth 180 degrees, so that specular light goes to azimuth 0."""
    scale = math.pi / 180 if radians else 1
    return [
        f"{i * scale:.6g},{180 * scale:.6g},{s * scale:.6g},{p * scale:.6g},{value(i, s, p)}"
        for i in theta_i
        for s in THETA_S
        for p in PHI_S
    ]


# ------------------------------------------------------------------------------------------------ Klems


def klems_matrix(basis: str, value: float = 0.0, diagonal: NDArray[np.float64] | float = 0.0) -> NDArray[np.float64]:
    """A matrix with one value everywhere, and more on its diagonal."""
    n = len(KLEMS_BASES[basis])
    return np.full((n, n), value) + np.diag(np.broadcast_to(diagonal, n))


def klems(
    matrices: dict[str, NDArray[np.float64]],
    basis: str = "LBNL/Klems Quarter",
    *,
    structure: str = "Columns",
    wavelength: str = '<Wavelength unit="Integral">Visible</Wavelength>',
    definition: str | None = None,
) -> str:
    """A file of WINDOW: matrices[direction][outgoing, incoming] for structure Columns."""
    return klems_of([(wavelength, matrices)], basis, structure=structure, definition=definition)


def klems_of(
    spectra: list[tuple[str, dict[str, NDArray[np.float64]]]],
    basis: str = "LBNL/Klems Quarter",
    *,
    structure: str = "Columns",
    definition: str | None = None,
) -> str:
    blocks = []
    for wavelength, matrices in spectra:
        for direction, matrix in matrices.items():
            numbers = "\n".join("\t".join(f"{value:.9g}," for value in row) for row in matrix)
            blocks.append(
                f"<WavelengthData><LayerNumber>System</LayerNumber>{wavelength}"
                "<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>"
                "<DetectorSpectrum>ASTM E308 1931 Y.dsp</DetectorSpectrum>"
                f"<WavelengthDataBlock><WavelengthDataDirection>{direction}</WavelengthDataDirection>"
                f"<ColumnAngleBasis>{basis}</ColumnAngleBasis><RowAngleBasis>{basis}</RowAngleBasis>"
                f"<ScatteringDataType>{'BTDF' if direction.startswith('T') else 'BRDF'}</ScatteringDataType>"
                f"<ScatteringData>\n{numbers}\n</ScatteringData></WavelengthDataBlock></WavelengthData>"
            )
    definition = definition or f"<AngleBasis><AngleBasisName>{basis}</AngleBasisName></AngleBasis>"
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<WindowElement xmlns="urn:window">\n'
        "<WindowElementType>System</WindowElementType><FileType>BSDF</FileType><Optical><Layer>\n"
        "<Material><Name>small blind</Name><Manufacturer>nobody</Manufacturer></Material>\n"
        f"<DataDefinition><IncidentDataStructure>{structure}</IncidentDataStructure>{definition}</DataDefinition>\n"
        + "\n".join(blocks)
        + "\n</Layer></Optical></WindowElement>\n"
    )
