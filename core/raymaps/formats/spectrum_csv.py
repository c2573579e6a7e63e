# SPDX-License-Identifier: LGPL-2.1-or-later
"""Spectra as text: two columns, wavelength in nm and value, separated by comma, semicolon, tab or blanks.

A first line of words and lines that begin with ``#`` are passed over.
"""

from __future__ import annotations

import re
from pathlib import Path

from raymaps.errors import FormatError
from raymaps.formats.text import read_text

__all__ = ["read_spectrum"]


def read_spectrum(path: Path) -> dict[str, tuple[float, ...]]:
    """Read a spectrum.

    Returns
    -------
    dict with ``wavelength_nm`` and ``value``, tuples of equal length

    Raises
    ------
    FormatError
        If the file can't be read, or a line does not hold two finite numbers.
    """
    rows: list[tuple[float, float]] = []
    seen_words = False
    for number, line in enumerate(read_text(path).splitlines(), 1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        cells = [cell for cell in re.split(r"[,;\t ]+", line) if cell]
        try:
            values = [float(cell) for cell in cells]
        except ValueError:
            if not rows and not seen_words:
                seen_words = True
                continue
            raise FormatError(f"Spectrum '{path}', line {number}: '{line[:60]}' is not two numbers.") from None
        if len(values) != 2 or not all(abs(value) < float("inf") for value in values):
            raise FormatError(
                f"Spectrum '{path}', line {number}: a wavelength in nm and a value are needed, got '{line[:60]}'."
            )
        rows.append((values[0], values[1]))
    if not rows:
        raise FormatError(f"Spectrum '{path}' holds no line with a wavelength in nm and a value.")
    wavelength_nm, value = zip(*rows, strict=True)
    return {"wavelength_nm": wavelength_nm, "value": value}
