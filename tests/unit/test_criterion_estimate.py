# SPDX-License-Identifier: LGPL-2.1-or-later
"""Standard errors against closed forms, and against the spread of repeated simulations."""

import math

import numpy as np
import pytest

from raymaps.criterion import covariance_w2, estimate_flux


def of_samples(flux_w, samples):
    """Estimate of one source from the light of each of its rays."""
    samples = np.asarray(samples, float)
    value, error = estimate_flux([flux_w], [len(samples)], [samples.sum()], [np.sum(samples**2)])
    return float(value), float(error)


@pytest.mark.parametrize(("n", "k"), [(10, 1), (10, 9), (1000, 250), (10**9, 3)])
def test_counts_are_binomial(n, k):
    value, error = estimate_flux([2.0], [n], [k], [k])
    share = k / n
    assert value == pytest.approx(2.0 * share, rel=1e-15)
    # unbiased: p (1 - p) / (n - 1); a few roundings
    assert error == pytest.approx(2.0 * math.sqrt(share * (1 - share) / (n - 1)), rel=1e-9)


def test_light_of_any_size_has_the_sample_variance():
    samples = np.random.default_rng(1).gamma(0.5, size=400)
    value, error = of_samples(3.0, samples)
    assert value == pytest.approx(3.0 * samples.mean(), rel=1e-14)
    assert error == pytest.approx(3.0 * samples.std(ddof=1) / math.sqrt(400), rel=1e-12)


def test_sources_add_in_quadrature():
    n, k = np.array([100, 400]), np.array([20, 100])
    flux_w = np.array([1.0, 5.0])
    value, error = estimate_flux(flux_w, n, k, k)
    share = k / n
    assert value == pytest.approx(float(np.sum(flux_w * share)), rel=1e-15)
    assert error == pytest.approx(math.sqrt(np.sum(flux_w**2 * share * (1 - share) / (n - 1))), rel=1e-12)


@pytest.mark.parametrize("n", [1, 2, 50, 10**6])
def test_what_was_never_seen_is_uncertain_by_one_ray(n):
    value, error = estimate_flux([2.0], [n], [0], [0])
    assert (value, error) == (0.0, 2.0 / n)
    value, error = estimate_flux([2.0], [n], [n], [n])
    assert (value, error) == (2.0, 2.0 / n)


def test_one_ray_of_many_has_the_same_error_as_none():
    assert estimate_flux([2.0], [50], [1], [1])[1] == pytest.approx(estimate_flux([2.0], [50], [0], [0])[1], rel=1e-14)


def test_equal_samples_that_round_differently_are_equal():
    light = np.full(10**6, 0.1)
    _, error = of_samples(1.0, light)
    assert error == pytest.approx(0.1 / 10**6, rel=1e-9)


def test_certainty_has_no_error():
    assert estimate_flux([2.0, 1.0], [10, 10], [10, 0], [10, 0], exact=[True, True])[1] == 0
    assert estimate_flux([2.0, 1.0], [10, 10], [10, 0], [10, 0], exact=[True, False])[1] == 0.1


def test_nothing_is_known_of_a_source_without_rays():
    value, error = estimate_flux([2.0, 1.0], [0, 10], [0, 5], [0, 5])
    assert value == 0.5
    assert error > 2.0


def test_arrays_of_fluxes_at_once():
    rng = np.random.default_rng(2)
    samples = rng.random((2, 30, 3, 4)) * rng.integers(0, 2, (2, 30, 3, 4))
    value, error = estimate_flux([1.0, 2.0], [30, 30], samples.sum(axis=1), (samples**2).sum(axis=1))
    assert value.shape == error.shape == (3, 4)
    for cell in np.ndindex(3, 4):
        one = [of_samples(flux_w, samples[(source, slice(None), *cell)]) for source, flux_w in enumerate((1.0, 2.0))]
        assert value[cell] == pytest.approx(one[0][0] + one[1][0], rel=1e-13)
        assert error[cell] == pytest.approx(math.hypot(one[0][1], one[1][1]), rel=1e-12)


def test_covariance_is_that_of_the_samples():
    rng = np.random.default_rng(3)
    a = rng.random(200)
    b = 0.5 * a + rng.random(200)
    found = covariance_w2([3.0], [200], [a.sum()], [b.sum()], [np.sum(a * b)])
    assert found == pytest.approx(9.0 * np.cov(a, b)[0, 1] / 200, rel=1e-10)


def test_the_error_is_the_spread_of_repeated_simulations():
    rng = np.random.default_rng(4)
    repeats, n, share = 4000, 200, 0.07
    found = rng.binomial(n, share, repeats)
    fluxes, errors = zip(*(estimate_flux([1.0], [n], [k], [k]) for k in found), strict=True)
    spread = np.std(fluxes, ddof=1)
    # the standard deviation of 4000 samples is known to 1 / sqrt(8000); the mean error's own noise is smaller
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(spread, rel=5 / math.sqrt(2 * repeats))
