# SPDX-License-Identifier: LGPL-2.1-or-later
"""Data files of refractiveindex.info (YAML): a formula or a table of the index n, and a table of the extinction k.

What becomes of k: a medium whose k reaches 0.01 somewhere in the visible (380 to 780 nm; or anywhere, if the table says
nothing of the visible) is a conductor, n + ik, into which no light travels: at that k no more than 1/e of green light
is left after 5 µm. Otherwise k is the absorption of Beer-Lambert's law, a = 4π k / λ.

What lies beyond the wavelengths that a scene may speak of, 10 nm to 1 mm, is left out.

References
----------
M. N. Polyanskiy, Refractiveindex.info database of optical constants, Scientific Data 11 (2024) 94. M. Born, E. Wolf,
Principles of Optics, 7th edition, eq. 14.1 (20) for the absorption coefficient.
"""

from __future__ import annotations

import html
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError
from raymaps.formats.text import numbers_of, read_text

__all__ = ["CONDUCTOR_FROM_K", "read_refractiveindex"]

#: A medium with this extinction somewhere in the visible reflects or absorbs all light at its surface.
CONDUCTOR_FROM_K = 0.01
_VISIBLE_UM = (0.38, 0.78)

#: Wavelengths that a scene may speak of.
_SHORTEST_UM, _LONGEST_UM = 0.01, 1000.0

#: Metals in the far infrared have an n and a k of some hundreds.
_LARGEST_INDEX = 1000.0

#: Rounding leaves values just below 0.
_DUST = -1e-12

#: Data files are of kilobytes.
_LARGEST_BYTES = 4 * 2**20

Table = NDArray[np.float64]


def read_refractiveindex(path: Path) -> dict[str, Any]:
    """Read a data file as the data of a `raymaps.materials.Medium`.

    Raises
    ------
    FormatError
        If the file is no such file, or what it says is not a medium.
    """
    where = f"Refractive index file '{path}'"
    data = _parse(read_text(path, largest_bytes=_LARGEST_BYTES), where)
    blocks = data.get("DATA") if isinstance(data, dict) else None
    if not isinstance(blocks, list) or not blocks:
        raise FormatError(f"{where} holds no list DATA with a formula or a table: it is not of refractiveindex.info.")
    index: list[dict[str, Any]] = []
    extinction: list[Table] = []
    for number, block in enumerate(blocks, 1):
        place = f"{where}, DATA {number}"
        if not isinstance(block, dict) or not isinstance(block.get("type"), str):
            raise FormatError(f"{place}: its type is missing, such as 'formula 2' or 'tabulated nk'.")
        kind = " ".join(block["type"].split())
        if kind.startswith("formula "):
            index.append(_formula(kind, block, place))
        elif kind == "tabulated n":
            index.append(_index_table(_table(block, 2, place), place))
        elif kind == "tabulated k":
            extinction.append(_table(block, 2, place))
        elif kind == "tabulated nk":
            rows = _table(block, 3, place)
            index.append(_index_table(rows, place))
            extinction.append(rows[:, [0, 2]])
        else:
            raise FormatError(
                f"{place}: unknown type '{kind[:40]}'; known: formula 1 to 9, tabulated n, tabulated k, tabulated nk."
            )
    for what, found in (("refractive index n", index), ("extinction k", extinction)):
        if len(found) > 1:
            raise FormatError(f"{where} gives the {what} {len(found)} times; leave one of them in DATA.")
    if not index:
        raise FormatError(f"{where} gives no refractive index n, only an extinction: a medium needs both.")
    return {
        "refractive_index": index[0],
        **(_losses(extinction[0], where) if extinction else {}),
        "reference": _words(data, path),
    }


def _parse(text: str, where: str) -> Any:
    """What the YAML says, every plain value as the text that stands there."""
    import yaml

    class Loader(yaml.BaseLoader):
        """Builds texts, lists and dicts only, and refuses a key that stands twice."""

        def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
            seen = set()
            for key, _ in node.value:
                if key.value in seen:
                    raise yaml.MarkedYAMLError(problem=f"'{key.value[:40]}' stands twice", problem_mark=key.start_mark)
                seen.add(key.value if isinstance(key.value, str) else None)
            return super().construct_mapping(node, deep)

    try:
        return yaml.load(text, Loader)  # a BaseLoader makes no objects
    except yaml.MarkedYAMLError as error:
        line = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise FormatError(f"{where}{line} is not YAML: {error.problem}.") from None
    except (yaml.YAMLError, ValueError) as error:
        raise FormatError(f"{where} is not YAML: {str(error).splitlines()[0]}.") from None
    except RecursionError:
        raise FormatError(f"{where} is nested too deeply to be of refractiveindex.info.") from None


def _formula(kind: str, block: dict[str, Any], place: str) -> dict[str, Any]:
    """A formula of ours with the coefficients of one of theirs."""
    place = f"{place}, {kind}"
    number = kind.removeprefix("formula ")
    if number not in _LARGEST_COUNT:
        raise FormatError(f"{place}: known are formula 1 to formula 9.")
    c = _numbers(block, "coefficients", place)
    if not 1 <= len(c) <= _LARGEST_COUNT[number]:
        raise FormatError(f"{place}: it takes 1 to {_LARGEST_COUNT[number]} coefficients, got {len(c)}.")
    if number in ("1", "2", "3", "5", "6") and len(c) % 2 == 0:
        raise FormatError(
            f"{place}: the coefficients after the first come in pairs, but there are {len(c) - 1} of them."
        )
    limits = _numbers(block, "wavelength_range", place)
    if len(limits) != 2 or not 0 < limits[0] < limits[1]:
        raise FormatError(
            f"{place}: wavelength_range must be two wavelengths in µm that climb, got '{_shown(limits)}'."
        )
    _check_unit(limits, place)
    try:
        name, coefficients = _CONVERSIONS[number](c)
    except (ValueError, OverflowError, ZeroDivisionError):
        raise FormatError(f"{place}: the coefficients '{_shown(c)}' give no real number.") from None
    from_nm, to_nm = (float(f"{1000 * limit:.12g}") for limit in np.clip(limits, _SHORTEST_UM, _LONGEST_UM))
    return {"formula": name, "coefficients": tuple(coefficients), "from_nm": from_nm, "to_nm": to_nm}


def _padded(c: Sequence[float], count: int) -> list[float]:
    return [*c, *[0.0] * (count - len(c))]


def _sellmeier(c: Sequence[float], power: int) -> tuple[str, list[float]]:
    """A constant A is the term A λ² / (λ² − 0); formula 1 has the square roots of the places."""
    constant = [c[0], 0.0] if c[0] != 0 else []
    pairs = [value for b, d in zip(c[1::2], c[2::2], strict=True) for value in (b, d**power)]
    return "sellmeier", constant + pairs or [0.0, 0.0]


def _sellmeier_powers(c: Sequence[float]) -> tuple[str, list[float]]:
    """Their places of the resonances are powers, C4^C5 and C8^C9."""
    c1, s1, e1, p1, q1, s2, e2, p2, q2, *powers = _padded(c, max(9, len(c) + 1 - len(c) % 2))
    place_1 = math.pow(p1, q1) if s1 != 0 else 0.0
    place_2 = math.pow(p2, q2) if s2 != 0 else 0.0
    return "sellmeier_powers", [c1, s1, e1, place_1, s2, e2, place_2, *powers]


#: Numbers of coefficients that the data base allows.
_LARGEST_COUNT = {"1": 17, "2": 17, "3": 17, "4": 17, "5": 11, "6": 11, "7": 6, "8": 4, "9": 6}

_CONVERSIONS = {
    "1": lambda c: _sellmeier(c, 2),
    "2": lambda c: _sellmeier(c, 1),
    "3": lambda c: ("power_series_squared", c),
    "4": _sellmeier_powers,
    "5": lambda c: ("power_series", c),
    "6": lambda c: ("gases", c),
    "7": lambda c: ("herzberger", _padded(c, 3)),
    "8": lambda c: ("lorentz_lorenz", _padded(c, 4)),
    "9": lambda c: ("damped", _padded(c, 6)),
}


def _numbers(block: dict[str, Any], field: str, place: str) -> list[float]:
    text = block.get(field)
    if not isinstance(text, str) or not text.strip():
        raise FormatError(f"{place}: {field} is missing.")
    return numbers_of(text.split(), f"{place}, {field}")


def _table(block: dict[str, Any], columns: int, place: str) -> Table:
    """Rows of a table that climb in wavelength (µm); one that falls throughout is turned round."""
    place = f"{place}, {block['type']}"
    text = block.get("data")
    if not isinstance(text, str) or not text.strip():
        raise FormatError(f"{place}: the table 'data' is missing or empty.")
    rows = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip():
            row = numbers_of(line.split(), f"{place}, row {number}")
            if len(row) != columns:
                raise FormatError(f"{place}, row {number}: {columns} numbers are needed, got '{line.strip()[:60]}'.")
            rows.append(row)
    table = np.array(rows)
    if len(table) > 1 and (np.diff(table[:, 0]) < 0).all():
        table = table[::-1]
    table = table[np.append(True, (np.diff(table, axis=0) != 0).any(axis=1))]  # a row that stands twice is one
    for before, after in zip(table[:, 0], table[1:, 0], strict=False):
        if not after > before:
            raise FormatError(f"{place}: wavelengths must climb from row to row, but {after:g} follows {before:g} µm.")
    if table[0, 0] <= 0:
        raise FormatError(f"{place}: wavelengths must be above 0, got {table[0, 0]:g} µm.")
    for wavelength_um, lowest in zip(table[:, 0], table[:, 1:].min(axis=1), strict=True):
        if lowest < _DUST:
            raise FormatError(f"{place}: nothing may be negative, got {lowest:g} at {wavelength_um:g} µm.")
    _check_unit(table[:, 0], place)
    return table[(table[:, 0] >= _SHORTEST_UM) & (table[:, 0] <= _LONGEST_UM)]


def _check_unit(wavelength_um: Sequence[float] | Table, place: str) -> None:
    """Refuse climbing wavelengths that can hardly be in µm."""
    if wavelength_um[0] >= 100 or wavelength_um[-1] <= 0.01:
        raise FormatError(
            f"{place}: wavelengths from {wavelength_um[0]:g} to {wavelength_um[-1]:g} µm are not of light; this format "
            "is in µm, so divide those in nm by 1000."
        )


def _index_table(rows: Table, place: str) -> dict[str, Any]:
    """The columns of wavelength and n as a table of ours."""
    for wavelength_um, n in rows[:, :2]:
        if not 0 < n <= _LARGEST_INDEX:
            raise FormatError(
                f"{place}: n must be above 0 and at most {_LARGEST_INDEX:g}, got {n:g} at {wavelength_um:g} µm."
            )
    return {"wavelength_nm": _nm(rows), "n": tuple(map(float, rows[:, 1]))}


def _losses(rows: Table, where: str) -> dict[str, Any]:
    """What the extinction k means: that of a conductor, or an absorption."""
    wavelength_um, k = rows.T
    k = np.maximum(k, 0.0)
    if k.max() > _LARGEST_INDEX:
        raise FormatError(f"{where}: the extinction k must be at most {_LARGEST_INDEX:g}, got {k.max():g}.")
    seen = np.clip(_VISIBLE_UM, wavelength_um[0], wavelength_um[-1])
    if seen[0] < seen[1]:
        inside = k[(wavelength_um >= seen[0]) & (wavelength_um <= seen[1])]
        largest = max([*inside, *np.interp(seen, wavelength_um, k)])
    else:
        largest = k.max()
    if largest >= CONDUCTOR_FROM_K:
        return {"extinction": {"wavelength_nm": _nm(rows), "value": tuple(map(float, k))}}
    if k.max() == 0:
        return {}
    per_mm = 4 * math.pi * k / (wavelength_um / 1000)
    return {"absorption_per_mm": {"wavelength_nm": _nm(rows), "value": tuple(float(f"{a:.6g}") for a in per_mm)}}


def _nm(rows: Table) -> tuple[float, ...]:
    """The first column, µm, in nm, without the dust of the multiplication."""
    return tuple(float(f"{1000 * wavelength:.12g}") for wavelength in rows[:, 0])


def _shown(numbers: Sequence[float]) -> str:
    return " ".join(f"{number:g}" for number in numbers)[:60]


def _words(data: dict[str, Any], path: Path) -> str:
    """References and comments as plain text, or the name of the file if there are none."""
    parts = [data.get(field) for field in ("REFERENCES", "COMMENTS")]
    text = " ".join(html.unescape(re.sub(r"<[^<>]*>", " ", part)) for part in parts if isinstance(part, str))
    return " ".join(text.split())[:2000] or f"refractiveindex.info, {path.name}"
