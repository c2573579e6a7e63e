# SPDX-License-Identifier: LGPL-2.1-or-later
"""The flow on one page: scene, compile, trace, store; then the map can be asked."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

from raymaps.errors import Interrupted, MapError, OutputError, TraceError
from raymaps.scene import Scene, load_scene
from raymaps.store import MAP_VERSION, Manifest, MapWriter, RayMap, Stored
from raymaps.traced import FaceIndex
from raymaps.version import __version__

__all__ = ["Progress", "open_map", "simulate"]

#: Open a map that exists.
open_map = RayMap.open

#: Rays of a portion: few enough for their arrays to stay near the processor, many enough to compress well.
LARGEST_PORTION, SMALLEST_PORTION = 65_536, 4_096


@dataclass(frozen=True)
class Progress:
    """How far a run is; ``rays`` counts all that are stored, also by an earlier run."""

    rays: int
    of: int
    elapsed_s: float
    remaining_s: float | None


def simulate(
    scene: Scene | str | Path,
    path: str | Path,
    *,
    rays: int | None = None,
    seed: int | None = None,
    threads: int | None = None,
    resume: bool = False,
    portion_rays: int | None = None,
    store: Stored | Callable[[], Stored] | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    on_note: Callable[[str], None] | None = None,
    stop: threading.Event | None = None,
) -> RayMap:
    """Trace a scene and store it as a Ray Map.

    The result depends on the scene, the seed and the number of rays; not on threads, portions or interruptions.

    Parameters
    ----------
    scene : Scene, or path of a scene file
    path : path of the map, which must not exist unless ``resume``
    rays, seed : int, optional
        In place of the scene's settings; a map that is resumed goes on to the number that it was asked for.
    threads : int, optional
        Portions traced at the same time; by default one for each processor.
    resume : bool
        Go on with a map that was interrupted, or add rays to one; make it if it does not exist.
    portion_rays : int, optional
        Rays of a portion; by default chosen from the number of rays.
    store : "rgb" or "spectral", or a function that returns one of them, optional
        How the light of a spectral simulation is stored, in place of the scene's settings. A function is asked before
        each portion, so that a run can change from one to the other.
    on_progress, on_note : functions, optional
        Called after each portion; called with a sentence worth telling.
    stop : threading.Event, optional
        Once set, no further portion is begun.

    Returns
    -------
    RayMap

    Raises
    ------
    SceneError, OutputError, MapError
        If the scene can't be simulated, the map not written, or the map to resume is of another scene or seed.
    Interrupted
        If ``stop`` was set before all rays were traced; the map is valid.
    """
    from raymaps.compile import compile_scene
    from raymaps.jit import kept_machine_code

    started = time.monotonic()
    scene = scene if isinstance(scene, Scene) else load_scene(scene)
    path = Path(path)
    _check_numbers(
        rays=(rays, 1, 10**12),
        seed=(seed, 0, 2**64 - 1),
        threads=(threads, 1, 1024),
        portion_rays=(portion_rays, 1, 10**7),
    )
    if os.path.lexists(path) and not resume:
        raise OutputError(f"'{path}' exists already: name another output, delete it, or go on with it by --resume.")
    compiled = compile_scene(scene)
    if os.path.lexists(path):
        manifest = _resumable(Manifest.read(path), path, compiled.scene_hash, seed)
        n_rays = manifest.rays_asked if rays is None else rays
    else:
        n_rays = scene.settings.rays if rays is None else rays
        manifest = Manifest(
            seed=scene.settings.seed if seed is None else seed,
            scene_hash=compiled.scene_hash,
            names=compiled.names,
            rays_asked=n_rays,
            portion_rays=portion_rays or _portion_rays(n_rays, compiled.bands.n),
            grid_mm=compiled.frame.grid_mm,
            program=__version__,
            bands=compiled.bands,
        )
        MapWriter.create(path, manifest, scene, compiled.meshes, compiled.ray_sets)

    if on_note and not kept_machine_code():
        on_note("Compiling for this machine; that happens once and takes a minute or two.")
    from raymaps.trace import Tracer  # imports the kernels

    tables = compiled.tables
    writer = MapWriter(path, FaceIndex(tables.triangle_face, tables.face_body, tables.face_surface))
    with writer.alone():
        raymap = RayMap.open(path)
        if n_rays != manifest.rays_asked:
            Manifest(**{**manifest.__dict__, "rays_asked": max(n_rays, raymap.n_rays)}).write(path)
        missing = raymap.missing_rays(n_rays)
        stored = raymap.n_rays
        present = sum(max(0, min(p.first_ray + p.n_rays, n_rays) - p.first_ray) for p in raymap.portions)
        total = stored + n_rays - min(present, n_rays)
        tracer = Tracer(compiled, manifest.seed)

        def trace_and_store(first_ray: int, n: int) -> int:
            history = tracer.trace_portion(first_ray, n)
            writer.write(history, _stored(store() if callable(store) else store or scene.settings.store))
            return n

        before = stored
        if on_progress:
            on_progress(Progress(stored, total, time.monotonic() - started, None))
        for n in _in_threads(trace_and_store, missing, threads or os.cpu_count() or 1, stop or threading.Event()):
            stored += n
            elapsed = time.monotonic() - started
            if on_progress:
                on_progress(Progress(stored, total, elapsed, elapsed * (total - stored) / max(stored - before, 1)))
    if stored < total:
        raise Interrupted(f"Stopped after {stored} of {total} rays; go on with --resume.")
    return RayMap.open(path)


def _check_numbers(**limits: tuple[int | None, int, int]) -> None:
    for name, (value, lowest, highest) in limits.items():
        if value is not None and not lowest <= value <= highest:
            raise TraceError(f"{name} must be from {lowest} to {highest}, got {value}.")


def _stored(name: str) -> Stored:
    if name not in ("rgb", "spectral"):
        raise TraceError(f"store must be 'rgb' or 'spectral', got '{name}'.")
    return "spectral" if name == "spectral" else "rgb"


def _resumable(manifest: Manifest, path: Path, scene_hash: str, seed: int | None) -> Manifest:
    if manifest.version < MAP_VERSION:
        raise MapError(
            f"Ray Map '{path}' has version {manifest.version}; it can be asked, but rays can only be added to maps of "
            f"version {MAP_VERSION}: name another output."
        )
    if manifest.scene_hash != scene_hash:
        raise MapError(f"Ray Map '{path}' was made from another scene, or the scene has changed: name another output.")
    if seed is not None and seed != manifest.seed:
        raise MapError(f"Ray Map '{path}' was made with seed {manifest.seed}, not {seed}: name another output.")
    return manifest


def _portion_rays(n_rays: int, n_bands: int) -> int:
    """About 32 portions, so that progress shows, within what is good for speed and memory."""
    largest = max(SMALLEST_PORTION, LARGEST_PORTION * 32 // max(n_bands, 32))
    return min(largest, max(SMALLEST_PORTION, 1 << (n_rays // 32).bit_length()))


def _in_threads(
    work: Callable[[int, int], int], items: Iterator[tuple[int, int]], threads: int, stop: threading.Event
) -> Iterator[int]:
    """Results of the work as they come; a failure or a set ``stop`` lets only what has begun come to its end."""
    with ThreadPoolExecutor(threads, thread_name_prefix="trace") as pool:
        running: set[Future[int]] = set()
        try:
            while True:
                while len(running) < threads and not stop.is_set() and (item := next(items, None)):
                    running.add(pool.submit(work, *item))
                if not running:
                    return
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            stop.set()
