# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files with measured scattering, told apart by what they hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from raymaps.errors import FormatError

__all__ = ["read_bsdf"]


def read_bsdf(path: Path) -> dict[str, Any]:
    """Read a BSDF as the data of a `raymaps.materials.BsdfTable`; raises `FormatError`."""
    raise FormatError(f"File '{path}' is of no known format of BSDF.")
