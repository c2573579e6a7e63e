# SPDX-License-Identifier: LGPL-2.1-or-later
"""From where a model is looked at: a parallel projection that holds all of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.results.model_view import ModelView

__all__ = ["Camera", "fit_camera"]

Float = NDArray[np.float64]

#: Where the camera stands, seen from the middle of the scene: with z up, and with z to the right and y up.
_TOWARD = np.array([1.0, -1.55, 0.85])
_TOWARD_LYING = np.array([-1.0, 0.42, -0.42])
#: A model so much longer along z than across is shown lying.
_LONG_FROM = 1.6


class Camera(NamedTuple):
    """Directions as unit vectors, the middle of what is seen, and its size."""

    right: Float
    up: Float
    toward: Float
    middle_mm: Float
    width_mm: float
    height_mm: float


def fit_camera(content: ModelView, toward: Float | None = None) -> Camera:
    """A camera that sees all shapes: with z up, or with z to the right where the model is a long tube along z.

    ``toward``, (3,), says from where else it looks, with z up as far as that can be.
    """
    points = content.points_mm
    middle, size = (points.min(axis=0) + points.max(axis=0)) / 2, np.ptp(points, axis=0)
    lying = toward is None and size[2] > _LONG_FROM * max(size[0], size[1])
    toward = (_TOWARD_LYING if lying else _TOWARD).copy() if toward is None else toward
    toward = toward / np.linalg.norm(toward)
    upright = [0.0, 0.0, 1.0] if not lying and abs(toward[2]) < 0.999 else [0.0, 1.0, 0.0]
    right = np.cross(upright, toward)
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    across, along = (points - middle) @ right, (points - middle) @ up
    middle = middle + (across.max() + across.min()) / 2 * right + (along.max() + along.min()) / 2 * up
    width, height = float(np.ptp(across)), float(np.ptp(along))
    smallest = 1e-9 + 1e-2 * max(width, height)  # also of a single point
    return Camera(right, up, toward, middle, max(width, smallest), max(height, smallest))
