# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scenes with known answers whose cost is foretold, and the runs that tell what it was."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from raymaps.accuracy import Outlook
from raymaps.run import Progress, simulate
from raymaps.scene import Scene, load_scene
from raymaps.target import Target, quantities
from tests.physics.scenes import body, box, rectangle, write_scene
from tests.physics.test_integrating_sphere import sphere_with_port

__all__ = ["SCENES", "Real", "real_run"]

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _discs(folder: Path) -> tuple[Scene, Target]:
    """A Lambertian disc and a square detector: smooth."""
    scene = write_scene(
        folder / "discs",
        {"Floor": body(box((-50, -50, -2), (50, 50, -1)), "black")},
        surfaces={"black": {"kind": "absorber"}},
        sources={"Lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [3, 0, 20]}},
        detectors={"D": rectangle((0, 0, 0), 40, 40, resolution=[1, 1])},
    )
    return load_scene(scene), Target(1, "D")


def _singlet(folder: Path) -> tuple[Scene, Target]:
    """A lens of exact surfaces in a barrel."""
    return load_scene(EXAMPLES / "singlet_barrel.scene.json"), Target(1, "SensorPlane")


def _led(folder: Path) -> tuple[Scene, Target]:
    """Lamps, a collimator and a diffuser: many bounces."""
    return load_scene(EXAMPLES / "led_collimator.scene.json"), Target(1, "Target")


def _sphere(folder: Path) -> tuple[Scene, Target]:
    """An integrating sphere with a port: rough."""
    shape, _ = sphere_with_port()
    scene = write_scene(
        folder / "sphere",
        {"Sphere": body(shape, "white", Port="black")},
        surfaces={"white": {"kind": "lambertian", "reflectance": 0.9}, "black": {"kind": "absorber"}},
        sources={"S": {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 0]}},
    )
    return load_scene(scene), Target(1, where="hit(Sphere.Port)")


SCENES: dict[str, Callable[[Path], tuple[Scene, Target]]] = {
    "lamp over a screen": _discs,
    "singlet in a barrel": _singlet,
    "LED and collimator": _led,
    "integrating sphere": _sphere,
}


@dataclass(frozen=True)
class Real:
    """Rays and time of tracing that a relative error took."""

    rays: float
    tracing_s: float


def real_run(scene: Scene, target: Target, outlook: Outlook, rays: int, folder: Path) -> Real:
    """Trace so many rays, and scale to the error that was foretold for them by what they show.

    One run by Sobol' points knows its error to a quarter, so several tell.
    """
    sampling, n_runs = ("sobol", 6) if "Sobol'" in outlook.words else ("random", 1)
    scene = scene.model_copy(update={"settings": scene.settings.model_copy(update={"sampling": sampling})})
    law = outlook.noise
    assert law is not None
    squares, tracing_s = [], []
    for seed in range(1, n_runs + 1):
        at: list[Progress] = []
        raymap = simulate(scene, folder / f"{sampling}-{seed}.raymap", rays=rays, seed=seed, on_progress=at.append)
        tracing_s.append(at[-1].elapsed_s - at[0].elapsed_s)
        (quantity,) = quantities(raymap, target)
        tallies = [quantity.tally(portion) for portion in raymap.portions]
        squares.append(sum(tallies[1:], tallies[0]).relative_error(raymap.source_flux_w, quantity.exact) ** 2)
    more = (statistics.mean(squares) ** 0.5 / law.error(rays)) ** (1 / law.exponent)
    return Real(rays * more, statistics.median(tracing_s) * more)
