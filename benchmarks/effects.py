# SPDX-License-Identifier: LGPL-2.1-or-later
"""What effects cost: nothing where a scene does not use them, and how much once it does.

The scene is the glass ball in a white box, with a black safe in a corner that no light gets into. An effect is put into
the safe, or on the ball.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import trimesh

import raymaps.trace
from benchmarks.scenes import BALL_IN_BOX
from benchmarks.timing import Timing, alternate, paired
from raymaps.compile import CompiledScene, compile_scene
from raymaps.effects import EFFECTS, needed_effects
from raymaps.run import simulate
from raymaps.scene import Scene, load_scene
from raymaps.trace import Tracer

__all__ = ["EffectCost", "UnusedEffect", "measure_effect_costs", "measure_unused_effects"]

LAYER = {"medium": "film", "thickness_nm": 99.6}
OVER_ANGLE = {"angle_deg": [0, 45, 90], "value": [[0.3], [0.4], [0.9]]}
HALF_AND_HALF = [{"weight": 0.5, "surface": "polished"}, {"weight": 0.5, "surface": "white"}]

#: Kinds of surface that can stand on the ball; None is the medium alone.
SURFACES: dict[str, dict[str, Any]] = {
    "absorber": {"kind": "absorber"},
    "mirror": {"kind": "mirror", "reflectance": 0.9},
    "lambertian": {"kind": "lambertian", "reflectance": 0.9},
    "mixture": {"kind": "mixture", "parts": HALF_AND_HALF},
    "coefficients": {
        "kind": "coefficients", "specular_reflectance": OVER_ANGLE, "diffuse_transmittance": 0.1,
    },
    "thin_film": {"kind": "thin_film", "layers": [LAYER]},
    "rough": {"kind": "rough", "roughness": 0.2},
    "gaussian": {"kind": "gaussian", "reflectance": 0.5, "transmittance": 0.4, "sigma": 0.1},
    "abg": {"kind": "abg", "reflectance": 0.9, "a": 0.001, "b": 0.0001, "g": 2.0},
    "bsdf": {"kind": "bsdf", "data": {"file": "measured.csv"}},
}  # fmt: skip
#: Media that can fill the ball, by the effect that they call for.
MEDIA: dict[str, dict[str, Any]] = {
    "medium_scattering": {
        "refractive_index": 1.5,
        "scattering": [{"coefficient_per_mm": 0.02, "phase": {"kind": "henyey_greenstein", "g": 0.8}}],
    },
    "conductor": {"refractive_index": 0.2, "extinction": 3.4},
    "dispersion": {"refractive_index": {"formula": "cauchy", "coefficients": [1.48, 0.004]}},
}
WHITE_LIGHT = {"kind": "illuminant", "name": "D65"}
MEASURED = "# side: front\n# goes: reflection\ntheta_i,theta_s,phi_s,bsdf\n" + "".join(
    f"{i},{s},{p},{0.2 + 0.0005 * s}\n" for i in (0, 40, 80) for s in (0, 40, 80) for p in (0, 90, 180, 270)
)


@dataclass(frozen=True)
class UnusedEffect:
    """CPU time of a scene with something that it does not use, over that without."""

    what: str
    ratio: Timing  # a value a round
    same_content: bool


@dataclass(frozen=True)
class EffectCost:
    """The scene with an effect switched on."""

    effect: str
    rays_per_s: Timing
    segments_per_ray: float
    ns_per_segment: Timing
    over_plain: Timing
    share: float


class _Scenes:
    """Variants of the scene, written into a folder."""

    def __init__(self, folder: Path):
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        trimesh.creation.icosphere(subdivisions=4, radius=15.0).export(folder / "ball.ply")
        trimesh.creation.box(extents=(100.0, 100.0, 100.0)).export(folder / "box.ply")
        corner = trimesh.creation.box(bounds=((38.0, 38.0, 38.0), (48.0, 48.0, 48.0)))
        corner.export(folder / "safe.ply")
        hidden = trimesh.creation.icosphere(subdivisions=1, radius=3.0)
        hidden.apply_translation((43.0, 43.0, 43.0))
        hidden.export(folder / "hidden.ply")
        (folder / "measured.csv").write_text(MEASURED, encoding="utf-8")

    def plain(self) -> dict[str, Any]:
        """The scene as data."""
        data = json.loads(json.dumps(BALL_IN_BOX))
        data["surfaces"]["black"] = {"kind": "absorber"}
        data["bodies"]["Safe"] = {"geometry": {"file": "safe.ply"}, "medium": None, "surface": "black"}
        return data

    def load(self, name: str, data: dict[str, Any]) -> Scene:
        """A variant as a scene."""
        path = self._folder / f"{name}.scene.json"
        path.write_text(json.dumps({**data, "name": name}), encoding="utf-8")
        return load_scene(path)

    def with_all_defined(self) -> Scene:
        """Every surface property and medium is described and none of them stands anywhere."""
        data = self.plain()
        data["media"] |= {"film": {"refractive_index": 1.38}, **MEDIA}
        data["surfaces"] |= {name: prop for name, prop in SURFACES.items() if name not in data["surfaces"]}
        return self.load("all-defined", data)

    def with_effect(self, effect: str, body: str) -> Scene:
        """An effect called for by a body: the ball, or one hidden in the safe."""
        data = self.plain()
        data["bodies"].setdefault(body, {"geometry": {"file": "hidden.ply"}, "medium": "glass", "surface": "polished"})
        if effect in SURFACES:
            data["media"]["film"] = {"refractive_index": 1.38}
            data["surfaces"][f"{effect} on it"] = SURFACES[effect]
            data["bodies"][body]["surface"] = f"{effect} on it"
        elif effect in MEDIA:
            data["media"][effect] = MEDIA[effect]
            data["bodies"][body]["medium"] = effect
        if effect in ("spectral", "dispersion"):
            data["sources"]["Lamp"]["spectrum"] = WHITE_LIGHT
        return self.load(f"{effect}-{body}", data)


def measure_unused_effects(folder: Path, rays: int, rounds: int) -> list[UnusedEffect]:
    """Time and content of the scene as it is, beside the scene with what it does not use."""
    scenes = _Scenes(folder)
    plain = scenes.load("plain", scenes.plain())
    variants: dict[str, tuple[Scene, bool]] = {
        "plain": (plain, False),
        "nothing: the plain scene once more": (plain, False),
        "only its own effects in the program": (plain, True),
        "all described, none on a body": (scenes.with_all_defined(), False),
    }
    for effect in (*SURFACES, "medium_scattering", "conductor"):
        if effect not in needed_effects(plain):
            variants[f"{effect} where no light gets"] = (scenes.with_effect(effect, "Hidden"), False)
    contents = {name: _content(scene, folder / "content.raymap") for name, (scene, _) in variants.items()}
    works = {name: _tracing(scene, rays, own_effects_only=alone) for name, (scene, alone) in variants.items()}
    base = works.pop("plain")
    ratios = paired(base, works, rounds, budget_s=120.0)
    return [UnusedEffect(name, ratio, contents[name] == contents["plain"]) for name, ratio in ratios.items()]


def measure_effect_costs(folder: Path, rays: int, repeats: int) -> list[EffectCost]:
    """Time of the scene with each effect switched on, beside the plain one."""
    scenes = _Scenes(folder)
    variants = {"none besides": scenes.load("plain", scenes.plain())}
    for effect in (*(e.name for e in EFFECTS),):
        if effect in SURFACES or effect in MEDIA or effect == "spectral":
            variants[effect] = scenes.with_effect(effect, "Ball")
    compiled = {name: compile_scene(scene) for name, scene in variants.items()}
    tracers = {name: Tracer(one, 1) for name, one in compiled.items()}
    timings, portions = alternate(
        {name: partial(tracer.trace_portion, 0, rays) for name, tracer in tracers.items()},
        repeats, budget_s=120.0,
    )  # fmt: skip
    costs = []
    segments = {name: len(portion.kind) - rays for name, portion in portions.items()}
    plain = timings["none besides"].scaled(1e9 / segments["none besides"])
    for name, timing in timings.items():
        per_segment = timing.scaled(1e9 / segments[name])
        seconds = portions[name].seconds
        costs.append(
            EffectCost(
                name, timing.rate(rays), segments[name] / rays, per_segment, per_segment.over(plain),
                seconds.get(name, 0.0) / sum(seconds.values()),
            )
        )  # fmt: skip
    return costs


def _tracing(scene: Scene, rays: int, *, own_effects_only: bool) -> Callable[[], int]:
    """Traces one portion; the tracer is made beforehand, in a program of all effects or of the scene's own."""
    compiled = compile_scene(scene)
    tracer = _tracer_of_own_effects(compiled) if own_effects_only else Tracer(compiled, 1)
    return lambda: tracer.trace_portion(0, rays).first_ray


def _tracer_of_own_effects(compiled: CompiledScene) -> Tracer:
    own = tuple(effect for effect in EFFECTS if effect.name in compiled.effects)
    raymaps.trace.EFFECTS = own
    try:
        return Tracer(compiled, 1)
    finally:
        raymaps.trace.EFFECTS = EFFECTS


def _content(scene: Scene, path: Path) -> str:
    """Content hash of some of a scene's rays."""
    import shutil

    shutil.rmtree(path, ignore_errors=True)
    try:
        return simulate(scene, path, rays=5_000).content_hash
    finally:
        shutil.rmtree(path, ignore_errors=True)
