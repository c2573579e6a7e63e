# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the command line promises (see the user guide), on every scene that is shipped."""

from __future__ import annotations

import json
import math
import shutil
import signal
import time
from pathlib import Path

import pytest

from raymaps import open_map, query
from raymaps.check import check_map
from raymaps.run import simulate
from tests.cli.conftest import process

RAYS = 4000
SCENES = sorted((Path(__file__).resolve().parents[2] / "examples").rglob("*.scene.json"))


def quoted(name: str) -> str:
    return name if name.replace("_", "a").isalnum() and name.isascii() else f'"{name}"'


@pytest.fixture(scope="module", params=SCENES, ids=lambda path: path.name.removesuffix(".scene.json"))
def traced(request, tmp_path_factory):
    """A shipped scene and a map of it, traced on one thread."""
    path = tmp_path_factory.mktemp("contract") / "one.raymap"
    simulate(request.param, path, rays=RAYS, seed=7, threads=1, portion_rays=1500)
    return request.param, path


@pytest.fixture
def info(traced, raymaps):
    return raymaps("info", traced[1], "--json").data


def test_there_are_scenes():
    assert len(SCENES) >= 2


def test_threads_portions_and_progress(traced, info, raymaps, tmp_path):
    scene, _ = traced
    path = tmp_path / "two.raymap"
    done = raymaps("trace", scene, "-o", path, "--rays", RAYS, "--seed", 7, "--threads", 2, "--portion", 333,
                   "--progress", "json")  # fmt: skip
    assert done.code == 0
    assert all("event" in json.loads(line) for line in done.out.splitlines())
    other = raymaps("info", path, "--json").data
    assert other["content_hash"] == info["content_hash"]
    assert other["scene_hash"] == info["scene_hash"]
    assert other["rays"] == RAYS
    another = tmp_path / "seed.raymap"
    raymaps("trace", scene, "-o", another, "--rays", RAYS, "--seed", 8)
    assert raymaps("info", another, "--json").data["content_hash"] != info["content_hash"]


def test_killed_and_resumed_is_uninterrupted(traced, tmp_path):
    scene, _ = traced
    rays, path = 20_000, tmp_path / "broken.raymap"
    child = process("trace", scene, "-o", path, "--rays", rays, "--seed", 7, "--portion", 500, "--threads", 1)
    deadline = time.monotonic() + 60
    while not list(path.glob("portions/0*/portion.json")) and child.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    child.send_signal(signal.SIGKILL)
    child.communicate(timeout=30)
    assert child.returncode == -signal.SIGKILL
    assert 0 < open_map(path).n_rays < rays
    resumed = simulate(scene, path, rays=rays, seed=7, resume=True)
    whole = simulate(scene, tmp_path / "whole.raymap", rays=rays, seed=7)
    assert resumed.content_hash == whole.content_hash


def test_info(info):
    for key in ("rays", "events", "portions", "bytes", "seed", "scene_hash", "content_hash", "names", "ledger"):
        assert key in info
    assert (info["rays"], info["seed"], info["portions"]) == (RAYS, 7, 3)
    for key in ("sources", "bodies", "surfaces", "media", "detectors"):
        assert all(isinstance(name, str) for name in info["names"][key])


def test_the_ledger_closes(info, traced):
    ledger = info["ledger"]
    emitted = ledger["emitted_w"]
    scene = json.loads(traced[0].read_text(encoding="utf-8"))
    assert emitted == pytest.approx(sum(source["flux_w"] for source in scene["sources"].values()), rel=1e-12)
    assert ledger["absorbed_w"] + ledger["escaped_w"] + ledger["killed_w"] == pytest.approx(emitted, rel=1e-9)
    by_body, by_medium = ledger["absorbed_by_body_w"], ledger["absorbed_by_medium_w"]
    assert set(by_body) == set(info["names"]["bodies"])
    assert set(by_medium) == set(info["names"]["media"])
    assert math.fsum([*by_body.values(), *by_medium.values()]) == pytest.approx(
        ledger["absorbed_w"], abs=1e-9 * emitted
    )
    assert math.fsum(ledger["killed_by_reason_w"].values()) == pytest.approx(ledger["killed_w"], abs=1e-9 * emitted)
    assert ledger["killed_w"] < 1e-3 * emitted  # the examples lose nothing to speak of
    assert ledger["killed_by_reason_w"]["medium_mismatch"] == 0


def test_logic_of_criteria(traced, info, raymaps):
    _, path = traced
    raymap = open_map(path)
    counts: dict[str, int] = {}

    def count(text: str) -> int:
        if text not in counts:
            counts[text] = query(raymap, text).rays
        return counts[text]

    assert count("true") == RAYS
    names = info["names"]
    atoms = [f"from({quoted(x)})" for x in names["sources"]]
    atoms += [f"hit({quoted(x)})" for x in names["bodies"]]
    atoms += [f"surface({quoted(x)})" for x in names["surfaces"]]
    atoms += [f"detector({quoted(x)})" for x in names["detectors"]]
    atoms += [f"medium({quoted(x)}, absorption)" for x in names["media"]]
    atoms += ["event(fresnel_refraction)", "event(absorption)", "ended(left)"]
    assert any(0 < count(a) < RAYS for a in atoms)
    for a in atoms[:: len(atoms) // 5]:
        assert raymaps("query", path, a, "--json").data["rays"] == count(a), a
    for a in atoms:
        assert count(f"~{a}") + count(a) == RAYS, a
    for a, b in zip(atoms, atoms[1:], strict=False):
        assert count(f"{a} & {b}") + count(f"{a} | {b}") == count(a) + count(b), (a, b)
        assert count(f"~({a} & {b})") == count(f"~{a} | ~{b}"), (a, b)
    assert sum(count(f"ended({x})") for x in ("absorbed", "left", "killed")) == RAYS
    assert sum(count(f"from({quoted(x)})") for x in names["sources"]) == RAYS
    for body in names["bodies"]:
        faces = [f for f in names["faces"] if f.startswith(f"{body}.")]
        parts = " | ".join(f"hit({quoted(body)}.{quoted(f.removeprefix(f'{body}.'))})" for f in faces)
        assert count(parts) == count(f"hit({quoted(body)})"), body


def test_limit(traced, raymaps):
    found = raymaps("query", traced[1], "true", "--limit", 10, "--json").data
    assert found["ids"] == list(range(10))
    assert found["scanned"] < RAYS
    assert "flux_w" in found
    assert "flux_stderr_w" in found


def test_detectors_afterwards(traced, info, raymaps, tmp_path):
    _, path = traced
    emitted = info["ledger"]["emitted_w"]
    assert info["names"]["detectors"]
    for name in info["names"]["detectors"]:
        whole = raymaps("detector", path, name, "--json").data
        assert whole["flux_w"] > 0
        assert whole["flux_stderr_w"] > 0
        fine = raymaps("detector", path, name, "--resolution", "7x5", "--json").data
        assert fine["flux_w"] == pytest.approx(whole["flux_w"], abs=1e-9 * emitted)
        sources = info["names"]["sources"]
        parts = [raymaps("detector", path, name, "--source", source, "--json").data["flux_w"] for source in sources]
        assert math.fsum(parts) == pytest.approx(whole["flux_w"], abs=1e-9 * emitted)
        narrow = raymaps("detector", path, name, "--max-angle", 10, "--json").data
        assert narrow["flux_w"] <= whole["flux_w"] * (1 + 1e-12)
        picture = tmp_path / "map.png"
        assert raymaps("detector", path, name, "-o", picture).code == 0
        assert picture.stat().st_size > 1000


def test_report_explain_and_paths(traced, raymaps, tmp_path):
    scene, path = traced
    report = tmp_path / "report.html"
    assert raymaps("report", path, "--limit", 5, "-o", report).code == 0
    assert report.stat().st_size > 500
    effects = raymaps("explain", scene, "--json").data["effects"]
    assert any(effect["needed"] for effect in effects)
    assert all(effect["because"] for effect in effects if effect["needed"])
    paths = raymaps("paths", path, "--json").data["paths"]
    assert sum(p["rays"] for p in paths) == RAYS
    emitted = raymaps("info", path, "--json").data["ledger"]["emitted_w"]
    assert math.fsum(p["flux_w"] for p in paths) == pytest.approx(emitted, rel=1e-9)


def test_check(traced, raymaps):
    scene, path = traced
    assert raymaps("check", scene).code == 0
    assert raymaps("check", path).code == 0


@pytest.mark.parametrize("criterion", ["hit(NoSuchBody)", "hit(((", "event(teleportation)", "", "~" * 100_000 + "true"])
def test_criteria_that_are_refused(traced, raymaps, criterion):
    assert raymaps("query", traced[1], criterion).sentence


def test_maps_and_scenes_that_are_refused(traced, raymaps, tmp_path):
    scene, path = traced
    assert raymaps("info", tmp_path / "none.raymap").sentence
    assert raymaps("trace", tmp_path / "none.scene.json", "-o", tmp_path / "x.raymap").sentence
    assert raymaps("trace", scene, "-o", path, "--rays", 100).sentence
    assert raymaps("trace", scene, "--no-such-option").code == 2


@pytest.mark.parametrize("file", ["crossings", "events", "rays", "signatures"])
def test_a_truncated_file_is_found(traced, raymaps, tmp_path, file):
    path = tmp_path / "hurt.raymap"
    shutil.copytree(traced[1], path)
    target = path / "portions" / "000000001500" / f"{file}.parquet"
    target.write_bytes(target.read_bytes()[: target.stat().st_size // 2])
    assert file in raymaps("check", path).sentence
    assert any(finding.is_fault for finding in check_map(path))
