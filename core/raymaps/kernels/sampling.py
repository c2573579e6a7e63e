# SPDX-License-Identifier: LGPL-2.1-or-later
"""The four numbers that a ray draws at an event: random, or those of Sobol's points as far as these reach.

A ray's point has a coordinate for each of its first decisions. Draws of which a ray takes only one share a coordinate:
whether light is scattered is another one than where, but who is scattered meets no surface at that event.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.jit import inlined_kernel, kernel
from raymaps.kernels.random import (
    COLLAPSE,
    EMIT_PLACE,
    IN_MEDIUM,
    ON_SURFACE,
    SCATTER_DIRECTION,
    SCATTER_PLACE,
    uniforms,
)
from raymaps.kernels.sobol import N_DIMENSIONS, sobol_word

__all__ = ["DIMENSION", "sample"]

#: Events after the emission whose decisions have coordinates.
_N_EVENTS = 4
_PURPOSES = 7


def _dimensions() -> NDArray[np.int8]:
    """Coordinate of each draw by event, purpose and number, -1 if it is random: (1 + _N_EVENTS + 1, _PURPOSES, 4).

    The lowest ones fill the cube most evenly: the direction of the emission has them, then its place. A ray is narrowed
    to a wavelength once, at whatever event.
    """
    of = np.full((_N_EVENTS + 2, _PURPOSES, 4), -1, np.int8)
    of[0, ON_SURFACE, :3], of[0, EMIT_PLACE, :3] = (0, 1, 5), (2, 3, 4)
    of[:, COLLAPSE, :2] = (6, 7)
    for event in range(1, _N_EVENTS + 1):
        first = 2 + 6 * event
        outcome, one, other, taken, scattered, part = range(first, first + 6)
        of[event, ON_SURFACE] = part, outcome, one, other
        of[event, IN_MEDIUM, :2] = taken, one
        of[event, SCATTER_PLACE, [0, 2]] = scattered, outcome
        of[event, SCATTER_DIRECTION, :3] = part, one, other
    assert of.max() == N_DIMENSIONS - 1
    return of


DIMENSION = _dimensions()


@inlined_kernel
def sample(key, i, event, purpose):
    """Four uniform numbers in the open interval (0, 1), each a multiple of 2^-33.

    Parameters
    ----------
    key : raymaps.wave.RunKey
    i : int
        Slot of the ray in its portion.
    event : int
        Which event of the ray, 0 to 2^24 - 1.
    purpose : int
        One of those of `raymaps.kernels.random` below REJECTION.
    """
    if len(key.point) == 0:
        return uniforms(key.seed, key.first_ray + np.uint64(i), event, purpose)
    return _of_points(key, i, event, purpose)


@kernel
def _of_points(key, i, event, purpose):
    """See `sample`; of rays that have points."""
    a, b, c, d = uniforms(key.seed, key.first_ray + np.uint64(i), event, purpose)
    dimension = DIMENSION[min(event, len(DIMENSION) - 1), purpose]
    return (
        _coordinate(key, i, dimension[0], a),
        _coordinate(key, i, dimension[1], b),
        _coordinate(key, i, dimension[2], c),
        _coordinate(key, i, dimension[3], d),
    )


@inlined_kernel
def _coordinate(key, i, dimension, random):
    """Coordinate of ray i's point, or the random number where the draw has none."""
    if dimension < 0:
        return random
    scramble = key.scramble[key.group[i], dimension]
    return (np.float64(sobol_word(np.uint64(key.point[i]), dimension, scramble[0], scramble[1])) + 0.5) * 2.0**-32
