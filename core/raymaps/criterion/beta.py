# SPDX-License-Identifier: LGPL-2.1-or-later
"""The beta distribution for confidence intervals: its distribution function, and the quantiles of a mixture of two.

Where a parameter is 1 the distribution function is a power; else it is the normal approximation of Peizer and Pratt.
With both parameters 1 or more, which is all that intervals need, it is right to 0.003, in the tails of 2.5 % to 0.0007;
limits of counts that follow from it are right to a hundredth of a ray (`tests/unit/test_criterion_interval.py`).

References
----------
D. B. Peizer, J. W. Pratt, "A normal approximation for binomial, F, beta, and other common, related tail
probabilities, I", J. Amer. Statist. Assoc. 63 (1968) 1416, eqs. 2.1 to 2.4.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["beta_cdf", "mixture_quantile"]

Float = NDArray[np.float64]

#: Beyond these logits no quantile is sought: shares of 1e-26, and of all but that.
_LARGEST_LOGIT = 60.0
#: A quantile is sought so many standard deviations around the mean, by so many halvings: to 1e-8 of a deviation.
_WITHIN, _HALVINGS = 12.0, 32
#: A parameter that is so near to 1 is 1 but for rounding.
_ONE = 1e-6

_erf = np.vectorize(math.erf, otypes=[np.float64])


def beta_cdf(p: Float, q: Float, a: Float, b: Float) -> Float:
    """Distribution function of the beta distribution.

    Parameters
    ----------
    p, q : (...) float64, 0 to 1
        Where, and ``1 - p``, given by itself so that it is exact near 1.
    a, b : (...) float64, >= 0
        Parameters. With ``a`` = 0 all lies at 0, with ``b`` = 0 all at 1.

    Returns
    -------
    (...) float64, 0 to 1
    """
    # of a binomial with s successes beyond which, and t failures short of which: a = s + 1/2, b = t + 1/2
    s, t = np.maximum(a, 1.0) - 0.5, np.maximum(b, 1.0) - 0.5
    n = s + t
    distance = s + 1 / 6 - (n + 1 / 3) * p + 0.02 * (q / (s + 0.5) - p / (t + 0.5) + (q - 0.5) / (n + 1))
    spread = (1 + q * _g(s / (n * p)) + p * _g(t / (n * q))) / ((n + 1 / 6) * p * q)
    z = -distance * np.sqrt(spread)
    cdf = 0.5 * (1 + _erf(z / math.sqrt(2)))
    cdf = np.where(np.abs(a - 1) < _ONE, -np.expm1(b * np.log(q)), np.where(np.abs(b - 1) < _ONE, p**a, cdf))
    return np.where(a <= 0, 1.0, np.where(b <= 0, 0.0, cdf))


def _g(x: Float) -> Float:
    """``(1 - x² + 2 x ln x) / (1 - x)²``, by its series where the difference of terms would be rounding."""
    u = x - 1
    near = np.abs(u) < 1e-2
    series = u * (-1 / 3 + u * (1 / 6 + u * (-1 / 10 + u * (1 / 15 - u / 21))))
    apart = np.where(near, 1.0, u)
    return np.where(near, series, (1 - x**2 + 2 * x * np.log(x)) / apart**2)


def mixture_quantile(levels: Float, a: Float, b: Float) -> Float:
    """Quantiles of even mixtures of two beta distributions; of two alike they are theirs.

    Parameters
    ----------
    levels : (n_levels,) float64, 0 to 1
    a, b : (2, n) float64
        Parameters of the two.

    Returns
    -------
    (n_levels, n) float64, 0 to 1
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        mean, deviation = np.log(a) - np.log(b), np.sqrt(1 / a + 1 / b)  # of logits, about
        low, high = (
            np.nan_to_num(mean + side * _WITHIN * deviation, nan=side * _LARGEST_LOGIT) for side in (-1.0, 1.0)
        )
    low = np.tile(np.clip(low.min(axis=0), -_LARGEST_LOGIT, _LARGEST_LOGIT), (len(levels), 1))
    high = np.tile(np.clip(high.max(axis=0), -_LARGEST_LOGIT, _LARGEST_LOGIT), (len(levels), 1))
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        p, q = 1 / (1 + np.exp(-middle)), 1 / (1 + np.exp(middle))
        below = beta_cdf(p, q, a[:, None], b[:, None]).mean(axis=0) < levels[:, None]
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    edge = _LARGEST_LOGIT * (1 - 1e-9)
    return np.where(low > edge, 1.0, np.where(high < -edge, 0.0, 1 / (1 + np.exp(-(low + high) / 2))))
