# SPDX-License-Identifier: LGPL-2.1-or-later
"""Colours of light on a screen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import MissingPackageError

__all__ = ["FALSE_COLOURS", "false_colours", "hex_colour", "light_colours", "paper_colours"]

#: A ray with hardly any light left is drawn with this brightness, one with all its light with 1.
DIMMEST = 0.45
#: On white paper light is drawn no brighter than this luminance, and no more transparent than this opacity.
BRIGHTEST_ON_PAPER, FAINTEST_ON_PAPER = 0.30, 0.25

#: The colour map of irradiances.
FALSE_COLOURS = "inferno"

#: Luminance of the three bands as sRGB primaries, IEC 61966-2-1.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


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
    left = np.clip(light.sum(axis=1, keepdims=True), 0.0, 1.0)
    brightness = DIMMEST + (1.0 - DIMMEST) * np.sqrt(left)
    return np.round(255.0 * _encoded(linear) * brightness).astype(np.uint8)


def hex_colour(rgb: NDArray[np.uint8]) -> str:
    """``#rrggbb``."""
    red, green, blue = (int(band) for band in rgb)
    return f"#{red:02x}{green:02x}{blue:02x}"


def paper_colours(light: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Colours of light on white paper: its own hue, dark enough to be seen, and fainter the less is left.

    Parameters
    ----------
    light : (n, 3 bands) float, relative to the ray's emission

    Returns
    -------
    (n, 4) uint8, sRGB and opacity.
    """
    light = np.asarray(light, np.float64)
    strongest = light.max(axis=1, keepdims=True)
    linear = np.divide(light, strongest, np.zeros_like(light), where=strongest > 0)
    luminance = linear @ _LUMINANCE
    linear *= np.minimum(1.0, BRIGHTEST_ON_PAPER / np.maximum(luminance, 1e-9))[:, None]
    left = np.clip(light.sum(axis=1), 0.0, 1.0)
    opacity = FAINTEST_ON_PAPER + (1.0 - FAINTEST_ON_PAPER) * np.sqrt(left)
    return np.round(255.0 * np.column_stack([_encoded(linear), opacity])).astype(np.uint8)


def false_colours(share: NDArray[np.floating]) -> NDArray[np.uint8]:
    """False colours of numbers from 0 to 1, as in pictures of detectors.

    Parameters
    ----------
    share : (...) float

    Returns
    -------
    (..., 3) uint8

    Raises
    ------
    MissingPackageError
        If matplotlib is not installed.
    """
    try:
        from matplotlib import colormaps
    except ImportError:
        raise MissingPackageError("matplotlib", "pictures", "A picture in false colours") from None
    return np.asarray(colormaps[FALSE_COLOURS](share, bytes=True)[..., :3])


def _encoded(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Encode as sRGB does, IEC 61966-2-1, so that mixtures have the hue that they have as light."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)
