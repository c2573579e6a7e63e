# SPDX-License-Identifier: LGPL-2.1-or-later
"""Phase functions as text: two columns, scattering angle in degrees and value; see `raymaps.formats.two_columns`."""

from __future__ import annotations

from pathlib import Path

from raymaps.errors import FormatError
from raymaps.formats.two_columns import read_two_columns

__all__ = ["read_phase_function"]


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
    rows = read_two_columns(path, what, "an angle in degrees and a value", "angles", "degrees")
    for angle_deg, value, line in rows:
        if not 0 <= angle_deg <= 180:
            raise FormatError(
                f"{what}, line {line}: the scattering angle must be from 0 to 180 degrees, got {angle_deg:g}."
            )
        if value < 0:
            raise FormatError(f"{what}, line {line}: a phase function is nowhere below 0, got {value:g}.")
    first, last = rows[0].at, rows[-1].at
    if first != 0 or last != 180:
        hint = "give the angles in degrees, not in radians" if 3.1 < last < 3.2 else "add what is missing"
        raise FormatError(f"{what} reaches from {first:g} to {last:g} degrees in place of 0 to 180: {hint}.")
    if not any(row.value > 0 for row in rows):
        raise FormatError(f"{what} is 0 at all angles.")
    return {"angle_deg": tuple(row.at for row in rows), "value": tuple(row.value for row in rows)}
