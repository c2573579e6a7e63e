# SPDX-License-Identifier: LGPL-2.1-or-later
"""Errors of rays that are no independent samples, from independent sets of them: replicates.

Rays whose numbers are points of a sequence know of each other, so the spread of their light says nothing of the error.
The rays of a source are in R replicates that are independent. With T_r the light of the n_r rays of one, and
m_r = T_r / n_r,

    var(mean) = sum (m_r - m)² / (R (R - 1)).                                                                (1)

R - 1 differences know it to within sqrt(2 / (R - 1)) of itself. So it is widened by the square of the ratio of
Student's quantile to the normal one, which makes value ± 1.96 errors an interval of 95 %.

Where few rays count, or all replicates are nearly as large, (1) may be 0 by chance. The interval is never narrower
than three rays to either side, as that of an event that was not seen, unless independent rays would be as sure.

From there on all goes its usual way: as if rays were independent, and their squares added up to what gives that error.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raymaps.criterion.estimate import along, is_rounding

__all__ = ["by_source", "effective_products", "effective_squares"]

Float = NDArray[np.float64]

_NORMAL = 1.959963985
#: Student's quantile at 97.5 % of `raymaps.ray_numbers.REPLICATES` - 1 degrees of freedom over the normal one, squared.
_WIDER = (2.131449546 / _NORMAL) ** 2
#: Squares of light of typical rays to which three rays to either side correspond.
_LEAST = (3.0 / _NORMAL) ** 2


def by_source(values: ArrayLike, n_sources: int) -> Float:
    """Sums over the replicates of each source, (n_sources, ...), of what is told by group, (n_sources * R, ...)."""
    array = np.asarray(values)
    return np.asarray(array.reshape(n_sources, len(array) // max(n_sources, 1), *array.shape[1:]).sum(axis=1))


def effective_squares(n_rays: ArrayLike, total: ArrayLike, squares: ArrayLike) -> Float:
    """Squares of as many independent rays that would have the error that the replicates tell.

    Parameters
    ----------
    n_rays : (n_sources, R)
        Rays of each replicate.
    total : (n_sources, R, ...)
        Sum over its rays of ``X``, see `raymaps.criterion.estimate`.
    squares : (n_sources, ...)
        Sum over all rays of ``X²``.

    Returns
    -------
    (n_sources, ...) float64; ``squares`` itself where R is 1, where all rays bring the same, and where a replicate has
    no ray.
    """
    rays, total, squares = np.asarray(n_rays, np.float64), np.asarray(total, np.float64), np.asarray(squares)
    if rays.shape[1] == 1:
        return squares
    n, in_all = along(rays.sum(axis=1), squares.ndim), total.sum(axis=1)
    some = np.maximum(n, 1.0)
    spread = squares - in_all**2 / some
    of_one = squares / np.where(in_all != 0, in_all, 1.0)
    least = np.minimum(_LEAST * of_one**2, spread) / some**2
    variance = np.maximum(_covariance(rays, total, total), least)
    found = in_all**2 / some + n * (n - 1.0) * variance
    unknown = along((rays == 0).any(axis=1), squares.ndim) != 0
    return np.where(unknown | is_rounding(spread, squares), squares, found)


def effective_products(n_rays: ArrayLike, total_a: ArrayLike, total_b: ArrayLike, products: ArrayLike) -> Float:
    """The same of products: sums of ``A B``, for `raymaps.criterion.covariance_w2`."""
    rays, a, b = (np.asarray(values, np.float64) for values in (n_rays, total_a, total_b))
    products = np.asarray(products, np.float64)
    if rays.shape[1] == 1:
        return products
    n = along(rays.sum(axis=1), products.ndim)
    found = a.sum(axis=1) * b.sum(axis=1) / np.maximum(n, 1.0) + n * (n - 1.0) * _covariance(rays, a, b)
    return np.where(along((rays == 0).any(axis=1), products.ndim) != 0, products, found)


def _covariance(rays: Float, a: Float, b: Float) -> Float:
    """Covariance of the means over all rays by (1), widened; replicate by replicate, as there may be many cells."""
    n_replicates = rays.shape[1]
    n = np.maximum(rays.sum(axis=1), 1.0)
    mean_a, mean_b = (total.sum(axis=1) / along(n, total.ndim - 1) for total in (a, b))
    found = np.zeros(np.broadcast_shapes(mean_a.shape, mean_b.shape))
    for r in range(n_replicates):
        of_a, of_b = (total[:, r] / along(np.maximum(rays[:, r], 1.0), total.ndim - 1) for total in (a, b))
        found += (of_a - mean_a) * (of_b - mean_b)
    return np.asarray(found * (_WIDER / (n_replicates * (n_replicates - 1))))
