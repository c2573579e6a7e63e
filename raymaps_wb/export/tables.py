# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tables of text files: columns separated by comma, semicolon, tab or blanks; a first line of words; ``#`` comments."""

import os
import re
from collections import namedtuple

from raymaps_wb.errors import ExportError

#: heading: words of the first line, empty if it is numbers. rows: tuples of floats, at least one, all of one length.
Table = namedtuple("Table", "heading rows")

LARGEST_BYTES = 64 * 2**20
SHORTEST_NM, LONGEST_NM = 10.0, 1e6


def read_table(path):
    """Read a table.

    Raises
    ------
    ExportError
        If it can't be read, is not text, or a line is not numbers.
    """
    name = os.path.basename(path)
    heading: tuple[str, ...] = ()
    rows: list[tuple[float, ...]] = []
    for number, line in enumerate(_text(path, name).splitlines(), 1):
        cells = [cell for cell in re.split(r"[,;\t ]+", line.strip()) if cell]
        if not cells or cells[0].startswith("#"):
            continue
        try:
            values = tuple(float(cell) for cell in cells)
        except ValueError:
            if not rows and not heading:
                heading = tuple(cells)
                continue
            raise ExportError(f"File '{name}', line {number}: '{line.strip()[:60]}' is not numbers.") from None
        if not all(abs(value) < float("inf") for value in values):
            raise ExportError(f"File '{name}', line {number}: '{line.strip()[:60]}' holds a number that is not finite.")
        if rows and len(values) != len(rows[0]):
            raise ExportError(f"File '{name}', line {number}: {len(rows[0])} numbers are needed, got {len(values)}.")
        rows.append(values)
    if not rows:
        raise ExportError(f"File '{name}' holds no line with numbers.")
    return Table(heading, rows)


def two_columns(path, what):
    """The columns of a table that has two, as two lists; raises `ExportError`."""
    table = read_table(path)
    if len(table.rows[0]) != 2:
        raise ExportError(
            f"File '{os.path.basename(path)}': two columns are needed ({what}), got {len(table.rows[0])}."
        )
    first, second = (list(column) for column in zip(*table.rows, strict=True))
    _check_ascending(first, path)
    return first, second


def index_table(path):
    """Refractive index over wavelength, as a scene has it; raises `ExportError`."""
    wavelength_nm, n = two_columns(path, "wavelength in nm and refractive index")
    _check_wavelengths(wavelength_nm, path)
    return {"wavelength_nm": wavelength_nm, "n": n}


def spectrum(path):
    """A spectrum, as a scene has it; raises `ExportError`."""
    wavelength_nm, value = two_columns(path, "wavelength in nm and value")
    _check_wavelengths(wavelength_nm, path)
    return {"wavelength_nm": wavelength_nm, "value": value}


def over_angle(path, largest_deg):
    """A function of an angle from 0 on, as a scene has it; raises `ExportError`."""
    angle_deg, value = two_columns(path, "angle in degrees and value")
    _check_angles(angle_deg, path, largest_deg)
    if angle_deg[0] != 0:
        raise ExportError(f"File '{os.path.basename(path)}': the first angle must be 0, got {angle_deg[0]:g}.")
    return {"angle_deg": angle_deg, "value": value}


def is_over_angle(path):
    """Whether a table goes over the angle of incidence: its first line begins with a word such as angle_deg."""
    heading = read_table(path).heading
    return bool(heading) and heading[0].lower().startswith(("angle", "theta", "aoi"))


def share_over_angle(path):
    """A share of light over the angle of incidence and, if the first line names them, wavelengths; as a scene has it.

    Raises
    ------
    ExportError
        If the columns are not those that the first line names.
    """
    table, name = read_table(path), os.path.basename(path)
    columns = [list(column) for column in zip(*table.rows, strict=True)]
    _check_angles(columns[0], path, 90)
    found = {"angle_deg": columns[0], "value": [list(row) for row in zip(*columns[1:], strict=True)]}
    if len(columns) < 2:
        raise ExportError(f"File '{name}': an angle and a value are needed in each line, got one number.")
    if len(columns) == 2 and not _numbers(table.heading[1:]):
        return found
    wavelength_nm = _numbers(table.heading[1:])
    if not wavelength_nm or len(wavelength_nm) != len(columns) - 1:
        raise ExportError(
            f"File '{name}': its first line must name the wavelength in nm of each of the {len(columns) - 1} columns "
            "of values, such as angle_deg, 450, 550, 650."
        )
    _check_ascending(wavelength_nm, path)
    _check_wavelengths(wavelength_nm, path)
    return {"angle_deg": columns[0], "wavelength_nm": wavelength_nm, "value": found["value"]}


def _numbers(cells):
    """Cells such as 450 or 450nm as numbers; None if one is none."""
    try:
        return [float(cell.removesuffix("nm")) for cell in cells]
    except ValueError:
        return None


def _check_ascending(values, path):
    for before, after in zip(values, values[1:], strict=False):
        if not after > before:
            raise ExportError(
                f"File '{os.path.basename(path)}': {after:g} follows {before:g}; wavelengths and angles must climb."
            )


def _check_wavelengths(values, path):
    for value in (values[0], values[-1]):
        if not SHORTEST_NM <= value <= LONGEST_NM:
            hint = " (1 \u00b5m is 1000 nm)" if value < SHORTEST_NM else ""
            raise ExportError(
                f"File '{os.path.basename(path)}': wavelengths must be in nm, from 10 to 1000000; got {value:g}{hint}."
            )


def _check_angles(values, path, largest_deg):
    _check_ascending(values, path)
    if values[0] < 0 or values[-1] > largest_deg:
        raise ExportError(
            f"File '{os.path.basename(path)}': angles must be from 0 to {largest_deg:g} degrees, got {values[0]:g} to "
            f"{values[-1]:g}."
        )


def _text(path, name):
    try:
        if os.path.getsize(path) > LARGEST_BYTES:
            raise ExportError(f"File '{name}' is larger than {LARGEST_BYTES >> 20} MiB: it is not a table.")
        with open(path, "rb") as file:
            data = file.read()
    except OSError as error:
        raise ExportError(f"File '{path}' can't be read: {error.strerror or error}.") from error
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace")
    if b"\0" in data:
        raise ExportError(f"File '{name}' is not a text file.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
