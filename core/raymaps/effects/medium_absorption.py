# SPDX-License-Identifier: LGPL-2.1-or-later
"""Absorption inside media by Beer-Lambert's law, drawn as an event."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import used_media
from raymaps.materials import SpectrumTable
from raymaps.scene import Scene

__all__ = ["Data", "absorbed_share", "acts_on", "lower", "needed_by"]


class Data(NamedTuple):
    """What the kernel reads."""

    absorption: NDArray[np.float64]  # (n_media, n_bands) per frame unit


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for absorption in media if a medium that light can travel in absorbs."""

    def absorbs(name: str) -> bool:
        value = scene.media[name].absorption_per_mm
        return any(value.value if isinstance(value, SpectrumTable) else value) and not scene.media[name].is_conductor

    return tuple(f"medium '{name}' of {where}" for name, where in used_media(scene).items() if absorbs(name))


def acts_on(data: Data) -> NDArray[np.bool_]:
    """Media that absorb, (n_media,)."""
    return data.absorption.max(axis=1) > 0


def lower(lowering: Lowering) -> Data:
    """Absorption of each medium by band."""
    by_band = lowering.by_medium(lambda medium: medium.absorption_per_mm, "absorption_per_mm")
    return Data(by_band * lowering.frame.unit_mm)


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
