# SPDX-License-Identifier: LGPL-2.1-or-later
"""Dispersion: a refractive index that depends on wavelength.

A ray carries its whole spectrum until it first meets a surface that refracts between media of which one disperses.
There one wavelength is drawn by the spectrum that the ray then has, and the ray goes on with all its light at that
wavelength. Each band's expectation stays what it was, so nothing is biased.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import used_media
from raymaps.errors import SceneError
from raymaps.kinds import SurfaceKind
from raymaps.scene import Scene

__all__ = ["Data", "acts_on", "drawn_wavelength", "interpolated_index", "lower", "needed_by"]

#: Surfaces at which the refractive index decides what happens.
_REFRACTING = (
    SurfaceKind.FRESNEL, SurfaceKind.ROUGH, SurfaceKind.THIN_FILM, SurfaceKind.COEFFICIENTS, SurfaceKind.GAUSSIAN,
    SurfaceKind.ABG, SurfaceKind.BSDF,
)  # fmt: skip


class Data(NamedTuple):
    """What the kernel reads."""

    refracts: NDArray[np.bool_]  # (256,) by SurfaceKind
    row: NDArray[np.int16]  # (n_media,) row of a dispersive medium's index, -1 for the others
    first_nm: float
    step_nm: float
    n: NDArray[np.float64]  # (n_dispersive media, n_wavelengths) refractive index
    nm: NDArray[np.float64]  # (n_nm,) wavelengths, the borders of the bands among them
    cumulated: NDArray[np.float64]  # (n_sources, n_nm) light of each source below each of them
    first: NDArray[np.int64]  # (n_bands,) place of each band's lower border in ``nm``
    last: NDArray[np.int64]  # (n_bands,) place of its upper border


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for dispersion if the index of a medium that light can travel in depends on wavelength."""
    return tuple(
        f"medium '{name}' of {where}"
        for name, where in used_media(scene).items()
        if scene.media[name].is_dispersive and not scene.media[name].is_conductor
    )


def acts_on(data: Data) -> NDArray[np.bool_]:
    """Media that are dispersive, (n_media,)."""
    return data.row >= 0


def lower(lowering: Lowering) -> Data:
    """Index of each dispersive medium on an even grid of wavelengths, and how each source's light is spread over them.

    The grid does not reach beyond what is simulated, where data may end; a single wavelength fills it alone.
    """
    bands = lowering.bands
    low, high = float(bands.low_nm.min()), float(bands.high_nm.max())
    n_steps = max(3, int(np.ceil(high - low)))
    step_nm = (high - low) / n_steps if high > low else 1.0
    grid = np.linspace(low, high, n_steps + 1)
    used = used_media(lowering.scene)
    row: list[int] = []
    index: list[NDArray[np.float64]] = []
    for name, medium in zip(lowering.names.media, lowering.media, strict=True):
        if name not in used or isinstance(medium.refractive_index, float | int) or medium.is_conductor:
            row.append(-1)
            continue
        first, last = medium.refractive_index.range_nm
        if low < first - 1e-9 or high > last + 1e-9:
            raise SceneError(
                f"Medium '{name}': its refractive index is known from {first:g} to {last:g} nm, but light from "
                f"{low:g} to {high:g} nm is simulated: narrow settings.spectrum, give the medium data that reach "
                'further, or switch the effect off by settings.without ["dispersion"].'
            )
        row.append(len(index))
        index.append(medium.index_at(grid))
    refracts = np.zeros(256, bool)
    refracts[list(_REFRACTING)] = True
    nm, cumulated = bands.spread(lowering.scene.sources.values())
    first_place, last_place = (np.searchsorted(nm, border).astype(np.int64) for border in (bands.low_nm, bands.high_nm))
    return Data(
        refracts, np.array(row, np.int16), low, step_nm, np.array(index), nm, cumulated, first_place, last_place
    )


def drawn_wavelength(data: Data, source: int, band: int, u: float) -> float:
    """Wavelength in nm that a random number gives within a band, distributed as the source's light.

    Where the source itself has no light in the band, all its wavelengths are alike.
    """
    inside = slice(data.first[band], data.last[band] + 1)
    nm, cumulated = data.nm[inside], data.cumulated[source, inside]
    if cumulated[-1] <= cumulated[0]:
        return float(nm[0] + u * (nm[-1] - nm[0]))
    target = cumulated[0] + u * (cumulated[-1] - cumulated[0])
    step = int(np.searchsorted(cumulated[1:-1], target, side="right"))
    share = (target - cumulated[step]) / (cumulated[step + 1] - cumulated[step])
    return float(nm[step] + share * (nm[step + 1] - nm[step]))


def interpolated_index(data: Data, row: int, wavelength_nm: float) -> float:
    """Refractive index between the grid's points: the cubic through the four points around or nearest (Lagrange).

    With steps of 1 nm it is right to 1e-9 for the formulas of glasses. Where a table bends, it stays between the two
    points next to it.

    References
    ----------
    M. Abramowitz, I. Stegun: Handbook of Mathematical Functions, eq. 25.2.13.
    """
    place = (wavelength_nm - data.first_nm) / data.step_nm
    first = min(max(int(place) - 1, 0), data.n.shape[1] - 4)
    p = place - first - 1
    weights = (-p * (p - 1) * (p - 2) / 6, (p * p - 1) * (p - 2) / 2, -p * (p + 1) * (p - 2) / 2, p * (p * p - 1) / 6)
    below = min(int(place), data.n.shape[1] - 2)
    return float(np.clip(np.dot(weights, data.n[row, first : first + 4]), *sorted(data.n[row, below : below + 2])))
