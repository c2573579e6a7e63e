# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scattering by a table of measured BRDF and BTDF, with what goes on specularly beside it.

What is computed, and by which formulas, is told in `raymaps.effects.bsdf`.
"""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import allocating_kernel, kernel
from raymaps.kernels.at_surface import go_through, incidence_cosine, reflect, refract, refraction_cosine, turn_back
from raymaps.kernels.outcome import draw_among, total
from raymaps.kernels.random import ON_SURFACE, ON_SURFACE_MORE
from raymaps.kernels.sampling import sample
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

_HERE = int(SurfaceKind.BSDF)
_ABSORPTION = int(EventKind.ABSORPTION)
_SPECULAR_REFLECTION = int(EventKind.BSDF_SPECULAR_REFLECTION)
_SPECULAR_REFRACTION = int(EventKind.BSDF_SPECULAR_REFRACTION)
_DIFFUSE_REFLECTION = int(EventKind.BSDF_DIFFUSE_REFLECTION)
_DIFFUSE_REFRACTION = int(EventKind.BSDF_DIFFUSE_REFRACTION)

_TURN = 2.0 * math.pi


@kernel
def frame(nx, ny, nz, x_axis):
    """Directions of azimuth 0 and 90 degrees on a surface with an outward unit normal."""
    ax, ay, az = x_axis[0], x_axis[1], x_axis[2]
    length2 = ax * ax + ay * ay + az * az
    for _ in range(2):
        along = ax * nx + ay * ny + az * nz
        tx, ty, tz = ax - along * nx, ay - along * ny, az - along * nz
        if tx * tx + ty * ty + tz * tz >= 1e-6 * length2:
            break
        ax, ay, az = az, ax, ay
    length = math.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = tx / length, ty / length, tz / length
    return tx, ty, tz, ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx


@kernel
def last_below(values, first, last, x):
    """Index of the last of the ascending values[first:last] that is not above x; ``first`` if all are."""
    while last - first > 1:
        middle = (first + last) // 2
        if values[middle] <= x:
            first = middle
        else:
            last = middle
    return first


@kernel
def _in_ring(data, ring, azimuth, share, index, weight, count):
    """Add the directions of a ring next to an azimuth, with weights that add up to ``share``; returns their number."""
    first, last = data.direction_start[ring], data.direction_start[ring + 1]
    if last - first == 1:
        index[count], weight[count] = first, share
        return count + 1
    around = data.azimuth[first] + (azimuth - data.azimuth[first]) % _TURN
    before = last_below(data.azimuth, first, last, around)
    after = before + 1 if before + 1 < last else first
    width = data.azimuth[after] - data.azimuth[before]
    if width <= 0.0:
        width += _TURN
    part = min(max((around - data.azimuth[before]) / width, 0.0), 1.0)
    index[count], weight[count] = before, share * (1.0 - part)
    index[count + 1], weight[count + 1] = after, share * part
    return count + 2


@kernel
def incidence(data, lobe, polar, azimuth, index, weight):
    """Directions of incidence that stand for one, with weights that add up to 1.

    Parameters
    ----------
    lobe : int
    polar, azimuth : float, radians
    index : (4,) int64, filled
    weight : (4,) float64, filled

    Returns
    -------
    int: how many there are, 1 to 4
    """
    first, last = data.ring_start[lobe], data.ring_start[lobe + 1]
    ring = last_below(data.polar, first, last, polar)
    if data.is_cells[lobe]:
        start, end = data.direction_start[ring], data.direction_start[ring + 1]
        around = data.azimuth[start] + (azimuth - data.azimuth[start]) % _TURN
        index[0], weight[0] = last_below(data.azimuth, start, end, around), 1.0
        return 1
    if ring + 1 >= last or polar <= data.polar[ring]:
        return _in_ring(data, ring, azimuth, 1.0, index, weight, 0)
    part = (polar - data.polar[ring]) / (data.polar[ring + 1] - data.polar[ring])
    count = _in_ring(data, ring, azimuth, 1.0 - part, index, weight, 0)
    return _in_ring(data, ring + 1, azimuth, part, index, weight, count)


@kernel
def _add_shares(data, count, index, weight, specular, scattered):
    """Add to two (n_bands,) rows the shares of light that go on specularly and that scatter."""
    for k in range(count):
        for band in range(len(specular)):
            specular[band] += weight[k] * data.specular[index[k], band]
            scattered[band] += weight[k] * data.scattered[index[k], band]


@kernel
def _limit(shares):
    """Scale shares of each band that add up to more than 1, which rounding makes them."""
    for band in range(shares.shape[1]):
        all_shares = 0.0
        for outcome in range(shares.shape[0]):
            all_shares += shares[outcome, band]
        if all_shares > 1.0:
            for outcome in range(shares.shape[0]):
                shares[outcome, band] /= all_shares


@kernel
def _taken_on(data, row, light):
    """Light of all bands that the cells of a direction of incidence up to one of them take on."""
    columns = data.cumulated.shape[1]
    result = 0.0
    for band in range(len(light)):
        result += light[band] * data.cumulated[row, band if columns > 1 else 0]
    return result


@kernel
def draw_cell(data, count, index, weight, arriving, light, u, v):
    """Draw a direction of incidence that stands for the ray's, and an outgoing cell of it, by the light that it takes
    on.

    Parameters
    ----------
    count, index, weight : see `incidence`
    arriving : (n_bands,) float64
        Light before anything was drawn.
    light : (n_bands,) float32
        Light that goes on in all cells together; changed in place to bands as in the cell, and the same in all.
    u, v : float, uniform in (0, 1)

    Returns
    -------
    int: row of the cell's borders
    """
    going_on = total(light)
    all_light = 0.0
    for k in range(count):
        all_light += weight[k] * _taken_on(data, data.value_start[index[k] + 1] - 1, arriving)
    u *= all_light
    drawn, below = -1, 0.0
    for k in range(count):
        by_this = weight[k] * _taken_on(data, data.value_start[index[k] + 1] - 1, arriving)
        if by_this > 0.0:
            drawn = index[k]
            below += by_this
            if u < below:
                break
    first, last = data.value_start[drawn], data.value_start[drawn + 1] - 1
    v *= _taken_on(data, last, arriving)
    low, high = first, last
    while low < high:
        middle = (low + high) // 2
        if _taken_on(data, middle, arriving) > v:
            high = middle
        else:
            low = middle + 1
    while low > first and _taken_on(data, low, arriving) <= _taken_on(data, low - 1, arriving):
        low -= 1  # v was rounded up to the end, behind which cells are dark
    columns = data.cumulated.shape[1]
    in_cell = 0.0
    for band in range(len(light)):
        column = band if columns > 1 else 0
        share = data.cumulated[low, column] - (data.cumulated[low - 1, column] if low > first else 0.0)
        light[band] = arriving[band] * share
        in_cell += arriving[band] * share
    for band in range(len(light)):
        light[band] = light[band] * (going_on / in_cell)
    return data.border_start[drawn] + low - first


@allocating_kernel
def run(active, wave, tables, data, key, depth):
    """Reflect, transmit, scatter or absorb every ray that meets a surface with a table."""
    n_bands = wave.light.shape[1]
    shares = np.empty((4, n_bands))  # specular and diffuse reflection, specular and diffuse transmission
    arriving = np.empty(n_bands)
    index = np.zeros((2, 4), np.int64)
    weight = np.zeros((2, 4))
    counts = np.zeros(2, np.int64)
    for k in range(len(active)):
        i = active[k]
        surface = wave.surface[i]
        if wave.state[i] != PENDING or tables.surface_kind[surface] != _HERE:
            continue
        normal = wave.normal[i]
        nx, ny, nz = normal[0], normal[1], normal[2]
        dx, dy, dz = wave.direction[i, 0], wave.direction[i, 1], wave.direction[i, 2]
        cos_i = incidence_cosine(wave, i, normal)
        cos_t = refraction_cosine(cos_i, wave.n_near[i], wave.n_far[i])
        tx, ty, tz, bx, by, bz = frame(nx, ny, nz, data.x_axis[surface])
        azimuth = math.atan2(dx * bx + dy * by + dz * bz, dx * tx + dy * ty + dz * tz)
        face = 0 if wave.near_side[i] > 0 else 1
        shares[:] = 0.0
        for way in range(2):
            lobe = data.lobe[surface, face, way]
            counts[way] = 0
            if lobe >= 0:
                counts[way] = incidence(data, lobe, math.acos(cos_i), azimuth, index[way], weight[way])
                _add_shares(data, counts[way], index[way], weight[way], shares[2 * way], shares[2 * way + 1])
        _limit(shares)
        for band in range(n_bands):
            if data.is_conductor[wave.beyond[i]]:
                shares[2, band] = shares[3, band] = 0.0
            elif cos_t < 0.0:  # total reflection
                shares[0, band] += shares[2, band]
                shares[2, band] = 0.0
        for band in range(n_bands):
            arriving[band] = wave.light[i, band]
        _, u, v, w = sample(key, i, depth, ON_SURFACE)
        outcome = draw_among(wave.light[i], shares, key.roulette_threshold, u)
        if outcome < 0:
            wave.state[i] = _ABSORPTION
            continue
        if outcome == 0:
            reflect(wave, i, normal)
            wave.state[i] = _SPECULAR_REFLECTION
            continue
        if outcome == 2:
            refract(wave, i, normal, cos_i, cos_t)
            wave.state[i] = _SPECULAR_REFRACTION
            continue
        way = outcome // 2
        p, q, _, _ = sample(key, i, depth, ON_SURFACE_MORE)
        cell = draw_cell(data, counts[way], index[way], weight[way], arriving, wave.light[i], p, q)
        border = data.border[cell]
        sin2 = border[0] + v * (border[1] - border[0])
        turn = border[2] + w * (border[3] - border[2])
        if not data.is_cells[data.lobe[surface, face, way]]:
            turn += azimuth
        sine = math.sqrt(sin2)
        along, across = sine * math.cos(turn), sine * math.sin(turn)
        if way == 0:
            wave.state[i] = _DIFFUSE_REFLECTION
            turn_back(wave, i)
        else:
            wave.state[i] = _DIFFUSE_REFRACTION
            go_through(wave, i)
        up = wave.side[i] * math.sqrt(max(1.0 - sin2, 0.0))
        wave.direction[i, 0] = along * tx + across * bx + up * nx
        wave.direction[i, 1] = along * ty + across * by + up * ny
        wave.direction[i, 2] = along * tz + across * bz + up * nz
