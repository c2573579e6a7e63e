# SPDX-License-Identifier: LGPL-2.1-or-later
"""The catalogue of media that comes with Ray Maps: ``resources/materials/*.json``, each figure with its source."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

from raymaps.errors import unknown_name

__all__ = ["CATALOGUE_FOLDER", "catalogue", "catalogue_medium"]

CATALOGUE_FOLDER = Path(__file__).resolve().parents[3] / "resources" / "materials"


@lru_cache(maxsize=1)
def catalogue() -> dict[str, dict[str, Any]]:
    """All media of the catalogue by name, as they would stand in a scene; in the order of the files."""
    media: dict[str, dict[str, Any]] = {}
    for file in sorted(CATALOGUE_FOLDER.glob("*.json")):
        media.update(json.loads(file.read_text(encoding="utf-8"))["media"])
    return media


def catalogue_medium(name: str) -> dict[str, Any]:
    """One medium of the catalogue, as it would stand in a scene; raises `ValueError` if the name is unknown."""
    media = catalogue()
    if name not in media:
        raise ValueError(unknown_name("medium of the catalogue", name, media))
    return media[name]
