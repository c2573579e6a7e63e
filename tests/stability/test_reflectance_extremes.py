# SPDX-License-Identifier: LGPL-2.1-or-later
"""Fresnel's equations where their terms cancel, against fifty digits: head-on, grazing, critical, nearly no interface.

A factor of an angle's cosine is given as a float64 and taken as exact.
"""

import math

import numpy as np
import pytest

from raymaps.effects.conductor import metal_reflectance
from raymaps.effects.fresnel import fresnel_reflectance
from raymaps.kernels import reflectance
from raymaps.kernels.at_surface import refraction_cosine
from tests.stability.exact_reflectance import interface, metal

EPS = np.finfo(float).eps
#: Cosines of the angle of incidence from head-on to a millionth of a millionth short of 90 degrees.
COSINES = np.unique(np.concatenate([10.0 ** np.linspace(-12, 0, 61), 1 - 10.0 ** np.linspace(-16, -1, 31)]))


def off_by(n_i, n_t, of=None):
    """Largest error of the reflectance and of the cosine of refraction over all angles."""
    of = of or reflectance.of_clear_medium
    found = [of(c, n_i, n_t) for c in COSINES]
    exact = [interface(c, n_i, n_t) for c in COSINES]
    assert all(math.isfinite(r) and 0 <= r <= 1 and 0 <= t <= 1 for r, t in found)
    return tuple(np.array([abs(float(f[i]) - float(e[i])) for f, e in zip(found, exact, strict=True)]) for i in (0, 1))


@pytest.mark.parametrize("ratio", [1 + 1e-12, 1 - 1e-12, 1 + 1e-6, 1 - 1e-6, 1.0])
def test_hardly_any_interface(ratio):
    """Indices that are equal, or nearly: at 90 degrees less 1e-12 the reflectance is still right to 1e-9.

    Guards: cos² of refraction is summed from (n_t - n_i)(n_t + n_i) and n_i² cos², not taken from 1 - sin², which at
    grazing incidence keeps no digit: equal indices would reflect light below a cosine of 1e-8.
    """
    of_r, of_t = off_by(1.5, 1.5 * ratio)
    assert of_r.max() < 1e-9
    assert of_t.max() < 1e-9
    for c in COSINES:
        exact = float(interface(c, 1.5, 1.5 * ratio)[1])
        assert refraction_cosine(c, 1.5, 1.5 * ratio) == pytest.approx(exact or -1.0, abs=1e-9)


def test_equal_indices_reflect_nothing_and_bend_nothing():
    """Guards: as above; and `refraction_cosine`, which returns the very cosine that it was given."""
    for c in COSINES:
        share, cos_t = reflectance.of_clear_medium(c, 1.5, 1.5)
        assert share < 2.0**-33  # the least number that is drawn
        assert cos_t == pytest.approx(c, rel=4 * EPS, abs=0)
        assert refraction_cosine(c, 1.5, 1.5) == c


@pytest.mark.parametrize(("n_i", "n_t"), [(1.0, 1.5), (1.5, 1.0), (1.0, 2.4), (1.33, 1.52), (1.0, 10.0), (10.0, 0.1)])
def test_grazing_and_head_on(n_i, n_t):
    """Reflectance to 1e-14 at all angles that are not near the critical one; head-on to the last digits.

    Guards: the cosines are never taken from each other near grazing incidence.
    """
    of_r, _ = off_by(n_i, n_t)
    far = np.array([abs(1 - (n_i / n_t) ** 2 * (1 - c * c)) > 0.01 for c in COSINES])
    assert of_r[far].max() < 1e-13
    assert reflectance.of_clear_medium(1.0, n_i, n_t)[0] == pytest.approx(
        ((n_t - n_i) / (n_t + n_i)) ** 2, rel=2e-15, abs=0
    )
    assert reflectance.of_clear_medium(0.0, n_i, n_t)[0] == 1.0


@pytest.mark.parametrize(("n_i", "n_t"), [(1.5, 1.0), (1.0003, 1.0), (2.4, 1.33), (1 + 1e-9, 1.0)])
def test_within_a_millionth_of_a_millionth_of_the_critical_angle(n_i, n_t):
    """Total reflection is exactly 1 beyond the critical angle; before it 1 - R falls as the root of what is missing.

    The cosine of refraction t is known to EPS / t: so is the reflectance, times its slope of at most 4 (n_i/n_t).
    Guards: the border itself (NaN of the root of a negative number), and that 1 is returned there.
    """
    critical = math.asin(n_t / n_i)
    totals = 0
    for off in [s * 10.0**-e for e in range(3, 17) for s in (-1, 1)] + [0.0]:
        angle = critical * (1 + off)
        if angle >= math.pi / 2:
            continue
        c = math.cos(angle)
        share, cos_t = reflectance.of_clear_medium(c, n_i, n_t)
        exact_share, exact_t = (float(x) for x in interface(c, n_i, n_t))
        slack = 4 * EPS
        assert abs(cos_t**2 - exact_t**2) <= slack
        error_of_t = min(math.sqrt(slack), slack / max(exact_t, 1e-300))
        slope = 4 * max(n_i / n_t, n_t / n_i) / max(c, 1e-300)
        assert abs(share - exact_share) <= slope * error_of_t + slack
        assert 0 <= share <= 1
        if off > 1e-12:
            assert (share, cos_t) == (1.0, 0.0)
            assert refraction_cosine(c, n_i, n_t) == -1.0
            totals += 1
    assert totals >= 6


def test_the_reference_holds_at_the_extremes_too():
    """The plain formula that kernels are compared with is no less exact than they are."""
    for n_i, n_t in ((1.5, 1.5), (1.5, 1.5 * (1 + 1e-12)), (1.0, 1.5), (1.5, 1.0)):
        exact = np.array([float(interface(c, n_i, n_t)[0]) for c in COSINES])
        far = np.abs(1 - (n_i / n_t) ** 2 * (1 - COSINES**2)) > 0.01 if n_i > 1.4 * n_t else np.ones(len(COSINES), bool)
        assert np.abs(fresnel_reflectance(COSINES, n_i, n_t) - exact)[far].max() < 1e-9


@pytest.mark.parametrize("n_i", [1.0, 1.5])
@pytest.mark.parametrize(("n", "k"), [(1.0, 1e6), (1e-6, 1e6), (0.05, 4.2), (1.5, 1e-9), (1e-9, 1e-3), (1000.0, 1e6)])
def test_metals_from_almost_clear_to_almost_perfect(n, k, n_i):
    """An extinction of a million reflects all but 4 n / k²: light never grows, and the rest is right.

    Guards: reflectance is at most 1 (rounding alone would make light), and no overflow or cancellation of epsilon.
    """
    for c in COSINES:
        exact = float(metal(c, n_i, n, k))
        for found in (reflectance.of_metal(c, n_i, n, k), float(metal_reflectance(c, n_i, n, k))):
            assert 0 <= found <= 1
            assert found == pytest.approx(exact, abs=1e-13)
