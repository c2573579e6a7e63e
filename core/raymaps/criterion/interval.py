# SPDX-License-Identifier: LGPL-2.1-or-later
"""Confidence intervals of fluxes, good for few rays too, from the sums over rays that standard errors follow from.

Of ``n`` rays ``k`` count, each with the same light. Then the share is between the mid-p limits of the binomial: with
``B(a, b)`` the beta distribution, the quantiles of

    H = ½ B(k, n - k + 1) + ½ B(k + 1, n - k),                                                               (1)

the even mixture of the two that make Clopper and Pearson's limits. These hold their level at worst, and far above it
where rays are few; the mid-p limits hold it on the average over what there is to be estimated. If no ray counts, the
upper one is three rays (the 95 % rule of Hanley and Lippman-Hand), if all do the lower one is three rays less than all.
For small shares (1) is a mixture of gamma distributions: Poisson limits.

The two parts of (1) are what one ray more would make of the sample: one without light, one with it. So they are read
here for light of any size, several crossings a ray and several sources. With ``X`` as in `raymaps.criterion.estimate`,
at most ``x``, and sources that are not decided by logic,

    F = sum Phi x,    m = sum Phi mean(X) / F,    v = sum Phi² s²(X) / n / F²,    N = m (1 - m) / v,           (2)

the flux is taken for a share ``m`` of the most that is possible, as known as from ``N`` rays that count or don't:
``B(m N, (1 - m) N)`` has the mean and (but for one ray in N) the variance. One part is of the sample with one ray more
that brings what rays with light bring, ``sum X² / sum X``; the other with one that lacks what rays lack. Of several
sources that one gets the ray of which it makes the most: heavy rays that never came may come. For counts of one source
that is (1). For rare light it is the mid-p gamma interval of Fay and Kim, whose matching of moments is that of Fay and
Feuer; away from 0 and 1 it is that of Korn and Graubard for surveys.

References
----------
M. P. Fay, E. J. Feuer, "Confidence intervals for directly standardized rates", Statistics in Medicine 16 (1997) 791.
M. P. Fay, S. Kim, "Confidence intervals for directly standardized rates using mid-p gamma intervals", Biometrical
Journal 59 (2017) 377.
E. L. Korn, B. I. Graubard, "Confidence intervals for proportions with small expected number of positive counts
estimated from survey data", Survey Methodology 24 (1998) 193.
J. A. Hanley, A. Lippman-Hand, "If nothing goes wrong, is everything all right?", JAMA 249 (1983) 1743.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raymaps.criterion.beta import mixture_quantile
from raymaps.criterion.estimate import along, estimate_flux, is_rounding

__all__ = ["CONFIDENCE", "confidence_interval"]

Float = NDArray[np.float64]

#: How often an interval contains the truth.
CONFIDENCE = 0.95
#: As many rays as certainty is worth.
_CERTAIN = 1e30
#: Rounding of light to float32, as a share of it.
_OF_LIGHT = 1e-5


def confidence_interval(
    source_flux_w: ArrayLike,
    n_rays: ArrayLike,
    total: ArrayLike,
    squares: ArrayLike,
    exact: ArrayLike = False,
    light_of_one: ArrayLike = 1.0,
    most: ArrayLike = 1.0,
    confidence: float = CONFIDENCE,
) -> tuple[Float, Float]:
    """Limits between which a flux lies, as often as the confidence says.

    Parameters
    ----------
    source_flux_w, n_rays, total, squares, exact, light_of_one
        As of `raymaps.criterion.estimate_flux`.
    most : (n_sources, ...)
        The most that ``X`` can be; where rays count several times the most that was seen.
    confidence : float, 0 to 1

    Returns
    -------
    low_w, high_w : (...) float64, W
        Both the flux where the sources alone decide it. Of a source without rays all is possible.
    """
    total, squares = np.asarray(total, np.float64), np.asarray(squares, np.float64)
    given = (source_flux_w, n_rays, exact, light_of_one, most)
    phi, n, known, one, most_x = (np.broadcast_to(along(values, total.ndim), total.shape) for values in given)
    flux_w, _ = estimate_flux(source_flux_w, n_rays, total, squares, exact)
    rows, back = np.unique(
        np.stack([phi, n, known != 0, one, most_x, total, squares]).reshape(7 * len(total), -1).T,
        axis=0, return_inverse=True,
    )  # fmt: skip
    low_w, high_w = _limits_w(rows.T.reshape(7, len(total), -1), (1 - confidence) / 2)
    low_w, high_w = (limit[back.ravel()].reshape(flux_w.shape) for limit in (low_w, high_w))
    return np.minimum(low_w, flux_w), np.maximum(high_w, flux_w)


def _limits_w(samples: Float, tail: float) -> tuple[Float, Float]:
    """Limits of each of the columns of (7, n_sources, n_columns): flux, rays, whether known, and so on."""
    phi, n, known, one, most, total, squares = samples
    certain_w = np.sum(np.where((known != 0) & (n > 0), phi * total / np.maximum(n, 1), 0.0), axis=0)
    unseen_w = np.sum(np.where((known == 0) & (n == 0), phi * most, 0.0), axis=0)
    phi = np.where((known != 0) | (n == 0), 0.0, phi)
    n = np.maximum(n, 1.0)
    total = np.clip(total, 0.0, n * most)
    # rays in replicates may be as uncertain as fewer, heavier ones
    heavier = (total > 0) & (squares > total * most * (1 + _OF_LIGHT))
    most = np.where(heavier, squares / np.where(total > 0, total, 1.0), most)
    squares = np.minimum(squares, total * most)
    lacks, lack_squares = n * most - total, n * most**2 - 2 * most * total + squares
    lacks = np.where(is_rounding(lacks, n * most), 0.0, lacks)
    # one ray more: light that rays bring, or lack; all of what is possible where none does, or all are alike
    alike = is_rounding(squares - total**2 / n, squares)
    light = np.where(alike, np.where(total > 0, most, one), squares / np.where(total > 0, total, 1.0))
    lack = np.where(alike | (lacks == 0), most, lack_squares / np.where(lacks > 0, lacks, 1.0))
    most_w = np.sum(phi * most, axis=0)

    def parameters(weight_w: Float, of_one: Float) -> tuple[Float, Float]:
        """``a`` and ``b`` by (2), with one ray more of the source of which it weighs most."""
        source, columns = np.argmax(phi * weight_w / n, axis=0), np.arange(phi.shape[1])
        rays, sums, sums_of_squares = n.copy(), total.copy(), squares.copy()
        rays[source, columns] += 1
        sums[source, columns] += of_one[source, columns]
        sums_of_squares[source, columns] += of_one[source, columns] ** 2
        share = np.sum(phi * sums / rays, axis=0) / np.where(most_w > 0, most_w, 1.0)
        of_source = np.maximum(sums_of_squares / rays - (sums / rays) ** 2, 0.0) / rays
        variance = np.sum(phi**2 * of_source, axis=0) / np.where(most_w > 0, most_w, 1.0) ** 2
        spread = share * (1 - share)
        n_like = np.where(variance * _CERTAIN > spread, spread / np.where(variance > 0, variance, 1.0), _CERTAIN)
        return np.where(share > 0, share * n_like, 0.0), np.where(share < 1, (1 - share) * n_like, 0.0)

    a, b = np.moveaxis(np.array([parameters(lack, most - lack), parameters(light, light)]), 1, 0)
    low, high = mixture_quantile(np.array([tail, 1 - tail]), a, b)
    return certain_w + most_w * low, certain_w + most_w * high + unseen_w
