# SPDX-License-Identifier: LGPL-2.1-or-later
"""A scene's portions traced in threads and stored, with progress, until all are there, time is up, or it is stopped."""

from __future__ import annotations

import copy
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from raymaps.errors import Interrupted
from raymaps.store import MapWriter, Portion, RayMap, Stored
from raymaps.traced import FaceIndex

if TYPE_CHECKING:
    from raymaps.compile import CompiledScene

__all__ = ["Progress", "Runner", "Watch"]

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Progress:
    """How far a run is; ``rays`` counts all that are stored, also by an earlier run.

    Of a run to a target ``of`` and ``remaining_s`` are those of the target, as predicted, and ``error`` is the relative
    error so far; ``pilot_rays`` and ``pilot_hits`` count its pilot, while that runs.
    """

    rays: int
    of: int
    elapsed_s: float
    remaining_s: float | None
    error: float | None = None
    pilot_rays: int | None = None
    pilot_hits: int | None = None


class Watch(Protocol):
    """Sees each portion that is stored; only to tell how far the run is."""

    def see(self, portion: Portion) -> None:
        """Called in the thread that traced it."""

    def error(self) -> float | None:
        """Relative error so far."""


class Runner:
    """What it takes to trace portions of one map.

    Parameters
    ----------
    compiled : CompiledScene
    path : Path
        Of the map, which exists.
    seed, threads : int
    store : function that returns how light is stored
    stop : threading.Event
        Once set, no further portion is begun.
    started : float
        `time.monotonic` when the run began.
    time_limit_s : float or None
        No further portion is begun once the run is so old.
    on_progress, on_note : functions or None
    """

    def __init__(
        self,
        compiled: CompiledScene,
        path: Path,
        seed: int,
        *,
        threads: int,
        store: Callable[[], Stored],
        stop: threading.Event,
        started: float,
        time_limit_s: float | None = None,
        on_progress: Callable[[Progress], None] | None = None,
        on_note: Callable[[str], None] | None = None,
    ):
        from raymaps.trace import Tracer  # imports the kernels

        self.path = path
        self.seed = seed
        self.time_limit_s = time_limit_s
        self.seconds_per_ray: float | None = None
        tables = compiled.tables
        self.writer = MapWriter(path, FaceIndex(tables.triangle_face, tables.face_body, tables.face_surface))
        self._tracer = Tracer(compiled, seed)
        self._threads, self._store, self._stop, self._started = threads, store, stop, started
        self._on_progress, self.note = on_progress or (lambda at: None), on_note or (lambda text: None)

    @property
    def elapsed_s(self) -> float:
        """Age of the run."""
        return time.monotonic() - self._started

    @property
    def is_late(self) -> bool:
        """Whether its time is up."""
        return self.time_limit_s is not None and self.elapsed_s >= self.time_limit_s

    def to(self, n_rays: int, watch: Watch | None = None) -> RayMap:
        """Trace what the map lacks of its first ``n_rays``; less if time is up, but at least one portion of a new map.

        Raises
        ------
        Interrupted
            If ``stop`` was set before all were traced.
        """
        raymap = RayMap.open(self.path)
        stored = before = raymap.n_rays
        present = sum(max(0, min(p.first_ray + p.n_rays, n_rays) - p.first_ray) for p in raymap.portions)
        total = stored + n_rays - min(present, n_rays)
        began_s = self.elapsed_s

        def trace_and_store(piece: tuple[int, int]) -> int:
            summary = self.writer.write(self._tracer.trace_portion(*piece), self._store())
            if watch is not None:
                watch.see(self.writer.portion(summary))
            return piece[1]

        def has_to_end(begun: int) -> bool:
            return self._stop.is_set() or (self.is_late and before + begun > 0)

        self._on_progress(Progress(stored, total, began_s, None, watch.error() if watch else None))
        missing = raymap.missing_rays(n_rays)
        for n in _in_threads(trace_and_store, missing, self._threads, has_to_end):
            stored += n
            elapsed_s = self.elapsed_s
            self.seconds_per_ray = (elapsed_s - began_s) / (stored - before)
            remaining_s = self.seconds_per_ray * (total - stored)
            if self.time_limit_s is not None:
                remaining_s = min(remaining_s, max(self.time_limit_s - elapsed_s, 0.0))
            error = watch.error() if watch else None
            self._on_progress(Progress(stored, total, elapsed_s, remaining_s, error))
        if stored < total and self._stop.is_set():
            raise Interrupted(f"Stopped after {stored} of {total} rays; go on with --resume.")
        return RayMap.open(self.path)

    def apart(self, pieces: Iterable[tuple[int, int]], seed: int, see: Callable[[Portion], Result]) -> list[Result]:
        """What one sees in portions (first ray, number) of another seed, which are thrown away; in their order.

        Raises
        ------
        Interrupted
            If ``stop`` was set.
        """
        tracer = copy.copy(self._tracer)
        tracer.seed = seed

        def trace_and_see(piece: tuple[int, int]) -> tuple[int, Result]:
            portion = self.writer.apart(tracer.trace_portion(*piece), self._store(), Path(folder))
            seen = see(portion)
            shutil.rmtree(portion.folder, ignore_errors=True)
            return piece[0], seen

        with tempfile.TemporaryDirectory(prefix="raymaps-pilot-") as folder:
            found = dict(_in_threads(trace_and_see, iter(pieces), self._threads, lambda begun: self._stop.is_set()))
        if self._stop.is_set():
            raise Interrupted("Stopped in the pilot; go on with --resume.")
        return [found[first] for first in sorted(found)]

    def tell_pilot(self, rays: int, hits: int, error: float | None, most: int) -> None:
        """Tell how far the pilot is."""
        self._on_progress(Progress(0, most, self.elapsed_s, None, error, rays, hits))


def _in_threads(
    work: Callable[[Item], Result], items: Iterator[Item], threads: int, has_to_end: Callable[[int], bool]
) -> Iterator[Result]:
    """Results of the work as they come; a failure, or having to end, lets only what has begun come to its end.

    ``has_to_end`` is asked before each item, with how many were begun.
    """
    begun = 0
    with ThreadPoolExecutor(threads, thread_name_prefix="trace") as pool:
        running: set[Future[Result]] = set()
        while True:
            while len(running) < threads and not has_to_end(begun) and (item := next(items, None)) is not None:
                running.add(pool.submit(work, item))
                begun += 1
            if not running:
                return
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
