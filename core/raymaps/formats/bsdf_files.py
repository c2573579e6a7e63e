# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files with measured scattering, told apart by what they hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from raymaps.errors import FormatError
from raymaps.formats.astm_e1392 import is_astm, parse_astm
from raymaps.formats.bsdf_csv import is_bsdf_csv, parse_bsdf_csv
from raymaps.formats.klems import is_klems, parse_klems
from raymaps.formats.text import read_text

__all__ = ["read_bsdf"]


def read_bsdf(path: Path, spectrum: str = "visible") -> dict[str, Any]:
    """Read a BSDF as the data of a `raymaps.materials.BsdfTable`.

    Parameters
    ----------
    spectrum : "visible" or "solar"
        Which of the integrals of a Klems file to take.

    Raises
    ------
    FormatError
        If the file can't be read, is damaged or is of no known format.
    """
    text = read_text(path)
    if not text.strip():
        raise FormatError(f"BSDF '{path}' is empty.")
    if is_klems(text):
        return parse_klems(text, str(path), spectrum)
    if is_bsdf_csv(text):
        return parse_bsdf_csv(text, str(path))
    if is_astm(text):
        return parse_astm(text, str(path))
    raise FormatError(
        f"File '{path}' is of no known format of BSDF: own CSV (it has a line of column names with theta_i), Klems XML "
        "(it begins with '<') and ASTM E1392 (it has a line VARS) are known."
    )
