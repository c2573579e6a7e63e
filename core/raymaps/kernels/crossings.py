# SPDX-License-Identifier: LGPL-2.1-or-later
"""Crossings of virtual detectors by segments."""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kinds import ANGLE_STEP_RAD

__all__ = ["ON_PLANE", "run"]

#: In frame units: what is nearer to a detector's plane lies on it. Far above the rounding of hit points and of
#: coordinates that were written with 12 digits, far below the distance at which a ray starts off its triangle.
ON_PLANE = 2.0**-32

#: The largest angle that can be stored: pi rounded down.
_LARGEST_ANGLE_RAD = math.floor(math.pi / ANGLE_STEP_RAD) * ANGLE_STEP_RAD


@kernel
def run(active, wave, data, frame, depth, found):
    """Find the crossings of the segments that end at event ``depth``, in the order of the rays and along each segment.

    A segment crosses a detector if it starts off its plane and passes the plane or ends on it. One that starts on the
    plane does not: light that a face in the plane of a detector reflects or transmits crossed when it arrived.

    Parameters
    ----------
    found : (n,) CROSSING, filled as far as it goes

    Returns
    -------
    int: number of crossings; if larger than n, those past n were not written
    """
    count = 0
    n_detectors = len(data.number)
    for k in range(len(active)):
        i = active[k]
        first_here = count
        for d in range(n_detectors):
            before = after = 0.0
            for axis in range(3):
                normal = data.axes[d, 2, axis]
                before += (wave.position[i, axis] - data.center[d, axis]) * normal
                after += (wave.end[i, axis] - data.center[d, axis]) * normal
            if abs(before) <= ON_PLANE or (abs(after) > ON_PLANE and (before > 0.0) == (after > 0.0)):
                continue
            part = min(1.0, before / (before - after)) if abs(after) > ON_PLANE else 1.0
            x = y = cosine = 0.0
            for axis in range(3):
                start, end = wave.position[i, axis], wave.end[i, axis]
                offset = start + part * (end - start) - data.center[d, axis]
                x += offset * data.axes[d, 0, axis]
                y += offset * data.axes[d, 1, axis]
                cosine -= wave.direction[i, axis] * data.axes[d, 2, axis]
            if abs(x) > data.half[d, 0] or abs(y) > data.half[d, 1]:
                continue
            if count < len(found):
                at = count  # kept in the order along the segment
                while at > first_here and found[at - 1].part > part:
                    found[at] = found[at - 1]
                    at -= 1
                c = found[at]
                c.slot = i
                c.event = depth - 1
                grid_mm = data.grid_mm[d]
                c.x_mm = math.floor(x * frame.unit_mm / grid_mm + 0.5) * grid_mm
                c.y_mm = math.floor(y * frame.unit_mm / grid_mm + 0.5) * grid_mm
                c.part = part
                angle = math.acos(min(1.0, max(-1.0, cosine)))
                angle = math.floor(angle / ANGLE_STEP_RAD + 0.5) * ANGLE_STEP_RAD
                c.angle_rad = min(angle, _LARGEST_ANGLE_RAD)
                c.detector = data.number[d]
            count += 1
    return count
