# SPDX-License-Identifier: LGPL-2.1-or-later
"""The names behind the indices of a simulation: of its sources, bodies, faces, surface properties, media, detectors."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

__all__ = ["Names"]


@dataclass(frozen=True)
class Names:
    """Names in the order of their indices.

    Attributes
    ----------
    sources, bodies, surfaces, media, detectors : tuple of str
    faces : tuple of (int, str)
        Body index and face name of each face; faces of all bodies are counted in one row.
    """

    sources: tuple[str, ...]
    bodies: tuple[str, ...]
    surfaces: tuple[str, ...]
    media: tuple[str, ...]
    detectors: tuple[str, ...]
    faces: tuple[tuple[int, str], ...]

    def face_label(self, face_index: int) -> str:
        """``Body.Face`` of a face."""
        body, face = self.faces[face_index]
        return f"{self.bodies[body]}.{face}"

    def to_dict(self) -> dict[str, Any]:
        """As stored in a manifest."""
        return {
            "sources": list(self.sources),
            "bodies": list(self.bodies),
            "surfaces": list(self.surfaces),
            "media": list(self.media),
            "detectors": list(self.detectors),
            "faces": [list(face) for face in self.faces],
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Names:
        """From a manifest; raises `KeyError`, `TypeError` or `ValueError` if it is damaged."""

        def texts(values: Iterable[Any]) -> tuple[str, ...]:
            return tuple(str(value) for value in values)

        bodies = texts(data["bodies"])
        faces = tuple((int(body), str(face)) for body, face in data["faces"])
        if any(not 0 <= body < len(bodies) for body, _ in faces):
            raise ValueError("a face of a body that does not exist")
        return cls(
            texts(data["sources"]),
            bodies,
            texts(data["surfaces"]),
            texts(data["media"]),
            texts(data["detectors"]),
            faces,
        )
