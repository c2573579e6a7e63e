# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a pilot foretells against what runs take: four scenes, independent rays and Sobol' points.

``pytest -s tests/accuracy/test_forecast.py`` prints the factors; `make bench` measures them on an idle machine.
"""

from __future__ import annotations

import pytest

from raymaps.accuracy import forecast
from tests.accuracy.forecast_scenes import SCENES, real_run

#: Time that the run is to take that is foretold.
RUN_S = 1.0


@pytest.mark.parametrize("name", SCENES)
def test_rays_and_time_to_an_error_are_foretold(tmp_path, name):
    scene, target = SCENES[name](tmp_path)
    found = forecast(scene, target, seconds=4.0)
    assert found.of[0].is_scene
    for one in found.of[:2]:
        rays = one.rays(one.error(one.start_s + RUN_S))
        foretold_s, error = rays * one.ray_s, one.noise.error(rays)
        real = real_run(scene, target, one, rays, tmp_path)
        print(
            f"{name}, {one.words} (exponent {one.noise.exponent:.2f}): {100 * error:.2g} % foretold for {rays} rays in "
            f"{foretold_s:.2f} s; needed {real.rays:.0f} rays, {real.tracing_s:.2f} s: factors {real.rays / rays:.2f}, "
            f"{real.tracing_s / foretold_s:.2f}"
        )
        assert 1 / 1.5 < real.rays / rays < 1.5
        assert 1 / 4 < real.tracing_s / foretold_s < 4  # machines are busy while tests run
