# SPDX-License-Identifier: LGPL-2.1-or-later
"""Signatures: what happened to a ray without its numbers, each distinct one kept once.

A signature is a sequence of steps: the emission, then each event, and after each event the detectors that
the segment starting there crosses. A million rays of a typical scene have only thousands of distinct ones, so
most questions are answered once per signature and then looked up per ray.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from raymaps.kinds import EventKind

__all__ = ["NONE", "STEP_COLUMNS", "SignatureTable"]

#: Stands for "no such thing" in an index column (no body, no detector, ...).
NONE = -1

#: The columns of a step, in the order in which they are stored, with their types.
STEP_COLUMNS: dict[str, type[np.generic]] = {
    "kind": np.uint8,  # EventKind
    "source": np.int16,  # on the emission only
    "body": np.int32,
    "face": np.int32,  # index into the map's list of all faces
    "surface": np.int16,  # surface property
    "medium": np.int16,  # medium along the segment that starts here
    "detector": np.int16,  # on crossings only
    "registered": np.int8,  # on crossings only: 1 if the detector's own side and angle accept it
}


@dataclass(frozen=True)
class SignatureTable:
    """Steps of all signatures, one after the other.

    Attributes
    ----------
    offsets : (n_signatures + 1,) int64
        Signature ``s`` owns the steps ``offsets[s]`` to ``offsets[s + 1] - 1``.
    kind, source, body, face, surface, medium, detector, registered : (n_steps,)
        See `STEP_COLUMNS`; ``NONE`` where a column does not apply.
    """

    offsets: NDArray[np.int64]
    kind: NDArray[np.uint8]
    source: NDArray[np.int16]
    body: NDArray[np.int32]
    face: NDArray[np.int32]
    surface: NDArray[np.int16]
    medium: NDArray[np.int16]
    detector: NDArray[np.int16]
    registered: NDArray[np.int8]

    def __post_init__(self) -> None:
        for field in fields(self):
            getattr(self, field.name).setflags(write=False)

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def ray_source(self) -> NDArray[np.int16]:
        """Source of each signature, (n_signatures,)."""
        return self.source[self.offsets[:-1]]

    @property
    def ending(self) -> NDArray[np.uint8]:
        """Kind of each signature's last event, (n_signatures,)."""
        return self.kind[self.offsets[1:] - 1]

    @property
    def n_events(self) -> NDArray[np.int64]:
        """Number of events (emission included, crossings not) of each signature, (n_signatures,)."""
        is_event = (self.kind != EventKind.CROSSING).astype(np.int64)
        return np.add.reduceat(is_event, self.offsets[:-1]) if len(self) else np.zeros(0, np.int64)
