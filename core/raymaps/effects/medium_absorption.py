# SPDX-License-Identifier: LGPL-2.1-or-later
"""Absorption inside media by Beer-Lambert's law, drawn as an event."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.scene import Scene

__all__ = ["absorbed_share", "needed_by"]


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for absorption in media if a medium that light can travel in absorbs."""
    reasons = [
        f"medium '{body.medium}' of body '{name}'"
        for name, body in scene.bodies.items()
        if body.medium is not None and any(scene.media[body.medium].absorption_per_mm)
    ]
    if any(scene.ambient_medium.absorption_per_mm):
        reasons.append(f"the ambient medium '{scene.ambient}'")
    return tuple(reasons)


def absorbed_share(
    light: NDArray[np.float64], absorption_per_mm: NDArray[np.float64], distance_mm: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Share of a ray's light, all bands together, that a medium absorbs over a distance.

    Parameters
    ----------
    light : (n_rays, 3) float64, >= 0
    absorption_per_mm : (3,) float64, >= 0
    distance_mm : (n_rays,) float64, >= 0

    Returns
    -------
    (n_rays,) float64, 0 to 1
    """
    lost = light * -np.expm1(-absorption_per_mm * distance_mm[:, None])
    return lost.sum(axis=1) / light.sum(axis=1)
