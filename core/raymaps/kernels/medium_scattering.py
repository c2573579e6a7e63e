# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scattering inside media: `run` ends a segment where the ray is scattered, `scatter` turns it there."""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import allocating_kernel, kernel
from raymaps.kernels.directions import around
from raymaps.kernels.interface import undo_passes
from raymaps.kernels.phase import henyey_greenstein, tabulated
from raymaps.kernels.random import SCATTER_DIRECTION, SCATTER_PLACE
from raymaps.kernels.sampling import sample
from raymaps.kinds import EventKind

__all__ = ["run", "scatter"]

_MEDIUM_SCATTERING = int(EventKind.MEDIUM_SCATTERING)
_NUMERICAL = int(EventKind.KILLED_NUMERICAL)
#: Whether and how a medium scatters (`raymaps.effects.medium_scattering.Data.mode`).
_CLEAR, _GREY = 0, 1


@kernel
def fine(u, v):
    """A uniform number in [0, 1) in steps of 2^-64 near 0, from two of `sample`; its largest value is 1 - 2^-53."""
    return min((u - 2.0**-33) + v * 2.0**-32, 1.0 - 2.0**-53)


@allocating_kernel
def run(active, wave, tables, data, key, depth):
    """End the segments of rays that a medium scatters; the light of all rays is recoloured, its sum stays.

    With light l_b, and e_b = exp(-m_b d) the share of band b that gets through unscattered, a ray gets through with
    probability s = sum(l_b e_b) / sum(l_b) and then carries l_b e_b / s. Else it is scattered after the distance t,
    drawn from the density sum(l_b m_b exp(-m_b t)) cut off at d, with light in proportion to l_b m_b exp(-m_b t).
    """
    weight = np.empty(data.coefficient.shape[1])
    for k in range(len(active)):
        i = active[k]
        medium = wave.medium[i]
        if data.mode[medium] == _CLEAR:
            continue
        coefficient = data.coefficient[medium]
        light = wave.light[i]
        distance = wave.distance[i]
        a, b, c, d = sample(key, i, depth, SCATTER_PLACE)
        u, v = fine(a, b), fine(c, d)
        if data.mode[medium] == _GREY:
            drawn = coefficient[0]
            if u >= -math.expm1(-drawn * distance):
                continue
            way = _place(drawn, distance, v)
        else:
            total = all_scattered = 0.0
            for band in range(len(light)):
                total += np.float64(light[band])
                weight[band] = light[band] * -math.expm1(-coefficient[band] * distance)
                all_scattered += weight[band]
            u *= total
            if u >= all_scattered:
                for band in range(len(light)):
                    weight[band] = light[band] * math.exp(-coefficient[band] * distance)
                recolour(light, weight)
                continue
            drawn = coefficient[_draw(weight, u)]
            way = _place(drawn, distance, v)
            for band in range(len(light)):
                weight[band] = light[band] * coefficient[band] * math.exp(-coefficient[band] * way)
            recolour(light, weight)
        for axis in range(3):
            wave.end[i, axis] = wave.position[i, axis] + way * wave.direction[i, axis]
        wave.distance[i] = way
        wave.hit[i] = -1
        wave.state[i] = _MEDIUM_SCATTERING if undo_passes(wave, i, way) else _NUMERICAL


@kernel
def _place(coefficient, distance, v):
    """Distance drawn from the exponential of a coefficient, cut off at a distance."""
    return min(-math.log1p(v * math.expm1(-coefficient * distance)) / coefficient, distance)


@kernel
def _draw(weight, u):
    """Index drawn by weights; u lies from 0 to below their sum."""
    below = 0.0
    for index in range(len(weight)):
        below += weight[index]
        if u < below:
            return index
    return len(weight) - 1


@kernel
def recolour(light, weight):
    """Set the light of bands in proportion to weights; its sum stays."""
    total = weights = 0.0
    for band in range(len(light)):
        total += np.float64(light[band])
        weights += weight[band]
    if weights > 0.0:
        for band in range(len(light)):
            light[band] = weight[band] * (total / weights)


@allocating_kernel
def scatter(active, wave, tables, data, key, depth):
    """Turn the rays that are scattered.

    The scatterer is drawn by its share of the light, the angle by its phase function, the azimuth evenly.
    """
    weight = np.empty(data.coefficient.shape[1])
    for k in range(len(active)):
        i = active[k]
        if wave.state[i] != _MEDIUM_SCATTERING:
            continue
        medium = wave.medium[i]
        u, v, w, _ = sample(key, i, depth, SCATTER_DIRECTION)
        component, end = data.component_start[medium], data.component_start[medium + 1]
        if end - component > 1:
            component += _draw_component(wave.light[i], data.component_share[component:end], weight, u)
        start, stop = data.table_start[component], data.table_start[component + 1]
        if stop > start:
            table = data.angle_rad[start:stop], data.value[start:stop], data.cumulated[start:stop]
            cosine, sine = tabulated(*table, v)
        else:
            cosine, sine = henyey_greenstein(data.g[component], v)
        dx, dy, dz = wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2]
        dx, dy, dz = around(dx, dy, dz, cosine, sine, 2.0 * math.pi * w)
        wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2] = dx, dy, dz


@allocating_kernel
def _draw_component(light, share, weight, u):
    """Draw one of several scatterers by its share of the light, and recolour the light to what it scatters.

    Parameters
    ----------
    light : (n_bands,) float32, changed in place; its sum stays
    share : (n_components, n_bands) float64
        Share of each scatterer in the medium's coefficient, by band.
    weight : (n_bands,) float64
        Room to work in.
    u : float, uniform in (0, 1)
    """
    by_component = np.empty(len(share))
    scattered = 0.0
    for component in range(len(share)):
        by_component[component] = 0.0
        for band in range(len(light)):
            by_component[component] += light[band] * share[component, band]
        scattered += by_component[component]
    drawn = _draw(by_component, u * scattered)
    for band in range(len(light)):
        weight[band] = light[band] * share[drawn, band]
    recolour(light, weight)
    return drawn
