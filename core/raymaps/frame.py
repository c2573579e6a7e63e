# SPDX-License-Identifier: LGPL-2.1-or-later
"""The coordinates in which light is traced.

Lengths inside are in *frame units*: the scene moved to its own centre and scaled by a power of two so that it fits a
cube from -1 to 1. So single precision in Embree loses nothing to a model's place or size, and every distance that the
tracer calls small is small against the scene.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Frame"]


class Frame(NamedTuple):
    """Where the scene's own coordinates stand: mm = center_mm + unit_mm * coordinates.

    ``grid_mm``, a power of two near a millionth of the scene, is the step to which stored positions are rounded.
    """

    center_mm: NDArray[np.float64]
    unit_mm: float
    grid_mm: float

    def to_units(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """(..., 3) points in mm to frame units."""
        return (points_mm - self.center_mm) / self.unit_mm

    def to_mm(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """(..., 3) points in frame units to mm, not rounded to the grid."""
        return self.center_mm + self.unit_mm * points
