# SPDX-License-Identifier: LGPL-2.1-or-later
"""A small scene in which everything happens."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.physics.scenes import ball, body, box, disc_source, rectangle, write_scene

#: Solids, the smallest first: where they overlap the smaller rules. Left and Right overlap, Core stands in Ball.
RANKED = ("Core", "Right", "Left", "Ball")
#: Solids in which sources stand.
SOURCE_SOLIDS = {"Point": (), "Inside": ("Ball",), "Spot": ("Left",), "Beam": (), "Lamp": ()}


def everything(folder: Path, **sections: Any) -> Path:
    """Write the scene: all kinds of surfaces and sources, coloured media, nested, overlapping and open bodies."""
    sheet = box((15, -9, -9), (15.5, 9, 9))
    sheet = sheet._replace(triangles=sheet.triangles[2:4], faces=(("+x", 2),))
    mixture = [("white", 0.5), ("mirror", 0.3), ("black", 0.2)]
    return write_scene(
        folder,
        {
            "Ball": body(ball(8, 3), "polished", "glass"),
            "Core": body(ball(3, 2).moved(2, 0, 0), "polished", "ink"),
            "Floor": body(box((-40, -40, -21), (40, 40, -20)), "mixed", minus_x="black"),
            "Sheet": body(sheet.turned(0.1, (0, 0, 1)), "white"),
            "Wall": body(box((-30, -20, -20), (-29, 20, 20)).turned(0.2, (1, 3, 1)), "mirror", plus_x="tinted"),
            "Left": body(box((-6, 20, -3), (0, 26, 3)).turned(0.1, (1, 0, 1)), "polished", "glass"),
            "Right": body(box((-2, 19, -2), (6, 25, 2)), "coated", "ink"),
        },
        ambient="fog",
        media={
            "glass": {"refractive_index": 1.5, "absorption_per_mm": [0.001, 0.01, 0.05]},
            "ink": {"refractive_index": 1.33, "absorption_per_mm": [0.2, 0.01, 0.0]},
            "fog": {"refractive_index": 1.0003, "absorption_per_mm": [0.0001, 0.001, 0.003]},
        },
        surfaces={
            "polished": {"kind": "fresnel"},
            "white": {"kind": "lambertian", "reflectance": [0.8, 0.6, 0.5], "transmittance": [0.1, 0.2, 0.3]},
            "mirror": {"kind": "mirror", "reflectance": [0.9, 0.8, 0.7]},
            "tinted": {"kind": "mirror", "reflectance": [0, 0, 0.7]},
            "black": {"kind": "absorber"},
            "mixed": {"kind": "mixture", "parts": [{"weight": w, "surface": s} for s, w in mixture]},
            "coated": {
                "kind": "mixture",
                "parts": [{"weight": 0.8, "surface": "polished"}, {"weight": 0.2, "surface": "white"}],
            },
        },
        sources={
            "Point": {"kind": "point", "flux_w": 2, "position_mm": [0, 0, 15], "rgb": [0.5, 0.3, 0.2]},
            "Inside": {"kind": "point", "flux_w": 0.7, "position_mm": [-4, 0, 0]},
            "Spot": {
                "kind": "cone",
                "flux_w": 0.5,
                "position_mm": [-3, 22, 0],
                "direction": [1, 0, 0.2],
                "half_angle_deg": 130,
            },
            "Beam": disc_source((0, 0, 30), (0.1, 0, -1), 12, 2, (0.1, 0.1, 1)),
            "Lamp": {"kind": "faces", "flux_w": 1, "body": "Floor", "faces": ["+z", "+y"], "rgb": [1, 0, 0.1]},
        },
        detectors={
            "Flat": rectangle((0, 0, -15), 30, 20, side="both"),
            "Tilted": rectangle(
                (3, 1, 11), 25, 30, normal=[1, 0.5, 2], x_axis=[0, 1, 0], side="front", max_angle_deg=35
            ),
            "Back": rectangle((0, 0, -14), 30, 20, side="back", max_angle_deg=60),
            "Through": rectangle((0, 0, 0), 40, 40, normal=[1, 0, 0], x_axis=[0, 0, 1]),
        },
        **sections,
    )
