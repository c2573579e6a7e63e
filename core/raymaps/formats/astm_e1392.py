# SPDX-License-Identifier: LGPL-2.1-or-later
"""BSDFs as ASTM E1392 and E2387 exchange them: lines of a keyword and a value, then rows of angles and values.

The keyword ``VARS`` names the columns of the rows that follow it: ``theta_i``, ``phi_i``, ``theta_s``, ``phi_s``, then
one value in 1/sr (``BRDF``, ``BTDF``, ``BSDF`` or any name), three called R, G and B, or one for each wavelength, such
as ``550nm``. ``NUM_POINTS`` tells how many rows there are. Understood besides: ``WAVELENGTH`` with its unit (of a file
with one value), ``ANGLE_UNITS`` (deg or rad), ``SPECULAR_REFLECTANCE`` and ``SPECULAR_TRANSMITTANCE`` (the share that
goes on specularly, at all angles of incidence, beside what scatters). Other keywords are passed over.

Azimuths are those of the positions of source and detector as seen from the sample, so light goes on specularly to phi_s
= phi_i + 180 degrees. Scattered light at theta_s above 90 degrees is transmitted; with a column ``BTDF`` it all is.
Without ``ANGLE_UNITS`` angles are in radians if none is larger than a hemisphere has in radians, as in the files of the
Cornell University light measurement laboratory, else in degrees.

References
----------
ASTM E1392-96(2002), Standard Practice for Angle Resolved Optical Scatter Measurements on Specular or Diffuse Surfaces,
appendix X3; ASTM E2387-05(2011), Standard Practice for Goniometric Optical Scatter Measurements.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError
from raymaps.formats.bsdf_csv import value_columns
from raymaps.formats.bsdf_points import Points, lobe_of_points

__all__ = ["is_astm", "parse_astm"]

Float = NDArray[np.float64]

_ANGLES = ("theta_i", "phi_i", "theta_s", "phi_s")
_NM = {"nm": 1.0, "nanometer": 1.0, "nanometers": 1.0, "um": 1e3, "µm": 1e3, "μm": 1e3, "micron": 1e3, "microns": 1e3,
       "micrometer": 1e3, "micrometers": 1e3}  # fmt: skip


def is_astm(text: str) -> bool:
    """Whether a text looks like this format."""
    return bool(re.search(r"^\s*(VARS|NUM_POINTS)\b", text, re.M | re.I))


def parse_astm(text: str, path: str) -> dict[str, Any]:
    """The data of a `raymaps.materials.BsdfTable`; ``path`` is what the text is called in errors."""
    where = f"ASTM file '{path}'"
    lines = text.splitlines()
    header, start = _header(lines, where)
    columns = [name.strip() for name in re.split(r"[,\s]+", header["VARS"]) if name.strip()]
    lowered = [name.lower() for name in columns]
    if lowered[:4] != list(_ANGLES):
        raise FormatError(f"{where}: VARS must begin with {','.join(_ANGLES)}, got '{header['VARS'][:60]}'.")
    names = tuple(lowered[4:])
    wavelengths = _wavelengths(names, header, where)
    rows = _rows(lines, start, columns, where)
    expected = header.get("NUM_POINTS")
    if expected is not None and expected != str(len(rows)):
        raise FormatError(
            f"{where}: NUM_POINTS says {expected[:20]} rows, but {len(rows)} follow; it may be cut short."
        )
    angles = _degrees(rows[:, :4], header.get("ANGLE_UNITS"), where)
    if rows[:, 4:].min() < 0:
        at = int(np.argmin(rows[:, 4:].min(axis=1)))
        raise FormatError(
            f"{where}, row {at + 1}: a BSDF must be 0 or more, got {rows[at, 4:].min():g}; set what is below the noise "
            "to 0."
        )
    lobes = []
    through = np.full(len(rows), names == ("btdf",)) | (np.abs(angles[:, 2]) > 90)
    if (angles[:, 2] > 180).any():
        raise FormatError(f"{where}: theta_s must be at most 180 degrees, got {angles[:, 2].max():g}.")
    for is_through, goes_to, key in (
        (False, "reflection", "SPECULAR_REFLECTANCE"), (True, "transmission", "SPECULAR_TRANSMITTANCE"),
    ):  # fmt: skip
        mine = through == is_through
        if not mine.any():
            continue
        theta_i, phi_i, theta_s, phi_s = angles[mine].T
        theta_s = np.where(theta_s > 90, 180 - theta_s, np.where(theta_s < -90, -180 - theta_s, theta_s))
        specular = _specular(header.get(key), theta_i, phi_i + 180, len(names), f"{where}, {key}")
        points = Points(theta_i, phi_i + 180, theta_s, phi_s, rows[mine, 4:], specular)
        lobes.append(lobe_of_points(points, "front", goes_to, f"{where}, {goes_to}"))
    return {"lobes": tuple(lobes), "wavelength_nm": wavelengths, "reference": header.get("TITLE")}


def _header(lines: list[str], where: str) -> tuple[dict[str, str], int]:
    """Keywords and their values up to VARS, and the index of the line after it."""
    header: dict[str, str] = {}
    for index, line in enumerate(lines):
        match = re.match(r"\s*([A-Za-z_][\w]*)\s*[:=]?\s*(.*)$", line)
        if match is None:
            if line.strip() and not line.strip().startswith(("#", "!", "*")):
                raise FormatError(
                    f"{where}, line {index + 1}: a keyword is needed before the rows, got '{line.strip()[:40]}'."
                )
            continue
        key, value = match[1].upper(), match[2].strip()
        if key in header and key in ("VARS", "NUM_POINTS", "WAVELENGTH", "ANGLE_UNITS"):
            raise FormatError(f"{where}, line {index + 1}: the keyword {key} stands twice.")
        header[key] = value
        if key == "VARS":
            return header, index + 1
    raise FormatError(f"{where}: the keyword VARS, which names the columns, is missing.")


def _wavelengths(names: tuple[str, ...], header: dict[str, str], where: str) -> tuple[float, ...] | None:
    """Wavelengths in nm of the columns of values, None if they have none."""
    if names in (("x", "y", "z"), ("ccbrdf",), ("ccbsdf",), ("ccbtdf",)):
        what = (
            "tristimulus values X, Y, Z" if len(names) == 3 else f"values with the cosine in them ({names[0].upper()})"
        )
        raise FormatError(f"{where}: {what} can't be used; a BSDF in 1/sr by wavelength, or as R, G, B, is needed.")
    if names == ("r", "g", "b") or len(names) != 1 or names[0].endswith("nm"):
        return value_columns(names, where)
    if "WAVELENGTH" not in header:
        return None
    match = re.fullmatch(r"([\d.]+(?:[eE][-+]?\d+)?)\s*([^\W\d_]*)", header["WAVELENGTH"])
    if match is None or match[2].lower() not in ("", *_NM):
        raise FormatError(f"{where}: WAVELENGTH must be a number and nm or um, got '{header['WAVELENGTH'][:40]}'.")
    if not match[2] and float(match[1]) < 100:
        raise FormatError(f"{where}: WAVELENGTH {match[1]} has no unit: write nm or um after it.")
    return (float(match[1]) * _NM[match[2].lower() or "nm"],)


def _rows(lines: list[str], start: int, columns: list[str], where: str) -> Float:
    """(n_rows, n_columns) numbers after the header."""
    rows = []
    for index in range(start, len(lines)):
        line = lines[index].strip()
        if not line or line.upper() in ("DATA", "END", "BEGIN"):
            continue
        cells = [cell for cell in re.split(r"[,;\s]+", line) if cell]
        try:
            row = [float(cell) for cell in cells]
        except ValueError:
            raise FormatError(f"{where}, line {index + 1}: '{line[:60]}' is not a row of numbers.") from None
        if len(row) != len(columns):
            raise FormatError(f"{where}, line {index + 1}: VARS names {len(columns)} columns, got {len(row)} numbers.")
        if not all(abs(value) < float("inf") for value in row):
            raise FormatError(f"{where}, line {index + 1}: '{line[:60]}' holds a number that is not finite.")
        rows.append(row)
    if not rows:
        raise FormatError(f"{where}: no rows follow VARS.")
    return np.array(rows)


def _degrees(angles: Float, unit: str | None, where: str) -> Float:
    """The four angles of each row in degrees."""
    if unit is not None:
        if unit.lower()[:3] not in ("deg", "rad"):
            raise FormatError(f"{where}: ANGLE_UNITS must be deg or rad, got '{unit[:40]}'.")
        return _from_radians(angles) if unit.lower().startswith("rad") else angles
    polar, azimuth = np.abs(angles[:, (0, 2)]).max(), np.abs(angles[:, (1, 3)]).max()
    if polar > np.pi + 1e-3 or azimuth > 2 * np.pi + 1e-3:
        return angles
    if np.abs(angles[:, 2]).max() < 1:
        raise FormatError(
            f"{where}: angles up to {polar:g} may be degrees or radians: tell by the keyword ANGLE_UNITS."
        )
    return _from_radians(angles)


def _from_radians(angles: Float) -> Float:
    """Degrees, to the hundredth, which is what radians with a few digits tell; about 90 is the horizon."""
    degrees = np.asarray(np.round(np.degrees(angles), 2), np.float64)
    polar = degrees[:, (0, 2)]
    degrees[:, (0, 2)] = np.where(np.isclose(np.abs(polar), 90, atol=0.05), np.copysign(90, polar), polar)
    return degrees


def _specular(
    text: str | None, theta_i: Float, phi_i: Float, n_layers: int, where: str
) -> dict[tuple[float, float], tuple[float, ...]]:
    """The same specular share for all angles of incidence; nothing if the keyword is missing."""
    if text is None:
        return {}
    try:
        share = float(text)
    except ValueError:
        raise FormatError(f"{where}: '{text[:40]}' is not a number.") from None
    if not 0 <= share <= 1:
        raise FormatError(f"{where}: a specular share must be from 0 to 1, got {share:g}.")
    return dict.fromkeys(zip(theta_i.tolist(), phi_i.tolist(), strict=True), (share,) * n_layers)
