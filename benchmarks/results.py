# SPDX-License-Identifier: LGPL-2.1-or-later
"""How fast results come out of a map whose columns were loaded by an earlier question."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.questions import QUESTIONS
from benchmarks.timing import Timing, repeat
from raymaps.results.detector import evaluate_detector
from raymaps.results.overlay import overlay
from raymaps.results.paths import distinct_paths
from raymaps.results.report import report
from raymaps.store import RayMap

__all__ = ["ResultTime", "measure_results"]

OVERLAY_RAYS, REPORT_RAYS = 10_000, 20
#: A limit that no overlay of the rays above reaches.
OVERLAY_SEGMENTS = 10_000_000


@dataclass(frozen=True)
class ResultTime:
    """One result: what it was made of, first with loading (where that was measured), then with columns loaded."""

    scene: str
    name: str
    amount: str
    amount_number: int
    first: Timing | None
    again: Timing


def measure_results(raymap: RayMap, repeats: int, folder: Path) -> list[ResultTime]:
    """Detector re-binned, overlay, path table, report; and an overlay asked of `raymaps serve`."""
    questions = QUESTIONS[raymap.scene.name]
    where, detector = questions.first(1), questions.detector
    n_x, n_y = raymap.scene.detectors[detector].resolution
    works: dict[str, tuple[Callable[[RayMap], Any], Callable[[Any], tuple[int, str]]]] = {
        "detector re-binned": (
            lambda m: evaluate_detector(m, detector, resolution=(2 * n_x, 2 * n_y), max_angle_deg=80.0),
            lambda d: (d.crossings, "crossings"),
        ),
        "detector re-binned where a criterion holds": (
            lambda m: evaluate_detector(m, detector, resolution=(2 * n_x, 2 * n_y), max_angle_deg=80.0, where=where),
            lambda d: (d.crossings, "crossings"),
        ),
        "overlay of 10 000 rays": (
            lambda m: overlay(m, where, OVERLAY_RAYS, OVERLAY_SEGMENTS),
            lambda o: (o.n_segments, "segments"),
        ),
        "path table, the 30 largest": (lambda m: distinct_paths(m, limit=30), lambda t: (t.n_paths, "paths")),
        "path table, all paths": (lambda m: distinct_paths(m), lambda t: (t.n_paths, "paths")),
        "report of 20 rays as HTML": (
            lambda m: report(m, where, REPORT_RAYS).to_html(),
            lambda html: (len(html), "bytes"),
        ),
    }
    loaded = RayMap.open(raymap.path)
    results = []
    for name, (work, count) in works.items():
        first, _ = repeat(lambda work=work: work(RayMap.open(raymap.path)), 1)  # type: ignore[misc]
        again, result = repeat(lambda work=work: work(loaded), repeats)  # type: ignore[misc]
        number, unit = count(result)
        results.append(ResultTime(raymap.scene.name, name, f"{number} {unit}", number, first, again))
    results.append(_overlay_of_server(raymap, where, repeats, folder / "overlay.bin"))
    return results


def _overlay_of_server(raymap: RayMap, where: str, repeats: int, file: Path) -> ResultTime:
    """A request to `raymaps serve` until its answer is read and the file is there, as the workbench asks it."""
    server = subprocess.Popen(
        [sys.executable, "-m", "raymaps", "serve", str(raymap.path)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    requests, answers = server.stdin, server.stdout
    assert requests is not None
    assert answers is not None

    def ask(method: str, **params: Any) -> dict[str, Any]:
        request = {"jsonrpc": "2.0", "id": 1, "method": method, "params": params}
        print(json.dumps(request), file=requests, flush=True)
        answer = json.loads(answers.readline())
        if "error" in answer:
            raise RuntimeError(answer["error"]["message"])
        return answer["result"]

    def ask_overlay() -> dict[str, Any]:
        limits = {"max_rays": OVERLAY_RAYS, "max_segments": OVERLAY_SEGMENTS}
        answer = ask("overlay", criterion=where, file=str(file), **limits)
        file.read_bytes()
        return answer

    try:
        again, answer = repeat(ask_overlay, repeats)
        ask("shutdown")
    finally:
        requests.close()
        server.wait(timeout=10)
    amount = f"{answer['segments']} segments"
    return ResultTime(
        raymap.scene.name, "overlay of 10 000 rays, asked of `raymaps serve`", amount, answer["segments"], None, again
    )
