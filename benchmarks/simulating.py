# SPDX-License-Identifier: LGPL-2.1-or-later
"""How fast a scene is simulated and stored, beside a bare Embree loop over the same rays.

One pass of the tracer records the float32 rays of every search that it hands to Embree. The bare loop then does
nothing but these searches, portion by portion, on as many threads, and takes turns with the tracer.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.timing import Timing, alternate, repeat
from raymaps.compile import CompiledScene, compile_scene
from raymaps.intersect import Intersector
from raymaps.run import simulate
from raymaps.scene import Scene
from raymaps.store import Manifest, MapWriter, RayMap
from raymaps.trace import Tracer
from raymaps.traced import FaceIndex

__all__ = ["Speed", "measure_speed"]

Batch = tuple[NDArray[np.float32], NDArray[np.float32]]
Span = tuple[int, int]

#: So many portions share the rays: of a quarter million rays each is as large as in a run of a million.
N_PORTIONS = 8


@dataclass(frozen=True)
class Speed:
    """Seconds for one scene and one number of threads; ``searches`` counts the rays handed to Embree."""

    scene: str
    threads: int
    rays: int
    segments: int
    searches: int
    portion_rays: int
    prepare: Timing
    embree: Timing
    trace: Timing
    store: Timing


class _Recorder:
    """Stands before an `Intersector` and keeps what it is asked, batch by batch."""

    def __init__(self, intersector: Intersector):
        self._intersector = intersector
        self.batches: list[Batch] = []

    def find(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32]
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        self.batches.append((origin.copy(), direction.copy()))
        return self._intersector.find(origin, direction)


def measure_speed(scene: Scene, rays: int, threads: tuple[int, ...], repeats: int, folder: Path) -> list[Speed]:
    """Trace alone, trace and store, and bare Embree, at each number of threads."""
    portion_rays = -(-rays // N_PORTIONS)
    first = simulate(scene, folder / "first.raymap", rays=rays, portion_rays=portion_rays)  # also compiles the kernels
    spans = [(portion.first_ray, portion.n_rays) for portion in first.portions]
    manifest, content = first.manifest, first.content_hash
    segments = first.n_events - first.n_rays
    shutil.rmtree(first.path)

    compiled = compile_scene(scene)
    seed = manifest.seed
    prepare, _ = repeat(lambda: Tracer(compile_scene(scene), seed), 3)
    tracer = Tracer(compiled, seed)
    recorded = _record(compiled, seed, spans)
    embree = tracer._intersector._all._scene  # the very scene that the tracer searches
    assert embree is not None
    path = folder / "timed.raymap"

    def bare(n_threads: int) -> None:
        def search(batches: list[Batch]) -> None:
            for origin, direction in batches:
                embree.run(origin, direction, output=True)

        _in_threads(search, recorded, n_threads)

    def trace(n_threads: int) -> None:
        _in_threads(lambda span: tracer.trace_portion(*span).first_ray, spans, n_threads)

    def trace_and_store(n_threads: int) -> None:
        writer = _writer(path, manifest, compiled)
        _in_threads(lambda span: writer.write(tracer.trace_portion(*span)).first_ray, spans, n_threads)

    result = []
    for n in threads:
        contestants = {"embree": partial(bare, n), "trace": partial(trace, n), "store": partial(trace_and_store, n)}
        timings, _ = alternate(contestants, repeats, prepare=lambda: shutil.rmtree(path, ignore_errors=True))
        if not path.exists():  # another contestant came last
            trace_and_store(n)
        if RayMap.open(path).content_hash != content:
            raise AssertionError(f"{scene.name}: what was timed is not what `simulate` stores")
        n_searches = sum(len(origin) for batches in recorded for origin, _ in batches)
        result.append(
            Speed(
                scene.name, n, rays, segments, n_searches, spans[0][1], prepare,
                timings["embree"], timings["trace"], timings["store"],
            )
        )  # fmt: skip
    shutil.rmtree(path)
    return result


def _record(compiled: CompiledScene, seed: int, spans: list[Span]) -> list[list[Batch]]:
    """For each portion, the batches of rays that Embree is asked about."""
    tracer = Tracer(compiled, seed)
    recorder = _Recorder(tracer._intersector)
    tracer._intersector = recorder  # type: ignore[assignment]
    recorded = []
    for span in spans:
        tracer.trace_portion(*span)
        recorded.append(recorder.batches)
        recorder.batches = []
    return recorded


def _writer(path: Path, manifest: Manifest, compiled: CompiledScene) -> MapWriter:
    MapWriter.create(path, manifest, compiled.scene, compiled.meshes)
    tables = compiled.tables
    return MapWriter(path, FaceIndex(tables.triangle_face, tables.face_body, tables.face_surface))


def _in_threads(work: Callable, items: list, n_threads: int) -> None:
    with ThreadPoolExecutor(n_threads) as pool:
        for _ in pool.map(work, items):
            pass
