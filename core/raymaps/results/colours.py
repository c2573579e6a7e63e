# SPDX-License-Identifier: LGPL-2.1-or-later
"""Colours of light on a screen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["hex_colour", "light_colours"]

#: A ray with hardly any light left is drawn with this brightness, one with all its light with 1.
DIMMEST = 0.45


def light_colours(light: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Display colours of light: its own hue, and brighter the more is left, but never too dim to be seen.

    Parameters
    ----------
    light : (n, 3 bands) float, relative to the ray's emission (which adds up to 1)

    Returns
    -------
    (n, 3) uint8, sRGB; black where there is no light.
    """
    light = np.asarray(light, np.float64)
    strongest = light.max(axis=1, keepdims=True)
    linear = np.divide(light, strongest, np.zeros_like(light), where=strongest > 0)
    # sRGB's transfer function, IEC 61966-2-1, so that mixtures have the hue that they have as light
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)
    left = np.clip(light.sum(axis=1, keepdims=True), 0.0, 1.0)
    brightness = DIMMEST + (1.0 - DIMMEST) * np.sqrt(left)
    return np.round(255.0 * encoded * brightness).astype(np.uint8)


def hex_colour(rgb: NDArray[np.uint8]) -> str:
    """``#rrggbb``."""
    red, green, blue = (int(band) for band in rgb)
    return f"#{red:02x}{green:02x}{blue:02x}"
