# SPDX-License-Identifier: LGPL-2.1-or-later
"""Photometric files of the IES: LM-63 of 1986, 1991, 1995, 2002 and 2019, photometry of type C.

A file holds words up to a line ``TILT=``, then numbers: 13 that say what follows, vertical angles, horizontal angles,
and candela by horizontal angle. Factors of tilted luminaires are passed over: they say how a lamp dims when turned.

References
----------
ANSI/IESNA LM-63-02: Standard File Format for the Electronic Transfer of Photometric Data and Related Information.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError
from raymaps.formats.text import split_lines

__all__ = ["is_ies", "parse_ies"]

#: More values than any measurement has, and more candela than any lamp.
MOST_VALUES, MOST_CANDELA = 4_000_000, 1e11
#: A last half plane that stands this near to another counts as it.
NEAR_DEG = 1e-3

_TILT = re.compile(r"\s*TILT\s*=\s*(.*?)\s*$", re.IGNORECASE)
#: First lines of the versions in which the 12th number is a factor of the lamp; later ones use it for other ends.
_WITH_LAMP_FACTOR = ("IESNA86", "IESNA91", "IESNA:LM-63-1986", "IESNA:LM-63-1991", "IESNA:LM-63-1995")


def is_ies(text: str) -> bool:
    """Whether a text is meant as an LM-63 file."""
    return text.lstrip()[:4].upper().startswith(("IESN", "IES:")) or any(map(_TILT.match, split_lines(text)))


def parse_ies(text: str, path: Path) -> dict[str, Any]:
    """Intensities of an LM-63 file, symmetric halves and quarters written out.

    Returns
    -------
    dict with ``c_deg`` (n_c,), from 0 to 360; ``gamma_deg`` (n_gamma,); ``candela``, n_c rows of n_gamma values

    Raises
    ------
    FormatError
        If the file is damaged, or of photometry of type A or B.
    """
    lines = split_lines(text)
    tilt = next((i for i, line in enumerate(lines) if _TILT.match(line)), None)
    if tilt is None:
        raise FormatError(f"IES file '{path}' has no line TILT=: it is cut short or of another format.")
    numbers = _Numbers(lines, tilt + 1, path)
    match = _TILT.match(lines[tilt])
    if match is not None and match.group(1).upper() == "INCLUDE":
        numbers.take(1, "lamp-to-luminaire geometry")
        numbers.take(2 * numbers.count("number of tilt angles", 1), "tilt angles and factors")

    numbers.take(2, "number of lamps and lumens per lamp")
    multiplier = numbers.take(1, "multiplier")[0]
    n_gamma, n_c = numbers.count("number of vertical angles", 2), numbers.count("number of horizontal angles", 1)
    if n_gamma * n_c > MOST_VALUES:
        raise FormatError(
            f"IES file '{path}': {n_gamma} vertical and {n_c} horizontal angles are more than a measurement has: its "
            "numbers are not those of an IES file."
        )
    _check_kind(numbers, path)
    numbers.take(3, "size of the luminous opening")
    ballast, lamp_factor, _ = numbers.take(3, "ballast factor, lamp factor and input watts")
    if lines[0].strip().upper().startswith(_WITH_LAMP_FACTOR) or not lines[0].strip().upper().startswith("IES"):
        ballast *= lamp_factor
    if not (multiplier > 0 and ballast > 0):
        raise FormatError(
            f"IES file '{path}': multiplier and ballast factors must be above 0, got {multiplier:g} and {ballast:g}."
        )
    gamma = numbers.angles(n_gamma, "vertical", 180.0)
    c = numbers.angles(n_c, "horizontal", 360.0)
    candela = numbers.take(n_gamma * n_c, "candela values").reshape(n_c, n_gamma) * (multiplier * ballast)
    numbers.nothing_left()
    if candela.min() < 0 or candela.max() <= 0 or candela.max() > MOST_CANDELA:
        raise FormatError(
            f"IES file '{path}': candela values must be from 0 to {MOST_CANDELA:g} and above 0 somewhere, got "
            f"{candela.min():g} to {candela.max():g}."
        )
    c, candela = _all_round(c, candela, path)
    return {
        "c_deg": tuple(c.tolist()),
        "gamma_deg": tuple(gamma.tolist()),
        "candela": tuple(map(tuple, candela.tolist())),
    }


def _check_kind(numbers: _Numbers, path: Path) -> None:
    """Photometric type and unit, as far as they decide what the rest means."""
    kind, unit = (int(number) for number in numbers.take(2, "photometric type and unit"))
    if kind in (2, 3):
        raise FormatError(
            f"IES file '{path}' is of photometry of type {'B' if kind == 2 else 'A'}; only type C is read: convert it."
        )
    if kind != 1 or unit not in (1, 2):
        raise FormatError(
            f"IES file '{path}': photometric type must be 1 (C) and unit 1 (feet) or 2 (metres), got {kind} and {unit}."
        )


def _all_round(
    c: NDArray[np.float64], candela: NDArray[np.float64], path: Path
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Half planes from 0 to 360 degrees, both included."""
    first, last = c[0], c[-1]
    if len(c) == 1:
        return np.array([0.0, 360.0]), np.repeat(candela, 2, axis=0)
    if abs(first) < NEAR_DEG and abs(last - 90) < NEAR_DEG:  # alike in all quadrants
        c = np.concatenate([c, 180 - c[-2::-1]])
        candela = np.concatenate([candela, candela[-2::-1]])
        last = 180.0
    elif abs(first - 90) < NEAR_DEG and abs(last - 270) < NEAR_DEG:  # alike on both sides of the plane 90 - 270
        middle = np.interp(180.0, c, np.arange(len(c)))
        if abs(c[round(middle)] - 180) > NEAR_DEG:
            raise FormatError(f"IES file '{path}': half planes from 90 to 270 degrees need one at 180.")
        half = round(middle)
        right = 180 - c[: half + 1][::-1]  # from 0 to 90
        left = 540 - c[half:][::-1]  # from 270 to 360
        c = np.concatenate([right, c[1:-1], left])
        candela = np.concatenate([candela[: half + 1][::-1], candela[1:-1], candela[half:][::-1]])
        first, last = 0.0, 360.0
    if abs(first) < NEAR_DEG and abs(last - 180) < NEAR_DEG:  # alike on both sides of the plane 0 - 180
        c = np.concatenate([c, 360 - c[-2::-1]])
        candela = np.concatenate([candela, candela[-2::-1]])
        last = 360.0
    elif abs(first) < NEAR_DEG and 180 < last < 360 - NEAR_DEG and 360 - last <= 1.5 * np.diff(c).max():
        c, candela = np.append(c, 360.0), np.concatenate([candela, candela[:1]])
        last = 360.0
    if abs(first) > NEAR_DEG or abs(last - 360) > NEAR_DEG:
        raise FormatError(
            f"IES file '{path}': horizontal angles must be 0 alone or go from 0 to 90, 180 or 360 or from 90 to 270 "
            f"degrees, got {first:g} to {last:g}."
        )
    c = c.copy()
    c[0], c[-1] = 0.0, 360.0
    return c, candela


class _Numbers:
    """The numbers of a file in their order, with their lines."""

    def __init__(self, lines: list[str], first_line: int, path: Path):
        self._path = path
        self._words = [
            (word, number)
            for number, line in enumerate(lines[first_line:], first_line + 1)
            for word in line.replace("\x1a", " ").replace(",", " ").split()
        ]
        self._at = 0

    def take(self, n: int, what: str) -> NDArray[np.float64]:
        """The next n numbers, (n,) float64."""
        words = self._words[self._at : self._at + n]
        if len(words) < n:
            raise FormatError(
                f"IES file '{self._path}' ends after {len(words)} of {n} values of its {what}: it is cut short or its "
                "counts are wrong."
            )
        self._at += n
        values = np.empty(n)
        for i, (word, line) in enumerate(words):
            try:
                values[i] = float(word if word.isascii() and "_" not in word else "")
            except ValueError:
                values[i] = np.nan
            if not np.isfinite(values[i]):
                raise FormatError(f"IES file '{self._path}', line {line}: {what}: '{word[:40]}' is not a number.")
        return values

    def count(self, what: str, least: int) -> int:
        """The next number as a count."""
        line = self._words[self._at][1] if self._at < len(self._words) else 0
        value = float(self.take(1, what)[0])
        if value != int(value) or value < least:
            raise FormatError(
                f"IES file '{self._path}', line {line}: {what} must be a whole number of at least {least}, "
                f"got {value:g}."
            )
        return int(value)

    def angles(self, n: int, what: str, largest: float) -> NDArray[np.float64]:
        """The next n numbers as climbing angles in degrees."""
        values = self.take(n, f"{what} angles")
        if values[0] < 0 or values[-1] > largest or (np.diff(values) <= 0).any():
            raise FormatError(
                f"IES file '{self._path}': {what} angles must climb within 0 to {largest:g} degrees, got "
                f"{', '.join(f'{v:g}' for v in values[:4])}{' ...' if n > 4 else ''} to {values[-1]:g}."
            )
        return values

    def nothing_left(self) -> None:
        """Raise `FormatError` if numbers are left."""
        if self._at < len(self._words):
            word, line = self._words[self._at]
            raise FormatError(
                f"IES file '{self._path}', line {line}: '{word[:40]}' follows the last candela value: its counts "
                "are wrong."
            )
