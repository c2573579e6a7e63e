# SPDX-License-Identifier: LGPL-2.1-or-later
"""Monte-Carlo estimates: a flux and its standard error from sums over rays.

Rays of one source are independent samples of the same random experiment. With ``X`` the light of a ray that counts
(0 if none does, up to 1 or more if it counts several times), the source's flux ``Phi`` and ``n`` rays traced,

    flux     = Phi mean(X)
    variance = Phi² s²(X) / n,   s²(X) = (sum X² - (sum X)² / n) / (n - 1)      (unbiased sample variance)

summed over the sources (each source has its own rays, so variances add up). For ``X`` in {0, 1} this is the binomial
``Phi² p (1 - p) / (n - 1)``.

Where all samples of a source are equal the sample variance is 0 although nothing is certain: an event that none of n
rays met may still happen. Then the error is that of *one* ray, ``Phi X / n``, as if one ray had told otherwise: it is
what the formula above gives for one ray among n, and the flux of a possible event that was never seen is below three of
it at 95 % confidence ("rule of three": J. A. Hanley, A. Lippman-Hand, JAMA 249 (1983) 1743). Of a source without any
ray nothing is known: its whole flux is the error. The error is 0 only where the source alone decides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["along", "covariance_w2", "estimate_flux", "is_rounding"]

Float = NDArray[np.float64]

#: A difference below this share of the sums that it is of is rounding: all samples are equal.
_ROUNDING = 1e-12


def estimate_flux(
    source_flux_w: ArrayLike,
    n_rays: ArrayLike,
    total: ArrayLike,
    squares: ArrayLike,
    exact: ArrayLike = False,
    light_of_one: ArrayLike = 1.0,
) -> tuple[Float, Float]:
    """Flux and its standard error.

    Parameters
    ----------
    source_flux_w : (n_sources,) W
    n_rays : (n_sources,)
        Rays traced of each source, whether or not they count.
    total, squares : (n_sources, ...)
        Sum over those rays of ``X`` and of ``X²``; ``X`` is a ray's light that counts, relative to its emission.
    exact : (n_sources,) bool
        Where the source alone decides the value of ``X``, so that there is no error.
    light_of_one : (n_sources, ...)
        ``X`` of the one ray that stands for what was not seen, where no ray counts.

    Returns
    -------
    flux_w, stderr_w : (...) float64, W
    """
    total, squares = np.asarray(total, np.float64), np.asarray(squares, np.float64)
    phi, n, known = (along(values, total.ndim) for values in (source_flux_w, n_rays, exact))
    some = np.maximum(n, 1.0)
    spread = squares - total**2 / some
    all_equal = is_rounding(spread, squares) | (n < 2)
    one = np.where(total > 0, squares / np.where(total > 0, total, 1.0), light_of_one)
    variance = np.where(all_equal, (one / some) ** 2, spread / (some * np.maximum(n - 1.0, 1.0)))
    variance = np.where(known != 0, 0.0, variance)
    return np.sum(phi * total / some, axis=0), np.sqrt(np.sum(phi**2 * variance, axis=0))


def covariance_w2(
    source_flux_w: ArrayLike, n_rays: ArrayLike, total_a: ArrayLike, total_b: ArrayLike, products: ArrayLike
) -> Float:
    """Covariance of two fluxes that are estimated from the same rays.

    Parameters
    ----------
    source_flux_w, n_rays : (n_sources,)
        As in `estimate_flux`.
    total_a, total_b, products : (n_sources, ...)
        Sums over the rays of ``A``, ``B`` and ``A B``.

    Returns
    -------
    (...) float64, W²; 0 for sources with fewer than two rays.
    """
    total_a, total_b = np.asarray(total_a, np.float64), np.asarray(total_b, np.float64)
    phi, n = (along(values, total_a.ndim) for values in (source_flux_w, n_rays))
    some = np.maximum(n, 2.0)
    sample = (np.asarray(products, np.float64) - total_a * total_b / some) / (some * (some - 1.0))
    return np.sum(np.where(n < 2, 0.0, phi**2 * sample), axis=0)


def is_rounding(spread: Float, of: Float) -> NDArray[np.bool_]:
    """Where a difference of sums is no more than their rounding."""
    return spread <= _ROUNDING * of


def along(values: ArrayLike, ndim: int) -> Float:
    """Values per source, shaped so that they combine with arrays whose first axis is the source."""
    array = np.asarray(values, np.float64)
    return array.reshape(array.shape + (1,) * (ndim - array.ndim)) if array.ndim else array
