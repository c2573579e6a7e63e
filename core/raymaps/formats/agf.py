# SPDX-License-Identifier: LGPL-2.1-or-later
"""Zemax glass catalogues (AGF): formula of the index, its range, and internal transmittance of many glasses.

Read are the lines NM (name, number of the formula, n_d, V_d), CD (coefficients), LD (range in µm) and IT (wavelength in
µm, internal transmittance, thickness in mm), which may run on in lines that begin with a number; TD, ED, OD, GC and
others are passed over: the index is that at the reference temperature and pressure of the catalogue, relative to air.

Internal transmittance T through the thickness d becomes absorption, a = -ln(T) / d. Where a wavelength stands with
several thicknesses the one is taken whose rounding matters least, T nearest to 1/e. A transmittance of 0, which says
that none was measured, is read as 1e-5. Rows that catalogues leave blank, with no transmittance, -999 or no thickness,
are passed over.

References
----------
Zemax Optical Design Program, User's Manual (2011), chapter "Using glass catalogs".
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from raymaps.errors import FormatError, unknown_name
from raymaps.formats.text import numbers_of, read_text

__all__ = ["glass_names", "read_glass"]

#: What a transmittance that is printed as 0 is read as: an optical density of 5.
_LEAST_TRANSMITTANCE = 1e-5

#: Marks a transmittance that was not measured.
_NOT_MEASURED = -999.0

#: Catalogues give n_d to five or six digits; a larger difference from the formula says that one of them is damaged.
_TOLERANCE_OF_ND = 0.005
_D_LINE_UM = 0.5875618

#: Catalogues of one maker are of one or two megabytes.
_LARGEST_BYTES = 32 * 2**20

Coefficients = Sequence[float]
#: Index by a formula of `raymaps.materials.dispersion`: its name, its coefficients and a wavelength in nm.
IndexByFormula = Callable[[str, tuple[float, ...], float], Any]


@dataclass(frozen=True)
class _Formula:
    """A formula of Zemax, and how its coefficients are those of a formula of ours."""

    name: str
    count: int
    convert: Callable[[Coefficients], tuple[str, Sequence[float]]]


def _even_powers(c: Coefficients, exponents: Sequence[int]) -> tuple[str, list[float]]:
    """c₀ + Σ c λ^e for the square of the index."""
    return "power_series_squared", [c[0], *(value for pair in zip(c[1:], exponents, strict=True) for value in pair)]


_FORMULAS = {
    1: _Formula("Schott", 6, lambda c: ("schott", c)),
    2: _Formula("Sellmeier 1", 6, lambda c: ("sellmeier", c)),
    3: _Formula("Herzberger", 6, lambda c: ("herzberger", c)),
    4: _Formula("Sellmeier 2", 5, lambda c: ("sellmeier_powers", [1 + c[0], c[1], 2, c[2] ** 2, c[3], 0, c[4] ** 2])),
    5: _Formula("Conrady", 3, lambda c: ("conrady", c)),
    6: _Formula("Sellmeier 3", 8, lambda c: ("sellmeier", c)),
    7: _Formula("Handbook of Optics 1", 4, lambda c: ("sellmeier_powers", [c[0], c[1], 0, c[2], 0, 0, 0, -c[3], 2])),
    8: _Formula("Handbook of Optics 2", 4, lambda c: ("sellmeier_powers", [c[0], c[1], 2, c[2], 0, 0, 0, -c[3], 2])),
    9: _Formula("Sellmeier 4", 5, lambda c: ("sellmeier_powers", [c[0], c[1], 2, c[2], c[3], 2, c[4]])),
    10: _Formula("Extended", 8, lambda c: ("schott", c)),
    11: _Formula("Sellmeier 5", 10, lambda c: ("sellmeier", c)),
    12: _Formula("Extended 2", 8, lambda c: _even_powers(c, (2, -2, -4, -6, -8, 4, 6))),
    13: _Formula("Extended 3", 9, lambda c: _even_powers(c, (2, 4, -2, -4, -6, -8, -10, -12))),
}


@dataclass
class _Glass:
    """The lines of a glass: (number of the line, its words)."""

    line: int
    heading: list[str]
    fields: dict[str, list[tuple[int, list[str]]]] = field(default_factory=dict)

    @property
    def data(self) -> list[Any]:
        """What the lines say, wherever they stand."""
        return [self.heading[1], *((keyword, words) for keyword in self.fields for _, words in self.fields[keyword])]


def glass_names(path: Path) -> tuple[str, ...]:
    """Names of the glasses of a catalogue, in its order; raises `FormatError`."""
    return tuple(_glasses(path))


def read_glass(path: Path, glass: str | None = None, index_by_formula: IndexByFormula | None = None) -> dict[str, Any]:
    """Read a glass as the data of a `raymaps.materials.Medium`.

    Parameters
    ----------
    path : Path
    glass : str, optional
        Its name; a catalogue of a single glass needs none.
    index_by_formula : function, optional
        By which the index that the coefficients give is compared with the n_d that the catalogue states.

    Raises
    ------
    FormatError
        If the file is no such catalogue, has no such glass, or what it says of the glass can't be.
    """
    glasses = _glasses(path)
    if glass is None:
        if len(glasses) > 1:
            raise FormatError(f"Glass catalogue '{path}' holds {len(glasses)} glasses: say which one by 'glass'.")
        glass = next(iter(glasses))
    if glass not in glasses:
        alike = [name for name in glasses if name.casefold() == glass.casefold()]
        if len(alike) != 1:
            nearest = difflib.get_close_matches(glass.upper(), glasses, n=12, cutoff=0.0)
            sentence = unknown_name("glass", glass, nearest + [name for name in glasses if name not in nearest])
            raise FormatError(f"Glass catalogue '{path}': {sentence[:1].lower()}{sentence[1:]}")
        glass = alike[0]
    found = glasses[glass]
    if len(found) > 1 and any(other.data != found[0].data for other in found):
        lines = " and ".join(str(entry.line) for entry in found)
        raise FormatError(f"Glass catalogue '{path}': glass '{glass}' stands in lines {lines} with different data.")
    return _medium(path, glass, found[0], index_by_formula)


def _glasses(path: Path) -> dict[str, list[_Glass]]:
    """The lines of each glass by its name; a name can stand several times."""
    glasses: dict[str, list[_Glass]] = {}
    current: _Glass | None = None
    before = ""
    for number, line in enumerate(read_text(path, largest_bytes=_LARGEST_BYTES).splitlines(), 1):
        words = line.split()
        keyword = words[0] if words else ""
        if keyword == "NM":
            if len(words) < 3:
                raise FormatError(
                    f"Glass catalogue '{path}', line {number}: NM needs a name and the number of a formula, got "
                    f"'{line.strip()[:60]}'."
                )
            current = _Glass(number, words[1:])
            glasses.setdefault(words[1], []).append(current)
        elif keyword in ("CD", "LD", "IT") and current is not None:
            current.fields.setdefault(keyword, []).append((number, words[1:]))
        elif keyword[:1] in "+-.0123456789" and before in ("CD", "LD", "IT") and current is not None:
            current.fields[before][-1][1].extend(words)
            continue
        before = keyword
    if not glasses:
        raise FormatError(
            f"File '{path}' is no Zemax glass catalogue: none of its lines begins with NM, the name of a glass."
        )
    return glasses


def _medium(path: Path, name: str, glass: _Glass, index_by_formula: IndexByFormula | None) -> dict[str, Any]:
    where = f"Glass catalogue '{path}', glass '{name}'"
    place = f"{where}, line {glass.line}"
    number, *stated = numbers_of(glass.heading[1:2] + glass.heading[3:4], place)
    formula = _FORMULAS.get(int(number)) if number == int(number) else None
    if formula is None:
        raise FormatError(f"{place}: formula {number:g} is unknown; known are the numbers 1 to 13.")
    line, words = _single(glass, "CD", where)
    c = numbers_of(words, f"{where}, line {line}")
    if len(c) < formula.count:
        raise FormatError(f"{where}, line {line}: {formula.name} needs {formula.count} coefficients, got {len(c)}.")
    if any(c[formula.count :]):
        raise FormatError(
            f"{where}, line {line}: {formula.name} has {formula.count} coefficients, but further ones are not 0; "
            f"check the number of the formula in line {glass.line}."
        )
    kind, coefficients = formula.convert(c[: formula.count])
    index: dict[str, Any] = {"formula": kind, "coefficients": tuple(map(float, coefficients))}
    if "LD" in glass.fields:
        index["from_nm"], index["to_nm"] = _range_nm(*_single(glass, "LD", where), where)
    if index_by_formula and index.get("from_nm", 0) <= 1000 * _D_LINE_UM <= index.get("to_nm", math.inf):
        # catalogues state 1 or 0 for glasses that they have no n_d of
        given = float(index_by_formula(kind, index["coefficients"], 1000 * _D_LINE_UM))
        if stated and stated[0] > 1 and not abs(given - stated[0]) <= _TOLERANCE_OF_ND:
            raise FormatError(
                f"{place}: the catalogue states the index n_d {stated[0]:g}, but its formula {formula.name} with the "
                f"coefficients of line {line} gives {given:.5f}: one of them is wrong."
            )
    absorption = _absorption(glass.fields.get("IT", []), where)
    return {
        "refractive_index": index,
        **({"absorption_per_mm": absorption} if absorption else {}),
        "reference": f"Glass {name} of the catalogue {path.name}; index relative to air",
    }


def _single(glass: _Glass, keyword: str, where: str) -> tuple[int, list[str]]:
    """The one line of a glass with a keyword: its number and words."""
    lines = glass.fields.get(keyword, [])
    if len(lines) != 1:
        raise FormatError(
            f"{where}, line {glass.line}: one line {keyword} must follow NM, found {len(lines)}"
            + ("; the file may have been cut short." if not lines else ".")
        )
    return lines[0]


def _range_nm(line: int, words: list[str], where: str) -> tuple[float, float]:
    limits = numbers_of(words, f"{where}, line {line}")
    if len(limits) != 2 or not 0 < limits[0] < limits[1]:
        raise FormatError(
            f"{where}, line {line}: LD must be two wavelengths in µm that climb, got '{' '.join(words)[:60]}'."
        )
    _check_unit(limits, f"{where}, line {line}")
    return float(f"{1000 * limits[0]:.12g}"), float(f"{1000 * limits[1]:.12g}")


def _check_unit(wavelength_um: Sequence[float], place: str) -> None:
    """Refuse wavelengths that can't be in µm."""
    for wavelength in wavelength_um:
        if not 0.01 <= wavelength < 100:
            raise FormatError(f"{place}: a wavelength of {wavelength:g} can't be in µm, which glass catalogues are in.")


def _absorption(lines: list[tuple[int, list[str]]], where: str) -> dict[str, Any] | None:
    """Internal transmittances as a table of the absorption coefficient in 1/mm; None if the glass is clear."""
    best: dict[float, tuple[float, float]] = {}  # wavelength: how much the row tells, absorption
    for line, words in lines:
        place = f"{where}, line {line}"
        row = numbers_of(words, place)
        if len(row) < 2 or len(row) > 3:
            raise FormatError(
                f"{place}: IT must be wavelength, transmittance and thickness, got '{' '.join(words)[:60]}'."
            )
        _check_unit(row[:1], place)
        if len(row) == 2 or row[1] == _NOT_MEASURED or row[2] == 0:
            continue
        wavelength_um, transmittance, thickness_mm = row
        if not 0 <= transmittance <= 1:
            raise FormatError(f"{place}: internal transmittance must be from 0 to 1, got {transmittance:g}.")
        if not 0 < thickness_mm <= 1000:
            raise FormatError(f"{place}: the thickness must be above 0 and at most 1000 mm, got {thickness_mm:g}.")
        depth = -math.log(max(transmittance, _LEAST_TRANSMITTANCE))
        told = transmittance * depth  # the error of a by rounding of T is relative to 1 / (T |ln T|)
        if wavelength_um not in best or (told, depth / thickness_mm) > best[wavelength_um]:
            best[wavelength_um] = (told, depth / thickness_mm)
    if not any(per_mm for _, per_mm in best.values()):
        return None
    wavelengths = sorted(best)
    return {
        "wavelength_nm": tuple(float(f"{1000 * wavelength:.12g}") for wavelength in wavelengths),
        "value": tuple(float(f"{best[wavelength][1]:.6g}") for wavelength in wavelengths),
    }
