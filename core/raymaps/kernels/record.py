# SPDX-License-Identifier: LGPL-2.1-or-later
"""Keeping events: each ray of the wave has one event a depth; at the end they are put in the order of the rays."""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind

__all__ = ["advance", "keep", "scatter"]

_NUMERICAL = int(EventKind.KILLED_NUMERICAL)


@kernel
def keep(active, wave, frame, kind, triangle, position, light, medium):
    """Copy the events at which the active rays are; positions in mm, rounded to the frame's grid.

    Parameters
    ----------
    kind, triangle, medium : (n_active,), filled
    position : (n_active, 3) float32 or float64, filled
    light : (n_active, n_bands) float32, filled
    """
    per_grid = 1.0 / frame.grid_mm
    for k in range(len(active)):
        i = active[k]
        if wave.state[i] == PENDING or not math.isfinite(
            wave.direction[i, 0] + wave.direction[i, 1] + wave.direction[i, 2]
        ):
            wave.state[i] = _NUMERICAL
        kind[k] = wave.state[i]
        triangle[k] = wave.hit[i]
        medium[k] = wave.medium[i]
        for a in range(3):
            at = frame.center_mm[a] + frame.unit_mm * wave.end[i, a]
            position[k, a] = math.floor(at * per_grid + 0.5) * frame.grid_mm
        for band in range(light.shape[1]):
            light[k, band] = wave.light[i, band]


@kernel
def advance(active, wave, is_end, media):
    """Move the rays that go on to their events; the active list keeps only those, in their order.

    Parameters
    ----------
    is_end : (256,) bool, which states end a ray
    media : (n_media,) bool, set for each medium that a ray goes on in

    Returns
    -------
    int: how many rays go on; they stand first in ``active``
    """
    going_on = 0
    for k in range(len(active)):
        i = active[k]
        if is_end[wave.state[i]]:
            continue
        for a in range(3):
            wave.position[i, a] = wave.end[i, a]
        wave.triangle[i] = wave.hit[i]
        media[wave.medium[i]] = True
        active[going_on] = i
        going_on += 1
    return going_on


@kernel
def scatter(slots, first_row, depth, chunk, columns):
    """Put the events of one depth to their places: ray i's event is row ``first_row[i] + depth`` of the columns.

    Parameters
    ----------
    slots : (n,) int32
    first_row : (n_rays,) int64
    depth : int
    chunk, columns : tuples of kind, triangle, medium, position, light
    """
    kind, triangle, medium, position, light = chunk
    to_kind, to_triangle, to_medium, to_position, to_light = columns
    for k in range(len(slots)):
        row = first_row[slots[k]] + depth
        to_kind[row] = kind[k]
        to_triangle[row] = triangle[k]
        to_medium[row] = medium[k]
        for a in range(3):
            to_position[row, a] = position[k, a]
        for band in range(light.shape[1]):
            to_light[row, band] = light[k, band]
