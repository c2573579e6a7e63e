# SPDX-License-Identifier: LGPL-2.1-or-later
"""Crossings of virtual detectors by segments."""

from __future__ import annotations

import math

import numpy as np

from raymaps.kernels.options import kernel

__all__ = ["CROSSING", "run"]

#: A crossing as it is found, in frame units; ``distance`` orders the crossings of a segment.
CROSSING = np.dtype(
    [("slot", "i4"), ("event", "i4"), ("detector", "i2"), ("distance", "f8"), ("x", "f8"), ("y", "f8"), ("angle", "f4")]
)


@kernel
def run(active, wave, tables, depth, found):
    """Find the crossings of the segments that end at event ``depth``.

    Parameters
    ----------
    found : (n,) CROSSING, filled as far as it goes

    Returns
    -------
    int: number of crossings; if larger than n, those past n were not written
    """
    count = 0
    n_detectors = len(tables.detector_center)
    for k in range(len(active)):
        i = active[k]
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
                at = start + part * (end - start) - tables.detector_center[d, axis]
                x += at * tables.detector_axes[d, 0, axis]
                y += at * tables.detector_axes[d, 1, axis]
                cosine -= wave.direction[i, axis] * tables.detector_axes[d, 2, axis]
            if abs(x) > tables.detector_half[d, 0] or abs(y) > tables.detector_half[d, 1]:
                continue
            if count < len(found):
                c = found[count]
                c.slot = i
                c.event = depth - 1
                c.detector = d
                c.distance = part * wave.distance[i]
                c.x = x
                c.y = y
                c.angle = math.acos(min(1.0, max(-1.0, cosine)))
            count += 1
    return count
