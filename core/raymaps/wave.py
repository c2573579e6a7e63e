# SPDX-License-Identifier: LGPL-2.1-or-later
"""What kernels read and write for each ray of a portion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.kernels.interface import MAX_PASSES
from raymaps.kernels.sobol import N_DIMENSIONS

__all__ = ["Found", "RunKey", "Wave"]


class Wave(NamedTuple):
    """State of the rays of a portion, a slot each; lengths in frame units."""

    position: NDArray[np.float64]  # (n, 3) where the ray is
    direction: NDArray[np.float64]  # (n, 3) unit vector
    end: NDArray[np.float64]  # (n, 3) where the segment ends
    distance: NDArray[np.float64]  # (n,) length of the segment
    light: NDArray[np.float32]  # (n, n_bands) relative to the emission
    wavelength_nm: NDArray[np.float64]  # (n,) the one wavelength that a ray is narrowed to, 0 before that
    source: NDArray[np.int16]  # (n,) source that the ray comes from
    triangle: NDArray[np.int32]  # (n,) triangle that the ray stands on, -1 none
    hit: NDArray[np.int32]  # (n,) triangle at the segment's end, -1 none
    normal: NDArray[np.float64]  # (n, 3) outward unit normal there
    side: NDArray[np.int8]  # (n,) on which side of its triangle the ray starts: 1 front, -1 back
    near_side: NDArray[np.int8]  # (n,) from which side it arrives
    inside: NDArray[np.uint64]  # (n, n_words) solids that the ray is in, a bit each
    across: NDArray[np.uint64]  # (n, n_words) solids that it enters or leaves by going through the surface
    passed: NDArray[np.float64]  # (n,) how far its search has silently passed surfaces of overlapped solids
    pass_t: NDArray[np.float64]  # (n, MAX_PASSES) where it passed them
    pass_solid: NDArray[np.int32]  # (n, MAX_PASSES) whose they were
    n_passes: NDArray[np.uint8]  # (n,) how many
    n_short: NDArray[np.uint8]  # (n,) segments in a row, from surface to surface, that were no longer than a contact
    medium: NDArray[np.int16]  # (n,) medium that the ray is in
    beyond: NDArray[np.int16]  # (n,) medium behind the surface that it arrives on
    n_near: NDArray[np.float64]  # (n,) refractive index of the medium that it arrives in
    n_far: NDArray[np.float64]  # (n,) refractive index of the medium beyond
    surface: NDArray[np.int16]  # (n,) surface property that it meets
    state: NDArray[np.uint8]  # (n,) EventKind, or PENDING and the like of `raymaps.kernels.transport`

    @classmethod
    def allocate(cls, n_rays: int, n_bands: int, n_words: int = 1) -> Wave:
        """A wave of rays in no particular state."""
        three, none = np.zeros((n_rays, 3)), np.full(n_rays, -1, np.int32)
        solids, passes = np.zeros((n_rays, n_words), np.uint64), (n_rays, MAX_PASSES)
        return cls(
            position=three, direction=three.copy(), end=three.copy(), distance=np.zeros(n_rays),
            light=np.zeros((n_rays, n_bands), np.float32), wavelength_nm=np.zeros(n_rays),
            source=np.zeros(n_rays, np.int16), triangle=none, hit=none.copy(), normal=three.copy(),
            inside=solids, across=solids.copy(), passed=np.zeros(n_rays), pass_t=np.zeros(passes),
            pass_solid=np.zeros(passes, np.int32), n_passes=np.zeros(n_rays, np.uint8),
            n_short=np.zeros(n_rays, np.uint8), side=np.ones(n_rays, np.int8), near_side=np.ones(n_rays, np.int8),
            medium=np.zeros(n_rays, np.int16), beyond=np.zeros(n_rays, np.int16),
            n_near=np.ones(n_rays), n_far=np.ones(n_rays),
            surface=np.zeros(n_rays, np.int16), state=np.zeros(n_rays, np.uint8),
        )  # fmt: skip


class Found(NamedTuple):
    """Crossings of each ray between which a search decides."""

    t: NDArray[np.float64]  # (n, n_places) distances
    triangle: NDArray[np.int32]  # (n, n_places)
    normal: NDArray[np.float64]  # (n, n_places, 3) outward

    @classmethod
    def allocate(cls, n: int, n_places: int) -> Found:
        """Places for n rays, with nothing in particular in them."""
        return cls(np.empty((n, n_places)), np.empty((n, n_places), np.int32), np.empty((n, n_places, 3)))


class RunKey(NamedTuple):
    """What random numbers and roulette depend on, beside the ray and its event.

    The arrays are empty where all numbers are random.
    """

    seed: np.uint64
    first_ray: np.uint64
    roulette_threshold: float
    point: NDArray[np.uint32] = np.zeros(0, np.uint32)  # (n,) which point of its sequence each ray has
    group: NDArray[np.int32] = np.zeros(0, np.int32)  # (n,) sequence: one for each source and replicate
    scramble: NDArray[np.uint32] = np.zeros((0, N_DIMENSIONS, 2), np.uint32)  # (n_groups, N_DIMENSIONS, 2)
