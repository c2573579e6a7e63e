# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of what detectors register, as the program draws them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

import raymaps
from docs.drawing.scenes import trace

__all__ = ["draw_face", "draw_rectangle"]

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _example(folder: Path, name: str, rays: int, **detectors: dict[str, Any]) -> raymaps.RayMap:
    """An example with further detectors, traced."""
    scene = json.loads((EXAMPLES / f"{name}.scene.json").read_text(encoding="utf-8"))
    for body in scene["bodies"].values():
        body["geometry"]["file"] = str(EXAMPLES / body["geometry"]["file"])
    scene["detectors"].update(detectors)
    path = folder / f"{name}.scene.json"
    path.write_text(json.dumps(scene))
    return raymaps.simulate(path, folder / f"{name}.raymap", rays=rays)


def _picture(raymap: raymaps.RayMap, name: str, folder: Path, width: int, **asked: Any) -> Image.Image:
    raymaps.evaluate_detector(raymap, name, **asked).write(folder / "drawn.png")
    image = Image.open(folder / "drawn.png").convert("RGB")
    return image.resize((width, round(image.height * width / image.width)), Image.Resampling.LANCZOS)


def draw_rectangle(folder: Path) -> Image.Image:
    """Irradiance on the middle of the work plane of the LED example."""
    middle = {
        "kind": "rectangle", "center_mm": [0, 0, 0.05], "normal": [0, 0, 1], "x_axis": [1, 0, 0],
        "width_mm": 50, "height_mm": 50, "resolution": [100, 100],
    }  # fmt: skip
    raymap = _example(folder, "led_collimator", 1_000_000, Middle=middle)
    return _picture(raymap, "Middle", folder, 620)


def draw_face(folder: Path) -> Image.Image:
    """Light on two walls and the floor of a corner, in which a ball stands."""
    corners = np.array([[x, y, z] for x in (0, 100) for y in (0, 100) for z in (0, 100)], float)
    squares = ((0, 4, 6, 2), (0, 1, 5, 4), (0, 2, 3, 1))  # each seen from within
    corner = trimesh.Trimesh(corners, [t for a, b, c, d in squares for t in ((a, b, c), (a, c, d))], process=False)
    ball = trimesh.creation.icosphere(4, 16)
    ball.apply_translation((48, 48, 17))
    rays = trace(
        folder, "corner", {"Corner": {"shape": corner, "surface": "white"}, "Ball": {"shape": ball, "surface": "grey"}},
        rays=2_000_000,
        surfaces={
            "white": {"kind": "lambertian", "reflectance": 0.5}, "grey": {"kind": "lambertian", "reflectance": 0.3},
        },
        sources={"Lamp": {"kind": "point", "flux_w": 10, "position_mm": [75, 68, 80]}},
        detectors={"Walls": {"kind": "face", "body": "Corner"}},
    )  # fmt: skip
    return _picture(rays.raymap, "Walls", folder, 700, resolution=(50, 50))
