# SPDX-License-Identifier: LGPL-2.1-or-later
"""Laws of errors, what follows from them, and which choices a scene has."""

from __future__ import annotations

import math

import numpy as np
import pytest

from raymaps.accuracy import Outlook, Outlooks, Present, choices, forecast
from raymaps.compile import compile_scene
from raymaps.scene import load_scene
from raymaps.target import Law, Target, law_of_points
from tests.physics.lenses import Lens, write_lenses
from tests.physics.sequential import LensFace
from tests.store.small_scenes import lamp_in_a_room, write_scene

PLAIN = Law(1.0, 0.5)


def outlook(words="a", noise=PLAIN, bias=None, bias_stderr=None, ray_s=1e-6, is_even=False):
    settings = {"sampling": "sobol" if is_even else "random"}
    return Outlook(words, words == "a", 1000, 1.0, 0.01, noise, bias, bias_stderr, 2.0, ray_s, settings)


def test_a_law_and_its_inverse():
    assert Law(2.0, 0.5).error(400) == pytest.approx(0.1)
    assert Law(2.0, 0.5).rays(0.1) == pytest.approx(400)
    assert Law(8.0, 1.5).rays(0.008) == pytest.approx(100)
    assert Law(0.0, 0.5).rays(0.1) == 0
    assert math.isinf(Law(1.0, 0.5).rays(0.0))
    law = Law(1.0, 1.0, 1000)
    assert [law.error(n) for n in (100, 1000, 100_000)] == pytest.approx([1e-2, 1e-3, 1e-4])
    assert [law.rays(error) for error in (1e-2, 1e-3, 1e-4)] == pytest.approx([100, 1000, 100_000])


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0, 3.0])
def test_a_power_of_the_number_of_points_is_found_and_goes_on(power):
    rays = np.array([1024.0, 4096.0, 16384.0])
    law = law_of_points(rays, (0.01 * rays**-power), 16384)
    assert law.exponent == pytest.approx(power / 2)
    assert law.error(1e5) == pytest.approx(0.1 * 1e5 ** (-power / 2))


def test_a_law_of_points_lies_between_the_power_that_they_show_and_the_slowest_part_of_it():
    rays = 2.0 ** np.arange(8, 15)
    variance = 1e-3 / rays + 100 / rays**3  # equal parts near 300 rays
    law = law_of_points(rays, variance, 2**14)
    steepness, at_one = np.polyfit(np.log(rays), np.log(variance), 1)
    n = 2.0**18
    power = math.exp(0.5 * (at_one + steepness * math.log(n)))
    assert power < 0.9 * math.sqrt(1e-3 / n)
    assert power < law.error(n) < math.sqrt(1e-3 / n)
    assert law.error(2.0**20) / law.error(2.0**18) == pytest.approx(0.5)  # beyond 16 times the pilot's rays
    assert law_of_points(rays, np.zeros(7), 2**14).rays(0.01) == 0


def test_noise_alone():
    one = outlook()
    assert one.rays(0.01) == 10_000
    assert one.time_s(0.01) == pytest.approx(2.01)
    assert one.error(2.01) == pytest.approx(0.01, rel=1e-3)
    assert one.error(2.0) is None
    assert one.rays(0.5) == 1000  # no run has fewer


def test_a_bias_that_is_seen_can_not_be_undercut():
    one = outlook(bias=-0.03, bias_stderr=0.001)
    assert one.least_error == 0.03
    assert (
        outlook(noise=Law(10.0, 0.5), bias=-0.03, bias_stderr=0.001).rays(0.05) == 62_500
    )  # sqrt(0.05² - 0.03²) = 0.04
    assert one.rays(0.03) is None
    assert one.time_s(0.01) is None
    assert one.error(3.0) == pytest.approx(math.hypot(1e-3, 0.03))


def test_a_bias_within_its_error_may_be_none():
    one = outlook(bias=0.0015, bias_stderr=0.001)
    assert one.least_error == 0
    assert one.rays(0.001) == 1_000_000


def test_what_may_be_off_by_more_is_not_the_cheapest():
    unknown = outlook("quick", bias=0.0, bias_stderr=0.002, ray_s=1e-8)
    found = Outlooks("it", 2, 3.0, (outlook(noise=Law(300.0, 0.5)), unknown))
    assert found.cheapest(0.005).words == "quick"
    assert found.cheapest(0.003).words == "a"  # it may be off by 0.4 %


def test_points_of_a_sequence_come_in_powers_of_two():
    one = outlook(noise=Law(1.0, 1.0), is_even=True)
    assert one.rays(0.0001) == 16_384
    assert one.error(2.0 + 0.02) == pytest.approx(1 / 16_384)


def test_nothing_arrived():
    one = outlook(noise=None)
    assert one.rays(0.1) is None
    assert one.error(100.0) is None
    assert "nothing arrived" in Outlooks("it", 1, 1.0, (one,)).to_text()


def test_the_cheapest_choice_depends_on_the_error():
    biased = outlook("quick", bias=0.02, bias_stderr=0.001, ray_s=1e-8)
    found = Outlooks("it", 2, 3.0, (outlook(noise=Law(300.0, 0.5)), biased), Present(500, 0.044))
    assert found.cheapest(0.1).words == "quick"  # 11 s in place of 2 s
    assert found.cheapest(0.003).words == "a"
    assert found.cheapest(0.01).words == "a"
    assert Outlooks("it", 2, 3.0, (biased,)).cheapest(0.001) is None
    told = found.to_dict()
    assert told["choices"][1]["time_s"] == {"10": pytest.approx(2.00001, abs=1e-5), "1": None, "0.1": None}
    assert told["cheapest"] == {"10": "quick", "1": "a", "0.1": "a"}
    even = Outlooks("it", 2, 3.0, (outlook(), outlook("b", ray_s=0.99e-6)))
    assert even.cheapest(0.001).words == "a"  # the scene's own: the other saves too little
    assert told["map"] == {"rays": 500, "error_percent": pytest.approx(4.4)}
    text = found.to_text()
    assert "never" in text
    assert "* a" in text
    assert "This map   500 rays: 4.4 %" in text


def test_triangles_of_plane_faces_are_not_split(tmp_path):
    scene = load_scene(write_scene(tmp_path, lamp_in_a_room(tmp_path)))
    faceted = scene.model_copy(update={"settings": scene.settings.model_copy(update={"surfaces": "faceted"})})
    found = forecast(faceted, Target(1), seconds=1.0)
    assert {one.finer for one in found.of} == {1}
    assert len({one.words for one in found.of}) == len(found.of)


def words_of(scene):
    return [one.words for one in choices(scene, compile_scene(scene))]


def test_choices_of_a_plain_scene(tmp_path):
    scene = load_scene(write_scene(tmp_path, lamp_in_a_room(tmp_path)))
    assert words_of(scene) == ["random", "Sobol'", "random, losses drawn"]


def test_finer_facets_come_nearer_to_the_exact_surface(tmp_path):
    """The flux that a lens of few triangles brings into a hole nears that of the exact one."""
    lens = Lens(LensFace(0, 1 / 50), LensFace(5, -1 / 50), 10)
    source = {"kind": "disc", "flux_w": 1.0, "radius_mm": 4, "direction": [0, 0, 1], "position_mm": [0, 0, -10]}
    hole = {"kind": "rectangle", "center_mm": [0, 0, 50], "normal": [0, 0, -1], "x_axis": [1, 0, 0],
            "width_mm": 1.0, "height_mm": 1.0}  # fmt: skip
    path = write_lenses(tmp_path, {"Lens": (lens, 4)}, {"glass": 1.5}, sources={"S": source}, detectors={"D": hole})
    told = []
    found = forecast(path, Target(1, "D"), seconds=4.0, on_choice=lambda number, of, words: told.append((of, words)))
    words = [one.words for one in found.of]
    assert words == [words for _, words in told]
    assert words[-3:] == ["faceted, random", "faceted, random, 4x finer", "faceted, random, 16x finer"]
    assert [one.finer for one in found.of[-3:]] == [1, 4, 16]
    coarse, fine, finest = (abs(one.bias) for one in found.of[-3:])
    assert coarse > fine > finest > 0
    assert found.of[-3].least_error == coarse


def test_choices_of_a_lens_with_a_spectrum(tmp_path):
    lens = Lens(LensFace(0, 1 / 50), LensFace(5, -1 / 50), 10)
    source = {"kind": "disc", "flux_w": 1.0, "radius_mm": 5, "direction": [0, 0, 1], "position_mm": [0, 0, -10],
              "spectrum": {"kind": "illuminant", "name": "D65"}}  # fmt: skip

    def scene(**settings):
        path = write_lenses(tmp_path, {"Lens": (lens, 4)}, {"glass": 1.5}, sources={"S": source}, settings=settings)
        return load_scene(path)

    found = choices(scene(), compile_scene(scene()))
    assert [one.words for one in found] == [
        "exact, 32 bands, random", "exact, 32 bands, Sobol'", "exact, 32 bands, random, losses drawn",
        "faceted, 32 bands, random", "exact, RGB, random",
        "exact, 4 bands, random", "exact, 8 bands, random", "exact, 16 bands, random", "exact, 64 bands, random",
    ]  # fmt: skip
    assert [one.is_scene for one in found] == [True] + 8 * [False]
    assert [one.is_finest for one in found] == 8 * [False] + [True]
    assert [one.has_own_bias for one in found] == [True, False, False, *6 * [True]]
    faceted = choices(scene(surfaces="faceted"), compile_scene(scene(surfaces="faceted")))
    assert [one.words for one in faceted if one.is_finest] == ["exact, 64 bands, random"]  # the two of all changes
