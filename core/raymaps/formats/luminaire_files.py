# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files with the intensities of luminaires, told apart by what they hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from raymaps.errors import FormatError

__all__ = ["read_luminaire"]


def read_luminaire(path: Path) -> dict[str, Any]:
    """Read a luminaire as the data of a `raymaps.scene.IntensityTable`; raises `FormatError`."""
    raise FormatError(f"File '{path}' is of no known format of luminaires.")
