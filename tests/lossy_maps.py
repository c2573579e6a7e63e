# SPDX-License-Identifier: LGPL-2.1-or-later
"""Maps with lost rays. Sound scenes lose none, so rays are lost on the way from the tracer to the store."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from raymaps.kinds import EventKind
from raymaps.run import simulate
from raymaps.store import RayMap
from raymaps.trace import Tracer
from raymaps.traced import TracedPortion


def lossy_map(scene: Path, path: Path, n_rays: int = 2000, portion_rays: int = 700) -> RayMap:
    """Trace a scene; of the rays that end on a face every 20th is lost there, every 300th in the middle of nowhere, and
    every 140th as old versions lost rays at touching bodies."""
    trace = Tracer.trace_portion
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Tracer, "trace_portion", lambda self, first, n: with_losses(trace(self, first, n)))
        return simulate(scene, path, rays=n_rays, portion_rays=portion_rays, threads=1)


def with_losses(history: TracedPortion) -> TracedPortion:
    """The same with lost rays, which keep the light that they had."""
    kind, triangle, light = history.kind.copy(), history.triangle.copy(), history.light.copy()
    end = history.event_offsets[1:] - 1
    ray = history.first_ray + np.arange(len(end))
    lost = (ray % 20 == 0) & (triangle[end] >= 0)
    rows = end[lost]
    kind[rows] = EventKind.KILLED_NUMERICAL
    light[rows] = light[rows - 1]
    kind[end[lost & (ray % 140 == 0)]] = EventKind.KILLED_MEDIUM_MISMATCH
    triangle[end[lost & (ray % 300 == 0)]] = -1
    return replace(history, kind=kind, triangle=triangle, light=light)
