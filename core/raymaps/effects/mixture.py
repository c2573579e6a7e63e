# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mixtures: several surface properties side by side on a face, one drawn for each ray that meets it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import faces_of_kind
from raymaps.materials import Mixture
from raymaps.scene import Scene

__all__ = ["Data", "drawn_part", "lower", "needed_by"]


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for mixtures if a face has one."""
    return faces_of_kind(scene, "mixture")


class Data(NamedTuple):
    """What the kernel reads."""

    start: NDArray[np.int32]  # (n_surfaces + 1,) a mixture's parts are start[i] : start[i + 1]
    part: NDArray[np.int16]  # (n_parts,) surface property of each part
    edge: NDArray[np.float64]  # (n_parts,) cumulated weight of each part


def lower(lowering: Lowering) -> Data:
    """Parts of all mixtures in one row."""
    start, parts, edges = [0], [], []
    for prop in lowering.scene.surfaces.values():
        if isinstance(prop, Mixture):
            weights = np.array([part.weight for part in prop.parts])
            parts += [lowering.names.surfaces.index(part.surface) for part in prop.parts]
            edges += list(np.cumsum(weights) / weights.sum())
        start.append(len(parts))
    return Data(np.array(start, np.int32), np.array(parts, np.int16), np.array(edges, np.float64))


def drawn_part(u: NDArray[np.float64], weights: tuple[float, ...]) -> NDArray[np.int64]:
    """Index of the part that each uniform number draws, (n_rays,), with probabilities proportional to the weights."""
    edges = np.cumsum(weights) / np.sum(weights)
    return np.minimum(np.searchsorted(edges, u, side="right"), len(weights) - 1)
