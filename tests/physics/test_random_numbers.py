# SPDX-License-Identifier: LGPL-2.1-or-later
"""Random numbers: the published vectors of Philox, and draws that are uniform and independent."""

import numba
import numpy as np
import pytest

from raymaps.kernels.random import EMIT_PLACE, IN_MEDIUM, ON_SURFACE, philox4x32, uniforms
from tests.physics.scenes import agrees, chi_square_agrees, follows

#: Random123 (J. Salmon et al., SC11, 2011), file kat_vectors, lines "philox4x32 10": counter, key, result.
KNOWN_ANSWERS = [
    ("00000000 00000000 00000000 00000000", "00000000 00000000", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ("ffffffff ffffffff ffffffff ffffffff", "ffffffff ffffffff", "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ("243f6a88 85a308d3 13198a2e 03707344", "a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
]


def words(text):
    return [np.uint64(int(word, 16)) for word in text.split()]


@pytest.mark.parametrize(("counter", "key", "result"), KNOWN_ANSWERS)
def test_philox_gives_the_published_answers(counter, key, result):
    assert [int(x) for x in philox4x32(*words(counter), *words(key))] == [int(x) for x in words(result)]


@pytest.mark.parametrize(("seed", "ray"), [(0x299F31D0A4093822, 0x85A308D3243F6A88)])
def test_uniforms_are_philox_of_ray_event_purpose_and_seed(seed, ray):
    """The counter is (ray, ray >> 32, event | purpose << 24, 0), the key the seed; a word w gives (w + 1/2) / 2^32."""
    event, purpose = 0x198A2E, IN_MEDIUM
    counter = [ray & 0xFFFFFFFF, ray >> 32, event | purpose << 24, 0]
    key = [seed & 0xFFFFFFFF, seed >> 32]
    expected = [(int(x) + 0.5) / 2**32 for x in philox4x32(*(np.uint64(x) for x in counter + key))]
    assert list(uniforms(np.uint64(seed), np.uint64(ray), event, purpose)) == expected


@numba.njit
def _draws(seed, rays, events, purpose):
    result = np.empty((rays, events, 4))
    for ray in range(rays):
        for event in range(events):
            result[ray, event] = uniforms(np.uint64(seed), np.uint64(ray), event, purpose)
    return result


@pytest.mark.parametrize("purpose", [ON_SURFACE, IN_MEDIUM, EMIT_PLACE])
def test_draws_are_uniform(purpose):
    draws = _draws(1, 50_000, 4, purpose)
    assert draws.min() > 0
    assert draws.max() < 1
    for k in range(4):
        follows(f"draw {k} of purpose {purpose}", draws[:, :, k].reshape(-1), 1000)


def test_draws_are_independent():
    """Pairs of draws fill the unit square evenly and have no correlation (standard error 1/sqrt(n)): of one event, of
    following events, of following rays, of different purposes and of different seeds.
    """
    a, b = _draws(1, 50_000, 3, ON_SURFACE), _draws(1, 50_000, 3, IN_MEDIUM)
    c = _draws(2, 50_000, 3, ON_SURFACE)
    pairs = {
        "of one event": (a[:, 1, 0], a[:, 1, 1]),
        "of one event, others": (a[:, 1, 2], a[:, 1, 3]),
        "of following events": (a[:, 0, 0], a[:, 1, 0]),
        "of following rays": (a[:-1, 1, 1], a[1:, 1, 1]),
        "of two purposes": (a[:, 1, 1], b[:, 1, 1]),
        "of two seeds": (a[:, 1, 1], c[:, 1, 1]),
    }
    for what, (x, y) in pairs.items():
        n = len(x)
        agrees(f"correlation {what}", ((x - 0.5) * (y - 0.5)).mean() * 12, n**-0.5, 0)
        counts = np.histogram2d(x, y, 20, ((0, 1), (0, 1)))[0]
        chi_square_agrees(f"pairs {what}", counts, np.full((20, 20), n / 400))
