# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a ray's number tells: the source that it comes from, its rank among the rays of that source, and its replicate.

Sources share the rays by flux, or as their ``ray_share`` says: ray numbers run through an additive recurrence with the
golden ratio (M. Roberts: The unreasonable effectiveness of quasirandom sequences, 2018), so any run of rays has each
source's share to within a few rays.

Rays that are no independent samples, as those of `sampling` "sobol", come in `REPLICATES` sets that are: the rays of a
source go to them in turn.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from raymaps.scene import Scene

__all__ = ["MOST_OF_SOBOL", "REPLICATES", "n_replicates", "ranks", "ranks_before", "source_of_rays"]

#: Independent sets of the rays of each source.
REPLICATES = 16
#: Rays of a map that can have points of Sobol's sequence, of which 32 bits of an index are known.
MOST_OF_SOBOL = REPLICATES * 2**32

#: 2^64 / golden ratio: the additive recurrence ray * _STEP mod 2^64 fills the unit interval evenly from any start.
_STEP = 0x9E3779B97F4A7C15
_START = _STEP >> 1


def n_replicates(scene: Scene) -> int:
    """Independent sets that the rays of each source are in; 1 where each ray is independent."""
    return REPLICATES if scene.settings.sampling == "sobol" else 1


def source_of_rays(scene: Scene, first_ray: int, n_rays: int) -> NDArray[np.int16]:
    """Which source each ray comes from, a function of its number alone: (n_rays,) int16."""
    rays = np.arange(n_rays, dtype=np.uint64) + np.uint64(first_ray)
    place = ((rays * np.uint64(_STEP) + np.uint64(_START)) >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return np.searchsorted(_edges(scene), place, side="right").astype(np.int16)


def _edges(scene: Scene) -> NDArray[np.float64]:
    """Where the unit interval passes from source to source, (n_sources - 1,)."""
    share = np.array([source.ray_share or source.flux_w for source in scene.sources.values()])
    return np.asarray(np.cumsum(share / share.sum())[:-1])


def ranks_before(scene: Scene, ray: int) -> NDArray[np.int64]:
    """How many rays with a number below ``ray`` each source has, (n_sources,), without going through them.

    A ray with r _STEP + _START = q 2^64 + z comes from a source up to k where z is below the k-th border b. Those are
    counted by the sum of floor((r _STEP + _START) / 2^64) - floor((r _STEP + _START - b) / 2^64), 1 or 0.
    """
    whole = 1 << 64
    all_turns = _floor_sum(ray, whole, _STEP, _START)
    below = [0]
    for edge in _edges(scene).tolist():
        border = min(math.ceil(edge * 2.0**53), 1 << 53) << 11  # places are whole steps of 2^-53
        below.append(all_turns + ray - _floor_sum(ray, whole, _STEP, _START + whole - border))
    return np.diff([*below, ray]).astype(np.int64)


def _floor_sum(n: int, m: int, a: int, b: int) -> int:
    """Sum of floor((a i + b) / m) over i from 0 to n - 1, in steps of Euclid's algorithm; a, b >= 0."""
    total = 0
    while n > 0:
        total += n * (n - 1) // 2 * (a // m) + n * (b // m)
        a, b = a % m, b % m
        top = a * n + b
        n, b, m, a = top // m, top % m, a, m
    return total


def ranks(source: NDArray[np.int16], before: NDArray[np.int64]) -> NDArray[np.int64]:
    """Ranks of consecutive rays among those of their sources.

    Parameters
    ----------
    source : (n_rays,) int
    before : (n_sources,) int64
        Rays of each source before the first one, see `ranks_before`.

    Returns
    -------
    (n_rays,) int64, from 0
    """
    order = np.argsort(source, kind="stable")
    counts = np.bincount(source, minlength=len(before))
    found = np.empty(len(source), np.int64)
    found[order] = np.arange(len(source)) + np.repeat(before - (np.cumsum(counts) - counts), counts)
    return found
