# SPDX-License-Identifier: LGPL-2.1-or-later
"""Trace a portion: a wave of rays bounces until all have ended. Knows no files.

Each turn of the loop takes every living ray from one event to the next: Embree finds the triangle, then each effect
that the scene calls for acts on all rays in turn. An effect's kernel is imported, and so compiled, only if needed.
"""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.compile import CompiledScene
from raymaps.intersect import Intersector
from raymaps.kernels import emission, record, transport
from raymaps.kinds import ENDINGS, EventKind
from raymaps.sources import emitters, relative_light, source_of_rays
from raymaps.traced import TracedPortion

__all__ = ["RunKey", "Tracer", "Wave"]

#: How often a search may be taken up again behind a hit that lies where the ray stands.
MAX_SEARCHES = 16
#: Effects that act on the way, before the surface that a ray arrives on is looked up.
_ON_THE_WAY = ("medium_absorption", "crossings")


class Wave(NamedTuple):
    """State of the rays of a portion, a slot each; lengths in frame units."""

    position: NDArray[np.float64]  # (n, 3) where the ray is
    direction: NDArray[np.float64]  # (n, 3) unit vector
    end: NDArray[np.float64]  # (n, 3) where the segment ends
    distance: NDArray[np.float64]  # (n,) length of the segment
    light: NDArray[np.float32]  # (n, 3 bands) relative to the emission
    triangle: NDArray[np.int32]  # (n,) triangle that the ray stands on, -1 none
    hit: NDArray[np.int32]  # (n,) triangle at the segment's end, -1 none
    side: NDArray[np.int8]  # (n,) on which side of its triangle the ray starts: 1 front, -1 back
    near_side: NDArray[np.int8]  # (n,) from which side it arrives
    medium: NDArray[np.int16]  # (n,) medium that the ray is in
    beyond: NDArray[np.int16]  # (n,) medium behind the surface that it arrives on
    surface: NDArray[np.int16]  # (n,) surface property that it meets
    state: NDArray[np.uint8]  # (n,) EventKind, or PENDING and the like of `raymaps.kernels.transport`

    @classmethod
    def allocate(cls, n_rays: int) -> Wave:
        """A wave of rays in no particular state."""
        three, none = np.zeros((n_rays, 3)), np.full(n_rays, -1, np.int32)
        return cls(
            position=three, direction=three.copy(), end=three.copy(), distance=np.zeros(n_rays),
            light=np.zeros((n_rays, 3), np.float32), triangle=none, hit=none.copy(),
            side=np.ones(n_rays, np.int8), near_side=np.ones(n_rays, np.int8),
            medium=np.zeros(n_rays, np.int16), beyond=np.zeros(n_rays, np.int16),
            surface=np.zeros(n_rays, np.int16), state=np.zeros(n_rays, np.uint8),
        )  # fmt: skip


class RunKey(NamedTuple):
    """What random numbers and roulette depend on, beside the ray and its event."""

    seed: np.uint64
    first_ray: np.uint64
    roulette_threshold: float


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
        self._intersector = Intersector(compiled)
        self._emitters = emitters(compiled)
        self._light = relative_light(compiled.scene)
        kernels = {name: importlib.import_module(f"raymaps.kernels.{name}") for name in compiled.effects}
        self._absorption: ModuleType | None = kernels.get("medium_absorption")
        self._crossings: ModuleType | None = kernels.get("crossings")
        self._on_surfaces = tuple(module for name, module in kernels.items() if name not in _ON_THE_WAY)
        self._is_end = np.zeros(256, bool)
        self._is_end[[kind for kinds in ENDINGS.values() for kind in kinds]] = True
        self._position_type = position_type(compiled)

    def trace_portion(self, first_ray: int, n_rays: int) -> TracedPortion:
        """Trace the rays ``first_ray`` to ``first_ray + n_rays - 1`` to their ends."""
        settings = self.compiled.scene.settings
        tables = self.compiled.tables
        key = RunKey(np.uint64(self.seed), np.uint64(first_ray), settings.roulette_threshold)
        source = source_of_rays(self.compiled.scene, first_ray, n_rays)
        wave = self._emit(source, key)
        log = _EventLog(self.compiled, n_rays, self._position_type, self._crossings)
        active = np.arange(n_rays, dtype=np.int32)
        log.keep(active, wave)
        record.advance(active, wave, self._is_end)

        for depth in range(1, settings.max_events):
            # the way: to the next triangle or out of the scene, through a medium, past detectors
            self._find_next(active, wave)
            if self._absorption is not None:
                self._absorption.run(active, wave, tables, key, depth)
            log.cross(active, wave, depth)
            # the surface: what happens there is up to the effect that its property belongs to
            transport.arrive(active, wave, tables)
            if depth == settings.max_events - 1:
                wave.state[active[wave.state[active] == transport.PENDING]] = EventKind.KILLED_DEPTH
            for stage in self._on_surfaces:
                stage.run(active, wave, tables, key, depth)
            log.keep(active, wave)
            active = active[: record.advance(active, wave, self._is_end)]
            if not len(active):
                break
        return log.in_ray_order(first_ray, source)

    def _emit(self, source: NDArray[np.int16], key: RunKey) -> Wave:
        """A wave at its emission."""
        wave = Wave.allocate(len(source))
        for index, emitter in enumerate(self._emitters):
            slots = np.flatnonzero(source == index).astype(np.int32)
            getattr(emission, emitter.kernel)(slots, wave, key, *emitter.arguments)
        wave.light[:] = self._light[source]
        wave.medium[:] = np.array(self.compiled.source_media, np.int16)[source]
        wave.end[:] = wave.position
        wave.hit[:] = wave.triangle
        wave.state[:] = EventKind.EMISSION
        return wave

    def _find_next(self, active: NDArray[np.int32], wave: Wave) -> None:
        """Where each ray's segment ends; rays whose search does not come to an end are killed."""
        tables = self.compiled.tables
        searching, searched = active, np.zeros(len(active))
        for _ in range(MAX_SEARCHES):
            origin = np.empty((len(searching), 3), np.float32)
            direction = np.empty((len(searching), 3), np.float32)
            transport.start(searching, wave, tables, searched, origin, direction)
            triangle, distance = self._intersector.find(origin, direction)
            if not transport.locate(searching, wave, tables, searched, triangle, distance):
                return
            again = wave.state[searching] == transport.REJECTED
            searching, searched = searching[again], searched[again]
        wave.state[searching] = EventKind.KILLED_NUMERICAL
        wave.hit[searching] = -1
        wave.end[searching] = wave.position[searching]
        wave.distance[searching] = 0.0


class _EventLog:
    """Events and crossings of a portion as they come, a chunk a depth."""

    def __init__(
        self, compiled: CompiledScene, n_rays: int, position_type: np.dtype, crossings_kernel: ModuleType | None
    ):
        self._compiled = compiled
        self._crossings_kernel = crossings_kernel
        self._n_events = np.zeros(n_rays, np.int64)
        self._position_type = position_type
        self._chunks: list[tuple[NDArray, ...]] = []
        self._crossings: list[NDArray] = []

    def keep(self, active: NDArray[np.int32], wave: Wave) -> None:
        """Copy the events at which the active rays are."""
        n = len(active)
        kind, triangle, medium = np.empty(n, np.uint8), np.empty(n, np.int32), np.empty(n, np.int16)
        position, light = np.empty((n, 3), self._position_type), np.empty((n, 3), np.float32)
        record.keep(active, wave, self._compiled.frame, kind, triangle, position, light, medium)
        self._chunks.append((active.copy(), kind, triangle, medium, position, light))
        self._n_events[active] += 1

    def cross(self, active: NDArray[np.int32], wave: Wave, depth: int) -> None:
        """Find and keep the detector crossings of the segments that end at this depth."""
        kernel, compiled = self._crossings_kernel, self._compiled
        if kernel is None:
            return
        found = np.empty(len(active), kernel.CROSSING)
        count = kernel.run(active, wave, compiled.tables, compiled.frame, depth, found)
        if count > len(found):
            found = np.empty(count, kernel.CROSSING)
            kernel.run(active, wave, compiled.tables, compiled.frame, depth, found)
        if count:
            self._crossings.append(found[:count].copy())

    def in_ray_order(self, first_ray: int, source: NDArray[np.int16]) -> TracedPortion:
        """Everything kept, in the order of the rays and then of time."""
        offsets = np.concatenate([[0], np.cumsum(self._n_events)])
        n = int(offsets[-1])
        columns = (
            np.empty(n, np.uint8), np.empty(n, np.int32), np.empty(n, np.int16),
            np.empty((n, 3), self._position_type), np.empty((n, 3), np.float32),
        )  # fmt: skip
        for depth, (slots, *chunk) in enumerate(self._chunks):
            record.scatter(slots, offsets, depth, tuple(chunk), columns)
        return TracedPortion(first_ray, source, offsets, *columns, **self._crossing_columns(offsets))

    def _crossing_columns(self, offsets: NDArray[np.int64]) -> dict[str, NDArray]:
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
