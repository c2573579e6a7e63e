# SPDX-License-Identifier: LGPL-2.1-or-later
"""Source files of Zemax OpticStudio (.DAT, .SDF), binary or text: places, direction cosines, and flux of rays.

A binary file is a header of 208 bytes and float32 records of x, y, z, l, m, n, flux and, in the spectral format, the
wavelength in µm. A text file has the number of rays and the code of the unit of length in its first line, then a ray a
line, with or without a wavelength in µm. Of the header only number of rays, unit, and format count, as in OpticStudio.

References
----------
Ansys Zemax OpticStudio help: Source File, Binary Source File format.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError
from raymaps.formats.ray_set import RaySet
from raymaps.formats.text import read_text, split_lines

__all__ = ["HEADER", "IDENTIFIERS", "read_zemax_dat", "read_zemax_text"]

#: First word of a binary file: of .DAT and of .SDF.
IDENTIFIERS = (1010, 8675309)
HEADER = np.dtype(
    [
        ("identifier", "<u4"), ("rays", "<u4"), ("description", "S100"), ("source_flux", "<f4"),
        ("ray_set_flux", "<f4"), ("wavelength_um", "<f4"), ("angles", "<f4", 4),
        ("unit", "<i4"), ("place", "<f4", 3), ("rotation", "<f4", 3),
        ("scale", "<f4", 3), ("unused", "<f4", 4), ("format", "<i4"), ("flux_kind", "<i4"), ("reserved", "<i4", 2),
    ]
)  # fmt: skip
#: Codes of units: metres, inches, centimetres, feet, millimetres.
_MM_PER_UNIT = (1000.0, 25.4, 10.0, 304.8, 1.0)
_FLUX_ONLY, _SPECTRAL = 0, 2


def read_zemax_dat(path: Path) -> RaySet:
    """Read a binary source file; raises `FormatError`."""
    size = os.path.getsize(path)
    if size < HEADER.itemsize:
        raise FormatError(f"Zemax source file '{path}' is cut short: {size} bytes do not hold its header.")
    header = np.fromfile(path, HEADER, 1)[0]
    if header["identifier"] not in IDENTIFIERS:
        raise FormatError(f"Zemax source file '{path}' must begin with 1010, got {header['identifier']}.")
    if header["format"] not in (_FLUX_ONLY, _SPECTRAL) or header["flux_kind"] not in (0, 1):
        raise FormatError(
            f"Zemax source file '{path}': format must be 0 (flux) or 2 (spectral) and kind of flux 0 (W) or 1 (lm), "
            f"got {header['format']} and {header['flux_kind']}."
        )
    n, width = int(header["rays"]), 8 if header["format"] == _SPECTRAL else 7
    if HEADER.itemsize + 4 * width * n != size:
        what = "cut short" if HEADER.itemsize + 4 * width * n > size else "longer than its rays"
        raise FormatError(
            f"Zemax source file '{path}' is {what}: {n} rays of {4 * width} bytes make "
            f"{HEADER.itemsize + 4 * width * n} bytes, it has {size}."
        )
    rays = np.fromfile(path, "<f4", offset=HEADER.itemsize).reshape(n, width)
    return _ray_set(rays, int(header["unit"]), path)


def read_zemax_text(path: Path) -> RaySet:
    """Read a text source file; raises `FormatError`."""
    lines = split_lines(read_text(path))
    numbered = [(i, line) for i, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("!")]
    first = re.fullmatch(r"\s*(\d{1,10})[\s,]+(\d)(?:[\s,].*)?", numbered[0][1]) if numbered else None
    if first is None:
        raise FormatError(
            f"File '{path}' is of no known format of rays: neither TM-25, binary Zemax .DAT, Ray Maps' own, nor a text "
            "that begins with a number of rays and a unit."
        )
    n, unit = int(first[1]), int(first[2])
    if len(numbered) - 1 != n:
        raise FormatError(
            f"Zemax source file '{path}' says that it holds {n} rays, but {len(numbered) - 1} lines follow: it is cut "
            "short or its count is wrong."
        )
    width = len(_cells(numbered[1][1])) if n else 7
    if width not in (7, 8):
        raise FormatError(
            f"Zemax source file '{path}', line {numbered[1][0]}: a ray is x y z l m n flux, and a wavelength or none, "
            f"got {width} values."
        )
    rays = np.empty((n, width))
    for row, (number, line) in zip(rays, numbered[1:], strict=True):
        try:
            row[:] = [float(cell) for cell in _cells(line if line.isascii() and "_" not in line else "_")]
        except ValueError:
            raise FormatError(
                f"Zemax source file '{path}', line {number}: {width} numbers are needed, got '{line.strip()[:60]}'."
            ) from None
    return _ray_set(rays, unit, path)


def _cells(line: str) -> list[str]:
    return line.replace(",", " ").split()


def _ray_set(rays: NDArray[Any], unit: int, path: Path) -> RaySet:
    """Rays as (n, 7 or 8) numbers to a set in mm and nm."""
    if not 0 <= unit < len(_MM_PER_UNIT):
        raise FormatError(
            f"Zemax source file '{path}': unit of length must be 0 (m), 1 (inch), 2 (cm), 3 (foot) or 4 (mm), "
            f"got {unit}."
        )
    with np.errstate(over="ignore"):
        position = rays[:, :3] * rays.dtype.type(_MM_PER_UNIT[unit])
        wavelength = rays[:, 7] * rays.dtype.type(1000.0) if rays.shape[1] == 8 else None
    return RaySet(
        position, rays[:, 3:6].copy(), rays[:, 6].copy(), wavelength_nm=wavelength, where=f"Zemax source file '{path}'"
    )
