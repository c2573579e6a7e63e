# SPDX-License-Identifier: LGPL-2.1-or-later
"""Drawing what happens on a surface whose coefficients differ by band.

While the light that would go on stays above the threshold, what is lost is taken off. Below it the loss is drawn: the
ray is absorbed whole or goes on with min(light, threshold) (Russian roulette). So is a loss that is too small to be
taken off a float32: a mirror that keeps all but 1e-8 would else lose nothing ever. Light never grows.

With arriving light w (all bands), shares c_1 + ... = c averaged over that light, and light w' that goes on with
probability p = w c / w', outcome k with c_k / c and band b with l_b C_kb w' / (w c_k), the expectation of band b over
outcome k is l_b C_kb.
"""

from __future__ import annotations

import numpy as np

from raymaps.jit import kernel

__all__ = ["SMALL_LOSS", "draw_among", "draw_outcome", "draw_reflection", "total"]

#: Share of the light below which a loss is drawn; rounding to float32 takes up to 2^-25.
SMALL_LOSS = 2.0**-18


@kernel
def total(light):
    """Light of all bands together, a float64, added up in their order."""
    result = 0.0
    for band in range(len(light)):
        result += np.float64(light[band])
    return result


@kernel
def _weighted(light, share):
    """Light of all bands together that a share of each takes on."""
    result = 0.0
    for band in range(len(light)):
        result += light[band] * share[band]
    return result


@kernel
def _going_on(arriving, through, threshold):
    """Light that a ray goes on with if it does, of what arrives and what gets through in the mean."""
    if through > (1.0 - SMALL_LOSS) * arriving:
        return max(through, arriving)
    return max(through, min(arriving, threshold))


@kernel
def _scale(light, share, factor):
    for band in range(len(light)):
        light[band] = light[band] * share[band] * factor


@kernel
def draw_reflection(light, share, threshold, u):
    """Draw whether the ray goes on with a share of its light or is absorbed.

    Parameters
    ----------
    light : (n_bands,) float32
        Light that arrives, relative to the ray's emission; changed in place to the light that goes on (0 if absorbed).
    share : (n_bands,) float64
        Share of the light in each band that goes on.
    threshold : float
    u : float, uniform in (0, 1)

    Returns
    -------
    bool: whether it goes on
    """
    arriving = total(light)
    through = _weighted(light, share)
    going_on = _going_on(arriving, through, threshold)
    if u * going_on >= through or through <= 0.0:
        light[:] = 0.0
        return False
    _scale(light, share, going_on / through)
    return True


@kernel
def draw_outcome(light, first, second, threshold, u):
    """Draw one of two outcomes or absorption, and scale the light so that its expectation is right in each band.

    Parameters
    ----------
    light, threshold, u : see `draw_reflection`
    first, second : (n_bands,) float64
        Share of the light in each band that the outcomes take on.

    Returns
    -------
    int: 0 for the first outcome, 1 for the second, -1 for absorption
    """
    arriving = total(light)
    by_first = _weighted(light, first)
    by_second = _weighted(light, second)
    through = by_first + by_second
    going_on = _going_on(arriving, through, threshold)
    u *= going_on
    if u >= through or through <= 0.0:
        light[:] = 0.0
        return -1
    if u < by_first:
        _scale(light, first, going_on / by_first)
        return 0
    _scale(light, second, going_on / by_second)
    return 1


@kernel
def draw_among(light, shares, threshold, u):
    """Draw one of several outcomes or absorption, and scale the light so that its expectation is right in each band.

    Parameters
    ----------
    light, threshold, u : see `draw_reflection`
    shares : (n_outcomes, n_bands) float64
        Share of the light in each band that each outcome takes on; at most 1 together.

    Returns
    -------
    int: the outcome, -1 for absorption
    """
    arriving = total(light)
    through = 0.0
    for outcome in range(len(shares)):
        through += _weighted(light, shares[outcome])
    going_on = _going_on(arriving, through, threshold)
    u *= going_on
    if u >= through or through <= 0.0:
        light[:] = 0.0
        return -1
    drawn = -1
    by_drawn = below = 0.0
    for outcome in range(len(shares)):
        by_this = _weighted(light, shares[outcome])
        if by_this > 0.0:
            drawn, by_drawn = outcome, by_this
            below += by_this
            if u < below:
                break
    _scale(light, shares[drawn], going_on / by_drawn)
    return drawn
