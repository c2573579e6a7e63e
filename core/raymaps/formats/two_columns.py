# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tables as text: two columns, separated by semicolon, tab, comma or blanks.

A first line of words and lines that begin with ``#`` are passed over. Where semicolons or tabs separate, decimals may
follow a comma. A table that falls throughout is turned round.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from raymaps.errors import FormatError
from raymaps.formats.text import numbers_of, read_text, split_lines

__all__ = ["Row", "read_two_columns"]

#: Such tables are of kilobytes.
_LARGEST_BYTES = 16 * 2**20


class Row(NamedTuple):
    """A line of a table."""

    at: float
    value: float
    line: int


def read_two_columns(path: Path, what: str, needed: str, places: str, unit: str) -> list[Row]:
    """Read a table whose first column climbs.

    Parameters
    ----------
    what : str
        What the file is called in errors.
    needed, places, unit : str
        What a line holds, what the first column holds, and its unit: ``a wavelength in nm and a value``,
        ``wavelengths``, ``nm``.

    Raises
    ------
    FormatError
        If the file can't be read, a line does not hold two finite numbers, or the lines are out of order.
    """
    rows: list[Row] = []
    seen_words = False
    for number, line in enumerate(split_lines(read_text(path, largest_bytes=_LARGEST_BYTES)), 1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        cells = _cells(line)
        if not rows and not seen_words and cells and cells[0][0] not in "+-.0123456789":
            seen_words = True
            continue
        where = f"{what}, line {number}"
        if len(cells) != 2:
            raise FormatError(f"{where}: {needed} are needed, got '{line[:60]}'.")
        at, value = numbers_of(cells, where)
        rows.append(Row(at, value, number))
    if not rows:
        raise FormatError(f"{what} holds no line with {needed}.")
    if len(rows) > 1 and all(after.at < before.at for before, after in zip(rows, rows[1:], strict=False)):
        rows.reverse()
    for before, after in zip(rows, rows[1:], strict=False):
        if not after.at > before.at:
            raise FormatError(
                f"{what}, line {after.line}: {places} must climb from line to line, but {after.at:g} {unit} follow "
                f"{before.at:g} {unit}; sort the lines and leave out what stands twice."
            )
    return rows


def _cells(line: str) -> list[str]:
    """The cells of a line, in which decimals follow a point."""
    if ";" in line or "\t" in line:
        return [cell.strip().replace(",", ".") for cell in re.split(r"[;\t]", line) if cell.strip()]
    return [cell for cell in re.split(r"[, ]+", line) if cell]
