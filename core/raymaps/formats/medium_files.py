# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files with a medium, told apart by their names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from raymaps.errors import FormatError

__all__ = ["read_medium"]


def read_medium(
    path: Path, glass: str | None = None, index_by_formula: Callable[..., Any] | None = None
) -> dict[str, Any]:
    """Read a medium as the data of a `raymaps.materials.Medium`.

    Parameters
    ----------
    path : Path
        ``.yml`` or ``.yaml`` of refractiveindex.info, or ``.agf``, a Zemax glass catalogue.
    glass : str, optional
        Name in a catalogue of several glasses.
    index_by_formula : function, optional
        See `raymaps.formats.agf.read_glass`.

    Raises
    ------
    FormatError
        If the file is of neither kind, or can't be read.
    """
    kind = path.suffix.lower()
    if kind == ".agf":
        from raymaps.formats.agf import read_glass

        return read_glass(path, glass, index_by_formula)
    if kind not in (".yml", ".yaml"):
        raise FormatError(
            f"File '{path}' is no medium: allowed are YAML files of refractiveindex.info (.yml, .yaml) and Zemax glass "
            "catalogues (.agf)."
        )
    if glass is not None:
        raise FormatError(f"File '{path}' holds a single medium: leave out the glass '{glass}'.")
    from raymaps.formats.refractiveindex import read_refractiveindex

    return read_refractiveindex(path)
