# SPDX-License-Identifier: LGPL-2.1-or-later
"""The colour of light between two events, in media that take bands unequally."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from raymaps.effects import scene_without
from raymaps.effects.usage import used_media
from raymaps.store import Lights, Portion, RayMap

__all__ = ["light_on_the_way"]

Float = NDArray[np.float64]


def light_on_the_way(
    raymap: RayMap, portion: Portion, row: NDArray[np.int64], place_mm: Callable[[NDArray[np.int64]], Float]
) -> tuple[Lights, NDArray[np.int64]]:
    """The light with which segments arrive at places on them.

    Along a segment the light in all is constant, because what media take is drawn. In a medium that takes the bands
    unequally their shares shift on the way: to l_b exp(-a_b t), scaled to the same sum. Where a spectral simulation
    stored colours in place of spectra the light keeps the colour of the segment's start.

    Parameters
    ----------
    row : (n,) int64
        Events that start the segments.
    place_mm : function
        Of some of the segments, (k,) int64 from 0 to n - 1, to the places on them, (k, 3) float64.

    Returns
    -------
    Lights, and (n,) int64 the row in them of each place
    """
    lights = portion.lights
    light_row = portion.event_light[row].astype(np.int64)
    extinction = _extinction_per_mm(raymap)
    tinted = (extinction != extinction[:, :1]).any(axis=1)
    if lights.spectra is None or not tinted.any():
        return lights, light_row
    medium = portion.signatures.medium[portion.event_step[row]]
    here = np.flatnonzero(tinted[medium])
    way_mm = np.linalg.norm(place_mm(here) - portion.position_mm[row[here]], axis=1)
    light = lights.spectra[light_row[here]].astype(np.float64)
    through = _through(light, extinction[medium[here]] * way_mm[:, None])
    light_row[here] = len(lights.values) + np.arange(len(here))
    return Lights(np.concatenate([lights.values, through]), lights.names, lights.bands), light_row


def _through(light: Float, depth: Float) -> Float:
    """Light of bands behind optical depths, both (n, n_bands), scaled to the sum that it had.

    Only differences of depths count: however little gets through, it keeps its colour.
    """
    least = np.where(light > 0, depth, np.inf).min(axis=1, keepdims=True)
    through = light * np.exp(np.minimum(least - depth, 0.0))
    total = through.sum(axis=1, keepdims=True)
    return through * np.divide(light.sum(axis=1, keepdims=True), total, out=np.zeros_like(total), where=total > 0)


def _extinction_per_mm(raymap: RayMap) -> Float:
    """What media that light can meet take from a segment by absorption and scattering, (n_media, n_bands); else 0."""
    scene = scene_without(raymap.scene)
    result = np.zeros((len(raymap.names.media), raymap.bands.n))
    for name in used_media(scene):
        medium = scene.media[name]
        if not medium.is_conductor:
            values = (medium.absorption_per_mm, *(part.coefficient_per_mm for part in medium.scattering))
            result[raymap.names.media.index(name)] = sum(raymap.bands.average(v, f"Medium '{name}'") for v in values)
    return result
