# SPDX-License-Identifier: LGPL-2.1-or-later
"""Dispersion: rays that meet a refracting surface of a dispersive medium are narrowed to one wavelength."""

from __future__ import annotations

import numpy as np

from raymaps.jit import kernel
from raymaps.kernels.random import COLLAPSE
from raymaps.kernels.sampling import sample
from raymaps.kernels.transport import PENDING


@kernel
def index_at(data, row, wavelength_nm):
    """See `raymaps.effects.dispersion.interpolated_index`."""
    place = (wavelength_nm - data.first_nm) / data.step_nm
    first = min(max(int(place) - 1, 0), data.n.shape[1] - 4)
    p = place - first - 1.0
    values = data.n[row]
    below = min(int(place), data.n.shape[1] - 2)
    cubic = (
        -p * (p - 1.0) * (p - 2.0) / 6.0 * values[first]
        + (p * p - 1.0) * (p - 2.0) / 2.0 * values[first + 1]
        - p * (p + 1.0) * (p - 2.0) / 2.0 * values[first + 2]
        + p * (p * p - 1.0) / 6.0 * values[first + 3]
    )
    return min(max(cubic, min(values[below], values[below + 1])), max(values[below], values[below + 1]))


@kernel
def wavelength_in(data, source, band, u):
    """See `raymaps.effects.dispersion.drawn_wavelength`."""
    below, above = data.first[band], data.last[band]
    cumulated = data.cumulated[source]
    if cumulated[above] <= cumulated[below]:
        return data.nm[below] + u * (data.nm[above] - data.nm[below])
    target = cumulated[below] + u * (cumulated[above] - cumulated[below])
    while above - below > 1:
        middle = (below + above) // 2
        if cumulated[middle] <= target:
            below = middle
        else:
            above = middle
    share = (target - cumulated[below]) / (cumulated[above] - cumulated[below])
    return data.nm[below] + share * (data.nm[above] - data.nm[below])


@kernel
def run(active, wave, tables, data, key, depth):
    """Draw the wavelength of rays that do not have one yet, and tell the indices before and beyond the surface."""
    for k in range(len(active)):
        i = active[k]
        if wave.state[i] != PENDING or not data.refracts[tables.surface_kind[wave.surface[i]]]:
            continue
        near, far = data.row[wave.medium[i]], data.row[wave.beyond[i]]
        if near < 0 and far < 0:
            continue
        if wave.wavelength_nm[i] == 0.0:
            light = wave.light[i]
            total = 0.0
            for band in range(len(light)):
                total += np.float64(light[band])
            u, v, _, _ = sample(key, i, depth, COLLAPSE)
            u *= total
            drawn = 0
            below = 0.0
            for band in range(len(light)):
                if light[band] > 0.0:
                    drawn = band
                    below += np.float64(light[band])
                    if u < below:
                        break
            for band in range(len(light)):
                light[band] = 0.0
            light[drawn] = total
            wave.wavelength_nm[i] = wavelength_in(data, wave.source[i], drawn, v)
        if near >= 0:
            wave.n_near[i] = index_at(data, near, wave.wavelength_nm[i])
        if far >= 0:
            wave.n_far[i] = index_at(data, far, wave.wavelength_nm[i])
