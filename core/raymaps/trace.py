# SPDX-License-Identifier: LGPL-2.1-or-later
"""Trace a portion: a wave of rays bounces until all have ended. Knows no files.

Each turn of the loop takes every living ray from one event to the next: Embree finds the triangle, then each effect
that the scene calls for acts on all rays in turn. An effect's kernel is imported, and so compiled, only if needed, and
runs only where a ray meets what it acts on.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.compile import CompiledScene
from raymaps.effects import EFFECTS
from raymaps.effects.crossings import CROSSING
from raymaps.intersect import Intersector
from raymaps.kernels import record, smooth, transport
from raymaps.kernels.sobol import N_DIMENSIONS, scrambles
from raymaps.kinds import ENDINGS, EventKind, SurfaceKind
from raymaps.ray_numbers import REPLICATES, n_replicates, ranks, ranks_before, source_of_rays
from raymaps.scene import RectangleDetector
from raymaps.slow_search import MAX_SEARCHES, SlowSearch
from raymaps.sources import emitters, quantised
from raymaps.traced import TracedPortion
from raymaps.wave import Found, RunKey, Wave

__all__ = ["Tracer"]


#: Crossings of triangles that are near to what a ray meets, beside those.
ROOM = 8


class _Stage(NamedTuple):
    """A kernel of an effect, what it reads, and the media or kinds of surfaces that it acts on."""

    name: str
    run: Callable[..., Any]
    data: Any
    media: NDArray[np.bool_]  # (n_media,)
    surfaces: NDArray[np.bool_]  # (256,) by `SurfaceKind`

    def acts(self, media: NDArray[np.bool_], met: NDArray[np.bool_]) -> bool:
        """Whether a wave that is in, or comes to, these media and meets these kinds of surfaces has work for it."""
        return bool((self.media & media).any() or (self.surfaces & met).any())


class _Clock:
    """Adds up the time that stages take."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def book(self, name: str) -> None:
        """Put the time since the last entry to an account."""
        now = time.perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._last
        self._last = now


class Tracer:
    """Traces portions of one scene; `trace_portion` may be called from several threads at once.

    Parameters
    ----------
    compiled : CompiledScene
    seed : int
    """

    def __init__(self, compiled: CompiledScene, seed: int):
        self.compiled = compiled
        self.seed = seed
        self._intersector = Intersector(compiled.boundary)
        self._slow = SlowSearch(compiled.tables, compiled.boundary.tables)
        self._emitters = tuple(
            (importlib.import_module(f"raymaps.kernels.emission.{emitter.kernel}").run, emitter.arguments)
            for emitter in emitters(compiled)
        )
        self._light = quantised(compiled.source_light)
        self._stages: dict[str, list[_Stage]] = {"way": [], "surface": []}
        self._in_mixtures = np.zeros(256, bool)  # kinds of surfaces that are parts of mixtures
        self._crossings: _Stage | None = None
        for effect in EFFECTS:
            if effect.name not in compiled.effects or effect.stage == "none":
                continue
            module = importlib.import_module(f"raymaps.kernels.{effect.name}")
            data = compiled.effect_data[effect.name]
            media, surfaces = np.zeros(len(compiled.tables.medium_index), bool), np.zeros(256, bool)
            if effect.acts_on is not None:
                media = effect.acts_on(data)
            elif effect.stage == "surface":
                surfaces[SurfaceKind[effect.name.upper()]] = True
            stage = _Stage(effect.name, module.run, data, media, surfaces)
            if effect.name == "crossings":
                self._crossings = stage
            else:
                self._stages[effect.stage].append(stage)
            if effect.name == "mixture":
                self._in_mixtures[compiled.tables.surface_kind[data.part]] = True
            if hasattr(module, "scatter"):  # an effect on the way whose rays go on in another direction
                self._stages["surface"].append(stage._replace(run=module.scatter))
        self._is_end = np.zeros(256, bool)
        self._is_end[[kind for kinds in ENDINGS.values() for kind in kinds]] = True
        self._position_type = position_type(compiled)
        self._smooths = bool((compiled.boundary.smooth.row >= 0).any())

    def trace_portion(
        self, first_ray: int, n_rays: int, watch: Callable[[int, NDArray[np.int32], Wave], None] | None = None
    ) -> TracedPortion:
        """Trace the rays ``first_ray`` to ``first_ray + n_rays - 1`` to their ends.

        Parameters
        ----------
        watch : function of depth, slots and `Wave`, optional
            Called at each event: the events are at ``wave.end``, unrounded, the ways after them in ``wave.direction``.
        """
        settings = self.compiled.scene.settings
        tables = self.compiled.tables
        clock = _Clock()
        source = source_of_rays(self.compiled.scene, first_ray, n_rays)
        key = self._key(first_ray, source)
        wave = self._emit(source, key)
        log = _EventLog(self.compiled, n_rays, self._position_type, self._crossings)
        active = np.arange(n_rays, dtype=np.int32)
        if watch is not None:
            watch(0, active, wave)
        log.keep(active, wave)
        # which media rays are in, or come to, and what surfaces they meet: only effects that act on them run
        media, met = np.zeros(len(tables.medium_index), bool), np.zeros(256, bool)
        record.advance(active, wave, self._is_end, media)
        clock.book("emission")

        for depth in range(1, settings.max_events):
            # the way: to the next triangle or out of the scene, through a medium, past detectors
            self._find_next(active, wave)
            clock.book("intersection")
            for stage in self._stages["way"]:
                if stage.acts(media, met):
                    stage.run(active, wave, tables, stage.data, key, depth)
                    clock.book(stage.name)
            if self._crossings is not None:
                log.cross(active, wave, depth)
                clock.book("crossings")
            # the surface: what happens there is up to the effect that its property belongs to
            met[:] = False
            transport.arrive(active, wave, tables, met, media)
            if met[SurfaceKind.MIXTURE]:
                met |= self._in_mixtures
            if depth == settings.max_events - 1:
                is_open = (wave.state[active] == transport.PENDING) | (
                    wave.state[active] == EventKind.MEDIUM_SCATTERING
                )
                wave.state[active[is_open]] = EventKind.KILLED_DEPTH
            clock.book("intersection")
            for stage in self._stages["surface"]:
                if stage.acts(media, met):
                    stage.run(active, wave, tables, stage.data, key, depth)
                    clock.book(stage.name)
            if self._smooths:
                smooth.keep_on_side(active, wave, tables, self.compiled.boundary.smooth, self._is_end)
            if watch is not None:
                watch(depth, active, wave)
            log.keep(active, wave)
            media[:] = False
            active = active[: record.advance(active, wave, self._is_end, media)]
            clock.book("recording")
            if not len(active):
                break
        portion = log.in_ray_order(first_ray, wave)
        clock.book("recording")
        return replace(portion, seconds=clock.seconds, replicate=(key.group % REPLICATES).astype(np.uint8))

    def _key(self, first_ray: int, source: NDArray[np.int16]) -> RunKey:
        """What the numbers of a portion's rays follow from."""
        scene = self.compiled.scene
        key = RunKey(np.uint64(self.seed), np.uint64(first_ray), scene.settings.roulette_threshold)
        if n_replicates(scene) == 1:
            return key
        rank = ranks(source, ranks_before(scene, first_ray))
        scramble = np.empty((len(scene.sources) * REPLICATES, N_DIMENSIONS, 2), np.uint32)
        scrambles(key.seed, scramble)
        group = source * np.int32(REPLICATES) + (rank % REPLICATES).astype(np.int32)
        return key._replace(point=(rank // REPLICATES).astype(np.uint32), group=group, scramble=scramble)

    def _emit(self, source: NDArray[np.int16], key: RunKey) -> Wave:
        """A wave at its emission."""
        inside = self.compiled.source_inside[source]
        wave = Wave.allocate(len(source), self.compiled.bands.n, inside.shape[1])
        wave.source[:] = source
        wave.light[:] = self._light[source]
        wave.inside[:] = inside
        wave.medium[:] = np.array(self.compiled.source_media, np.int16)[source]
        for index, (emit, arguments) in enumerate(self._emitters):
            emit(np.flatnonzero(source == index).astype(np.int32), wave, key, *arguments)
        wave.end[:] = wave.position
        wave.hit[:] = wave.triangle
        wave.state[:] = EventKind.EMISSION
        return wave

    def _find_next(self, active: NDArray[np.int32], wave: Wave) -> None:
        """Where each ray's segment ends; rays whose search does not come to an end are killed."""
        tables, boundary = self.compiled.tables, self.compiled.boundary.tables
        transport.begin(active, wave)
        searching, searched = active, np.zeros(len(active))
        for _ in range(MAX_SEARCHES):
            origin = np.empty((len(searching), 3), np.float32)
            direction = np.empty((len(searching), 3), np.float32)
            transport.start(searching, wave, tables, boundary, searched, origin, direction)
            triangle, distance = self._intersector.find(origin, direction)
            found, ways = Found.allocate(len(triangle), triangle.shape[1] + ROOM), np.zeros(triangle.shape, np.int8)
            if not transport.locate(
                searching, wave, tables, boundary, searched, triangle, ways, searched[:, None] + distance, found, False
            ):
                break
            again = wave.state[searching] == transport.SEARCHING
            searching, searched = searching[again], searched[again]
        self._slow.decide(active[np.isin(wave.state[active], (transport.SEARCHING, transport.DOUBTFUL))], wave)
        if self._smooths:
            smooth.turn_normals(active, wave, tables, self.compiled.boundary.smooth)


class _EventLog:
    """Events and crossings of a portion as they come, a chunk a depth."""

    def __init__(self, compiled: CompiledScene, n_rays: int, position_type: np.dtype, crossings_stage: _Stage | None):
        self._compiled = compiled
        self._crossings_stage = crossings_stage
        self._n_events = np.zeros(n_rays, np.int64)
        self._position_type = position_type
        self._chunks: list[tuple[NDArray, ...]] = []
        self._crossings: list[NDArray] = []

    def keep(self, active: NDArray[np.int32], wave: Wave) -> None:
        """Copy the events at which the active rays are."""
        n, n_bands = len(active), self._compiled.bands.n
        kind, triangle, medium = np.empty(n, np.uint8), np.empty(n, np.int32), np.empty(n, np.int16)
        position, light = np.empty((n, 3), self._position_type), np.empty((n, n_bands), np.float32)
        record.keep(active, wave, self._compiled.frame, kind, triangle, position, light, medium)
        self._chunks.append((active.copy(), kind, triangle, medium, position, light))
        self._n_events[active] += 1

    def cross(self, active: NDArray[np.int32], wave: Wave, depth: int) -> None:
        """Find and keep the detector crossings of the segments that end at this depth."""
        stage, frame = self._crossings_stage, self._compiled.frame
        assert stage is not None
        found = np.empty(len(active), CROSSING)
        count = stage.run(active, wave, stage.data, frame, depth, found)
        if count > len(found):
            found = np.empty(count, CROSSING)
            stage.run(active, wave, stage.data, frame, depth, found)
        if count:
            self._crossings.append(found[:count].copy())

    def in_ray_order(self, first_ray: int, wave: Wave) -> TracedPortion:
        """Everything kept, in the order of the rays and then of time."""
        offsets = np.concatenate([[0], np.cumsum(self._n_events)])
        n = int(offsets[-1])
        columns = (
            np.empty(n, np.uint8), np.empty(n, np.int32), np.empty(n, np.int16),
            np.empty((n, 3), self._position_type), np.empty((n, self._compiled.bands.n), np.float32),
        )  # fmt: skip
        for depth, (slots, *chunk) in enumerate(self._chunks):
            record.scatter(slots, offsets, depth, tuple(chunk), columns)
        return TracedPortion(
            first_ray, wave.source, offsets, *columns, wavelength_nm=wave.wavelength_nm.astype(np.float32),
            **self._crossing_columns(offsets),
        )  # fmt: skip

    def _crossing_columns(self, offsets: NDArray[np.int64]) -> dict[str, Any]:
        """Columns of the crossings, in the order of the rays and along each ray."""
        if not self._crossings:
            return {
                "crossing_row": np.empty(0, np.int64),
                "crossing_detector": np.empty(0, np.int16),
                "crossing_xy_mm": np.empty((0, 2), np.float32),
                "crossing_angle_rad": np.empty(0, np.float32),
                "crossing_registered": np.empty(0, bool),
            }
        crossings = np.concatenate(self._crossings)
        row = offsets[crossings["slot"]] + crossings["event"]
        order = np.argsort(row, kind="stable")  # a merge of the depths, each of which is in order already
        row, crossings = row[order], crossings[order]
        angle = crossings["angle_rad"].copy()
        registered = np.zeros(len(crossings), bool)
        for index, detector in enumerate(self._compiled.scene.detectors.values()):
            mine = crossings["detector"] == index
            if isinstance(detector, RectangleDetector):
                registered[mine] = detector.accepts(angle[mine])
        return {
            "crossing_row": row,
            "crossing_detector": crossings["detector"].copy(),
            "crossing_xy_mm": np.stack([crossings["x_mm"], crossings["y_mm"]], axis=1),
            "crossing_angle_rad": angle,
            "crossing_registered": registered,
        }


def position_type(compiled: CompiledScene) -> np.dtype:
    """float32 where it holds every point of the frame's grid exactly, else float64."""
    farthest = float((np.abs(compiled.frame.center_mm) + compiled.frame.unit_mm).max())
    return np.dtype(np.float32 if farthest / compiled.frame.grid_mm < 2**24 else np.float64)
