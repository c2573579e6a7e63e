# SPDX-License-Identifier: LGPL-2.1-or-later
"""Crossings of virtual detectors by segments."""

from __future__ import annotations

import math

import numpy as np

from raymaps.kernels.options import kernel

__all__ = ["ANGLE_STEP_RAD", "CROSSING", "run"]

#: Step to which crossing angles are rounded: 0.0002 degrees, far below what a detector tells apart.
ANGLE_STEP_RAD = 2.0**-18

#: A crossing: place in mm on the frame's grid, angle on its own; ``part`` says where along its segment, from 0 to 1.
CROSSING = np.dtype(
    [
        ("part", "f8"),
        ("slot", "i4"),
        ("event", "i4"),
        ("x_mm", "f4"),
        ("y_mm", "f4"),
        ("angle_rad", "f4"),
        ("detector", "i2"),
    ],
    align=True,
)


@kernel
def run(active, wave, tables, frame, depth, found):
    """Find the crossings of the segments that end at event ``depth``, in the order of the rays and along each segment.

    Parameters
    ----------
    found : (n,) CROSSING, filled as far as it goes

    Returns
    -------
    int: number of crossings; if larger than n, those past n were not written
    """
    count = 0
    n_detectors = len(tables.detector_center)
    per_grid = frame.unit_mm / frame.grid_mm
    for k in range(len(active)):
        i = active[k]
        first_here = count
        for d in range(n_detectors):
            before = after = 0.0
            for axis in range(3):
                normal = tables.detector_axes[d, 2, axis]
                before += (wave.position[i, axis] - tables.detector_center[d, axis]) * normal
                after += (wave.end[i, axis] - tables.detector_center[d, axis]) * normal
            if (before > 0.0) == (after > 0.0):
                continue
            part = before / (before - after)
            x = y = cosine = 0.0
            for axis in range(3):
                start, end = wave.position[i, axis], wave.end[i, axis]
                offset = start + part * (end - start) - tables.detector_center[d, axis]
                x += offset * tables.detector_axes[d, 0, axis]
                y += offset * tables.detector_axes[d, 1, axis]
                cosine -= wave.direction[i, axis] * tables.detector_axes[d, 2, axis]
            if abs(x) > tables.detector_half[d, 0] or abs(y) > tables.detector_half[d, 1]:
                continue
            if count < len(found):
                at = count  # kept in the order along the segment
                while at > first_here and found[at - 1].part > part:
                    found[at] = found[at - 1]
                    at -= 1
                c = found[at]
                c.slot = i
                c.event = depth - 1
                c.x_mm = math.floor(x * per_grid + 0.5) * frame.grid_mm
                c.y_mm = math.floor(y * per_grid + 0.5) * frame.grid_mm
                c.part = part
                angle = math.acos(min(1.0, max(-1.0, cosine)))
                c.angle_rad = math.floor(angle / ANGLE_STEP_RAD + 0.5) * ANGLE_STEP_RAD
                c.detector = d
            count += 1
    return count
