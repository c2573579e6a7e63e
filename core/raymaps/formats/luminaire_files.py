# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files with the intensities of luminaires, told apart by what they hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from raymaps.errors import FormatError
from raymaps.formats.eulumdat import is_eulumdat, parse_eulumdat
from raymaps.formats.ies import is_ies, parse_ies
from raymaps.formats.text import read_text

__all__ = ["read_luminaire"]


def read_luminaire(path: Path) -> dict[str, Any]:
    """Read a luminaire as the data of a `raymaps.scene.IntensityTable`: IES LM-63 or EULUMDAT.

    Raises
    ------
    FormatError
        If the file can't be read, is damaged, or is of another format.
    """
    text = read_text(path)
    if not text.strip():
        raise FormatError(f"Luminaire file '{path}' is empty.")
    suffix = path.suffix.lower()
    if is_ies(text) or suffix == ".ies":
        return parse_ies(text, path)
    if is_eulumdat(text) or suffix == ".ldt":
        return parse_eulumdat(text, path)
    raise FormatError(
        f"File '{path}' is of no known format of luminaires: neither IES LM-63 (a line TILT=) nor EULUMDAT (counts "
        "in its lines 2 to 7)."
    )
