# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small JSON files that notice when they were changed: they hold a checksum of what they say."""

from __future__ import annotations

import hashlib
import json
from typing import Any

__all__ = ["seal", "unseal"]

_KEY = "checksum"


def _checksum(data: dict[str, Any]) -> str:
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


def seal(data: dict[str, Any]) -> str:
    """Data as JSON text with their SHA-256 under ``checksum``."""
    return json.dumps({**data, _KEY: _checksum(data)}, indent=1, ensure_ascii=False)


def unseal(data: Any) -> dict[str, Any]:
    """Data without their checksum; raises `ValueError` if it does not fit."""
    if not isinstance(data, dict):
        raise ValueError("not a JSON object")
    plain = {key: value for key, value in data.items() if key != _KEY}
    if data.get(_KEY) != _checksum(plain):
        raise ValueError("the checksum does not fit")
    return plain
