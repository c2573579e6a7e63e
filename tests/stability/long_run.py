# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays into the shipped examples without storing them: how many are lost, and where.

    python -m tests.stability.long_run --rays 1e8 [--threads 2] [--seed 1] [SCENE ...]

A ray is lost if it is killed for a numerical reason, meets the boundary of a medium that it is not in, or leaves the
scene from within a body.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from raymaps.compile import CompiledScene, compile_scene
from raymaps.kinds import EventKind
from raymaps.scene import load_scene
from raymaps.trace import Tracer
from raymaps.traced import TracedPortion

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PORTION_RAYS = 65_536
#: Lost rays whose last events are told.
MAX_TOLD = 5


def losses(compiled: CompiledScene, portion: TracedPortion) -> dict[str, np.ndarray]:
    """Rays of a portion that are lost, as numbers within it, by how."""
    last = portion.event_offsets[1:] - 1
    kind, medium = portion.kind[last], portion.medium[last]
    ambient = int(compiled.tables.ambient[0])
    return {
        "numerical": np.flatnonzero(kind == EventKind.KILLED_NUMERICAL),
        "mismatch": np.flatnonzero(kind == EventKind.KILLED_MEDIUM_MISMATCH),
        "slipped": np.flatnonzero((kind == EventKind.LEFT) & (medium != ambient)),
    }


def trace_and_count(
    scene: Path, rays: int, *, threads: int, seed: int
) -> Iterator[tuple[int, int, Counter[str], list[str]]]:
    """Rays and events so far, how many are lost in each way, and what happened to the first, after each portion."""
    compiled = compile_scene(load_scene(scene))
    tracer = Tracer(compiled, seed)
    done, events, counts, told = 0, 0, Counter({"numerical": 0, "mismatch": 0, "slipped": 0}), list[str]()

    def portion(first: int) -> tuple[int, int, dict[str, np.ndarray], list[str]]:
        traced = tracer.trace_portion(first, min(PORTION_RAYS, rays - first))
        lost = losses(compiled, traced)
        words = [f"ray {first + ray}, {how}: {_history(traced, ray)}" for how, found in lost.items() for ray in found]
        return len(traced.event_offsets) - 1, len(traced.kind), lost, words[:MAX_TOLD]

    with ThreadPoolExecutor(threads) as pool:
        # a few portions at a time: a hundred million rays of them are not to wait in memory
        starts = iter(range(0, rays, PORTION_RAYS))
        while batch := list(itertools.islice(starts, 4 * threads)):
            for n_rays, n_events, lost, words in pool.map(portion, batch):
                done, events = done + n_rays, events + n_events
                counts.update({how: len(found) for how, found in lost.items()})
                told = (told + words)[:MAX_TOLD]
                yield done, events, counts, told


def _history(portion: TracedPortion, ray: int) -> str:
    """The last events of a ray."""
    rows = range(portion.event_offsets[ray], portion.event_offsets[ray + 1])[-3:]
    return ", ".join(
        f"{EventKind(portion.kind[row]).label} at {np.round(portion.position_mm[row].astype(float), 4).tolist()}"
        for row in rows
    )


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", type=Path, default=sorted(EXAMPLES.glob("*.scene.json")))
    parser.add_argument("--rays", type=lambda text: int(float(text)), default=10_000_000, help="of each scene")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    all_lost = 0
    for scene in given.scenes:
        started, shown = time.monotonic(), 0.0
        state = None
        for state in trace_and_count(scene, given.rays, threads=given.threads, seed=given.seed):
            if time.monotonic() - shown > 10:
                shown = time.monotonic()
                _tell(scene, state, started, "\r" if sys.stdout.isatty() else "\n")
        assert state is not None
        _tell(scene, state, started, "\n")
        for words in state[3]:
            print(f"  {words}")
        all_lost += sum(state[2].values())
    return 1 if all_lost else 0


def _tell(scene: Path, state: tuple[int, int, Counter[str], list[str]], started: float, end: str) -> None:
    done, events, counts, _ = state
    lost = ", ".join(f"{n} {how}" for how, n in counts.items())
    rate = done / (time.monotonic() - started)
    print(f"{scene.name}: {done:,} rays, {events:,} events, {rate:,.0f} rays/s; lost: {lost}", end=end, flush=True)


if __name__ == "__main__":
    sys.exit(main())
