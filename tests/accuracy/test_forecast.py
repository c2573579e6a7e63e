# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a pilot foretells against what runs take: four scenes, independent rays and Sobol' points.

``pytest -s tests/accuracy/test_forecast.py`` prints the factors; `make bench` measures them on an idle machine.
"""

from __future__ import annotations

import math

import pytest

from raymaps.accuracy import forecast
from raymaps.scene import load_scene
from raymaps.target import Target
from tests.accuracy.forecast_scenes import SCENES, real_run
from tests.physics.scenes import body, box, rectangle, write_scene

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
        # errors by 16 replicates are known to a quarter, so that rays are to a factor; of independent rays far better
        limit = 2.5 if one.is_even else 1.25
        assert 1 / limit < real.rays / rays < limit
        assert 1 / 4 < real.tracing_s / foretold_s < 4  # machines are busy while tests run


def test_rays_shared_by_need(tmp_path):
    """A lamp of which half the light meets the detector, and a bright one of which nearly all does (Neyman, 1934)."""
    share = {"Half": 0.5, "All": 0.99}
    flux_w = {"Half": 1.0, "All": 4.0}
    cones = {name: math.degrees(math.acos(1 - 0.2 / part)) for name, part in share.items()}
    scene = load_scene(
        write_scene(
            tmp_path,
            {"Floor": body(box((-50, -50, -2), (50, 50, -1)), "black")},
            surfaces={"black": {"kind": "absorber"}},
            sources={
                name: {"kind": "cone", "flux_w": flux_w[name], "position_mm": [0, 0, 10], "direction": [0, 0, -1],
                       "half_angle_deg": cones[name]}
                for name in share
            },
            detectors={"D": rectangle((0, 0, 0), 40, 40, resolution=[1, 1])},
        )
    )  # fmt: skip
    # of both cones the same inner part counts: 1 - cos = 0.2
    radius = 10 * math.tan(math.acos(0.8))
    where = f"detector(D, ellipse=(0,0,{radius!r},{radius!r}))"
    found = forecast(scene, Target(1, where=where), seconds=3.0)
    as_it_is, by_need = found.of[0], next(one for one in found.of if one.ray_share is not None)
    assert by_need.words == "random, rays by need"
    need = {name: flux_w[name] * math.sqrt(p * (1 - p)) for name, p in share.items()}
    best = {name: value / sum(need.values()) for name, value in need.items()}
    assert by_need.ray_share == pytest.approx(best, rel=0.15)
    in_all_w, expected = sum(flux_w[name] * share[name] for name in share), sum(need.values())
    assert by_need.noise.at_one == pytest.approx(expected / in_all_w, rel=0.05)
    proportional = math.sqrt(sum(need[name] ** 2 / (flux_w[name] / 5) for name in share))
    assert as_it_is.noise.at_one == pytest.approx(proportional / in_all_w, rel=0.05)
    assert as_it_is.flux_w == pytest.approx(in_all_w, abs=5 * as_it_is.flux_stderr_w)
    assert by_need.flux_w == pytest.approx(in_all_w, abs=5 * by_need.flux_stderr_w)
