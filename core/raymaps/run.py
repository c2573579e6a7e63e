# SPDX-License-Identifier: LGPL-2.1-or-later
"""The flow on one page: scene, compile, trace, store; then the map can be asked."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from raymaps.errors import MapError, OutputError, TraceError, listed
from raymaps.ray_numbers import MOST_OF_SOBOL
from raymaps.runner import Progress, Runner
from raymaps.scene import Scene, load_scene
from raymaps.store import MAP_VERSION, Manifest, MapWriter, RayMap, Stored
from raymaps.version import __version__

if TYPE_CHECKING:
    from raymaps.compile import CompiledScene
    from raymaps.target import Course, Target

__all__ = ["Progress", "new_map", "notes_at_start", "open_map", "simulate"]

#: Open a map that exists.
open_map = RayMap.open

#: Rays of a portion: few enough for their arrays to stay near the processor, many enough to compress well.
LARGEST_PORTION, SMALLEST_PORTION = 65_536, 4_096


#: A run to a target traces at most so many times the scene's rays, unless it is told a number.
MOST_FOR_TARGET = 100

#: What is told before the first run on a machine.
_COMPILING = "Compiling for this machine; that happens once and takes a minute or two."
#: Module of the loops that compiling spends most time on.
_LARGEST_LOOPS = "transport"


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
    target: Target | None = None,
    time_limit_s: float | None = None,
) -> RayMap:
    """Trace a scene and store it as a Ray Map.

    The result depends on the scene, the seed and the number of rays; not on threads, portions or interruptions.

    Parameters
    ----------
    scene : Scene, or path of a scene file
    path : path of the map, which must not exist unless ``resume``
    rays, seed : int, optional
        In place of the scene's settings; a map that is resumed goes on to the number that it was asked for. With a
        target the most rays; by default 100 times the scene's.
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
    target : Target, optional
        Trace until a figure is known so well, see `raymaps.target.rule`; a map that is resumed goes on to the one that
        it was asked for, unless ``rays`` says how many it shall have. ``on_note`` is told how it went.
    time_limit_s : float, optional
        Begin no further portion after so many seconds; a new map gets at least one.

    Returns
    -------
    RayMap

    Raises
    ------
    SceneError, OutputError, MapError
        If the scene can't be simulated, the map not written, or the map to resume is of another scene or seed.
    CriterionError, TraceError
        If the target names what the scene has not, or a number is out of range.
    Interrupted
        If ``stop`` was set before all rays were traced; the map is valid.
    """
    from raymaps.compile import compile_scene

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
    if scene.settings.sampling == "sobol" and (rays or scene.settings.rays) > MOST_OF_SOBOL:
        raise TraceError(
            f"Sampling 'sobol' has points for {MOST_OF_SOBOL} rays at most: ask for fewer, or set settings.sampling to "
            "'random'."
        )
    if time_limit_s is not None and not time_limit_s > 0:
        raise TraceError(f"The time limit must be above 0 s, got {time_limit_s:g} s.")
    compiled = compile_scene(scene)
    if target is not None:
        from raymaps.target import check_target

        check_target(target, compiled.names, scene.detectors)
    if os.path.lexists(path):
        manifest = _resumable(Manifest.read(path), path, compiled.scene_hash, seed)
        n_rays = manifest.rays_asked if rays is None else rays
    else:
        manifest = new_map(path, scene, compiled, rays=rays, seed=seed, portion_rays=portion_rays)
        n_rays = manifest.rays_asked

    for text in notes_at_start(compiled):
        if on_note:
            on_note(text)

    def how_stored() -> Stored:
        return _stored(store() if callable(store) else store or scene.settings.store)

    runner = Runner(
        compiled, path, manifest.seed, threads=threads or os.cpu_count() or 1, store=how_stored,
        stop=stop or threading.Event(), started=started, time_limit_s=time_limit_s, on_progress=on_progress,
        on_note=on_note,
    )  # fmt: skip
    with runner.writer.alone():
        present = RayMap.open(path).n_rays
        course = _course(manifest, target, rays, scene.settings.rays)
        if course is not None:
            from raymaps.target import reach

            def size(n: int) -> int:
                return manifest.portion_rays if present or portion_rays else _portion_rays(n, compiled.bands.n)

            replace(manifest, target=course.to_dict()).write(path)
            return reach(runner, course, scene.settings.rays, size)
        if n_rays != manifest.rays_asked or manifest.target:
            replace(manifest, rays_asked=max(n_rays, present), target=None).write(path)
        raymap = runner.to(n_rays)
    if raymap.n_rays < n_rays:
        runner.note(f"Stopped at the time limit after {raymap.n_rays} of {n_rays} rays; go on with --resume.")
    return raymap


def notes_at_start(compiled: CompiledScene) -> Iterator[str]:
    """What is worth telling before the first ray."""
    from raymaps.jit import kept_machine_code

    if not kept_machine_code(_LARGEST_LOOPS):
        yield _COMPILING
    lacking = compiled.boundary.fallbacks
    if lacking:
        faces = listed([f"{face.body}.{face.face}" for face in lacking], 3)
        yield f"Light meets the facets of {faces} in place of the exact surface: raymaps check tells why."


def new_map(
    path: Path,
    scene: Scene,
    compiled: CompiledScene,
    *,
    rays: int | None = None,
    seed: int | None = None,
    portion_rays: int | None = None,
) -> Manifest:
    """Make a map that has no rays yet; parameters as of `simulate`."""
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
    return manifest


def _course(manifest: Manifest, target: Target | None, rays: int | None, usual_rays: int) -> Course | None:
    """The way to a target, new or as far as an earlier run went; None if a number of rays was given."""
    if target is None and (manifest.target is None or rays is not None):
        return None
    from raymaps.target import Course

    most = rays if rays is not None else min(MOST_FOR_TARGET * usual_rays, 10**12)
    return Course(target, most) if target is not None else Course.from_dict(manifest.target or {})


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
