# SPDX-License-Identifier: LGPL-2.1-or-later
"""Points of Sobol's sequence: those of the published table, scrambled so that they stay nets and become uniform."""

import numba
import numpy as np
import pytest
from scipy.stats.qmc import Sobol

from raymaps.kernels.random import COLLAPSE, EMIT_PLACE, ON_SURFACE, ON_SURFACE_MORE, uniforms
from raymaps.kernels.sampling import DIMENSION, sample
from raymaps.kernels.sobol import _TURNS, N_DIMENSIONS, scrambles, sobol_word
from raymaps.wave import RunKey
from tests.physics.scenes import agrees, chi_square_agrees, follows

ALL = np.arange(N_DIMENSIONS)


@numba.njit
def points(seed, group, n, dimensions):
    """Words of the first n points of a group, (n, n_dimensions)."""
    scramble = np.empty((group + 1, N_DIMENSIONS, 2), np.uint32)
    scrambles(np.uint64(seed), scramble)
    found = np.empty((n, len(dimensions)), np.uint32)
    for k in range(n):
        for d in range(len(dimensions)):
            add, multiply = scramble[group, dimensions[d]]
            found[k, d] = sobol_word(np.uint64(k), dimensions[d], add, multiply)
    return found


def unscrambled(n):
    """The same without a scramble, from the directions that the kernel reads."""
    found = np.zeros((n, N_DIMENSIONS), np.uint64)
    for place in range(8):
        found ^= _TURNS[:, place, np.arange(n) >> 4 * place & 15].T
    return np.array([[int(f"{word:032b}"[::-1], 2) for word in row] for row in found.tolist()])


def test_points_are_those_of_joe_and_kuo():
    """scipy has them in the order of Gray's code: its point k is ours of k ^ (k >> 1)."""
    n = 2048
    k = np.arange(n)
    expected = Sobol(N_DIMENSIONS, scramble=False, bits=32).random(n)
    assert np.array_equal(unscrambled(n)[k ^ (k >> 1)] / 2.0**32, expected)


@pytest.mark.parametrize("m", [4, 7, 10])
@pytest.mark.parametrize("seed", [1, 2**62 + 5])
def test_scrambled_points_are_a_net(m, seed):
    """The first two coordinates of 2^m points: one point in each of the 2^m equal boxes of any shape."""
    for group in (0, 15):
        found = points(seed, group, 2**m, ALL[:2]).astype(np.uint64)
        for a in range(m + 1):
            box = (found[:, 0] >> np.uint64(32 - a)) << np.uint64(m - a) | found[:, 1] >> np.uint64(32 - m + a)
            assert np.array_equal(np.sort(box), np.arange(2**m)), (group, a)


def test_each_coordinate_has_each_interval_once():
    """In all dimensions, for any run of 2^m points that begins at a multiple of 2^m."""
    found = points(3, 4, 512, ALL) >> np.uint32(32 - 8)
    for d in ALL:
        assert np.array_equal(np.sort(found[:256, d]), np.arange(256))
        assert np.array_equal(np.sort(found[256:, d]), np.arange(256))


@numba.njit
def _low_words(index, dimension, multiply):
    """Highest 16 bits of a word for all low halves of ``add``, and lowest 16 bits for all high ones."""
    found = np.empty((2, 2**16), np.uint32)
    for k in range(2**16):
        found[0, k] = sobol_word(np.uint64(index), dimension, np.uint32(k), np.uint32(multiply)) >> 16
        found[1, k] = sobol_word(np.uint64(index), dimension, np.uint32(k << 16), np.uint32(multiply)) & 0xFFFF
    return found


@pytest.mark.parametrize(("index", "dimension", "multiply"), [(0, 0, 0), (12345, 7, 0xDEADBEE0), (2**32 - 1, 31, 77)])
def test_a_coordinate_is_exactly_uniform(index, dimension, multiply):
    """Over all scrambles each word comes once: the low half of ``add`` decides the high half of the word, one to one,
    and given that the high half decides the low one."""
    for half in _low_words(index, dimension, multiply):
        assert np.array_equal(np.sort(half), np.arange(2**16))


def test_coordinates_are_uniform_and_independent_over_seeds():
    """What makes the mean unbiased: the same point of the sequence, over seeds, fills the cube evenly."""
    found = np.array([points(seed, 3, 6, ALL)[5] for seed in range(20_000)]) / 2.0**32
    for d in (0, 1, 8, 31):
        follows(f"coordinate {d}", found[:, d], 1000)
    for a, b in ((0, 1), (0, 31), (8, 9), (20, 26)):
        counts = np.histogram2d(found[:, a], found[:, b], 10, ((0, 1), (0, 1)))[0]
        chi_square_agrees(f"coordinates {a} and {b}", counts, np.full((10, 10), len(found) / 100))


def test_groups_are_independent():
    """Means of replicates of a smooth function have no correlation over seeds: 1 / sqrt(n) is its standard error."""
    n = 4000
    means = np.array([[points(s, g, 5, ALL[:2]).prod(axis=1, dtype=float).mean() for g in (0, 1)] for s in range(n)])
    a, b = ((means - means.mean(axis=0)) / means.std(axis=0)).T
    agrees("correlation of replicates", (a * b).mean(), n**-0.5, 0)


@numba.njit
def _samples(key, event, purpose):
    found = np.empty((len(key.point), 4))
    for i in range(len(key.point)):
        found[i] = sample(key, i, event, purpose)
    return found


def key_of(n, seed=9):
    scramble = np.empty((16, N_DIMENSIONS, 2), np.uint32)
    scrambles(np.uint64(seed), scramble)
    rank = np.arange(n)
    return RunKey(
        np.uint64(seed), np.uint64(0), 0.1, (rank // 16).astype(np.uint32), (rank % 16).astype(np.int32), scramble
    )


def test_samples_are_coordinates_where_there_are_some_and_random_elsewhere():
    key = key_of(160)
    for event, purpose in ((0, ON_SURFACE), (0, EMIT_PLACE), (2, ON_SURFACE), (2, ON_SURFACE_MORE), (900, COLLAPSE)):
        found = _samples(key, event, purpose)
        assert (found > 0).all()
        assert (found < 1).all()
        random = np.array([uniforms(key.seed, np.uint64(i), event, purpose) for i in range(160)])
        for number, dimension in enumerate(DIMENSION[min(event, len(DIMENSION) - 1), purpose]):
            expected = random[:, number]
            if dimension >= 0:
                words = [points(9, i % 16, i // 16 + 1, ALL[dimension : dimension + 1])[-1, 0] for i in range(160)]
                expected = (np.array(words) + 0.5) / 2.0**32
            assert np.array_equal(found[:, number], expected), (event, purpose, number)


def test_what_a_ray_draws_at_one_event_shares_no_coordinate():
    """Emission, one event of each kind, and the narrowing; but for draws of which a ray takes only one."""
    emission = DIMENSION[0][[ON_SURFACE, EMIT_PLACE]]
    used = [emission[emission >= 0], [6, 7]]
    used += [np.unique(of[of >= 0]) for of in np.delete(DIMENSION[1:-1], COLLAPSE, axis=1)]
    assert sorted(np.concatenate(used).tolist()) == ALL.tolist()
    for of in DIMENSION[1:-1]:
        surface, place = of[ON_SURFACE], of[3]
        assert len(set(surface.tolist())) == 4
        assert set(place[[0, 2]].tolist()).isdisjoint(of[4].tolist())  # SCATTER_PLACE, SCATTER_DIRECTION
        assert of[1, 0] not in [*surface, *place, *of[4]]  # IN_MEDIUM
    assert (DIMENSION[-1][[ON_SURFACE, EMIT_PLACE]] == -1).all()
