# SPDX-License-Identifier: LGPL-2.1-or-later
"""Exit codes, signals and pipes: 0 done, 2 wrong usage, 3 bad scene, map or criterion, 4 interrupted."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import subprocess
import threading
import time

import pytest

from raymaps import open_map, simulate
from raymaps.check import check_map
from tests.cli.conftest import process
from tests.store.small_scenes import lamp_in_a_room, write_scene

RAYS, PORTION = 30_000, 500


# ---------------------------------------------------------------------------------------------------------------------
# 2: wrong usage

WRONG_USAGE = [
    (), ("no-such-command",), ("trace",), ("trace", "{scene}"), ("trace", "{scene}", "--no-such-option"),
    ("trace", "{scene}", "-o", "{new}", "--rays", "0"), ("trace", "{scene}", "-o", "{new}", "--rays", "-5"),
    ("trace", "{scene}", "-o", "{new}", "--rays", "many"), ("trace", "{scene}", "-o", "{new}", "--rays", "1e5"),
    ("trace", "{scene}", "-o", "{new}", "--seed", "-1"), ("trace", "{scene}", "-o", "{new}", "--seed", str(2**64)),
    ("trace", "{scene}", "-o", "{new}", "--threads", "0"), ("trace", "{scene}", "-o", "{new}", "--progress", "loud"),
    ("trace", "{scene}", "-o", "{new}", "--store", "spectrum"), ("trace", "{scene}", "{scene}", "-o", "{new}"),
    ("trace", "{scene}", "-o", "{new}", "--portion", "0"),
    ("info",), ("info", "{map}", "--jsn"), ("query", "{map}"), ("query", "{map}", "true", "--limit", "-1"),
    ("query", "{map}", "true", "--limit", "x"), ("paths", "{map}", "--limit", "0"), ("report", "{map}", "--limit", "0"),
    ("detector", "{map}"), ("detector", "{map}", "Around", "--resolution", "10"),
    ("detector", "{map}", "Around", "--resolution", "axb"), ("detector", "{map}", "Around", "--resolution", "-3x3"),
    ("detector", "{map}", "Around", "--max-angle", "181"), ("detector", "{map}", "Around", "--max-angle", "wide"),
    ("detector", "{map}", "Around", "--rect", "1,2,3"), ("detector", "{map}", "Around", "--rect", "a,b,c,d"),
    ("detector", "{map}", "Around", "--rect", "0,0,1,1", "--ellipse", "0,0,1,1"),
    ("view", "{map}"), ("check",), ("serve",), ("schema", "extra"), ("explain", "{scene}", "{scene}"),
]  # fmt: skip


@pytest.mark.parametrize("arguments", WRONG_USAGE, ids=" ".join)
def test_wrong_usage_is_2(raymaps, small_scene, small_map, tmp_path, arguments):
    places = {"scene": small_scene, "map": small_map, "new": tmp_path / "new.raymap"}
    done = raymaps(*(part.format(**places) for part in arguments))
    assert done.code == 2
    assert "Traceback" not in done.err + done.out
    assert done.err.strip() or not arguments
    assert not (tmp_path / "new.raymap").exists()


def little_memory() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (5 << 30, 5 << 30))


def test_more_rays_than_a_scene_may_ask_for_are_refused(small_scene, tmp_path):
    child = process("trace", small_scene, "-o", tmp_path / "m.raymap", "--rays", 10**13, preexec_fn=little_memory)
    try:
        err = child.communicate(timeout=20)[1]
    finally:
        child.kill()
        child.communicate()
    assert child.returncode in (2, 3)
    assert "1000000000000" in err
    assert not (tmp_path / "m.raymap").exists()


def test_a_run_of_very_many_rays_begins_at_once_and_in_little_memory(small_scene, tmp_path):
    """The most that a scene may ask for: the run is a plan, not a list."""
    path = tmp_path / "m.raymap"
    arguments = ("trace", small_scene, "-o", path, "--rays", 10**12, "--portion", 1000, "--progress", "json")
    child = process(*arguments, preexec_fn=little_memory)
    limit = threading.Timer(20, child.kill)
    limit.start()
    try:
        busy(child)
        child.send_signal(signal.SIGTERM)
        child.communicate(timeout=20)
    finally:
        limit.cancel()
        child.kill()
        child.communicate()
    assert child.returncode == 4
    assert open_map(path).manifest.rays_asked == 10**12


# ---------------------------------------------------------------------------------------------------------------------
# 3: a bad scene, map or criterion

BAD_CRITERIA = [
    "", "   ", "hit(((", "hit()", "hit(NoSuchBody)", "hit(Block.Lid)", "event(teleportation)", "event()", "from(Sun)",
    "surface(gold)", "medium(water, absorption)", "medium(glass, melting)", "detector(Eye)", "ended(happily)",
    "true &", "& true", "true true", "~", "hit(Block", "detector(Above, rect=(1,2,3))",
    "detector(Above, rect=(nan,0,1,1))", "detector(Above, circle=(0,0,1))", "hit(Block, hit(Chip))", "\x00", "☃",
    "__import__('os')", "(" * 100_000, "~" * 100_000 + "true", "true" + " & true" * 0 + ")", '"Block', "hit('Block')",
]  # fmt: skip


@pytest.mark.parametrize("criterion", BAD_CRITERIA, ids=lambda c: c[:25])
def test_a_bad_criterion_is_3(raymaps, small_map, criterion):
    assert raymaps("query", small_map, criterion).sentence


@pytest.mark.parametrize("command", [["paths", "--where"], ["report", "--where"], ["detector", "Around", "--where"]])
def test_a_bad_criterion_is_3_everywhere(raymaps, small_map, command):
    first, *rest = command
    assert "'NoSuchBody'" in raymaps(first, small_map, *rest, "hit(NoSuchBody)").sentence


def test_unknown_names_list_the_known_ones(raymaps, small_map):
    assert "'Block'" in raymaps("query", small_map, "hit(Blok)").sentence
    assert "'Around'" in raymaps("detector", small_map, "Arround").sentence
    assert "'Lamp'" in raymaps("detector", small_map, "Around", "--source", "Lump").sentence


def test_very_many_operands_are_no_error(raymaps, small_map):
    text = " | ".join(["hit(Block)"] * 20_000)
    one = raymaps("query", small_map, "hit(Block)", "--json").data["rays"]
    assert raymaps("query", small_map, text, "--json").data["rays"] == one


@pytest.mark.parametrize(
    "arguments",
    [
        ("info", "{none}"), ("info", "{none}", "--json"), ("query", "{none}", "true"), ("paths", "{none}"),
        ("report", "{none}"), ("detector", "{none}", "Around"), ("check", "{none}"), ("serve", "{none}"),
        ("view", "{none}", "-o", "{out}.png"), ("explain", "{none}"), ("trace", "{none}", "-o", "{out}.raymap"),
        ("info", "{scene}"), ("check", "{folder}"), ("explain", "{folder}"),
        ("trace", "{folder}", "-o", "{out}.raymap"),
        ("info", "{long}"), ("check", "{long}"), ("trace", "{long}", "-o", "{out}.raymap"),
        ("trace", "{scene}", "-o", "{long}"), ("trace", "{scene}", "-o", "{map}"),
        ("trace", "{scene}", "-o", "{scene}/m.raymap"), ("detector", "{map}", "NoSuch"),
        ("detector", "{map}", "Around", "-o", "{out}.pdf"), ("detector", "{map}", "Around", "-o", "{out}"),
        ("detector", "{map}", "Around", "-o", "{scene}/d.csv"), ("detector", "{map}", "Around", "--resolution", "0x5"),
        ("detector", "{map}", "Around", "--rect=1,1,0,0"), ("detector", "{map}", "Around", "--ellipse", "0,0,-1,1"),
        ("detector", "{map}", "Around", "--rect=nan,0,1,1"),
        ("report", "{map}", "-o", "{out}.docx"), ("report", "{map}", "-o", "{scene}/r.html"),
        ("view", "{map}", "-o", "{out}.docx"), ("view", "{map}", "-o", "{scene}/v.png"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_what_can_not_be_used_is_3(raymaps, small_scene, small_map, tmp_path, arguments):
    places = {
        "none": tmp_path / "none", "scene": small_scene, "map": small_map, "folder": tmp_path, "out": tmp_path / "out",
        "long": tmp_path / ("x" * 300),
    }  # fmt: skip
    done = raymaps(*(part.format(**places) for part in arguments))
    if arguments[0] == "view" and done.code == 3 and "pip install" in done.err:
        pytest.skip("pictures are not installed")
    assert done.sentence
    assert list(tmp_path.glob("out*")) == []


def test_check_of_a_damaged_map_is_3_also_as_json(raymaps, small_map, tmp_path):
    path = tmp_path / "hurt.raymap"
    shutil.copytree(small_map, path)
    target = path / "portions" / "000000000800" / "events.parquet"
    target.write_bytes(target.read_bytes()[:-100])
    done = raymaps("check", path, "--json")
    assert done.code == 3
    data = json.loads(done.out)
    assert data["sound"] is False
    assert "events.parquet" in data["findings"][0]["text"]
    assert len(done.err.splitlines()) == 1


# ---------------------------------------------------------------------------------------------------------------------
# 4: interrupted


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    folder = tmp_path_factory.mktemp("room")
    return write_scene(folder, lamp_in_a_room(folder))


@pytest.fixture(scope="module")
def whole(room, tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "whole.raymap"
    return simulate(room, path, rays=RAYS, portion_rays=16_000).content_hash


def busy(child: subprocess.Popen[str]) -> int:
    """Reads JSON lines until some rays are stored; returns how many."""
    assert child.stdout is not None
    for line in child.stdout:
        said = json.loads(line)
        if said["event"] == "progress" and said["rays"] >= 2 * PORTION:
            return said["rays"]
    raise AssertionError(f"the run said too little: {child.communicate()}")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_interrupted_is_4_and_resume_goes_on(room, whole, tmp_path, number):
    path = tmp_path / "m.raymap"
    child = process(
        "trace", room, "-o", path, "--rays", RAYS, "--portion", PORTION, "--threads", 1, "--progress", "json"
    )
    rays = busy(child)
    child.send_signal(number)
    out, err = child.communicate(timeout=60)
    assert child.returncode == 4, err
    assert len(err.strip().splitlines()) == 1
    assert "--resume" in err
    assert all(json.loads(line)["event"] == "progress" for line in out.splitlines())
    held = open_map(path)
    assert rays <= held.n_rays < RAYS
    assert not any(finding.is_fault for finding in check_map(path))
    resumed = process("trace", room, "-o", path, "--rays", RAYS, "--resume")
    assert resumed.communicate(timeout=60)[1] == ""
    assert resumed.returncode == 0
    assert open_map(path).content_hash == whole


def test_a_second_signal_ends_at_once(room, tmp_path):
    """Without waiting for the portions that are being traced; the map is valid all the same."""
    path = tmp_path / "m.raymap"
    child = process("trace", room, "-o", path, "--rays", 500 * RAYS, "--portion", 500 * PORTION, "--progress", "json")
    busy(child)
    child.send_signal(signal.SIGINT)
    time.sleep(0.02)  # a portion takes much longer
    child.send_signal(signal.SIGINT)
    child.communicate(timeout=60)
    assert child.returncode == 4
    assert open_map(path).n_rays > 0
    assert not any(finding.is_fault for finding in check_map(path))


def test_resume_alone_goes_on_to_the_number_of_rays_that_was_asked_for(raymaps, room, tmp_path):
    path = tmp_path / "m.raymap"
    child = process("trace", room, "-o", path, "--rays", RAYS, "--portion", PORTION, "--progress", "json")
    busy(child)
    child.send_signal(signal.SIGINT)
    child.communicate(timeout=60)
    assert child.returncode == 4
    assert open_map(path).n_rays < RAYS
    assert raymaps("trace", room, "-o", path, "--resume").code == 0
    assert open_map(path).n_rays == RAYS
    assert open_map(path).manifest.rays_asked == RAYS


def test_resume_with_another_seed_is_3(raymaps, room, tmp_path):
    path = tmp_path / "m.raymap"
    assert raymaps("trace", room, "-o", path, "--rays", 100, "--seed", 1).code == 0
    sentence = raymaps("trace", room, "-o", path, "--rays", 200, "--seed", 2, "--resume").sentence
    assert "seed 1" in sentence


# ---------------------------------------------------------------------------------------------------------------------
# Pipes


@pytest.mark.parametrize(
    "arguments", [("query", "true", "--json"), ("paths", "--json"), ("report", "--limit", "500"), ("report", "--json")]
)
def test_a_reader_that_goes_away_is_no_error(small_map, arguments):
    """As in ``raymaps report MAP | head -1``."""
    command, *rest = arguments
    reading, writing = os.pipe()
    child = process(command, small_map, *rest, stdout=writing)
    os.close(writing)
    os.close(reading)
    err = child.communicate(timeout=60)[1]
    assert err == ""
    assert child.returncode == 0


def test_head_takes_what_it_wants(small_map):
    child = process("report", small_map, "--limit", "500")
    head = subprocess.run(["head", "-1"], stdin=child.stdout, capture_output=True, text=True, check=True)
    child.stdout.close()
    err = child.stderr.read()
    child.stderr.close()
    assert head.stdout.strip()
    assert err == ""
    assert child.wait(60) == 0


def test_a_reader_of_progress_that_goes_away_leaves_a_valid_map(room, tmp_path):
    """FreeCAD may be closed while the tracer runs."""
    path = tmp_path / "m.raymap"
    child = process("trace", room, "-o", path, "--rays", RAYS, "--portion", PORTION, "--progress", "json")
    busy(child)
    child.stdout.close()
    err = child.stderr.read()
    child.stderr.close()
    assert child.wait(60) >= 0
    assert "Traceback" not in err
    assert open_map(path).n_rays > 0
    assert not any(finding.is_fault for finding in check_map(path))


def test_output_on_a_full_device_is_told(small_map):
    if not os.path.exists("/dev/full"):
        pytest.skip("there is no /dev/full here")
    with open("/dev/full", "w") as full:
        child = process("query", small_map, "true", "--json", stdout=full)
        err = child.communicate(timeout=60)[1]
    assert child.returncode == 3
    assert "Traceback" not in err
    assert len(err.strip().splitlines()) == 1


def test_a_module_is_the_same_command():
    child = process("--help")
    out, err = child.communicate(timeout=60)
    assert (child.returncode, err) == (0, "")
    assert "raymaps" in out
