# SPDX-License-Identifier: LGPL-2.1-or-later
"""Errors from replicates: the spread of their means, widened for there being few, and never nothing."""

import math

import numpy as np
import pytest

from raymaps.criterion import (
    confidence_interval,
    covariance_w2,
    effective_products,
    effective_squares,
    estimate_flux,
)
from raymaps.ray_numbers import REPLICATES

#: Student's quantile at 97.5 % of 15 degrees of freedom, over the normal one (any table of both).
WIDER = 2.13145 / 1.95996


def stderr(rays, total, squares):
    """Standard error of a source of 1 W, from sums by replicate."""
    rays, total = np.array([rays], float), np.array([total], float)
    _, error = estimate_flux([1.0], rays.sum(1), total.sum(1), effective_squares(rays, total, [squares]))
    return float(error)


def test_the_error_is_the_spread_of_the_replicates_means():
    rng = np.random.default_rng(1)
    total = rng.uniform(400, 500, REPLICATES)
    means = total / 1000
    expected = WIDER * means.std(ddof=1) / math.sqrt(REPLICATES)
    assert stderr([1000] * REPLICATES, total, total.sum()) == pytest.approx(expected, rel=1e-5)


def test_replicates_may_lack_a_ray():
    rays = np.where(np.arange(REPLICATES) < 5, 1001, 1000)
    total = rays * np.linspace(0.4, 0.5, REPLICATES)
    expected = WIDER * np.linspace(0.4, 0.5, REPLICATES).std(ddof=1) / 4
    assert stderr(rays, total, total.sum()) == pytest.approx(expected, rel=1e-3)


def test_independent_rays_keep_their_squares():
    squares = np.array([3.0, 7.0])
    assert effective_squares([[10], [20]], [[4.0], [8.0]], squares) is squares


def test_replicates_that_are_all_alike_leave_three_rays():
    rays, total = np.full((1, REPLICATES), 100), np.full((1, REPLICATES), 5.0)
    squares = effective_squares(rays, total, [80.0])
    low, high = confidence_interval([1.0], [1600], [80.0], squares)
    assert (80 / 1600 - float(low)) * 1600 == pytest.approx(3, rel=0.05)
    assert (float(high) - 80 / 1600) * 1600 == pytest.approx(3, rel=0.05)


def test_but_no_more_than_independent_rays_would():
    """Light that is nearly the same for all rays: a ray more tells less than its light."""
    rays, total = np.full((1, REPLICATES), 100), np.full((1, REPLICATES), 50.0)
    squares = 1600 * (0.25 + 1e-8)
    assert stderr(rays[0], total[0], squares) == pytest.approx(1e-4 / 40, rel=1e-3)


@pytest.mark.parametrize(("rays", "total"), [([1] * 8 + [0] * 8, [1, 0] * 4 + [0] * 8), ([9] * 16, [9.0] * 16)])
def test_too_few_rays_and_rays_that_are_all_alike_are_taken_for_independent(rays, total):
    found = effective_squares([rays], [total], [float(sum(total))])
    assert found.tolist() == [sum(total)]


def test_sources_and_cells_each_by_their_own():
    rng = np.random.default_rng(2)
    rays, total = rng.integers(90, 110, (3, REPLICATES)), rng.uniform(0, 20, (3, REPLICATES, 5))
    squares = total.sum(axis=1)
    found = effective_squares(rays, total, squares)
    assert found.shape == (3, 5)
    for s in range(3):
        for cell in range(5):
            alone = effective_squares(rays[s : s + 1], total[s : s + 1, :, cell], squares[s : s + 1, cell])
            assert found[s, cell] == pytest.approx(alone[0], rel=1e-12)


def test_products_give_the_covariance_of_the_replicates():
    rng = np.random.default_rng(3)
    rays, a, b = np.full((1, REPLICATES), 1000.0), *rng.uniform(0, 500, (2, 1, REPLICATES))
    b += a
    products = effective_products(rays, a, b, [0.0])
    found = covariance_w2([2.0], [16_000], a.sum(1), b.sum(1), products)
    expected = WIDER**2 * 4 * np.cov(a[0] / 1000, b[0] / 1000)[0, 1] / REPLICATES
    assert float(found) == pytest.approx(expected, rel=1e-4)
    same = effective_products(rays, a, a, a.sum(1))
    assert same == pytest.approx(effective_squares(rays, a, a.sum(1) * 10), rel=1e-12)


def test_an_interval_is_as_wide_as_errors_that_are_larger_than_independent_rays_could_have():
    """Counts of which the replicates' spread, by chance, is above that of any rays of light 0 or 1."""
    total, squares, n = 10_000.0, 20_000.0, 10**6
    _, error = estimate_flux([1.0], [n], [total], [squares])
    low, high = confidence_interval([1.0], [n], [total], [squares])
    assert float(high - low) == pytest.approx(2 * 1.96 * float(error), rel=0.01)
