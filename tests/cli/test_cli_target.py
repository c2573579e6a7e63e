# SPDX-License-Identifier: LGPL-2.1-or-later
"""``raymaps trace --target-error ... --time-limit ...``: what is printed, what is refused, what the map says of it."""

from __future__ import annotations

import json

import pytest
import typer

from raymaps import open_map
from raymaps.target_options import duration_s


def test_a_target_is_reached_and_told(raymaps, small_scene, tmp_path):
    path = tmp_path / "m.raymap"
    done = raymaps("trace", small_scene, "-o", path, "--target-error", "5%", "--target", "Above")
    assert done.code == 0
    assert "5 % of detector 'Above'" in done.err
    assert "target    5 % of detector 'Above'" in done.out
    figures = raymaps("detector", path, "Above", "--json").data
    assert figures["flux_stderr_w"] <= 0.05 * figures["flux_w"]


def test_info_tells_how_the_number_of_rays_was_chosen(raymaps, small_scene, tmp_path):
    path = tmp_path / "m.raymap"
    raymaps("trace", small_scene, "-o", path, "--target-error", "5", "--target-where", "hit(Mirror)")
    info = raymaps("info", path, "--json").data
    assert info["target"]["percent"] == 5
    assert info["target"]["quantity"] == "rays where hit(Mirror)"
    assert info["target"]["stages"] == [info["rays"]]
    assert info["target"]["reached_percent"] <= 5
    assert info["target"]["ended"] == "target"
    told = f"{info['rays']} rays traced (pilot of {info['target']['pilot_rays']} with "
    assert told in raymaps("info", path).out
    plain = tmp_path / "plain.raymap"
    raymaps("trace", small_scene, "-o", plain, "--rays", info["rays"])
    other = raymaps("info", plain, "--json").data
    assert (other["content_hash"], other["target"]) == (info["content_hash"], None)


def test_by_default_the_least_certain_detector_is_meant(raymaps, small_scene, tmp_path):
    path = tmp_path / "m.raymap"
    done = raymaps("trace", small_scene, "-o", path, "--target-error", "5%")
    assert "detector 'Above'" in done.err
    for name in ("Above", "Around"):
        figures = raymaps("detector", path, name, "--json").data
        assert figures["flux_stderr_w"] <= 0.05 * figures["flux_w"]


def test_progress_tells_the_error_so_far(raymaps, small_scene, tmp_path):
    arguments = ("--target-error", "3%", "--target", "Above", "--target-rect", "0,0,3,3", "--progress", "json")
    done = raymaps("trace", small_scene, "-o", tmp_path / "m.raymap", *arguments)
    assert done.err == ""
    lines = [json.loads(line) for line in done.out.splitlines()]
    events = [line["event"] for line in lines if line["event"] != "note"]
    assert events[0] == "pilot"
    assert events.index("start") == events.count("pilot")
    assert events[-1] == "done"
    steps = [line for line in lines if line["event"] == "progress"]
    assert steps[-1]["error_percent"] <= 3
    assert steps[-1]["rays"] == steps[-1]["of"]
    assert steps[-1]["remaining_s"] == 0
    assert lines[-1]["target"]["reached_percent"] == pytest.approx(steps[-1]["error_percent"])


def test_a_bar_shows_the_error(raymaps, small_scene, tmp_path):
    done = raymaps("trace", small_scene, "-o", tmp_path / "m.raymap", "--target-error", "10", "--progress", "bar")
    assert done.code == 0
    assert "±" in done.err


def test_a_target_out_of_reach_is_a_note(raymaps, small_scene, tmp_path):
    path = tmp_path / "m.raymap"
    done = raymaps("trace", small_scene, "-o", path, "--target-error", "0.1%", "--target", "Above", "--rays", "9000")
    assert done.code == 0
    assert open_map(path).n_rays == 9000
    last = done.err.splitlines()[-1]
    assert last.startswith("The target of 0.1 % for detector 'Above' was not reached")
    assert "the most that are allowed. It needs about" in last
    assert raymaps("check", path).code == 0


def test_a_time_limit_ends_a_run_and_resume_goes_on(raymaps, small_scene, tmp_path):
    path = tmp_path / "m.raymap"
    arguments = ("trace", small_scene, "-o", path, "--rays", 5000, "--portion", 1000, "--threads", 1)
    done = raymaps(*arguments, "--time-limit", "0.001s")
    assert done.code == 0
    assert "time limit" in done.err
    assert open_map(path).n_rays == 1000
    assert raymaps(*arguments, "--resume").code == 0
    assert open_map(path).n_rays == 5000


WRONG_USAGE = {
    "five": ("--target-error", "five"),
    "none": ("--target-error", "0%"),
    "all": ("--target-error", "100%"),
    "negative": ("--target-error=-1%",),
    "nothing to reach": ("--target", "Above"),
    "no error": ("--target-where", "hit(Block)"),
    "region": ("--target-error", "1%", "--target-rect", "1,2,3"),
    "two regions": ("--target-error", "1%", "--target-rect", "0,0,1,1", "--target-ellipse", "0,0,1,1"),
    "time": ("--time-limit", "soon"),
    "no time": ("--time-limit", "0s"),
}


@pytest.mark.parametrize("arguments", WRONG_USAGE.values(), ids=WRONG_USAGE)
def test_wrong_usage_is_2(raymaps, small_scene, tmp_path, arguments):
    done = raymaps("trace", small_scene, "-o", tmp_path / "m.raymap", *arguments)
    assert done.code == 2
    assert "Traceback" not in done.err + done.out
    assert not (tmp_path / "m.raymap").exists()


NOT_THERE = {
    "detector": (("--target", "Abov"), "Unknown detector 'Abov'; known: 'Above', 'Around'."),
    "criterion": (("--target-where", "hit(Nobody)"), "Nobody"),
    "syntax": (("--target-where", "hit("), "expected the name of a body"),
    "outside": (("--target", "Above", "--target-rect", "50,50,60,60"), "outside detector 'Above'"),
    "which": (("--target-rect", "0,0,1,1"), "name it"),
}


@pytest.mark.parametrize(("arguments", "said"), NOT_THERE.values(), ids=NOT_THERE)
def test_what_the_scene_has_not_is_3(raymaps, small_scene, tmp_path, arguments, said):
    path = tmp_path / "m.raymap"
    assert said in raymaps("trace", small_scene, "-o", path, "--target-error", "1%", *arguments).sentence
    assert not path.exists()


def test_a_region_of_faces_is_refused(raymaps, small_scene, tmp_path):
    data = json.loads(small_scene.read_text())
    data["detectors"]["Lit"] = {"kind": "face", "body": "Screen"}
    scene = small_scene.with_name("faces.scene.json")
    scene.write_text(json.dumps(data))
    path = tmp_path / "m.raymap"
    arguments = ("--target-error", "1%", "--target", "Lit", "--target-rect", "0,0,1,1")
    assert "one of faces" in raymaps("trace", scene, "-o", path, *arguments).sentence
    assert not path.exists()


@pytest.mark.parametrize(
    ("text", "seconds"), [("90s", 90), ("90", 90), ("1.5min", 90), ("2 h", 7200), ("2m", 120), (".5S", 0.5)]
)
def test_times(text, seconds):
    assert duration_s(text) == seconds


@pytest.mark.parametrize("text", ["", "s", "-1s", "1d", "1s2", "nan", "1e999s"])
def test_what_is_no_time(text):
    with pytest.raises(typer.BadParameter, match="90s, 5min or 2h"):
        duration_s(text)
