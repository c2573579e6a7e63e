# SPDX-License-Identifier: LGPL-2.1-or-later
"""Phase functions as text: two columns, scattering angle in degrees and value, separated as in tables of spectra.

A first line of words and lines that begin with ``#`` are passed over. Where semicolons or tabs separate, decimals may
follow a comma. A table that falls from 180 degrees is turned round.
"""

from __future__ import annotations

import re
from pathlib import Path

from raymaps.errors import FormatError
from raymaps.formats.text import numbers_of, read_text, split_lines

__all__ = ["read_phase_function"]

#: Phase functions are of kilobytes.
_LARGEST_BYTES = 16 * 2**20


def read_phase_function(path: Path) -> dict[str, tuple[float, ...]]:
    """Read a phase function.

    Returns
    -------
    dict with ``angle_deg``, which climbs from 0 to 180, and ``value``, tuples of equal length

    Raises
    ------
    FormatError
        If the file can't be read, or does not hold a value of 0 or more for angles from 0 to 180 degrees.
    """
    what = f"Phase function '{path}'"
    rows: list[tuple[float, float, int]] = []
    seen_words = False
    for number, line in enumerate(split_lines(read_text(path, largest_bytes=_LARGEST_BYTES)), 1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        words = _words(line)
        if not rows and not seen_words and words and words[0][0] not in "+-.0123456789":
            seen_words = True
            continue
        where = f"{what}, line {number}"
        if len(words) != 2:
            raise FormatError(f"{where}: an angle in degrees and a value are needed, got '{line[:60]}'.")
        angle_deg, value = numbers_of(words, where)
        if not 0 <= angle_deg <= 180:
            raise FormatError(f"{where}: the scattering angle must be from 0 to 180 degrees, got {angle_deg:g}.")
        if value < 0:
            raise FormatError(f"{where}: a phase function is nowhere below 0, got {value:g}.")
        rows.append((angle_deg, value, number))
    if not rows:
        raise FormatError(f"{what} holds no line with an angle in degrees and a value.")
    if len(rows) > 1 and rows[0][0] > rows[-1][0]:
        rows.reverse()
    for before, after in zip(rows, rows[1:], strict=False):
        if not after[0] > before[0]:
            raise FormatError(
                f"{what}, line {after[2]}: angles must climb from line to line, but {after[0]:g} degrees follow "
                f"{before[0]:g}; sort the lines and leave out what stands twice."
            )
    first, last = rows[0][0], rows[-1][0]
    if first != 0 or last != 180:
        hint = "give the angles in degrees, not in radians" if 3.1 < last < 3.2 else "add what is missing"
        raise FormatError(f"{what} reaches from {first:g} to {last:g} degrees in place of 0 to 180: {hint}.")
    if not any(value > 0 for _, value, _ in rows):
        raise FormatError(f"{what} is 0 at all angles.")
    return {"angle_deg": tuple(row[0] for row in rows), "value": tuple(row[1] for row in rows)}


def _words(line: str) -> list[str]:
    """The two columns of a line, in which decimals follow a point."""
    if ";" in line or "\t" in line:
        return [word.strip().replace(",", ".") for word in re.split(r"[;\t]", line) if word.strip()]
    return [word for word in re.split(r"[, ]+", line) if word]
