# SPDX-License-Identifier: LGPL-2.1-or-later
"""Confidence intervals against the exact mid-p limits of scipy's beta distribution, and at their edges."""

import math

import numpy as np
import pytest
from scipy import optimize, stats

from raymaps.criterion import confidence_interval, estimate_flux
from raymaps.criterion.beta import beta_cdf, mixture_quantile

LEVELS = np.array([0.001, 0.01, 0.025, 0.05, 0.2, 0.5, 0.8, 0.95, 0.975, 0.99, 0.999])


@pytest.mark.parametrize("a", [1, 1.2, 2, 3.7, 30, 1e4, 1e9])
@pytest.mark.parametrize("b", [1, 1.5, 5, 200, 1e6, 1e12])
def test_the_beta_distribution(a, b):
    p = stats.beta.ppf(LEVELS, a, b)
    q = stats.beta.isf(LEVELS, b, a)  # 1 - p, by itself
    error = np.abs(beta_cdf(p, q, np.full(p.shape, float(a)), np.full(p.shape, float(b))) - LEVELS)
    assert error.max() < 3e-3
    assert error[[2, 8]].max() < 7e-4  # at 2.5 and 97.5 %


def exact_mid_p(k, n, level):
    """Quantile of equation (1)."""

    def mixture(p):
        counted = stats.beta.cdf(p, k, n - k + 1) if k else 1.0
        one_more = stats.beta.cdf(p, k + 1, n - k) if k < n else 0.0
        return (counted + one_more) / 2 - level

    if (k == 0 and level < 0.5) or (k == n and level > 0.5):
        return k / n
    return optimize.brentq(mixture, 0, 1, xtol=1e-300, rtol=1e-14)


@pytest.mark.parametrize("n", [1, 2, 5, 20, 1000, 10**6, 10**12])
def test_counts_have_the_limits_of_the_mid_p_binomial(n):
    for k in {min(k, n) for k in (0, 1, 2, 3, 5, 10, 20, 100, 500)} | {max(n - k, 0) for k in (0, 1, 4)}:
        low, high = confidence_interval([1.0], [n], [k], [k])
        tolerance = 0.011 * max(1.0, min(k, n - k) * 0.02)  # in rays
        if n < 1e9 or k < n / 2:
            assert low * n == pytest.approx(exact_mid_p(k, n, 0.025) * n, abs=tolerance)
            assert high * n == pytest.approx(exact_mid_p(k, n, 0.975) * n, abs=tolerance)


def test_three_rays_where_none_counts():
    low, high = confidence_interval([2.0], [10**6], [0], [0])
    assert low == 0
    assert high == pytest.approx(2e-6 * math.log(20), rel=1e-5)  # "rule of three"
    low, high = confidence_interval([2.0], [10**6], [10**6], [10**6])
    assert 2 - low == pytest.approx(2e-6 * math.log(20), rel=1e-5)
    assert high == 2


def test_a_share_and_the_rest_are_mirrored():
    for k in (0, 1, 7, 60, 99, 100):
        low, high = confidence_interval([1.0], [100], [k], [k])
        other_low, other_high = confidence_interval([1.0], [100], [100 - k], [100 - k])
        assert (low, high) == (pytest.approx(1 - other_high, abs=1e-12), pytest.approx(1 - other_low, abs=1e-12))


def test_many_rays_have_the_normal_interval():
    samples = np.random.default_rng(1).random(10**6)
    sums = ([3.0], [10**6], [samples.sum()], [np.sum(samples**2)])
    flux, stderr = estimate_flux(*sums)
    low, high = confidence_interval(*sums)
    assert low == pytest.approx(flux - 1.959964 * stderr, abs=0.01 * stderr)
    assert high == pytest.approx(flux + 1.959964 * stderr, abs=0.01 * stderr)


def test_what_is_decided_and_what_is_unknown():
    assert confidence_interval([2.0], [10], [10], [10], exact=[True]) == (2.0, 2.0)
    assert confidence_interval([2.0], [10], [0], [0], exact=[True]) == (0.0, 0.0)
    low, high = confidence_interval([2.0, 1.0], [0, 10], [0, 5], [0, 5])  # nothing is known of the first
    alone = confidence_interval([1.0], [10], [5], [5])
    assert (low, high) == (pytest.approx(alone[0]), pytest.approx(alone[1] + 2.0))


def test_two_halves_of_a_source_are_the_source():
    """Rays of the same light are the same evidence, whichever source they are of."""
    for k in (0, 1, 5):
        whole = confidence_interval([2.0], [2000], [k], [k])
        halves = confidence_interval([1.0, 1.0], [1000, 1000], [k, 0], [k, 0])
        assert halves == (pytest.approx(whole[0], rel=0.05), pytest.approx(whole[1], rel=0.01))


def test_a_heavy_ray_that_was_not_seen_may_come():
    """A source of few rays of which none counted: up to three of its rays."""
    _, high = confidence_interval([1.0, 1.0], [10**6, 100], [500, 0], [500, 0])
    assert 0.02 < high < 0.03


def test_limits_are_those_of_the_scale():
    """Dim rays are as good evidence as bright ones."""
    bright = confidence_interval([1.0], [10**6], [20.0], [20.0])
    dim = confidence_interval([1.0], [10**6], [0.2], [0.002])
    assert dim == (pytest.approx(bright[0] / 100, rel=1e-4), pytest.approx(bright[1] / 100, rel=1e-4))


def test_equal_light_of_all_rays_is_uncertain_by_a_few():
    low, high = confidence_interval([1.0], [1000], [100.0], [10.0])
    assert 0.1 - 4 * 0.9 / 1000 < low < 0.1 < high < 0.1 + 4 * 0.9 / 1000


def test_rounding_is_no_lack_of_light():
    low, high = confidence_interval([1.0], [1000], [1000 * (1 + 1e-8)], [1000 * (1 + 2e-8)])
    assert low == pytest.approx(0.997, abs=1e-4)
    assert high == pytest.approx(1, abs=1e-7)


def test_arrays_of_fluxes_at_once():
    k = np.array([[0, 1, 20, 100, 20], [3, 0, 5, 50, 5]])
    low, high = confidence_interval([1.0, 2.0], [100, 50], k, k)
    for column in range(5):
        alone = confidence_interval([1.0, 2.0], [100, 50], k[:, column], k[:, column])
        assert (low[column], high[column]) == alone
    none = confidence_interval([1.0], [10], np.zeros((1, 0)), np.zeros((1, 0)))
    assert none[0].shape == none[1].shape == (0,)


def test_a_mixture_of_two_alike_is_theirs():
    a, b = np.array([3.0, 40.0]), np.array([9.0, 2000.0])
    found = mixture_quantile(np.array([0.025, 0.975]), np.stack([a, a]), np.stack([b, b]))
    assert found == pytest.approx(stats.beta.ppf(np.array([[0.025], [0.975]]), a, b), rel=5e-3)


def test_light_that_rounding_adds_is_none():
    """A medium that took less than float32 tells of 100,000 rays: as if no ray counted, three rays at most."""
    low, high = confidence_interval([1.0], [100_000.0], [[-0.0029802322387695312]], [[8.88e-11]])
    assert low[0] <= 0
    assert high[0] == pytest.approx(3 / 100_000, rel=0.01)
