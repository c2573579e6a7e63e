# SPDX-License-Identifier: LGPL-2.1-or-later
"""Drawing what happens on a surface whose coefficients differ by band."""

from __future__ import annotations

import numpy as np

from raymaps.jit import kernel

__all__ = ["draw_outcome"]


@kernel
def draw_outcome(light, first, second, threshold, u):
    """Draw one of two outcomes or absorption, and scale the light so that its expectation is right in each band.

    While the light that would go on stays above the threshold, what is lost is taken off. Below it the loss is
    drawn: the ray is absorbed whole or goes on with min(light, threshold) (Russian roulette). Light never grows.

    Parameters
    ----------
    light : (3 bands,) float32
        Light that arrives, relative to the ray's emission; changed in place to the light that goes on (0 if absorbed).
    first, second : (3 bands,) float64
        Share of the light in each band that the outcomes take on.
    threshold : float
    u : float, uniform in (0, 1)

    Returns
    -------
    int: 0 for the first outcome, 1 for the second, -1 for absorption

    Notes
    -----
    With arriving light w (all bands), shares c1 + c2 = c averaged over that light, and light w' that goes on with
    probability p = w c / w', outcome k with c_k / c and band b with l_b C_kb w' / (w c_k), the expectation of band b
    over outcome k is l_b C_kb.
    """
    arriving = np.float64(light[0]) + np.float64(light[1]) + np.float64(light[2])
    by_first = light[0] * first[0] + light[1] * first[1] + light[2] * first[2]
    by_second = light[0] * second[0] + light[1] * second[1] + light[2] * second[2]
    through = by_first + by_second  # = w c
    going_on = max(through, min(arriving, threshold))  # = w'
    u *= going_on
    if u >= through or through <= 0.0:
        light[0] = light[1] = light[2] = 0.0
        return -1
    if u < by_first:
        scale = going_on / by_first
        for band in range(3):
            light[band] = light[band] * first[band] * scale
        return 0
    scale = going_on / by_second
    for band in range(3):
        light[band] = light[band] * second[band] * scale
    return 1
