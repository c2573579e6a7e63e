# SPDX-License-Identifier: LGPL-2.1-or-later
"""Spectra as text: two columns, wavelength in nm and value, separated by semicolon, tab, comma or blanks.

A first line of words and lines that begin with ``#`` are passed over. Where semicolons or tabs separate, decimals may
follow a comma. A table that falls throughout is turned round.
"""

from __future__ import annotations

import re
from pathlib import Path

from raymaps.errors import FormatError
from raymaps.formats.text import numbers_of, read_text, split_lines

__all__ = ["read_spectrum"]

#: Spectra are of kilobytes.
_LARGEST_BYTES = 16 * 2**20


def read_spectrum(path: Path) -> dict[str, tuple[float, ...]]:
    """Read a spectrum.

    Returns
    -------
    dict with ``wavelength_nm``, which climbs, and ``value``, tuples of equal length

    Raises
    ------
    FormatError
        If the file can't be read, a line does not hold two finite numbers, or the wavelengths are out of order.
    """
    rows: list[tuple[float, float]] = []
    lines: list[int] = []
    seen_words = False
    for number, line in enumerate(split_lines(read_text(path, largest_bytes=_LARGEST_BYTES)), 1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        cells = _cells(line)
        if not rows and not seen_words and cells and cells[0][0] not in "+-.0123456789":
            seen_words = True
            continue
        where = f"Spectrum '{path}', line {number}"
        if len(cells) != 2:
            raise FormatError(f"{where}: a wavelength in nm and a value are needed, got '{line[:60]}'.")
        wavelength_nm, value = numbers_of(cells, where)
        rows.append((wavelength_nm, value))
        lines.append(number)
    if not rows:
        raise FormatError(f"Spectrum '{path}' holds no line with a wavelength in nm and a value.")
    if len(rows) > 1 and all(after[0] < before[0] for before, after in zip(rows, rows[1:], strict=False)):
        rows, lines = rows[::-1], lines[::-1]
    for (before, _), (after, _), number in zip(rows, rows[1:], lines[1:], strict=False):
        if not after > before:
            raise FormatError(
                f"Spectrum '{path}', line {number}: wavelengths must climb from line to line, but {after:g} nm follows "
                f"{before:g} nm; sort the lines and leave out what stands twice."
            )
    return {"wavelength_nm": tuple(row[0] for row in rows), "value": tuple(row[1] for row in rows)}


def _cells(line: str) -> list[str]:
    """The cells of a line, in which decimals follow a point."""
    if ";" in line or "\t" in line:
        return [cell.strip().replace(",", ".") for cell in re.split(r"[;\t]", line) if cell.strip()]
    return [cell for cell in re.split(r"[, ]+", line) if cell]
