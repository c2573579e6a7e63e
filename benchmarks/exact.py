# SPDX-License-Identifier: LGPL-2.1-or-later
"""What exact surfaces bring and cost: the error of a lens's focus against time, beside triangles of any fineness.

Two lenses in a parallel beam: a biconvex one of spheres, and a paraboloid with higher powers of the radius, which is a
B-spline to a CAD program. The reference is a sequential ray trace, ray by ray.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from benchmarks.timing import Timing, alternate, paired
from raymaps.compile import compile_scene
from raymaps.kinds import EventKind
from raymaps.scene import load_scene
from raymaps.trace import Tracer
from tests.physics import sequential
from tests.physics.lenses import Lens, follow, write_lenses
from tests.physics.sequential import LensFace, RaysAt

__all__ = ["Bench", "ExactCost", "FocusError", "measure_exact"]

Surfaces = Literal["exact", "faceted"]

GLASS = 1.5168
RADIUS_MM, BEAM_MM = 15.0, 13.0
LENSES = {
    "singlet": Lens(LensFace(0, 1 / 60), LensFace(9, -1 / 60), RADIUS_MM),
    "asphere": Lens(LensFace(0, 1 / 40, -1.0, (-3e-6, 1e-9)), LensFace(9, -1 / 150), RADIUS_MM),
}
#: How far triangles may lie from the surface; exact surfaces need no fine ones.
FACETED_MM = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
EXACT_MM = (1e-1, 1e-2, 1e-3)
#: Rays whose error is told.
N_COMPARED = 20_000


@dataclass(frozen=True)
class FocusError:
    """A lens with the error of its focus, and the time for that."""

    lens: str
    surfaces: Surfaces
    tolerance_mm: float
    triangles: int
    error_mm: float  # root mean square over rays, of the distance from the ray's true place in the plane of best focus
    prepare_s: float
    s_per_million_rays: Timing


@dataclass(frozen=True)
class ExactCost:
    """CPU time on exact surfaces over that on the triangles, of the same net."""

    lens: str
    tolerance_mm: float
    ratio: Timing  # a value a round


def measure_exact(folder: Path, rays: int, repeats: int, rounds: int) -> tuple[list[FocusError], list[ExactCost]]:
    """Error and time of all lenses, exact and faceted; and what exact surfaces cost on the same triangles."""
    errors: list[FocusError] = []
    costs: list[ExactCost] = []
    for name, lens in LENSES.items():
        benches: list[Bench] = [
            Bench(folder / name, lens, tolerance_mm, surfaces)
            for surfaces, tolerances in (("faceted", FACETED_MM), ("exact", EXACT_MM))
            for tolerance_mm in tolerances
        ]
        timings, _ = alternate(
            {f"{b.surfaces} {b.tolerance_mm}": partial(b.trace, rays) for b in benches},
            repeats, budget_s=60.0,
        )  # fmt: skip
        for b in benches:
            timing = timings[f"{b.surfaces} {b.tolerance_mm}"].scaled(1e6 / rays)
            errors.append(
                FocusError(name, b.surfaces, b.tolerance_mm, b.n_triangles, b.error_mm(), b.prepare_s, timing)
            )
        faceted = {b.tolerance_mm: b for b in benches if b.surfaces == "faceted"}
        for b in benches:
            if b.surfaces == "exact":
                same = faceted[b.tolerance_mm]
                ratio = paired(
                    partial(same.trace, rays), {"exact": partial(b.trace, rays)},
                    rounds, budget_s=30.0,
                )  # fmt: skip
                costs.append(ExactCost(name, b.tolerance_mm, ratio["exact"]))
    return errors, costs


class Bench:
    """Lenses in a parallel beam, ready to be traced.

    Parameters
    ----------
    folder : Path
        Scenes are written there.
    lens : Lens, or several in a row, each cemented to the one before
    tolerance_mm : float
        How far triangles may lie from the surface.
    surfaces : 'exact' or 'faceted'
    media : refractive index by name
    beam_mm, field_deg : radius of the beam, and its angle to the axis
    """

    def __init__(
        self, folder: Path, lens: Lens | Sequence[Lens], tolerance_mm: float, surfaces: Surfaces, *,
        media: dict[str, float] | None = None, beam_mm: float = BEAM_MM, field_deg: float = 0.0,
    ):  # fmt: skip
        lenses = [lens] if isinstance(lens, Lens) else list(lens)
        media = media or {"glass": GLASS}
        self.tolerance_mm, self.surfaces = tolerance_mm, surfaces
        self._faces = [lenses[0].front, *(one.rear for one in lenses)]
        self._indices = [1.0, *(media[one.medium] for one in lenses), 1.0]
        sine, cosine = math.sin(math.radians(field_deg)), math.cos(math.radians(field_deg))
        beam = {
            "kind": "disc", "flux_w": 1.0, "radius_mm": beam_mm, "direction": [sine, 0.0, cosine],
            "position_mm": [-20 * sine, 0.0, -20 * cosine],
        }  # fmt: skip
        rings = max(rings_for(one, tolerance_mm) for one in lenses)
        scene = load_scene(
            write_lenses(
                folder, {f"Lens{i}": (one, rings) for i, one in enumerate(lenses, 1)}, media, sources={"Beam": beam},
                settings={"surfaces": surfaces}, name=f"{surfaces}-{tolerance_mm:g}",
            )
        )  # fmt: skip
        started = time.perf_counter()
        self._tracer = Tracer(compile_scene(scene), 1)
        self.prepare_s = time.perf_counter() - started
        self.n_triangles = len(self._tracer.compiled.tables.triangle_face)

    def trace(self, rays: int) -> int:
        """Trace one portion."""
        return self._tracer.trace_portion(0, rays).first_ray

    def error_mm(self, n_rays: int = N_COMPARED) -> float:
        """Root mean square, over rays, of how far a ray meets the plane of best focus from its true place."""
        found, true = self.spot_mm(n_rays)
        return float(np.sqrt(((found - true) ** 2).sum(axis=1).mean()))

    def spot_mm(self, n_rays: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where rays that are refracted at each face meet the plane of best focus, and where they should, (n, 2)."""
        steps = follow(self._tracer, n_rays)
        start = steps[0]
        true = sequential.trace(self._faces, self._indices, start.points_mm, start.directions)[-1]
        last = steps[len(self._faces)]
        through = np.ones(n_rays, bool)
        for step in steps[1 : len(self._faces) + 1]:
            refracted = np.zeros(n_rays, bool)
            refracted[step.rays[step.kind == EventKind.FRESNEL_REFRACTION]] = True
            through &= refracted
        rows = through[last.rays] & ~np.isnan(true.directions[last.rays, 2]) & (last.directions[:, 2] > 0)
        true = RaysAt(*(column[last.rays[rows]] for column in true))
        z_mm = best_focus_mm(true)
        found = RaysAt(last.points_mm[rows], last.directions[rows])
        return sequential.at_plane(found, z_mm), sequential.at_plane(true, z_mm)


def rings_for(lens: Lens, tolerance_mm: float) -> int:
    """Rings of a net whose triangles, of the side h, lie h²/(6 R) off a sphere of the radius R in their middle."""
    steepest = max(abs(lens.front.curvature_per_mm), abs(lens.rear.curvature_per_mm))
    return math.ceil(lens.radius_mm / math.sqrt(6 * tolerance_mm / steepest))


def best_focus_mm(rays: RaysAt) -> float:
    """z of the plane across the axis in which rays lie closest together, by least squares."""
    slope = rays.directions[:, :2] / rays.directions[:, 2:]
    start = rays.points_mm[:, :2] - rays.points_mm[:, 2:] * slope
    slope, start = slope - slope.mean(axis=0), start - start.mean(axis=0)
    return float(-(slope * start).sum() / (slope * slope).sum())
