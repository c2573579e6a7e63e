# SPDX-License-Identifier: LGPL-2.1-or-later
"""Specular and diffuse reflection and transmission by given shares, over the angle of incidence."""

from __future__ import annotations

import math

import numpy as np

from raymaps.jit import allocating_kernel, kernel
from raymaps.kernels.at_surface import (
    go_through,
    incidence_cosine,
    reflect,
    refract,
    refraction_cosine,
    scatter_lambertian,
    turn_back,
)
from raymaps.kernels.outcome import draw_among
from raymaps.kernels.random import ON_SURFACE
from raymaps.kernels.sampling import sample
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind, SurfaceKind

__all__ = ["run", "shares_at"]

_HERE = int(SurfaceKind.COEFFICIENTS)
_ABSORPTION = int(EventKind.ABSORPTION)
_KINDS = (
    int(EventKind.SPECULAR_REFLECTION),
    int(EventKind.SPECULAR_REFRACTION),
    int(EventKind.DIFFUSE_REFLECTION),
    int(EventKind.DIFFUSE_REFRACTION),
)


@kernel
def shares_at(angle, nodes, table, shares):
    """Interpolate shares over the angle of incidence, linear between nodes and constant beyond.

    Parameters
    ----------
    angle : float, radians
    nodes : (n_angles,) float64, ascending
    table : (n_angles, 4, n_bands) float64
    shares : (4, n_bands) float64, filled
    """
    after = np.searchsorted(nodes, angle, side="right")
    before = max(after - 1, 0)
    after = min(after, len(nodes) - 1)
    place = 0.0
    if after > before and angle > nodes[before]:
        place = (angle - nodes[before]) / (nodes[after] - nodes[before])
    for outcome in range(shares.shape[0]):
        for band in range(shares.shape[1]):
            low, high = table[before, outcome, band], table[after, outcome, band]
            shares[outcome, band] = low + place * (high - low)


@allocating_kernel
def run(active, wave, tables, data, key, depth):
    """Reflect or transmit every ray that meets such a surface, specularly or diffusely, or absorb it."""
    n_bands = wave.light.shape[1]
    shares = np.empty((4, n_bands))
    for slot in range(len(active)):
        i = active[slot]
        surface = wave.surface[i]
        if wave.state[i] != PENDING or tables.surface_kind[surface] != _HERE:
            continue
        normal = wave.normal[i]
        cos_i = incidence_cosine(wave, i, normal)
        cos_t = refraction_cosine(cos_i, wave.n_near[i], wave.n_far[i])
        rows = slice(data.start[surface], data.start[surface + 1])
        shares_at(math.acos(cos_i), data.angle_rad[rows], data.share[rows], shares)
        for band in range(n_bands):
            if data.is_conductor[wave.beyond[i]]:
                shares[1, band] = shares[3, band] = 0.0
            elif cos_t < 0.0:
                shares[0, band] += shares[1, band]
                shares[1, band] = 0.0
        _, u, v, w = sample(key, i, depth, ON_SURFACE)
        outcome = draw_among(wave.light[i], shares, key.roulette_threshold, u)
        if outcome < 0:
            wave.state[i] = _ABSORPTION
            continue
        wave.state[i] = _KINDS[outcome]
        if outcome == 0:
            reflect(wave, i, normal)
        elif outcome == 1:
            refract(wave, i, normal, cos_i, cos_t)
        else:
            if outcome == 2:
                turn_back(wave, i)
            else:
                go_through(wave, i)
            scatter_lambertian(wave, i, normal, v, w)
