# SPDX-License-Identifier: LGPL-2.1-or-later
"""Crossings of virtual detectors by segments."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.effects.lowering import Lowering
from raymaps.scene import RectangleDetector, Scene

__all__ = ["CROSSING", "Data", "lower", "needed_by", "rectangle_crossing"]


#: A crossing: place in mm on the detector's grid, angle in its own steps; ``part`` says where on its segment (0 to 1).
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


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for crossings if it has a rectangle."""
    return tuple(
        f"detector '{n}'" for n, detector in scene.detectors.items() if isinstance(detector, RectangleDetector)
    )


class Data(NamedTuple):
    """What the kernel reads; lengths in frame units."""

    number: NDArray[np.int16]  # (n,) which detector of the scene it is
    center: NDArray[np.float64]  # (n, 3)
    axes: NDArray[np.float64]  # (n, 3 axes, 3) x, y, normal
    half: NDArray[np.float64]  # (n, 2) half width and half height
    grid_mm: NDArray[np.float64]  # (n,) step to which places on the detector are rounded


def lower(lowering: Lowering) -> Data:
    """The rectangles of a scene."""
    all_detectors = lowering.scene.detectors.values()
    rectangles = [(i, d) for i, d in enumerate(all_detectors) if isinstance(d, RectangleDetector)]
    detectors = [d for _, d in rectangles]
    frame = lowering.frame
    return Data(
        number=np.array([i for i, _ in rectangles], np.int16),
        center=frame.to_units(np.array([d.center_mm for d in detectors])),
        axes=np.array([d.axes for d in detectors]),
        half=np.array([(d.width_mm, d.height_mm) for d in detectors]) / 2 / frame.unit_mm,
        grid_mm=np.array([2.0 ** round(math.log2(max(d.width_mm, d.height_mm)) - 20) for d in detectors]),
    )


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
