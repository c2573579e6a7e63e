# SPDX-License-Identifier: LGPL-2.1-or-later
"""The catalogue of media that comes with Ray Maps: ``resources/materials/*.json``, each figure with its source.

Each file is ``{"media": {name: medium}}`` with media as they stand in a scene. Indices of solids are relative to air,
as their makers give them: they belong into a scene whose ambient is left out or has the index 1.
"""

from __future__ import annotations

import copy
import difflib
import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from raymaps.errors import unknown_name

__all__ = ["CATALOGUE_FOLDER", "catalogue", "catalogue_medium"]

CATALOGUE_FOLDER = Path(__file__).resolve().parents[3] / "resources" / "materials"


@lru_cache(maxsize=1)
def catalogue() -> Mapping[str, Any]:
    """All media of the catalogue by name, as they would stand in a scene; in the order of the files."""
    media: dict[str, Any] = {}
    for file in sorted(CATALOGUE_FOLDER.glob("*.json")):
        media.update(json.loads(file.read_text(encoding="utf-8"))["media"])
    return MappingProxyType(media)


def catalogue_medium(name: str) -> dict[str, Any]:
    """One medium of the catalogue, as it would stand in a scene.

    Raises
    ------
    ValueError
        If the name is unknown, with names that are like it; or if the catalogue is missing.
    """
    media = catalogue()
    if not media:
        raise ValueError(f"the catalogue of media is missing: there should be files in '{CATALOGUE_FOLDER}'")
    if name not in media:
        by_key = {known.casefold(): known for known in media}
        nearest = [by_key[key] for key in difflib.get_close_matches(name.casefold(), by_key, n=12, cutoff=0.5)]
        known = [*nearest, *(other for other in media if other not in nearest)]
        raise ValueError(unknown_name("medium of the catalogue", name, known))
    return copy.deepcopy(media[name])
