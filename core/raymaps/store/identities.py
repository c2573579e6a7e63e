# SPDX-License-Identifier: LGPL-2.1-or-later
"""What stands for sources, faces, media and detectors in content hashes: their names, not their indices.

So the hash of a map's rays stays what it is when the scene is given something that no light meets.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.names import Names

__all__ = ["Identities"]


class Identities:
    """Words for what happened, made of names."""

    def __init__(self, names: Names):
        self._media = _name_hashes(names.media)
        self._faces = _name_hashes(tuple(names.face_label(face) for face in range(len(names.faces))))
        self._detectors = _name_hashes(names.detectors)
        self._sources = _name_hashes(names.sources)

    def of_events(self, kind: Any, face: Any, medium: Any) -> NDArray[np.int64]:
        """A word for what happened at each event, (n_events,)."""
        return self._faces[face] ^ (self._media[medium] << 1) ^ np.asarray(kind).astype(np.int64)

    def of_crossings(self, detector: Any, registered: Any) -> NDArray[np.int64]:
        """A word for each crossing, (n_crossings,)."""
        return self._detectors[detector] ^ np.asarray(registered).astype(np.int64)

    def of_sources(self, source: Any) -> NDArray[np.int64]:
        """A word for the source of each ray, (n_rays,)."""
        return self._sources[source]


def _name_hashes(names: tuple[str, ...]) -> NDArray[np.int64]:
    """A number for each name, and at the end, at index -1, one for none."""
    digests = [hashlib.blake2b(name.encode(), digest_size=8).digest() for name in names]
    return np.array([*(int.from_bytes(digest, "little", signed=True) for digest in digests), 0], np.int64)
