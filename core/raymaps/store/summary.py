# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is known of a portion without opening its columns."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from raymaps.store.sealed import seal, unseal

__all__ = ["SUMMARY_FILE", "LedgerEntry", "PortionSummary", "folder_name"]

SUMMARY_FILE = "portion.json"


def folder_name(first_ray: int) -> str:
    """Name of a portion's folder."""
    return f"{first_ray:012d}"


@dataclass(frozen=True)
class LedgerEntry:
    """Light of a source's rays that ended in one way: the sum of their relative light, and of its squares ray by ray.

    ``what`` is "body" or "medium" (absorbed; ``index`` says by which), "escaped", or "killed" (``index`` is the
    `EventKind`). ``squares`` is None in maps of times before it was stored. ``replicates`` is the light by
    replicate, in maps whose rays are in such.
    """

    source: int
    what: str
    index: int
    light: float
    squares: float | None = None
    replicates: tuple[float, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """As plain data."""
        return {name: value for name, value in self.__dict__.items() if name != "replicates" or value}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> LedgerEntry:
        """From plain data; raises `KeyError`, `TypeError` or `ValueError` if it is damaged."""
        squares = data.get("squares")
        return cls(
            int(data["source"]), str(data["what"]), int(data["index"]), float(data["light"]),
            None if squares is None else float(squares), tuple(float(light) for light in data.get("replicates", ())),
        )  # fmt: skip


@dataclass(frozen=True)
class PortionSummary:
    """What is known of a portion without opening its columns; stored as ``portion.json``."""

    first_ray: int
    n_rays: int
    n_events: int
    n_crossings: int
    n_signatures: int
    rays_of_source: tuple[int, ...]
    content: tuple[int, int]
    ledger: tuple[LedgerEntry, ...]
    file_bytes: dict[str, int]
    file_sha256: dict[str, str]
    seconds: dict[str, float]
    has_wavelengths: bool

    def to_json(self) -> str:
        """As text."""
        data = {**self.__dict__, "content": [f"{word:016x}" for word in self.content]}
        return seal({**data, "ledger": [entry.to_dict() for entry in self.ledger]})

    @classmethod
    def from_json(cls, text: str) -> PortionSummary:
        """From text; raises `KeyError`, `TypeError` or `ValueError` if it is damaged."""
        data = unseal(json.loads(text))
        return cls(
            first_ray=int(data["first_ray"]),
            n_rays=int(data["n_rays"]),
            n_events=int(data["n_events"]),
            n_crossings=int(data["n_crossings"]),
            n_signatures=int(data["n_signatures"]),
            rays_of_source=tuple(int(n) for n in data["rays_of_source"]),
            content=(int(data["content"][0], 16), int(data["content"][1], 16)),
            ledger=tuple(LedgerEntry.from_dict(entry) for entry in data["ledger"]),
            file_bytes={str(name): int(size) for name, size in data["file_bytes"].items()},
            file_sha256={str(name): str(digest) for name, digest in data["file_sha256"].items()},
            seconds={str(stage): float(seconds) for stage, seconds in data.get("seconds", {}).items()},
            has_wavelengths=bool(data.get("has_wavelengths", False)),
        )
