# SPDX-License-Identifier: LGPL-2.1-or-later
"""Own format of BSDFs: a table that a person can write in a spreadsheet.

    # raymaps-bsdf
    # reference: goniometer, sample 12
    # from: front
    # to: reflection
    theta_i, theta_s, phi_s, 450nm, 550nm, 650nm
    0,       specular,    ,  0.02,  0.02,  0.02
    0,       0,      0,      0.25,  0.26,  0.27
    0,       80,     0,      0.25,  0.26,  0.27
    45,      specular,    ,  0.03,  0.03,  0.03
    45,      0,      0,      0.24,  0.25,  0.26
    45,      0 ...
    # to: transmission
    theta_i, theta_s, phi_s, 450nm, 550nm, 650nm
    ...

Separated by commas, semicolons or tabs (with semicolons and tabs a decimal comma is understood). Lines of ``# key:
value`` hold ``from`` (front, back), ``to`` (reflection, transmission), ``reference``, and ``wavelength_nm`` where there
is one column ``bsdf``; other lines with ``#`` are comments. A line of column names starts a table and can follow
another table, so one file holds up to four.

Columns: ``theta_i`` and ``theta_s``, degrees from the normal; ``phi_i`` and ``phi_s``, optional, azimuths in degrees in
which light travels, counter-clockwise as seen from the front; without ``phi_i`` the surface is isotropic and ``phi_s``
counts from the plane of incidence, 0 where specular light goes on to; without ``phi_s`` scattering is the same all
around the normal. Then ``bsdf``, or ``r``, ``g``, ``b``, or a column for each wavelength, ascending, in 1/sr. In a row
with the word ``specular`` for ``theta_s`` these hold the share of light that goes on specularly, beside what scatters.
Rows can stand in any order. How values stand for directions: `raymaps.formats.bsdf_points`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from raymaps.errors import FormatError
from raymaps.formats.bsdf_points import Points, lobe_of_points

__all__ = ["is_bsdf_csv", "parse_bsdf_csv", "value_columns"]

_ANGLES = ("theta_i", "phi_i", "theta_s", "phi_s")
_SIDES = ("front", "back")
_WAYS = ("reflection", "transmission")


@dataclass
class _Table:
    """A table while it is read."""

    line: int
    comes_from: str
    goes_to: str
    columns: list[str]
    layers: tuple[str, ...]
    rows: list[list[float]] = field(default_factory=list)
    specular: dict[tuple[float, float], tuple[float, ...]] = field(default_factory=dict)


def is_bsdf_csv(text: str) -> bool:
    """Whether a text looks like this format."""
    return bool(re.search(r"^\s*\"?#\s*raymaps-bsdf\b", text, re.M)) or bool(
        re.search(r"^\s*\"?theta_i\"?\s*[,;\t]", text, re.M | re.I)
    )


def parse_bsdf_csv(text: str, path: str) -> dict[str, Any]:
    """The data of a `raymaps.materials.BsdfTable`; ``path`` is what the text is called in errors."""
    header: dict[str, str] = {}
    tables: list[_Table] = []
    separator = ","
    for number, line in enumerate(text.splitlines(), 1):
        where = f"BSDF '{path}', line {number}"
        line = line.strip()
        if not line.strip(',;\t" '):
            continue
        if line.lstrip('"').startswith("#"):
            key, colon, value = line.strip('",;\t ').lstrip("# ").partition(":")
            if colon:
                _note(header, key.strip().lower(), value.strip(), where)
            continue
        first = re.split(r"[,;\t]", line)[0].strip('" ').lower()
        if first in _ANGLES:
            separator = next((mark for mark in (";", "\t") if mark in line), ",")
            columns = [cell.strip('" ').lower() for cell in line.split(separator)]
            tables.append(_start(columns, header, number, where))
        elif not tables:
            raise FormatError(
                f"{where}: a line of column names (theta_i, theta_s, ..., bsdf) must come before '{line[:40]}'."
            )
        else:
            cells = [cell.strip('" ') for cell in line.split(separator)]
            _add_row(tables[-1], cells, separator != ",", where)
    if not tables:
        raise FormatError(
            f"BSDF '{path}' holds no table: a line of column names (theta_i, theta_s, ..., bsdf) is needed."
        )
    layers = tables[0].layers
    lobes = []
    for table in tables:
        where = f"BSDF '{path}', {table.goes_to} of light from the {table.comes_from} (line {table.line})"
        if table.layers != layers:
            raise FormatError(
                f"{where}: all tables of a file must have the same columns of values: {', '.join(layers)}."
            )
        if not table.rows and not table.specular:
            raise FormatError(f"{where}: no rows follow the names of the columns.")
        lobes.append(lobe_of_points(_points(table), table.comes_from, table.goes_to, where))
    wavelengths = value_columns(layers, f"BSDF '{path}'")
    if wavelengths is None and "wavelength_nm" in header and layers == ("bsdf",):
        wavelengths = (_number(header["wavelength_nm"], False, f"BSDF '{path}', wavelength_nm"),)
    return {"lobes": tuple(lobes), "wavelength_nm": wavelengths, "reference": header.get("reference")}


def _note(header: dict[str, str], key: str, value: str, where: str) -> None:
    """Keep what a line of the header says."""
    allowed = {"from": _SIDES, "to": _WAYS}.get(key)
    if allowed is not None and value.lower() not in allowed:
        raise FormatError(f"{where}: '{key}' must be {' or '.join(allowed)}, got '{value[:40]}'.")
    header[key] = value if key == "reference" else value.lower()


def _start(columns: list[str], header: dict[str, str], number: int, where: str) -> _Table:
    """A new table under a line of column names."""
    while columns and not columns[-1]:
        columns = columns[:-1]
    for name in columns:
        if columns.count(name) > 1:
            raise FormatError(f"{where}: the column '{name}' stands twice.")
    for name in ("theta_i", "theta_s"):
        if name not in columns:
            raise FormatError(f"{where}: the column '{name}' is missing.")
    if "phi_i" in columns and "phi_s" not in columns:
        raise FormatError(f"{where}: with a column 'phi_i' a column 'phi_s' is needed.")
    layers = tuple(name for name in columns if name not in _ANGLES)
    value_columns(layers, where)
    return _Table(number, header.get("from", "front"), header.get("to", "reflection"), columns, layers)


def value_columns(names: tuple[str, ...], where: str) -> tuple[float, ...] | None:
    """Wavelengths in nm that the names of columns tell; None for ``bsdf`` and for r, g, b."""
    if names in (("bsdf",), ("r", "g", "b")):
        return None
    found = [re.fullmatch(r"(\d+(?:\.\d*)?)\s*nm", name) for name in names]
    if not names or not all(found):
        raise FormatError(
            f"{where}: after the angles a column 'bsdf', or 'r', 'g' and 'b', or one for each wavelength such as "
            f"'550nm' is needed, got {', '.join(repr(name[:20]) for name in names[:6]) or 'none'}."
        )
    wavelengths = tuple(float(match[1]) for match in found if match)
    for before, after in zip(wavelengths, wavelengths[1:], strict=False):
        if after <= before:
            raise FormatError(
                f"{where}: wavelengths must climb from column to column, but {after:g} follows {before:g}."
            )
    return wavelengths


def _add_row(table: _Table, cells: list[str], decimal_comma: bool, where: str) -> None:
    """Take on a row of scattered or of specular light."""
    while len(cells) > len(table.columns) and not cells[-1]:
        cells = cells[:-1]
    if len(cells) != len(table.columns):
        raise FormatError(
            f"{where}: {len(table.columns)} cells are needed ({', '.join(table.columns[:6])}), got {len(cells)}."
        )
    row = dict(zip(table.columns, cells, strict=True))
    is_specular = row["theta_s"].lower() == "specular"
    if is_specular:
        row.update(theta_s="0", phi_s="0")
    numbers = {name: _number(cell, decimal_comma, f"{where}, {name}") for name, cell in row.items()}
    values = tuple(numbers[name] for name in table.layers)
    if min(values) < 0:
        raise FormatError(f"{where}: a {'share' if is_specular else 'BSDF'} must be 0 or more, got {min(values):g}.")
    if not is_specular:
        table.rows.append([numbers.get(name, 0.0) for name in (*_ANGLES, *table.layers)])
        return
    if max(values) > 1:
        raise FormatError(f"{where}: a specular share must be at most 1, got {max(values):g}.")
    key = (numbers["theta_i"], numbers.get("phi_i", 0.0))
    if key in table.specular:
        raise FormatError(f"{where}: the specular share at {key[0]:g} degrees stands twice.")
    if not 0 <= key[0] <= 90:
        raise FormatError(f"{where}: theta_i must be from 0 to 90 degrees, got {key[0]:g}.")
    table.specular[key] = values


def _number(cell: str, decimal_comma: bool, where: str) -> float:
    try:
        value = float(cell.replace(",", ".") if decimal_comma else cell)
    except ValueError:
        raise FormatError(f"{where}: '{cell[:40]}' is not a number.") from None
    if not abs(value) < float("inf"):
        raise FormatError(f"{where}: '{cell[:40]}' is not a finite number.")
    return value


def _points(table: _Table) -> Points:
    rows = np.array(table.rows).reshape(len(table.rows), 4 + len(table.layers))
    return Points(
        rows[:, 0],
        rows[:, 1] if "phi_i" in table.columns else None,
        rows[:, 2],
        rows[:, 3] if "phi_s" in table.columns else None,
        rows[:, 4:],
        table.specular,
    )
