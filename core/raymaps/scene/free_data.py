# SPDX-License-Identifier: LGPL-2.1-or-later
"""Data of others that a scene carries along."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import AfterValidator

__all__ = ["FreeData"]

#: Levels that data which the program only passes on may be nested.
MAX_FREE_DEPTH = 32


def _is_plain(data: Any, depth: int = 0) -> bool:
    """Whether data can be written as JSON and read again."""
    if depth > MAX_FREE_DEPTH:
        return False
    if isinstance(data, dict):
        return all(
            isinstance(key, str) and _is_plain(key) and _is_plain(value, depth + 1) for key, value in data.items()
        )
    if isinstance(data, list):
        return all(_is_plain(value, depth + 1) for value in data)
    if isinstance(data, str):
        return not any("\ud800" <= c <= "\udfff" for c in data)
    return data is None or (isinstance(data, bool | int | float) and math.isfinite(data))


def _plain(data: dict[str, Any]) -> dict[str, Any]:
    if not _is_plain(data):
        raise ValueError(
            f"only text, finite numbers, lists and objects, {MAX_FREE_DEPTH} levels deep at most, can stand here"
        )
    return data


#: Data that the program passes on without looking at them.
FreeData = Annotated[dict[str, Any], AfterValidator(_plain)]
