# SPDX-License-Identifier: LGPL-2.1-or-later
"""Crossings of virtual detectors by segments."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.scene import RectangleDetector, Scene

__all__ = ["needed_by", "rectangle_crossing"]


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for crossings if it has a detector."""
    return tuple(f"detector '{name}'" for name in scene.detectors)


def rectangle_crossing(
    detector: RectangleDetector, start_mm: NDArray[np.float64], end_mm: NDArray[np.float64]
) -> tuple[float, float, float] | None:
    """Where a segment crosses a detector.

    Parameters
    ----------
    start_mm, end_mm : (3,) float64

    Returns
    -------
    (x_mm, y_mm, angle_rad) in the detector's axes, or None; the angle is 0 for light that arrives head-on at the front
    and pi for light that arrives head-on at the back.
    """
    x_axis, y_axis, normal = detector.axes
    start, end = start_mm - np.array(detector.center_mm), end_mm - np.array(detector.center_mm)
    before, after = start @ normal, end @ normal
    on_plane = 1e-9 * max(np.linalg.norm(start), np.linalg.norm(end))
    if abs(before) <= on_plane or (abs(after) > on_plane and (before > 0) == (after > 0)):
        return None  # a segment that starts on the plane crossed it when it arrived
    point = end if abs(after) <= on_plane else start + before / (before - after) * (end - start)
    x, y = float(point @ x_axis), float(point @ y_axis)
    if abs(x) > detector.width_mm / 2 or abs(y) > detector.height_mm / 2:
        return None
    direction = (end - start) / np.linalg.norm(end - start)
    return x, y, float(np.arccos(np.clip(-direction @ normal, -1, 1)))
