# SPDX-License-Identifier: LGPL-2.1-or-later
"""Axes that a z axis and a direction near the x axis stand for."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raymaps.materials.values import Vector

__all__ = ["check_axes", "unit_axes"]


def check_axes(z_axis: Vector, x_axis: Vector, z_name: str, x_name: str = "x_axis") -> None:
    """Refuse axes that are parallel; raises `ValueError`."""
    z, x = z_axis, x_axis
    cross = (z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0])
    if math.hypot(*cross) < 1e-6 * math.hypot(*z) * math.hypot(*x):
        raise ValueError(f"{x_name} must not be parallel to the {z_name}")


def unit_axes(z_axis: Vector, x_axis: Vector) -> NDArray[np.float64]:
    """Unit vectors x, y, z, (3 axes, 3); right-handed, x as near to ``x_axis`` as can be."""
    z = np.array(z_axis) / np.linalg.norm(z_axis)
    x = np.array(x_axis) / np.linalg.norm(x_axis)
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])
