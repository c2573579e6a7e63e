# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the tracer hands to the store: histories of consecutive rays as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["FaceIndex", "TracedPortion"]


class FaceIndex(NamedTuple):
    """What the faces of a scene belong to; indices count in the order of `raymaps.names.Names`."""

    triangle_face: NDArray[np.int32]  # (n_triangles,)
    face_body: NDArray[np.int32]  # (n_faces,)
    face_surface: NDArray[np.int16]  # (n_faces,) surface property


@dataclass(frozen=True)
class TracedPortion:
    """Histories of consecutive rays, in the order of the rays and then of time.

    Attributes
    ----------
    first_ray : int
    source : (n_rays,) int16
    event_offsets : (n_rays + 1,) int64
        Ray i of the portion owns the events ``event_offsets[i]`` to ``event_offsets[i + 1] - 1``.
    kind, triangle, medium : (n_events,)
    position_mm : (n_events, 3) float32 or float64, on the frame's grid
    light : (n_events, n_bands) float32
    crossing_row : (n_crossings,) int64
        Row of the event that starts the crossing segment.
    crossing_detector : (n_crossings,) int16
    crossing_xy_mm : (n_crossings, 2) float32, on the detector's grid
    crossing_angle_rad : (n_crossings,) float32, a multiple of `raymaps.kinds.ANGLE_STEP_RAD`
    crossing_registered : (n_crossings,) bool
    wavelength_nm : (n_rays,) float32
        The one wavelength that a ray was narrowed to by dispersion; 0 if it was not.
    replicate : (n_rays,) uint8
        Which of the independent sets of its source's rays each is in; empty where each ray is independent.
    seconds : dict of str to float
        Time that each stage took.
    """

    first_ray: int
    source: NDArray[np.int16]
    event_offsets: NDArray[np.int64]
    kind: NDArray[np.uint8]
    triangle: NDArray[np.int32]
    medium: NDArray[np.int16]
    position_mm: NDArray[np.floating]
    light: NDArray[np.float32]
    crossing_row: NDArray[np.int64]
    crossing_detector: NDArray[np.int16]
    crossing_xy_mm: NDArray[np.float32]
    crossing_angle_rad: NDArray[np.float32]
    crossing_registered: NDArray[np.bool_]
    wavelength_nm: NDArray[np.float32]
    replicate: NDArray[np.uint8] = field(default_factory=lambda: np.zeros(0, np.uint8))
    seconds: dict[str, float] = field(default_factory=dict)
