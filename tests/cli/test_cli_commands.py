# SPDX-License-Identifier: LGPL-2.1-or-later
"""Each command of the command line: what it prints, as text and as JSON, and which files it writes."""

from __future__ import annotations

import csv
import json
import math

import numpy as np
import pytest

from raymaps import open_map
from raymaps.scene import scene_json_schema
from tests.lossy_maps import lossy_map

COMMANDS = ("trace", "info", "query", "paths", "report", "detector", "explain", "view", "check", "schema", "serve")


def test_help_lists_every_command(raymaps):
    done = raymaps("--help")
    assert done.code == 0
    assert all(f"  {command} " in done.out or f" {command}\n" in done.out for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(raymaps, command):
    done = raymaps(command, "--help")
    assert done.code == 0
    assert f"raymaps {command}" in done.out
    assert len(done.out) > 100


OPTIONS = {
    "trace": [
        "-o", "--rays", "--seed", "--threads", "--store", "--resume", "--progress", "--target-error", "--target",
        "--target-rect", "--target-ellipse", "--target-where", "--time-limit",
    ],
    "info": ["--json"],
    "query": ["--limit", "--json"],
    "paths": ["--where", "--json"],
    "report": ["--where", "--limit", "-o"],
    "detector": ["--resolution", "--max-angle", "--source", "--where", "--rect", "--ellipse", "-o", "--json"],
    "explain": ["--json"],
    "view": ["--where", "-o"],
    "check": ["--json"],
}  # fmt: skip


@pytest.mark.parametrize("command", OPTIONS)
def test_promised_options_are_there(raymaps, command):
    text = raymaps(command, "--help").out
    assert all(option in text for option in OPTIONS[command])


# ---------------------------------------------------------------------------------------------------------------------
# trace


def test_trace_tells_what_it_did(raymaps, small_scene, tmp_path):
    done = raymaps("trace", small_scene, "-o", tmp_path / "m.raymap", "--rays", 300, "--seed", 9)
    assert done.code == 0
    assert "300 rays" in done.out
    assert "emitted 3.75 W" in done.out
    raymap = open_map(tmp_path / "m.raymap")
    assert (raymap.n_rays, raymap.manifest.seed) == (300, 9)


def test_trace_takes_rays_and_seed_of_the_scene(raymaps, small_scene, tmp_path):
    assert raymaps("trace", small_scene, "-o", tmp_path / "m.raymap", "--store", "rgb").code == 0
    raymap = open_map(tmp_path / "m.raymap")
    assert (raymap.n_rays, raymap.manifest.seed) == (3000, 5)


@pytest.mark.parametrize("seed", [0, 2**64 - 1, 2**63])
def test_trace_takes_any_seed_of_64_bits(raymaps, small_scene, tmp_path, seed):
    assert raymaps("trace", small_scene, "-o", tmp_path / "m.raymap", "--rays", 10, "--seed", seed).code == 0
    assert open_map(tmp_path / "m.raymap").manifest.seed == seed


def test_trace_in_any_folder(raymaps, small_scene, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert raymaps("trace", small_scene, "-o", "m.raymap", "--rays", 10).code == 0
    assert raymaps("info", "m.raymap").code == 0


def test_threads_and_portions_do_not_change_the_content(raymaps, small_scene, tmp_path):
    hashes = set()
    for i, options in enumerate((["--threads", 1], ["--threads", 2], ["--portion", 37], ["--portion", 5000])):
        path = tmp_path / f"{i}.raymap"
        assert raymaps("trace", small_scene, "-o", path, "--rays", 1000, *options).code == 0
        hashes.add(raymaps("info", path, "--json").data["content_hash"])
    assert len(hashes) == 1


def test_another_seed_is_another_content(raymaps, small_scene, tmp_path):
    hashes = set()
    for seed in (1, 2):
        path = tmp_path / f"{seed}.raymap"
        raymaps("trace", small_scene, "-o", path, "--rays", 200, "--seed", seed)
        hashes.add(raymaps("info", path, "--json").data["content_hash"])
    assert len(hashes) == 2


def progress_lines(text: str) -> list[dict]:
    lines = [json.loads(line) for line in text.splitlines()]
    assert all(isinstance(line, dict) for line in lines)
    return lines


FIELDS = {
    "start": {"rays": int, "done_rays": int, "map": str},
    "note": {"text": str},
    "progress": {"rays": int, "of": int, "elapsed_s": (int, float), "remaining_s": (int, float, type(None))},
    "done": {
        "map": str, "rays": int, "events": int, "elapsed_s": (int, float), "emitted_w": float, "absorbed_w": float,
        "escaped_w": float, "killed_w": float,
    },
}  # fmt: skip


def test_progress_as_json_lines(raymaps, small_scene, tmp_path):
    path = tmp_path / "m.raymap"
    done = raymaps("trace", small_scene, "-o", path, "--rays", 4000, "--portion", 500, "--progress", "json")
    lines = progress_lines(done.out)
    assert done.code == 0
    assert done.err == ""
    for line in lines:
        fields = dict(line)
        expected = FIELDS[fields.pop("event")]
        assert set(fields) >= set(expected), line
        for name, kind in expected.items():
            assert isinstance(fields[name], kind), line
    events = [line["event"] for line in lines if line["event"] != "note"]
    assert events[0] == "start"
    assert events[-1] == "done"
    assert set(events[1:-1]) == {"progress"}
    assert lines[0]["map"] == str(path)
    rays = [line["rays"] for line in lines if line["event"] == "progress"]
    assert rays == sorted(rays)
    assert rays[-1] == 4000
    assert len(rays) >= 8
    assert all(line["of"] == 4000 for line in lines if line["event"] == "progress")
    assert lines[-1]["rays"] == 4000
    ledger = raymaps("info", path, "--json").data["ledger"]
    for name in ("emitted_w", "absorbed_w", "escaped_w", "killed_w"):
        assert lines[-1][name] == ledger[name]


def test_progress_of_a_resumed_run_starts_where_it_stood(raymaps, small_scene, tmp_path):
    path = tmp_path / "m.raymap"
    raymaps("trace", small_scene, "-o", path, "--rays", 1000)
    done = raymaps("trace", small_scene, "-o", path, "--rays", 2500, "--resume", "--progress", "json")
    start = progress_lines(done.out)[0]
    assert (start["event"], start["done_rays"], start["rays"]) == ("start", 1000, 2500)


def test_progress_none_and_bar(raymaps, small_scene, tmp_path):
    none = raymaps("trace", small_scene, "-o", tmp_path / "a.raymap", "--rays", 100, "--progress", "none")
    assert none.err == ""
    bar = raymaps("trace", small_scene, "-o", tmp_path / "b.raymap", "--rays", 100, "--progress", "bar")
    assert bar.code == 0
    assert "100/100" in bar.err
    assert none.out.splitlines()[1] == bar.out.splitlines()[1]


# ---------------------------------------------------------------------------------------------------------------------
# info, query, paths, report, detector


def test_info(raymaps, small_map):
    data = raymaps("info", small_map, "--json").data
    assert data["rays"] == 2000
    assert data["portions"] == 3
    assert data["seed"] == 5
    assert data["events"] > 2000
    assert data["bytes"] > 10_000
    assert len(data["scene_hash"]) == 64
    assert int(data["content_hash"], 16) > 0
    assert data["names"]["bodies"] == ["Block", "Bubble", "Mirror", "Screen", "Stop", "Chip"]
    assert set(data["names"]) >= {"sources", "bodies", "surfaces", "media", "detectors"}
    ledger = data["ledger"]
    assert ledger["emitted_w"] == pytest.approx(3.75, rel=1e-12)
    assert ledger["absorbed_w"] + ledger["escaped_w"] + ledger["killed_w"] == pytest.approx(3.75, rel=1e-9)
    assert math.fsum(
        [*ledger["absorbed_by_body_w"].values(), *ledger["absorbed_by_medium_w"].values()]
    ) == pytest.approx(ledger["absorbed_w"], rel=1e-12)
    assert math.fsum(ledger["killed_by_reason_w"].values()) == pytest.approx(ledger["killed_w"], rel=1e-12)
    assert set(ledger["killed_by_reason_w"]) == {"depth", "numerical", "medium_mismatch"}
    assert ledger["absorbed_by_medium_w"]["glass"] > 0
    text = raymaps("info", small_map).out
    assert "2000 of 2000 rays" in text
    assert data["content_hash"] in text
    assert "by medium glass" in text


def test_lost_rays_are_told_by_place(raymaps, small_scene, tmp_path):
    """`info`, `report` and `check` name the place and the criterion, and `view` draws the rays."""
    path = tmp_path / "lossy.raymap"
    lossy_map(small_scene, path)
    lost = raymaps("info", path, "--json").data["lost"]
    assert lost
    for one in lost:
        assert set(one) >= {"body", "face", "reason", "rays", "flux_w", "point_mm"}
        assert one["criterion"] in raymaps("info", path).out
        assert one["criterion"] in raymaps("check", path).out
    assert lost[0]["criterion"] in raymaps("report", path, "--limit", 1).out
    assert raymaps("report", path, "--limit", 1, "--json").data["lost"] == lost
    assert raymaps("query", path, lost[0]["criterion"], "--json").data["rays"] == lost[0]["rays"]
    done = raymaps("view", path, "--where", lost[0]["criterion"], "-o", tmp_path / "lost.html")
    assert done.code == 0
    assert (tmp_path / "lost.html").stat().st_size > 3000


def test_query(raymaps, small_map):
    data = raymaps("query", small_map, "hit(Block) & detector(Above)", "--json").data
    assert data["rays"] == len(data["ids"]) > 0
    assert data["scanned"] == 2000
    assert 0 < data["flux_stderr_w"] < data["flux_w"] < 3.75
    assert data["ids"] == sorted(data["ids"])
    text = raymaps("query", small_map, "hit(Block) & detector(Above)").out
    assert f"{data['rays']} of 2000 rays match" in text


def test_query_limit_stops_early(raymaps, small_map):
    data = raymaps("query", small_map, "true", "--limit", 10, "--json").data
    assert data["ids"] == list(range(10))
    assert data["scanned"] < 2000
    assert raymaps("query", small_map, "true", "--limit", 0, "--json").data["ids"] == []


def test_query_of_no_ray(raymaps, small_map):
    data = raymaps("query", small_map, "~true", "--json").data
    assert (data["rays"], data["ids"], data["flux_w"]) == (0, [], 0)
    assert raymaps("query", small_map, "~true").code == 0


def test_paths(raymaps, small_map):
    paths = raymaps("paths", small_map, "--json").data["paths"]
    assert sum(path["rays"] for path in paths) == 2000
    fluxes = [path["flux_w"] for path in paths]
    assert fluxes == sorted(fluxes, reverse=True)
    assert all(set(path) >= {"signature", "rays", "flux_w", "flux_stderr_w"} for path in paths)
    some = raymaps("paths", small_map, "--where", "from(LED)", "--json").data["paths"]
    count = raymaps("query", small_map, "from(LED)", "--json").data["rays"]
    assert sum(path["rays"] for path in some) == count
    assert len(raymaps("paths", small_map, "--limit", 3, "--json").data["paths"]) == 3
    assert raymaps("paths", small_map).code == 0


def test_report_in_every_form(raymaps, small_map, tmp_path):
    text = raymaps("report", small_map, "--where", "hit(Block)", "--limit", 2).out
    assert "Block" in text
    assert "left the scene" in text or "absorbed" in text
    data = raymaps("report", small_map, "--where", "hit(Block)", "--limit", 2, "--json").data
    assert len(data["rays"]) == 2
    for ray in data["rays"]:
        assert set(ray) >= {"ray", "source", "flux_w", "ended", "events"}
        for event in ray["events"]:
            assert len(event["position_mm"]) == 3
            assert len(event["rgb"]) == 3
    for suffix in ("html", "csv", "txt"):
        path = tmp_path / f"r.{suffix}"
        assert raymaps("report", small_map, "--limit", 5, "-o", path).code == 0
        assert path.stat().st_size > 500
    html = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "<table" in html
    with (tmp_path / "r.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert {row["ray"] for row in rows} == {"0", "1", "2", "3", "4"}


def test_detector(raymaps, small_map):
    keys = {"flux_w", "flux_stderr_w", "crossings", "mean_w_per_mm2", "min_w_per_mm2", "max_w_per_mm2", "uniformity"}
    whole = raymaps("detector", small_map, "Around", "--json").data
    assert set(whole) >= keys
    assert whole["flux_w"] > 0
    finer = raymaps("detector", small_map, "Around", "--resolution", "7x5", "--json").data
    assert finer["flux_w"] == pytest.approx(whole["flux_w"], rel=1e-12)
    sources = ["LED", "Lamp", "Spot", "Beam"]
    parts = [raymaps("detector", small_map, "Around", "--source", s, "--json").data["flux_w"] for s in sources]
    assert math.fsum(parts) == pytest.approx(whole["flux_w"], rel=1e-12)
    narrow = raymaps("detector", small_map, "Around", "--max-angle", 10, "--json").data["flux_w"]
    assert 0 <= narrow < whole["flux_w"]
    left = raymaps("detector", small_map, "Around", "--rect=-15,-20,0,20", "--json").data["flux_w"]
    right = raymaps("detector", small_map, "Around", "--rect=0,-20,15,20", "--json").data["flux_w"]
    assert left + right == pytest.approx(whole["flux_w"], rel=1e-9)
    round_ = raymaps("detector", small_map, "Around", "--ellipse", "0,0,5,5", "--json").data
    assert 0 < round_["flux_w"] < whole["flux_w"]
    where = raymaps("detector", small_map, "Around", "--where", "from(LED)", "--json").data["flux_w"]
    assert where == pytest.approx(parts[0], rel=1e-12)
    assert raymaps("detector", small_map, "Around").code == 0


def test_detector_files(raymaps, small_map, tmp_path):
    for suffix in ("png", "csv", "npz"):
        assert raymaps("detector", small_map, "Around", "-o", tmp_path / f"d.{suffix}").code == 0
    assert (tmp_path / "d.png").read_bytes()[:4] == b"\x89PNG"
    flux_w = raymaps("detector", small_map, "Around", "--json").data["flux_w"]
    with np.load(tmp_path / "d.npz", allow_pickle=False) as data:
        assert any(np.isclose(data[name].sum(), flux_w) for name in data.files if data[name].dtype.kind == "f")


def test_explain(raymaps, small_scene):
    effects = raymaps("explain", small_scene, "--json").data["effects"]
    needed = {e["name"] for e in effects if e["needed"]}
    assert {"absorber", "mirror", "lambertian", "fresnel", "crossings", "medium_absorption", "mixture"} == needed
    assert all(set(e) >= {"name", "needed", "because"} for e in effects)
    assert any("'Chip'" in reason for e in effects for reason in e["because"])
    assert "fresnel" in raymaps("explain", small_scene).out
    surfaces = raymaps("explain", small_scene, "--json").data["surfaces"]
    assert (surfaces["exact"], surfaces["faceted"], len(surfaces["because"])) == (0, 26, 1)


def test_check_of_a_scene_and_of_a_map(raymaps, small_scene, small_map):
    for path in (small_scene, small_map):
        data = raymaps("check", path, "--json").data
        assert data["sound"] is True
        assert all(set(f) >= {"severity", "text"} for f in data["findings"])
        done = raymaps("check", path)
        assert done.code == 0
        assert "sound" in done.out
    assert "open shell" in raymaps("check", small_scene).out


def test_view(raymaps, small_scene, small_map, tmp_path):
    pytest.importorskip("pyvista")
    done = raymaps("view", small_map, "--where", "hit(Block)", "-o", tmp_path / "v.png")
    assert done.code == 0, done.err
    assert (tmp_path / "v.png").read_bytes()[:4] == b"\x89PNG"
    assert (tmp_path / "v.png").stat().st_size > 3000
    assert raymaps("view", small_scene, "-o", tmp_path / "s.png").code == 0


def test_schema(raymaps):
    done = raymaps("schema")
    assert done.code == 0
    assert json.loads(done.out) == scene_json_schema()


def test_names_that_are_not_ascii_are_printed_as_they_are(raymaps, tmp_path):
    from tests.store.small_scenes import lamp_in_a_room, write_scene

    data = lamp_in_a_room(tmp_path)
    data["sources"]['Glühlampe "2", ☀'] = data["sources"].pop("Lamp")
    scene = write_scene(tmp_path, data)
    path = tmp_path / "ü ö.raymap"
    assert raymaps("trace", scene, "-o", path, "--rays", 50).code == 0
    assert raymaps("info", path, "--json").data["names"]["sources"] == ['Glühlampe "2", ☀']
    assert "Glühlampe" in raymaps("info", path).out
