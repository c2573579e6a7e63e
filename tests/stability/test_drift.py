# SPDX-License-Identifier: LGPL-2.1-or-later
"""Light that is kept in float32 neither gains nor loses by rounding, however often it is reflected."""

import numpy as np
import pytest

from raymaps.kernels.outcome import SMALL_LOSS, draw_among, draw_outcome, draw_reflection
from raymaps.kernels.random import uniforms
from tests.physics.scenes import agrees, share_agrees

SEED = np.uint64(7)


def light_after(reflectance, reflections, rays, threshold=0.1, draw=draw_reflection):
    """Light of rays of three bands after so many reflections; the shares of the bands are those of the source."""
    light = np.zeros((rays, 3), np.float32)
    light[:] = [0.25, 0.5, 0.25]
    share = np.broadcast_to(np.asarray(reflectance, float), 3).copy()
    nothing = np.zeros(3)
    for ray in range(rays):
        of_ray = light[ray]
        for event in range(reflections):
            u = uniforms(SEED, np.uint64(ray), event, 0)[0]
            if draw is draw_reflection:
                goes_on = draw_reflection(of_ray, share, threshold, u)
            elif draw is draw_outcome:
                goes_on = draw_outcome(of_ray, share, nothing, threshold, u) == 0
            else:
                goes_on = draw_among(of_ray, np.stack([share, nothing]), threshold, u) == 0
            if not goes_on:
                break
    return light.astype(float)


@pytest.mark.parametrize("draw", [draw_reflection, draw_outcome, draw_among])
def test_a_perfect_mirror_keeps_every_bit(draw):
    """Guards: no factor other than 1 stands before light of which nothing is lost."""
    light = light_after(1.0, 20_000, 3, draw=draw)
    assert (light == [0.25, 0.5, 0.25]).all()


@pytest.mark.parametrize("draw", [draw_reflection, draw_outcome, draw_among])
def test_a_black_surface_keeps_nothing(draw):
    """Guards: ``through <= 0``, for light that is 0 can't be drawn, whatever u."""
    assert (light_after(0.0, 1, 2_000, draw=draw) == 0).all()


@pytest.mark.parametrize("loss", [3e-8, 1e-6, 3e-6])
def test_losses_too_small_for_float32_are_drawn(loss):
    """A share of the rays that is the loss is absorbed; the others have all their light.

    Guards: `SMALL_LOSS`. Without it light of 1 (1 - 3e-8) is rounded to 1, and nothing is ever absorbed; at 1e-6 the
    loss is off by several per cent.
    """
    assert loss < SMALL_LOSS
    draws = 10_000_000  # evenly spread, of which the last hundred are looked at: those that are absorbed
    light = np.array([0.25, 0.5, 0.25], np.float32)
    share = np.full(3, 1 - loss)
    gone = 0
    for k in range(100):
        of_ray = light.copy()
        if draw_reflection(of_ray, share, 0.1, 1 - (k + 0.5) / draws):
            assert (of_ray == light).all()
        else:
            gone += 1
    assert abs(gone - loss * draws) <= 0.5


@pytest.mark.parametrize("loss", [SMALL_LOSS * 1.01, 1e-4, 1e-2])
def test_losses_that_are_taken_off_add_up(loss):
    """Light after many reflections is (1 - loss)^m to half a hundredth of what is lost.

    Guards: light is rounded to the nearest float32, not cut off.
    """
    reflections = 2_000
    light = light_after(1 - loss, reflections, 3, threshold=0.0).sum(axis=1)
    expected = (1 - loss) ** reflections
    assert light == pytest.approx(expected, abs=5e-3 * (1 - expected))


def test_small_losses_of_coloured_light():
    """Bands that lose differently, all too little for float32: their sum is right in the mean.

    Guards: the drawn loss is the mean over the light, not over the bands.
    """
    share = 1 - np.array([2e-6, 0.0, 1e-6])
    light = np.array([0.25, 0.5, 0.25], np.float32)
    lost = float((light * (1 - share)).sum())
    rays = 4_000_000
    gone = sum(not draw_reflection(light.copy(), share, 0.1, (rays - k - 0.5) / rays) for k in range(60))
    assert gone == pytest.approx(lost * rays, abs=1)


def test_roulette_keeps_the_mean():
    """Light below the threshold: its mean after four reflections of 0.3 within five standard errors.

    Guards: what goes on is scaled by exactly what was thrown away.
    """
    light = light_after(0.3, 4, 40_000).sum(axis=1)
    agrees("mean light", light.mean(), light.std() / np.sqrt(len(light)), 0.3**4)
    share_agrees("alive", (light > 0).sum(), len(light), 0.3**4 / 0.1)
