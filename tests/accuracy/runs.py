# SPDX-License-Identifier: LGPL-2.1-or-later
"""A thousand small runs of a scene, each with its own seed: traced one after the other, stored once, asked one by one.

The rays of all runs are one portion on disk. A run is a map whose only portion is a piece of that; so questions go the
same ways as to a map of its own, and a run costs milliseconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from raymaps.compile import compile_scene
from raymaps.ray_numbers import n_replicates, ranks
from raymaps.scene import load_scene
from raymaps.store import Manifest, MapWriter, RayMap
from raymaps.store.ledger import sum_ledger
from raymaps.trace import Tracer
from raymaps.traced import FaceIndex, TracedPortion

N_RUNS = 1000


def runs(folder: Path, scene_path: Path, rays: int, n_runs: int = N_RUNS) -> Iterator[RayMap]:
    """Maps of so many rays of a scene, of the seeds 1, 2, 3 and so on."""
    compiled = compile_scene(load_scene(scene_path))
    tracer = Tracer(compiled, 0)
    traced = []
    for seed in range(1, n_runs + 1):
        tracer.seed = seed
        traced.append(tracer.trace_portion(0, rays))
    manifest = Manifest(
        seed=0, scene_hash=compiled.scene_hash, names=compiled.names, rays_asked=rays * n_runs,
        portion_rays=rays * n_runs, grid_mm=compiled.frame.grid_mm, program="test", bands=compiled.bands,
    )  # fmt: skip
    path = folder / "runs.raymap"
    MapWriter.create(path, manifest, compiled.scene, compiled.meshes)
    tables = compiled.tables
    MapWriter(path, FaceIndex(tables.triangle_face, tables.face_body, tables.face_surface)).write(_joined(traced))
    whole = RayMap.open(path)
    for run in range(n_runs):
        piece = RayMap(path, manifest, [_Piece(whole.portions[0], run * rays, rays, n_replicates(compiled.scene))])
        piece.__dict__.update(scene=whole.scene, meshes=whole.meshes, source_flux_w=whole.source_flux_w)
        yield piece


class _Piece:
    """Some of a portion's rays as a portion; see `raymaps.store.Portion`."""

    def __init__(self, whole, first_ray, n_rays, n_replicates):
        rays = slice(first_ray, first_ray + n_rays)
        rows = slice(*whole.event_offsets[[rays.start, rays.stop]])
        passed = slice(*np.searchsorted(whole.crossing_row, [rows.start, rows.stop]))
        self.names, self.first_ray, self.n_rays, self._n_replicates = whole.names, 0, n_rays, n_replicates
        self.n_events, self.n_crossings = rows.stop - rows.start, passed.stop - passed.start
        self.signatures, self.lights = whole.signatures, whole.lights
        self.ray_signature = whole.ray_signature[rays]
        self.event_offsets = whole.event_offsets[rays.start : rays.stop + 1] - rows.start
        for name in ("event_step", "triangle", "position_mm", "event_light", "power"):
            setattr(self, name, getattr(whole, name)[rows])
        self.crossing_row = whole.crossing_row[passed] - rows.start
        self.crossing_ray = whole.crossing_ray[passed] - rays.start
        for name in ("crossing_detector", "crossing_xy_mm", "crossing_angle_rad", "crossing_registered"):
            setattr(self, name, getattr(whole, name)[passed])

    @cached_property
    def summary(self):
        table, step = self.signatures, self.event_step
        source, n_sources = table.ray_source[self.ray_signature], len(self.names.sources)
        replicate = None
        if self._n_replicates > 1:
            replicate = ranks(source, np.zeros(n_sources, np.int64)) % self._n_replicates
        ledger = sum_ledger(
            source, n_sources, self.event_offsets, table.kind[step], table.face[step], table.medium[step],
            self.event_light, self.lights.power, np.array([body for body, _ in self.names.faces], np.int32), replicate,
        )  # fmt: skip
        counts = tuple(np.bincount(source, minlength=n_sources).tolist())
        return SimpleNamespace(ledger=ledger, rays_of_source=counts)


def _joined(traced: list[TracedPortion]) -> TracedPortion:
    """Portions one behind the other."""

    def all_of(name, start=None):
        columns = [getattr(portion, name) for portion in traced]
        return np.concatenate(columns if start is None else [c + s for c, s in zip(columns, start, strict=True)])

    start = np.cumsum([0, *(len(portion.kind) for portion in traced)])
    joined = {name: all_of(name) for name in TracedPortion.__dataclass_fields__ if name not in ("first_ray", "seconds")}
    offsets = [portion.event_offsets[:-1] + s for portion, s in zip(traced, start[:-1], strict=True)]
    joined["event_offsets"] = np.concatenate([*offsets, start[-1:]])
    joined["crossing_row"] = all_of("crossing_row", start[:-1])
    return TracedPortion(first_ray=0, **joined)
