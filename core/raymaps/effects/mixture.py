# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mixtures: several surface properties side by side on a face, one drawn for each ray that meets it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.effects.usage import faces_of_kind
from raymaps.scene import Scene

__all__ = ["drawn_part", "needed_by"]


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for mixtures if a face has one."""
    return faces_of_kind(scene, "mixture")


def drawn_part(u: NDArray[np.float64], weights: tuple[float, ...]) -> NDArray[np.int64]:
    """Index of the part that each uniform number draws, (n_rays,), with probabilities proportional to the weights."""
    edges = np.cumsum(weights) / np.sum(weights)
    return np.minimum(np.searchsorted(edges, u, side="right"), len(weights) - 1)
