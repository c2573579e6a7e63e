# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writing luminous intensities as IES LM-63-2002 and as EULUMDAT.

Both hold intensities over half planes C at equal steps from 0 and angles gamma from 0 to 180 degrees. All planes are
written: no symmetry is assumed. Decimals are chosen so that the largest value has about six significant digits.

References
----------
ANSI/IESNA LM-63-02: Standard File Format for the Electronic Transfer of Photometric Data and Related Information.
A. Stockmar: EULUMDAT - ein Leuchtendatenformat fuer den europaeischen Beleuchtungsplaner, Licht '90 (1990), p. 641.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError

__all__ = ["Photometry", "eulumdat_text", "ies_text"]

Float = NDArray[np.float64]

#: What readers of EULUMDAT take.
MOST_PLANES, MOST_GAMMAS = 721, 1801
#: Longest line of values.
_LINE = 78


@dataclass(frozen=True)
class Photometry:
    """Luminous intensities over directions.

    Attributes
    ----------
    name : str
        Of the luminaire.
    candela : (n_c, n_gamma) float64, >= 0
        At C = 0, 360/n_c, ... and gamma = 0, ..., 180 degrees.
    luminaire_lm : float
        Luminous flux that leaves the luminaire.
    lamps_lm : float or None
        Luminous flux of the lamps that the candela hold for; None in absolute photometry, which tells of no lamps.
    date : str
    remarks : tuple of str
    """

    name: str
    candela: Float
    luminaire_lm: float
    lamps_lm: float | None
    date: str
    remarks: tuple[str, ...] = ()

    @property
    def c_deg(self) -> Float:
        """Angles C, (n_c,), from 0."""
        n_c = self.candela.shape[0]
        return np.arange(n_c) * (360.0 / n_c)

    @property
    def gamma_deg(self) -> Float:
        """Angles gamma, (n_gamma,), from 0 to 180."""
        n_gamma = self.candela.shape[1]
        return np.arange(n_gamma) * (180.0 / (n_gamma - 1))


def ies_text(of: Photometry) -> str:
    """An LM-63-2002 file: type C, absolute photometry where no lamps are told apart."""
    candela, c_deg = of.candela, of.c_deg
    if len(c_deg) > 1:  # the last half plane is the first
        candela, c_deg = np.concatenate([candela, candela[:1]]), np.append(c_deg, 360.0)
    lumens = -1.0 if of.lamps_lm is None else of.lamps_lm
    lines = [
        "IESNA:LM-63-2002",
        f"[TEST] {_ascii(of.name)}",
        "[TESTLAB] Ray Maps, simulated",
        f"[ISSUEDATE] {_ascii(of.date)}",
        "[MANUFAC]",
        f"[LUMINAIRE] {_ascii(of.name)}",
        *(f"[OTHER] {_ascii(remark, 240)}" for remark in of.remarks),
        "TILT=NONE",
        f"1 {lumens:.8g} 1 {candela.shape[1]} {len(c_deg)} 1 2 0 0 0",
        "1 1 0",
        *_wrapped(_angle(value) for value in of.gamma_deg),
        *_wrapped(_angle(value) for value in c_deg),
    ]
    decimals = _decimals(candela)
    for row in candela:
        lines += _wrapped(f"{value:.{decimals}f}" for value in row)
    return "\r\n".join(lines) + "\r\n"


def eulumdat_text(of: Photometry) -> str:
    """A EULUMDAT file; in absolute photometry the number of lamps is -1 and their flux that of the luminaire.

    Raises
    ------
    FormatError
        If there are more directions than the format holds.
    """
    n_c, n_gamma = of.candela.shape
    if n_c > MOST_PLANES or n_gamma > MOST_GAMMAS:
        raise FormatError(
            f"EULUMDAT holds at most {MOST_PLANES} planes C and {MOST_GAMMAS} angles gamma, got {n_c} and {n_gamma}: "
            "ask for a coarser resolution."
        )
    absolute = of.lamps_lm is None
    lamps_lm = float(f"{of.luminaire_lm if of.lamps_lm is None else of.lamps_lm:.8g}")
    per_klm = of.candela * (1000.0 / lamps_lm)
    remarks = "; ".join(of.remarks)
    lines = [
        "Ray Maps, simulated",
        "1" if n_c == 1 else "3",  # a point source, symmetric about its axis or not
        "1" if n_c == 1 else "0",
        str(n_c), _angle(360.0 / n_c if n_c > 1 else 0.0), str(n_gamma), _angle(180.0 / (n_gamma - 1)),
        _ascii(remarks, 78), _ascii(of.name, 78), "", _ascii(of.name, 8), _ascii(of.date, 78),
        "0", "0", "0", "0", "0", "0", "0", "0", "0",  # no size is told
        f"{100 * _downward_share(of.candela):.4g}",
        f"{100.0 if absolute else 100 * of.luminaire_lm / lamps_lm:.6g}",
        "1", "0",
        "1",
        "-1" if absolute else "1", "simulated", f"{lamps_lm:.8g}", "", "", "0",
        *["0"] * 10,  # direct ratios are not told
        *map(_angle, of.c_deg),
        *map(_angle, of.gamma_deg),
    ]  # fmt: skip
    decimals = _decimals(per_klm)
    lines += [f"{value:.{decimals}f}" for value in per_klm.ravel()]
    return "\r\n".join(lines) + "\r\n"


def _downward_share(candela: Float) -> float:
    """Share of the flux at gamma up to 90 degrees, each value standing for the cell around its direction."""
    n = candela.shape[1] - 1
    edges = np.clip((np.arange(n + 2) - 0.5) * (math.pi / n), 0.0, math.pi)

    def flux(largest: float) -> float:
        cut = np.clip(edges, 0.0, largest)
        return float((candela.mean(axis=0) * -np.diff(np.cos(cut))).sum())

    whole = flux(math.pi)
    return flux(math.pi / 2) / whole if whole > 0 else 0.0


def _decimals(values: Float) -> int:
    """Decimals that leave the largest value about six significant digits."""
    largest = float(values.max())
    return min(max(5 - math.floor(math.log10(largest)), 0), 300) if largest > 0 else 1


def _angle(value: float) -> str:
    return f"{value:.7g}"


def _ascii(text: str, length: int = 78) -> str:
    """Text on one line in ASCII, other characters replaced."""
    plain = text.replace("±", "+-").replace("°", " deg").replace("²", "2").encode("ascii", "replace").decode("ascii")
    return " ".join(plain.split())[:length]


def _wrapped(words: Iterable[str]) -> Sequence[str]:
    """Words in lines."""
    lines, line = [], ""
    for word in words:
        if line and len(line) + 1 + len(word) > _LINE:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}" if line else word
    return [*lines, line]
