# SPDX-License-Identifier: LGPL-2.1-or-later
"""The set of solids that a ray is in: a bit for each, by rank, in words of 64; the lowest rank rules."""

from __future__ import annotations

import numpy as np

from raymaps.jit import inlined_kernel

__all__ = ["is_in", "medium_of", "ruling", "toggle", "toggle_all"]

_ONE = np.uint64(1)


@inlined_kernel
def is_in(inside, solid):
    """Whether a set, (n_words,) uint64, has a solid."""
    return (inside[solid >> 6] >> np.uint64(solid & 63)) & _ONE == _ONE


@inlined_kernel
def toggle(inside, solid):
    """Take a solid into a set, or out of it."""
    inside[solid >> 6] ^= _ONE << np.uint64(solid & 63)


@inlined_kernel
def toggle_all(inside, across):
    """Enter the solids of a set that a ray is not in, leave those that it is in."""
    for word in range(len(inside)):
        inside[word] ^= across[word]


@inlined_kernel
def ruling(inside, has_medium):
    """The solid of a set that says what medium there is: that of the lowest rank; -1 if none has a medium."""
    for word in range(len(inside)):
        bits = inside[word] & has_medium[word]
        if bits != np.uint64(0):
            solid = word << 6
            while bits & _ONE == np.uint64(0):
                bits >>= _ONE
                solid += 1
            return solid
    return -1


@inlined_kernel
def medium_of(solid, solid_medium, ambient):
    """Medium in a solid, the ambient one in none."""
    return solid_medium[solid] if solid >= 0 else ambient[0]
