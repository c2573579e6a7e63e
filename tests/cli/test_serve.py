# SPDX-License-Identifier: LGPL-2.1-or-later
"""``raymaps serve``: JSON-RPC 2.0, one object a line; each method answers what the command line prints."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from raymaps.errors import MapError
from raymaps.serve import METHODS, serve
from raymaps.store import RayMap
from tests.cli.conftest import process


@pytest.fixture
def ask(small_map) -> Callable[..., list[dict[str, Any]]]:
    """Send lines (text, or data that becomes JSON) to a server in this process; returns its answers."""

    def send(*lines: Any) -> list[dict[str, Any]]:
        texts = [line if isinstance(line, str) else json.dumps(line) for line in lines]
        answers = io.StringIO()
        serve(small_map, io.StringIO("".join(text + "\n" for text in texts)), answers)
        found = [json.loads(line) for line in answers.getvalue().splitlines()]
        for answer in found:
            assert answer["jsonrpc"] == "2.0"
            assert "id" in answer
            assert ("result" in answer) != ("error" in answer)
        return found

    return send


@pytest.fixture
def call(ask) -> Callable[..., dict[str, Any]]:
    """The result of one method."""

    def one(method: str, **params: Any) -> dict[str, Any]:
        (answer,) = ask({"jsonrpc": "2.0", "id": 1, "method": method, "params": params})
        assert "result" in answer, answer
        return answer["result"]

    return one


@pytest.fixture
def error(ask) -> Callable[..., dict[str, Any]]:
    """The error of one method."""

    def one(method: str, params: Any) -> dict[str, Any]:
        (answer,) = ask({"jsonrpc": "2.0", "id": "x", "method": method, "params": params})
        assert answer["id"] == "x"
        message = answer["error"]["message"]
        assert "\n" not in message
        assert "Traceback" not in message
        assert 0 < len(message) < 600
        return answer["error"]

    return one


# ---------------------------------------------------------------------------------------------------------------------
# Each method


def test_info(call, raymaps, small_map):
    assert call("info") == raymaps("info", small_map, "--json").data


def test_query(call, raymaps, small_map):
    assert call("query", criterion="hit(Block)") == raymaps("query", small_map, "hit(Block)", "--json").data
    limited = call("query", criterion="true", limit=3)
    assert limited["ids"] == [0, 1, 2]


def test_report(call, small_map):
    result = call("report", criterion="hit(Block)", limit=4)
    assert len(result["rays"]) == 4
    assert "<table" in result["html"]
    for ray in result["rays"]:
        assert set(ray) >= {"ray", "source", "flux_w", "ended", "events"}
        assert ray["events"][0]["kind"] == "emission"
        for event in ray["events"]:
            assert set(event) >= {
                "kind", "text", "body", "face", "surface", "medium", "position_mm", "rgb", "flux_left_w", "detectors",
            }  # fmt: skip
        left = [event["flux_left_w"] for event in ray["events"]]
        assert all(after <= before * (1 + 1e-6) for before, after in zip(left, left[1:], strict=False))
        assert left[0] == pytest.approx(ray["flux_w"])
    assert len(call("report", limit=1)["rays"]) == 1


def test_paths(call, raymaps, small_map):
    assert call("paths") == raymaps("paths", small_map, "--json").data
    assert (
        call("paths", criterion="from(LED)", limit=2)
        == raymaps("paths", small_map, "--where", "from(LED)", "--limit", 2, "--json").data
    )


def test_detector(call, raymaps, small_map, tmp_path):
    assert call("detector", name="Around") == raymaps("detector", small_map, "Around", "--json").data
    parameters = {
        "name": "Around", "resolution": [7, 5], "max_angle_deg": 30, "source": "LED", "criterion": "hit(Mirror)",
        "rect": [-10, -10, 10, 10],
    }  # fmt: skip
    printed = raymaps(
        "detector", small_map, "Around", "--resolution", "7x5", "--max-angle", 30, "--source", "LED", "--where",
        "hit(Mirror)", "--rect=-10,-10,10,10", "--json",
    )  # fmt: skip
    assert call("detector", **parameters) == printed.data
    round_ = call("detector", name="Around", ellipse=[0, 0, 5, 5], file=str(tmp_path / "d.csv"))
    assert round_["flux_w"] > 0
    assert (tmp_path / "d.csv").stat().st_size > 100


def test_overlay(call, small_map, tmp_path):
    """n * 6 float32, then n uint32; every segment starts and ends at events of matching rays."""
    path = tmp_path / "segments.bin"
    result = call("overlay", criterion="hit(Block)", max_rays=50, file=str(path))
    assert result["file"] == str(path)
    assert 0 < result["rays"] <= 50
    n = result["segments"]
    data = path.read_bytes()
    assert len(data) == n * 28
    segments = np.frombuffer(data, "<f4", 6 * n).reshape(n, 2, 3)
    colours = np.frombuffer(data, "<u4", n, 24 * n)
    assert np.isfinite(segments).all()
    assert (colours & 0xFF > 0).all()  # opaque enough to be seen
    raymap = RayMap.open(small_map)
    ids = call("query", criterion="hit(Block)", limit=result["rays"])["ids"]
    points = set()
    for portion in raymap.portions:
        for ray in ids:
            at = ray - portion.first_ray
            if 0 <= at < portion.n_rays:
                rows = slice(portion.event_offsets[at], portion.event_offsets[at + 1])
                points |= {tuple(p) for p in portion.position_mm[rows].astype(np.float32).tolist()}
    assert {tuple(p) for p in segments.reshape(-1, 3).tolist()} <= points


def test_overlay_of_nothing(call, tmp_path):
    result = call("overlay", criterion="~true", file=str(tmp_path / "none.bin"))
    assert (result["segments"], result["rays"]) == (0, 0)
    assert (tmp_path / "none.bin").read_bytes() == b""


def test_overlay_keeps_to_its_limits(call, tmp_path):
    few = call("overlay", max_segments=7, file=str(tmp_path / "a.bin"))
    assert few["segments"] <= 7
    assert call("overlay", max_rays=2, file=str(tmp_path / "b.bin"))["rays"] == 2


def test_names_of_methods():
    assert set(METHODS) == {"info", "query", "report", "paths", "detector", "overlay"}


# ---------------------------------------------------------------------------------------------------------------------
# Errors by their codes


@pytest.mark.parametrize(
    ("method", "params", "fragment"),
    [
        ("query", {"criterion": "hit("}, ""), ("query", {"criterion": "hit(Lid)"}, "'Block'"),
        ("query", {"criterion": "true", "limit": -1}, "-1"), ("query", {"criterion": "~" * 100_000 + "true"}, ""),
        ("detector", {"name": "Eye"}, "'Around'"), ("detector", {"name": "Around", "source": "Sun"}, "'LED'"),
        ("detector", {"name": "Around", "file": "/nowhere/d.csv"}, "/nowhere"),
        ("detector", {"name": "Around", "file": "d.docx"}, ".csv"),
        ("detector", {"name": "Around", "resolution": [0, 5]}, ""),
        ("detector", {"name": "Around", "rect": [1, 1, 0, 0]}, ""),
        ("overlay", {"file": "/nowhere/o.bin"}, "/nowhere"), ("report", {"criterion": "ended(well)"}, "left"),
        ("paths", {"criterion": "from(Sun)"}, "'LED'"),
    ],
)  # fmt: skip
def test_what_a_user_can_cause_is_32000(error, method, params, fragment):
    found = error(method, params)
    assert found["code"] == -32000
    assert fragment in found["message"]


@pytest.mark.parametrize(
    ("method", "params"),
    [
        ("query", {}), ("query", {"criterion": "true", "limits": 3}), ("query", {"criterion": "true", "limit": "many"}),
        ("query", [1, 2]), ("query", "true"), ("query", 3), ("query", {"criterion": 5}),
        ("query", {"criterion": ["true"]}),
        ("detector", {}), ("detector", {"name": "Around", "rect": [1, 2, 3]}),
        ("detector", {"name": "Around", "rect": "wide"}), ("detector", {"name": "Around", "resolution": 7}),
        ("detector", {"name": "Around", "resolution": ["a", "b"]}), ("detector", {"name": "Around", "resolution": [7]}),
        ("detector", {"name": "Around", "max_angle_deg": "wide"}), ("detector", {"name": 3}),
        ("detector", {"name": ["Around"]}), ("detector", {"name": {"a": 1}}),
        ("detector", {"name": "Around", "file": 3}),
        ("overlay", {}), ("overlay", {"file": 3}), ("overlay", {"file": "x.bin", "max_rays": "all"}),
        ("report", {"limit": "all"}), ("report", {"limit": [3]}), ("paths", {"limit": {}}), ("info", {"more": 1}),
        ("query", {"criterion": {"kind": "hit"}}), ("detector", {"name": "Around", "ellipse": [[], 0, 1, 1]}),
    ],
    ids=str,
)  # fmt: skip
def test_params_that_do_not_fit_are_told(error, method, params, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert error(method, params)["code"] in (-32602, -32000)
    assert list(tmp_path.iterdir()) == []


def test_params_of_a_wrong_type_are_32602(error):
    assert error("query", {})["code"] == -32602
    assert error("query", [1, 2])["code"] == -32602
    assert error("info", {"more": 1})["code"] == -32602
    assert error("overlay", {})["code"] == -32602


@pytest.mark.parametrize("method", ["fly", "", "__init__", "serve", "Query"])
def test_unknown_methods_are_32601(error, method):
    found = error(method, {})
    assert found["code"] == -32601
    assert "query" in found["message"]


@pytest.mark.parametrize(
    "line", ["{", "hello", "[1,", "\x00", "{'id': 1}", "[" * 100_000, '{"a": ' * 50_000, "9" * 5000, "nul"]
)
def test_lines_that_are_not_json_are_32700(ask, line):
    (answer,) = ask(line)
    assert answer["error"]["code"] == -32700
    assert answer["id"] is None


@pytest.mark.parametrize("line", ["[]", "3", "null", '"info"', "{}", '{"id": 1}', '{"id": 1, "method": 7}', "[{}]"])
def test_lines_that_are_no_request_are_32600(ask, line):
    (answer,) = ask(line)
    assert answer["error"]["code"] == -32600


def test_empty_lines_are_passed_over(ask):
    (answer,) = ask("", "   ", {"id": 1, "method": "info"}, "")
    assert answer["id"] == 1


def test_an_error_does_not_end_the_server(ask):
    answers = ask("{", {"id": 1, "method": "fly"}, {"id": 2, "method": "query", "params": {"criterion": "("}},
                  {"id": 3, "method": "query", "params": {"criterion": "true"}})  # fmt: skip
    assert [answer["id"] for answer in answers] == [None, 1, 2, 3]
    assert answers[3]["result"]["rays"] == 2000


@pytest.mark.parametrize("identity", [0, -3, "text", None, 1.5, 2**70])
def test_the_id_comes_back_as_it_was(ask, identity):
    (answer,) = ask({"jsonrpc": "2.0", "id": identity, "method": "info"})
    assert answer["id"] == identity


@pytest.mark.parametrize("params", [None, {}])
def test_params_may_be_left_out(ask, params):
    (answer,) = ask({"id": 1, "method": "info", **({} if params is None else {"params": params})})
    assert answer["result"]["rays"] == 2000


# ---------------------------------------------------------------------------------------------------------------------
# Notifications and the end


def test_a_notification_is_not_answered(ask):
    """A request without an id, whether it goes well or not."""
    answers = ask(
        {"method": "info"}, {"method": "query", "params": {"criterion": "("}}, {"method": "fly"},
        {"method": "query", "params": [1]}, {"id": 9, "method": "info"},
    )  # fmt: skip
    assert [answer["id"] for answer in answers] == [9]


def test_shutdown_answers_and_ends(ask):
    answers = ask({"id": 1, "method": "shutdown"}, {"id": 2, "method": "info"})
    assert answers == [{"jsonrpc": "2.0", "id": 1, "result": {}}]


def test_shutdown_as_a_notification_ends_without_an_answer(ask):
    assert ask({"method": "shutdown"}, {"id": 2, "method": "info"}) == []


def test_a_map_that_can_not_be_opened(tmp_path):
    with pytest.raises(MapError):
        serve(tmp_path / "none.raymap", io.StringIO(""), io.StringIO())


# ---------------------------------------------------------------------------------------------------------------------
# As a process


def test_as_a_process(small_map):
    child = process("serve", small_map, stdin=subprocess.PIPE)
    try:
        for i, criterion in enumerate(("hit(Block)", "hit(((", "hit(Glühlampe)")):
            child.stdin.write(json.dumps({"id": i, "method": "query", "params": {"criterion": criterion}}) + "\n")
            child.stdin.flush()
            answer = json.loads(child.stdout.readline())  # comes at once, not at the end
            assert answer["id"] == i
            assert ("result" in answer) == (i == 0)
        child.stdin.write('{"id": 9, "method": "shutdown"}\n')
        out, err = child.communicate(timeout=30)
    finally:
        child.kill()
    assert json.loads(out)["id"] == 9
    assert err == ""
    assert child.returncode == 0


def test_end_of_input_ends_the_process(small_map):
    child = process("serve", small_map, stdin=subprocess.PIPE)
    out, err = child.communicate(timeout=30)
    assert (child.returncode, out, err) == (0, "", "")


def test_bytes_that_are_not_utf8_do_not_end_the_process(small_map):
    child = process("serve", small_map, stdin=subprocess.PIPE)
    os.write(child.stdin.fileno(), b'\xff\xfe{"id": 1}\n{"id": 2, "method": "info"}\n')
    out, err = child.communicate(timeout=30)
    assert child.returncode == 0, err
    answers = [json.loads(line) for line in out.splitlines()]
    assert answers[0]["error"]["code"] == -32700
    assert answers[-1]["result"]["rays"] == 2000


def test_a_reader_that_goes_away_ends_the_process_quietly(small_map):
    child = process("serve", small_map, stdin=subprocess.PIPE)
    child.stdout.close()
    child.stdin.write('{"id": 1, "method": "info"}\n{"id": 2, "method": "info"}\n')
    child.stdin.close()
    err = child.stderr.read()
    child.stderr.close()
    assert child.wait(30) in (0, 1, -signal.SIGPIPE)
    assert "Traceback" not in err
