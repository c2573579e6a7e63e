# SPDX-License-Identifier: LGPL-2.1-or-later
"""The loops that look for steps of signatures; each stops at a signature's first step that is looked for."""

from __future__ import annotations

import numpy as np

from raymaps.jit import allocating_kernel

__all__ = ["has_step", "has_step_at"]


@allocating_kernel
def has_step(offsets, code, wanted):
    """Which signatures have a step with a wanted code.

    Parameters
    ----------
    offsets : (n_signatures + 1,) int64
    code : (n_steps,) uint8
    wanted : (256,) bool

    Returns
    -------
    (n_signatures,) bool
    """
    found = np.zeros(len(offsets) - 1, np.bool_)
    for signature in range(len(found)):
        for step in range(offsets[signature], offsets[signature + 1]):
            if wanted[code[step]]:
                found[signature] = True
                break
    return found


@allocating_kernel
def has_step_at(offsets, place, index, code, wanted):
    """Which signatures have a step at a place that also has a wanted code.

    Parameters
    ----------
    offsets : (n_signatures + 1,) int64
    place : (n_steps,) int16 or int32
        Body, face, surface property or detector of each step.
    index : int
        The one that is looked for.
    code : (n_steps,) uint8
    wanted : (256,) bool

    Returns
    -------
    (n_signatures,) bool
    """
    found = np.zeros(len(offsets) - 1, np.bool_)
    for signature in range(len(found)):
        for step in range(offsets[signature], offsets[signature + 1]):
            if place[step] == index and wanted[code[step]]:
                found[signature] = True
                break
    return found
