# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is simulated: every shipped example, and a scene as simple as they come."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import trimesh

from raymaps.materials import Lambertian, SpectrumTable
from raymaps.scene import Illuminant, Scene, SpectralBands, load_scene

__all__ = ["EXAMPLES_FOLDER", "SPECTRAL_BANDS", "bench_scenes", "in_wavelengths", "without_detectors"]

EXAMPLES_FOLDER = Path(__file__).parent.parent / "examples"

#: Bands of a spectral simulation, as many wavelengths as in the paper.
SPECTRAL_BANDS = 33

#: A glass ball in a white box with a small lamp beside it; a detector stands behind the ball.
BALL_IN_BOX = {
    "format": "raymaps-scene",
    "version": 1,
    "name": "ball_in_box",
    "media": {"glass": {"refractive_index": 1.5, "absorption_per_mm": 0.002}},
    "surfaces": {"polished": {"kind": "fresnel"}, "white": {"kind": "lambertian", "reflectance": 0.7}},
    "bodies": {
        "Ball": {"geometry": {"file": "ball.ply"}, "medium": "glass", "surface": "polished"},
        "Box": {"geometry": {"file": "box.ply"}, "medium": None, "surface": "white"},
    },
    "sources": {"Lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [0.0, 0.0, -30.0]}},
    "detectors": {
        "Behind": {
            "kind": "rectangle", "center_mm": [0.0, 0.0, 30.0], "normal": [0.0, 0.0, -1.0], "x_axis": [1.0, 0.0, 0.0],
            "width_mm": 80.0, "height_mm": 80.0, "resolution": [80, 80],
        }
    },
}  # fmt: skip


def bench_scenes(folder: Path) -> dict[str, Scene]:
    """All scenes by name; the simple one is written into a folder first."""
    folder.mkdir(parents=True, exist_ok=True)
    trimesh.creation.icosphere(subdivisions=4, radius=15.0).export(folder / "ball.ply")
    trimesh.creation.box(extents=(100.0, 100.0, 100.0)).export(folder / "box.ply")
    simple = folder / "ball_in_box.scene.json"
    simple.write_text(json.dumps(BALL_IN_BOX), encoding="utf-8")
    scenes = [load_scene(path) for path in (simple, *sorted(EXAMPLES_FOLDER.glob("*.scene.json")))]
    return {scene.name: scene for scene in scenes}


def without_detectors(scene: Scene) -> Scene:
    """The same scene, its detectors taken away."""
    return scene.model_copy(update={"detectors": {}})


def in_wavelengths(scene: Scene) -> Scene:
    """The same scene in daylight, its diffuse surfaces a little warm, with spectra stored."""

    def warm(reflectance: Any) -> SpectrumTable:
        largest = max(reflectance)
        return SpectrumTable(wavelength_nm=(380.0, 780.0), value=(0.9 * largest, largest))

    surfaces = {
        name: prop.model_copy(update={"reflectance": warm(prop.reflectance)}) if isinstance(prop, Lambertian) else prop
        for name, prop in scene.surfaces.items()
    }
    daylight = Illuminant(name="D65")
    sources = {name: source.model_copy(update={"spectrum": daylight}) for name, source in scene.sources.items()}
    bands = SpectralBands(bands=SPECTRAL_BANDS)
    settings = scene.settings.model_copy(update={"spectrum": bands, "store": "spectral"})
    return scene.model_copy(update={"surfaces": surfaces, "sources": sources, "settings": settings})
