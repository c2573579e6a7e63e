# SPDX-License-Identifier: LGPL-2.1-or-later
"""How fast a map is opened and asked, beside DuckDB and Polars over its files in the same rounds."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from benchmarks.questions import QUESTIONS, area_question, steps_of
from benchmarks.rivals import DuckDb, PolarsFrames, best_form
from benchmarks.timing import Timing, alternate, repeat
from raymaps.criterion import query
from raymaps.store import RayMap

__all__ = ["CONTESTANTS", "Answer", "Opening", "measure_answers", "measure_opening"]

#: Who answers: Ray Maps, DuckDB, Polars; from the files as they lie there, or with everything in memory already.
CONTESTANTS = tuple(f"{who}, {where}" for where in ("files", "memory") for who in ("Ray Maps", "DuckDB", "Polars"))


@dataclass(frozen=True)
class Opening:
    """Time to open a map in process, and of ``raymaps info`` as a whole process."""

    scene: str
    rays: int
    open: Timing
    info_process: Timing


@dataclass(frozen=True)
class Answer:
    """One question to one map; timings by contestant, forms that the rivals chose."""

    scene: str
    rays: int
    criterion: str
    n_events: int
    is_area: bool
    found: int
    timings: dict[str, Timing]
    forms: dict[str, str]


def measure_opening(raymap: RayMap, repeats: int) -> Opening:
    """Files are in the system's cache; the process starts from nothing else."""
    command = [sys.executable, "-m", "raymaps", "info", str(raymap.path)]
    opened, _ = repeat(lambda: RayMap.open(raymap.path), 5 * repeats)
    process, _ = repeat(lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL), repeats)
    return Opening(raymap.scene.name, raymap.n_rays, opened, process)


def measure_answers(raymap: RayMap, threads: int, repeats: int) -> list[Answer]:
    """One event, two to all of the scene's events, and an area of a detector; raises if counts differ."""
    questions = QUESTIONS[raymap.scene.name]
    duck, frames = DuckDb(raymap, threads), PolarsFrames(raymap)
    duck.load()
    frames.load()
    loaded = RayMap.open(raymap.path)
    rivals: dict[str, DuckDb | PolarsFrames] = {"DuckDB": duck, "Polars": frames}
    criteria = [questions.first(n) for n in range(1, len(questions.events) + 1)] + [questions.area]
    answers = []
    for index, criterion in enumerate(criteria):
        is_area = index == len(questions.events)
        contestants: dict[str, Callable[[], int]] = {
            "Ray Maps, files": partial(_ask_files, raymap, criterion),
            "Ray Maps, memory": partial(_ask, loaded, criterion),
        }
        chosen = {}
        for who, rival in rivals.items():
            for where in ("files", "memory"):
                if is_area:
                    forms = rival.area(area_question(criterion, raymap.names, raymap.scene), where)
                else:
                    forms = rival.steps(steps_of(criterion, raymap.names), where)
                chosen[f"{who}, {where}"], contestants[f"{who}, {where}"] = best_form(forms)
        timings, counts = alternate({name: contestants[name] for name in CONTESTANTS}, repeats)
        if len(set(counts.values())) != 1:
            raise AssertionError(f"{raymap.scene.name}: {criterion}: the contestants differ: {counts}")
        n_events = 1 if is_area else index + 1
        found = counts["Ray Maps, memory"]
        answers.append(Answer(raymap.scene.name, raymap.n_rays, criterion, n_events, is_area, found, timings, chosen))
    return answers


def _ask(raymap: RayMap, criterion: str) -> int:
    return query(raymap, criterion).rays


def _ask_files(raymap: RayMap, criterion: str) -> int:
    return query(RayMap.open(raymap.path), criterion).rays
