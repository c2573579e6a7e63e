# SPDX-License-Identifier: LGPL-2.1-or-later
"""Luminaire data files EULUMDAT (LDT): one value a line, intensities in cd per 1000 lm of the lamps.

References
----------
A. Stockmar: EULUMDAT - ein Leuchtendatenformat fuer den europaeischen Beleuchtungsplaner, Licht '90 (1990), p. 641.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError
from raymaps.formats.text import split_lines

__all__ = ["is_eulumdat", "parse_eulumdat"]

#: More cd/klm than any luminaire has: a beam of a hundredth of a degree.
MOST_CANDELA_PER_KLM = 1e11
#: Lines before the sets of lamps, of a set of lamps, and of direct ratios.
_HEAD, _LAMPS, _RATIOS = 26, 6, 10


def is_eulumdat(text: str) -> bool:
    """Whether a text looks like an LDT file: whole numbers where its kind and its counts stand."""
    lines = split_lines(text)
    return len(lines) > _HEAD and all(lines[i].strip().isdigit() for i in (1, 2, 3, 5))


def parse_eulumdat(text: str, path: Path) -> dict[str, Any]:
    """Intensities of an LDT file, symmetric parts written out.

    Returns
    -------
    dict with ``c_deg`` (n_c,), from 0 to 360; ``gamma_deg`` (n_gamma,); ``candela``, n_c rows of n_gamma values

    Raises
    ------
    FormatError
        If the file is damaged.
    """
    lines = _Lines(text, path)
    symmetry = lines.count(3, "symmetry Isym", 0, 4)
    n_c = lines.count(4, "number of C planes Mc", 1, 721)
    n_gamma = lines.count(6, "number of intensities Ng in a plane", 2, 1801)
    n_sets = lines.count(26, "number of sets of lamps", 0, 20)
    divisor = {2: 2, 3: 4, 4: 4}.get(symmetry, 1)
    if n_c % divisor:
        raise FormatError(
            f"EULUMDAT file '{path}': its symmetry {symmetry} needs a number of C planes that {divisor} divides, "
            f"got {n_c}."
        )
    at = _HEAD + _LAMPS * n_sets + _RATIOS
    c = lines.numbers(at + 1, n_c, "C angles")
    gamma = lines.numbers(at + 1 + n_c, n_gamma, "angles gamma")
    _check_angles(c, "C angles", 360.0, path)
    _check_angles(gamma, "angles gamma", 180.0, path)
    if c[0] != 0 or c[-1] >= 360:
        raise FormatError(
            f"EULUMDAT file '{path}': C angles must start at 0 and end before 360 degrees, got {c[0]:g} to {c[-1]:g}."
        )
    # planes that are given, counted from 0 and going on past 360 degrees
    first, last = {
        0: (0, n_c - 1), 1: (0, 0), 2: (0, n_c // 2), 3: (3 * n_c // 4, 3 * n_c // 4 + n_c // 2), 4: (0, n_c // 4),
    }[symmetry]  # fmt: skip
    n_given = last - first + 1
    values = lines.numbers(at + 1 + n_c + n_gamma, n_given * n_gamma, "intensities")
    lines.nothing_after(at + n_c + n_gamma + n_given * n_gamma)
    if values.min() < 0 or values.max() <= 0 or values.max() > MOST_CANDELA_PER_KLM:
        raise FormatError(
            f"EULUMDAT file '{path}': intensities must be from 0 to {MOST_CANDELA_PER_KLM:g} cd/klm and above 0 "
            f"somewhere, got {values.min():g} to {values.max():g}."
        )
    rows = values.reshape(n_given, n_gamma) * _candela_per_value(lines, n_sets)
    given = (np.arange(first, last + 1)) % n_c
    c_all, candela = _all_round(symmetry, c, given, rows, path)
    return {
        "c_deg": tuple(c_all.tolist()),
        "gamma_deg": tuple(gamma.tolist()),
        "candela": tuple(map(tuple, candela.tolist())),
    }


def _candela_per_value(lines: _Lines, n_sets: int) -> float:
    """Factor from cd/klm to cd: the conversion factor, and the flux of the first set of lamps where it is told."""
    factor = lines.number(24, "conversion factor")
    lumens = lines.number_or_none(_HEAD + 3) if n_sets else None
    return (factor if factor > 0 else 1.0) * (lumens if lumens is not None and lumens > 0 else 1000.0) / 1000.0


def _all_round(
    symmetry: int, c: NDArray[np.float64], given: NDArray[np.int64], rows: NDArray[np.float64], path: Path
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Half planes from 0 to 360 degrees, both included."""
    if symmetry == 1:
        return np.array([0.0, 360.0]), np.repeat(rows, 2, axis=0)
    planes = {round(float(c[plane]), 4): row for plane, row in zip(given, rows, strict=True)}
    mirrors = {2: (360.0,), 3: (180.0,), 4: (180.0, 360.0)}.get(symmetry, ())
    for mirror in mirrors:
        planes |= {round((mirror - angle) % 360, 4): row for angle, row in planes.items()}
    angles = np.array(sorted(planes))
    if len(angles) != len(c) or np.abs(angles - c).max() > 1e-3:
        raise FormatError(
            f"EULUMDAT file '{path}': its C angles are not those of its symmetry {symmetry}: mirrored, what it gives "
            f"are {len(angles)} planes other than the {len(c)} that it lists."
        )
    ordered = np.stack([planes[angle] for angle in angles])
    return np.append(angles, 360.0), np.concatenate([ordered, ordered[:1]])


def _check_angles(values: NDArray[np.float64], what: str, largest: float, path: Path) -> None:
    if values[0] < 0 or values[-1] > largest or (np.diff(values) <= 0).any():
        raise FormatError(
            f"EULUMDAT file '{path}': {what} must climb within 0 to {largest:g} degrees, got "
            f"{', '.join(f'{v:g}' for v in values[:4])}{' ...' if len(values) > 4 else ''} to {values[-1]:g}."
        )


class _Lines:
    """The lines of a file, counted from 1."""

    def __init__(self, text: str, path: Path):
        self._path = path
        self._lines = [line.strip() for line in split_lines(text.replace("\x1a", "").rstrip())]

    def _line(self, number: int, what: str) -> str:
        if number > len(self._lines):
            raise FormatError(
                f"EULUMDAT file '{self._path}' ends at line {len(self._lines)}, before its {what}: it is cut short or "
                "its counts are wrong."
            )
        return self._lines[number - 1]

    def number_or_none(self, number: int) -> float | None:
        """A line as a number, with a point or a comma; None if it is not one."""
        if number > len(self._lines):
            return None
        try:
            line = self._lines[number - 1]
            value = float(line.replace(",", ".") if line.isascii() and "_" not in line else "")
        except ValueError:
            return None
        return value if np.isfinite(value) else None

    def number(self, number: int, what: str) -> float:
        """A line as a number."""
        line, value = self._line(number, what), self.number_or_none(number)
        if value is None:
            raise FormatError(f"EULUMDAT file '{self._path}', line {number}: {what}: '{line[:40]}' is not a number.")
        return value

    def numbers(self, first: int, n: int, what: str) -> NDArray[np.float64]:
        """Lines as numbers, (n,) float64."""
        return np.array([self.number(first + i, what) for i in range(n)])

    def count(self, number: int, what: str, least: int, most: int) -> int:
        """A line as a count."""
        value = self.number(number, what)
        if value != int(value) or not least <= value <= most:
            raise FormatError(
                f"EULUMDAT file '{self._path}', line {number}: {what} must be a whole number from {least} to {most}, "
                f"got {value:g}."
            )
        return int(value)

    def nothing_after(self, number: int) -> None:
        """Raise `FormatError` if a line after this one holds anything."""
        for i, line in enumerate(self._lines[number:], number + 1):
            if line:
                raise FormatError(
                    f"EULUMDAT file '{self._path}', line {i}: '{line[:40]}' follows the last intensity: its counts "
                    "are wrong."
                )
