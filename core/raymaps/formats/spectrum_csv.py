# SPDX-License-Identifier: LGPL-2.1-or-later
"""Spectra as text: two columns, wavelength in nm and value; see `raymaps.formats.two_columns`."""

from __future__ import annotations

from pathlib import Path

from raymaps.formats.two_columns import read_two_columns

__all__ = ["read_spectrum"]


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
    rows = read_two_columns(path, f"Spectrum '{path}'", "a wavelength in nm and a value", "wavelengths", "nm")
    return {"wavelength_nm": tuple(row.at for row in rows), "value": tuple(row.value for row in rows)}
