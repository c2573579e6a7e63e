# SPDX-License-Identifier: LGPL-2.1-or-later
"""``raymaps accuracy``: a table, JSON, a plot; of scenes and of maps; sentences for what can't be."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image


def test_a_table_of_a_scene(raymaps, small_scene):
    done = raymaps("accuracy", small_scene, "--target", "Above", "--seconds", "1")
    assert done.code == 0
    assert "detector 'Above'" in done.out
    assert "10 %" in done.out
    assert "* random" in done.out
    assert "Sobol'" in done.out
    assert "Cheapest" in done.out


def test_json_and_plot_of_a_map(raymaps, small_scene, tmp_path):
    path, plot = tmp_path / "m.raymap", tmp_path / "m.png"
    raymaps("trace", small_scene, "-o", path, "--rays", "3000")
    found = raymaps("accuracy", path, "--target-where", "hit(Mirror)", "--seconds", "1", "-o", plot, "--json").data
    assert found["quantity"] == "rays where hit(Mirror)"
    assert found["map"]["rays"] == 3000
    flux = raymaps("query", path, "hit(Mirror)", "--json").data
    assert found["map"]["error_percent"] == pytest.approx(100 * flux["flux_stderr_w"] / flux["flux_w"])
    first = found["choices"][0]
    assert (first["choice"], first["scene"]) == ("random", True)
    # both are estimates of one error, known to sqrt(1 / 2 rays that count)
    expected = first["error_at_one_ray"] / 3000**0.5
    assert abs(found["map"]["error_percent"] / 100 / expected - 1) < 5 / (2 * flux["rays"]) ** 0.5
    assert first["rays"]["1"] > first["rays"]["10"] >= 1000
    pixels = np.asarray(Image.open(plot).convert("L"))
    assert pixels.shape[1] > 800
    assert pixels.std() > 10


def test_progress_in_lines(raymaps, small_scene):
    done = raymaps("accuracy", small_scene, "--seconds", "1", "--progress", "json")
    lines = [json.loads(line) for line in done.out.splitlines()]
    told = [(line["number"], line["of"], line["choice"]) for line in lines if line["event"] == "choice"]
    assert told[0] == (1, 3, "random")
    assert [number for number, _, _ in told] == [*range(1, told[-1][1] + 1)]  # rays by need are found on the way
    assert {"Sobol'", "random, losses drawn"} <= {choice for _, _, choice in told}
    assert lines[-1]["event"] == "done"
    assert [one["settings"]["sampling"] for one in lines[-1]["choices"][:2]] == ["random", "sobol"]


def test_by_default_the_least_certain_detector_is_meant(raymaps, small_scene):
    found = raymaps("accuracy", small_scene, "--seconds", "1", "--json").data
    assert found["quantity"] == "detector 'Above'"


def test_what_can_not_be_is_said_in_a_sentence(raymaps, small_scene, tmp_path):
    assert "Unknown detector 'Abov'" in raymaps("accuracy", small_scene, "--target", "Abov").sentence
    assert "Lamp" in raymaps("accuracy", small_scene, "--target-where", "hit(Lamp)").sentence
    assert "must end in .png" in raymaps("accuracy", small_scene, "-o", tmp_path / "a.pdf").sentence
    both = raymaps("accuracy", small_scene, "--target-rect", "0,0,1,1", "--target-ellipse", "0,0,1,1")
    assert both.code == 2
    assert "not both" in both.err


def test_nothing_that_arrives_is_told(raymaps, small_scene):
    done = raymaps("accuracy", small_scene, "--target-where", "hit(Mirror) & ~hit(Mirror)", "--seconds", "1")
    assert done.code == 0
    assert "nothing arrived" in done.out
