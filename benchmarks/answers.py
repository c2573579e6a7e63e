# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scenes whose flux is known: by a closed form, or by a reference that shares nothing with the program."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.exact import BEAM_MM, FACETED_MM, GLASS, LENSES, best_focus_mm, rings_for
from raymaps.compile import CompiledScene, compile_scene
from raymaps.kinds import EventKind
from raymaps.run import LARGEST_PORTION
from raymaps.scene import Scene, load_scene
from raymaps.spectral_data import illuminant
from raymaps.trace import Tracer
from raymaps.traced import TracedPortion
from tests.physics import sequential
from tests.physics.adding_doubling import slab
from tests.physics.lenses import write_lenses
from tests.physics.scenes import body, box, disc_source, rectangle, write_scene
from tests.physics.sequential import RaysAt
from tests.physics.test_integrating_sphere import sphere_with_port

__all__ = ["ROUGH", "SMOOTH", "Answer", "Choice", "Runs", "answers"]

Float = NDArray[np.float64]
#: What of each ray's light counts, (n_rays,), of a portion of a compiled scene.
Counted = Callable[[CompiledScene, TracedPortion], Float]

#: Pieces of a run that are independent of each other, as Sobol' points are in 16 replicates.
PIECES = 16
#: Names of the scenes whose light depends smoothly on what decides about a ray, and of those where much is decided.
SMOOTH = ("lamp and square", "singlet and pinhole", "dye in daylight")
ROUGH = ("integrating sphere", "scattering slab")


@dataclass(frozen=True)
class Choice:
    """A way to simulate a scene but for its sampling."""

    words: str
    scene: Scene


@dataclass(frozen=True)
class Answer:
    """A scene with its true flux, relative to what is emitted."""

    name: str
    how: str  # where the true flux comes from
    true: float
    choices: tuple[Choice, ...]
    counted: Counted


class Runs:
    """Runs of a choice, by seed."""

    def __init__(self, answer: Answer, choice: Choice, sampling: str):
        settings = choice.scene.settings.model_copy(update={"sampling": sampling})
        self._compiled = compile_scene(choice.scene.model_copy(update={"settings": settings}))
        self._tracer, self._answer = Tracer(self._compiled, 0), answer

    def trace(self, rays: int, seed: int) -> list[TracedPortion]:
        """Rays of a seed, in portions as large as the program's."""
        self._tracer.seed = seed
        pieces = range(0, rays, LARGEST_PORTION)
        return [self._tracer.trace_portion(first, min(LARGEST_PORTION, rays - first)) for first in pieces]

    def light(self, portions: list[TracedPortion]) -> Float:
        """What of each ray counts, relative to the true flux, (n_rays,)."""
        return np.concatenate([self._answer.counted(self._compiled, one) for one in portions]) / self._answer.true

    def errors(self, portions: list[TracedPortion]) -> Float:
        """Relative errors of `PIECES` independent parts, (PIECES,); their mean is that of the run."""
        light = self.light(portions)
        piece = np.concatenate([one.replicate for one in portions])
        piece = piece if len(piece) else np.arange(len(light)) % PIECES
        return np.bincount(piece, light, PIECES) / np.bincount(piece, minlength=PIECES) - 1


def answers(folder: Path) -> dict[str, Answer]:
    """All scenes, written into a folder."""
    made = (_lamp(folder), _singlet(folder), _dye(folder), _sphere(folder), _milk(folder))
    return {answer.name: answer for answer in made}


# ----------------------------------------------------------------------------------------------------------------------
# What counts


def _crossing(
    compiled: CompiledScene, portion: TracedPortion, *, radius_mm: float = math.inf, event: int | None = None
) -> Float:
    """Light at the detector, perhaps only within a circle or after so many events."""
    row = portion.crossing_row
    ray = np.searchsorted(portion.event_offsets, row, side="right") - 1
    counts = portion.crossing_registered & (np.hypot(*portion.crossing_xy_mm.T) < radius_mm)
    if event is not None:
        counts &= row - portion.event_offsets[ray] == event
    return np.bincount(ray[counts], portion.light[row[counts]].sum(axis=1, dtype=float), len(portion.source))


def _absorbed_by(compiled: CompiledScene, portion: TracedPortion, *, face: tuple[int, str]) -> Float:
    """Light that a face takes from rays that end there."""
    last = portion.event_offsets[1:] - 1
    is_face = compiled.tables.triangle_face[portion.triangle[last]] == compiled.names.faces.index(face)
    ends = is_face & (portion.kind[last] == EventKind.ABSORPTION)
    return np.where(ends, portion.light[last - 1].sum(axis=1, dtype=float), 0.0)


# ----------------------------------------------------------------------------------------------------------------------
# Scenes


def _lamp(folder: Path) -> Answer:
    """A point above a square; of its 4 pi, a square of side 2 a at the distance d sees 4 asin(a² / (a² + d²))."""
    half_mm, height_mm = 20.0, 20.0
    path = write_scene(
        folder / "lamp", {"Floor": body(box((-50, -50, -2), (50, 50, -1)), "black")},
        surfaces={"black": {"kind": "absorber"}},
        sources={"Lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, height_mm]}},
        detectors={"D": rectangle((0, 0, 0), 2 * half_mm, 2 * half_mm, resolution=[1, 1])},
    )  # fmt: skip
    true = math.asin(half_mm**2 / (half_mm**2 + height_mm**2)) / math.pi
    return Answer(SMOOTH[0], "closed form", true, (Choice("", load_scene(path)),), _crossing)


def _singlet(folder: Path) -> Answer:
    """A parallel beam through a lens: what meets the plane of best focus within a circle, without ghosts."""
    lens, radius_mm = LENSES["singlet"], 0.1
    heights = BEAM_MM * np.sqrt((np.arange(400_000) + 0.5) / 400_000)
    start = np.column_stack([heights, np.zeros_like(heights), np.full_like(heights, -20.0)])
    along = np.broadcast_to([0.0, 0.0, 1.0], start.shape)
    faces = [lens.front, lens.rear]
    steps = sequential.trace(faces, [1.0, GLASS, 1.0], start, along)
    z_mm = best_focus_mm(_both_sides(steps[-1]))
    spot = np.hypot(*sequential.at_plane(steps[-1], z_mm).T)
    through = np.ones_like(heights)
    for face, before, step, indices in zip(faces, (along, steps[0].directions), steps, ((1.0, GLASS), (GLASS, 1.0)),
                                           strict=True):  # fmt: skip
        normals = sequential.normals_at(face, step.points_mm)
        cosines = (np.abs((way * normals).sum(axis=1)) for way in (before, step.directions))
        through *= _transmittance(*cosines, *indices)
    detector = {
        "center_mm": [0.0, 0.0, z_mm], "normal": [0, 0, -1], "x_axis": [1, 0, 0], "width_mm": 40, "height_mm": 40,
        "resolution": [1, 1],
    }  # fmt: skip
    beam = {
        "kind": "disc", "flux_w": 1.0, "radius_mm": BEAM_MM, "direction": [0, 0, 1], "position_mm": [0, 0, -20.0],
    }  # fmt: skip
    choices = []
    for surfaces, tolerances in (("exact", (1e-1,)), ("faceted", FACETED_MM[1:4])):
        for tolerance_mm in tolerances:
            rings = rings_for(lens, tolerance_mm)
            path = write_lenses(
                folder / "singlet", {"Lens": (lens, rings)}, {"glass": GLASS}, sources={"Beam": beam},
                detectors={"D": detector}, settings={"surfaces": surfaces}, name=f"{surfaces}-{tolerance_mm:g}",
            )  # fmt: skip
            words = "exact" if surfaces == "exact" else f"facets, {tolerance_mm:g} mm"
            choices.append(Choice(words, load_scene(path)))
    true = float(np.where(spot < radius_mm, through, 0.0).mean())
    counted = partial(_crossing, radius_mm=radius_mm, event=len(faces))
    return Answer(SMOOTH[1], "sequential trace", true, tuple(choices), counted)


def _both_sides(rays: RaysAt) -> RaysAt:
    """Rays of a half meridian with their mirror images, whose best focus is that of the whole beam."""
    mirror = np.array([-1.0, 1.0, 1.0])
    return RaysAt(*(np.concatenate([column, column * mirror]) for column in rays))


def _transmittance(cos_i: Float, cos_t: Float, n_i: float, n_t: float) -> Float:
    """Of unpolarised light at a smooth interface (Born & Wolf, section 1.5, eqs. 20, 21, 34)."""
    s = (n_i * cos_i - n_t * cos_t) / (n_i * cos_i + n_t * cos_t)
    p = (n_t * cos_i - n_i * cos_t) / (n_t * cos_i + n_i * cos_t)
    return 1 - (s**2 + p**2) / 2


def _dye(folder: Path) -> Answer:
    """A cone of daylight through a dye with a line of absorption: Beer-Lambert over spectrum and angles."""
    thickness_mm, half_angle_deg = 10.0, 40.0
    nm = np.linspace(380, 780, 401)
    absorption = 0.01 + 0.3 * np.exp(-(((nm - 610) / 40) ** 2))
    cone = {
        "kind": "cone", "flux_w": 1.0, "position_mm": [0, 0, -5], "direction": [0, 0, 1],
        "half_angle_deg": half_angle_deg, "spectrum": {"kind": "illuminant", "name": "D65"},
    }  # fmt: skip
    path = write_scene(
        folder / "dye", {"Slab": body(box((-60, -60, 0), (60, 60, thickness_mm)), "polished", "dye")},
        surfaces={"polished": {"kind": "fresnel"}},
        media={"dye": {
            "refractive_index": 1.0, "absorption_per_mm": {"wavelength_nm": nm.tolist(), "value": absorption.tolist()},
        }},
        sources={"S": cone},
        detectors={"D": rectangle((0, 0, thickness_mm + 1), 110, 110, normal=[0, 0, -1], resolution=[1, 1])},
    )  # fmt: skip
    scene = load_scene(path)
    lowest = math.cos(math.radians(half_angle_deg))
    x, weight = np.polynomial.legendre.leggauss(40)
    cosine = lowest + (1 - lowest) * (x + 1) / 2
    fine = np.linspace(380, 780, 40_001)
    light = illuminant(fine, "D65")
    depth = np.interp(fine, nm, absorption) * thickness_mm
    mean = np.array([np.trapezoid(light * np.exp(-depth / c), fine) for c in cosine]) / np.trapezoid(light, fine)
    true = float((weight * mean).sum() / 2)
    settings = scene.settings
    rgb = settings.model_copy(update={"without": (*settings.without, "spectral")})
    by_words = {"RGB": rgb} | {
        f"{n} bands": settings.model_copy(update={"spectrum": settings.spectrum.model_copy(update={"bands": n})})
        for n in (4, 8, 32, 128)
    }
    choices = tuple(Choice(words, scene.model_copy(update={"settings": s})) for words, s in by_words.items())
    return Answer(SMOOTH[2], "closed form", true, choices, _crossing)


def _sphere(folder: Path, reflectance: float = 0.98) -> Answer:
    """Light into the port of an integrating sphere: f rho / (1 - rho (1 - f)), as in its test."""
    shape, f = sphere_with_port()
    path = write_scene(
        folder / "sphere", {"Sphere": body(shape, "white", Port="black")},
        surfaces={"white": {"kind": "lambertian", "reflectance": reflectance}, "black": {"kind": "absorber"}},
        sources={"S": {
            "kind": "cone", "flux_w": 1.0, "position_mm": [0, 0, 0], "direction": [0, 0, -1], "half_angle_deg": 60,
        }},
        settings={"max_events": 2000},
    )  # fmt: skip
    true = f * reflectance / (1 - reflectance * (1 - f))
    counted = partial(_absorbed_by, face=(0, "Port"))
    return Answer(ROUGH[0], "closed form", true, (Choice("", load_scene(path)),), counted)


def _milk(folder: Path, depth: float = 10.0, albedo: float = 0.99) -> Answer:
    """A beam onto a slab that scatters evenly, and what gets through: adding and doubling."""
    sides: Sequence[str] = ("plus_x", "minus_x", "plus_y", "minus_y")
    medium: dict[str, Any] = {
        "refractive_index": 1.0, "absorption_per_mm": (1 - albedo) * depth,
        "scattering": [{"coefficient_per_mm": albedo * depth, "phase": {"kind": "isotropic"}}],
    }  # fmt: skip
    path = write_scene(
        folder / "milk",
        {"Slab": body(box((-4, -4, 0), (4, 4, 1)), "polished", "milk", **dict.fromkeys(sides, "side"))},
        media={"milk": medium},
        surfaces={"polished": {"kind": "fresnel"}, "side": {"kind": "mirror", "reflectance": 1.0}},
        sources={"S": disc_source((0, 0, 1.5), (0, 0, -1), 0.1)},
        detectors={"D": rectangle((0, 0, -0.001), 9, 9, resolution=[1, 1])},
        settings={"max_events": 10_000},
    )  # fmt: skip
    true = slab(albedo, depth, np.array([1.0])).transmittance
    return Answer(ROUGH[1], "adding and doubling", true, (Choice("", load_scene(path)),), _crossing)
