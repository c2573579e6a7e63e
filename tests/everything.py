# SPDX-License-Identifier: LGPL-2.1-or-later
"""A scene that calls for every effect, with every kind of source and detector."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from raymaps.run import simulate
from tests.physics.scenes import ball, body, box, disc_source, rectangle, write_scene

VISIBLE = (380.0, 780.0)
WARM = {"kind": "black_body", "temperature_k": 3000}

MEDIA: dict[str, Any] = {
    "air": {"refractive_index": 1.0003},
    "glass": {"catalogue": "N-BK7"},
    "water": {"refractive_index": {"formula": "cauchy", "coefficients": [1.3244, 0.003046]}},
    "MgF2": {"refractive_index": 1.38},
    "tinted": {"refractive_index": 1.49, "absorption_per_mm": {"wavelength_nm": VISIBLE, "value": [0.3, 0.01]}},
    "milk": {
        "refractive_index": 1.35,
        "absorption_per_mm": 0.01,
        "scattering": [
            {"coefficient_per_mm": 0.4, "phase": {"kind": "henyey_greenstein", "g": 0.9}},
            {"coefficient_per_mm": {"wavelength_nm": VISIBLE, "value": [0.3, 0.1]}},
            {
                "coefficient_per_mm": 0.1,
                "phase": {"kind": "table", "angle_deg": [0, 30, 180], "value": [5, 1, 0.1]},
            },
        ],
    },
    "metal": {
        "refractive_index": {"wavelength_nm": VISIBLE, "n": [1.6, 0.18]},
        "extinction": {"wavelength_nm": VISIBLE, "value": [1.9, 4.2]},
    },
}

SURFACES: dict[str, Any] = {
    "black": {"kind": "absorber"},
    "mirror": {"kind": "mirror", "reflectance": 0.93},
    "white": {"kind": "lambertian", "reflectance": {"wavelength_nm": VISIBLE, "value": [0.8, 0.92]}},
    "red": {"kind": "lambertian", "reflectance": [0.8, 0.1, 0.05], "transmittance": 0.02},
    "polished": {"kind": "fresnel"},
    "ground": {"kind": "rough", "roughness": 0.3},
    "brushed": {"kind": "rough", "roughness": 0.15},
    "satin": {
        "kind": "mixture",
        "parts": [{"weight": 0.6, "surface": "polished"}, {"weight": 0.4, "surface": "ground"}],
    },
    "coated": {"kind": "thin_film", "layers": [{"medium": "MgF2", "thickness_nm": 99.6}]},
    "filter": {
        "kind": "coefficients",
        "specular_reflectance": {"angle_deg": [0, 60, 90], "value": [[0.05], [0.1], [0.8]]},
        "specular_transmittance": {"wavelength_nm": [380, 550, 560, 780], "value": [0.0, 0.0, 0.1, 0.1]},
        "diffuse_reflectance": [0.0, 0.0, 0.05],
        "diffuse_transmittance": 0.0,
    },
    "stained": {"kind": "gaussian", "reflectance": 0.6, "transmittance": 0.2, "scattered_share": 0.5, "sigma": 0.1},
    "scratched": {"kind": "abg", "reflectance": 0.9, "a": 0.001, "b": 0.0001, "g": 2.0},
    "measured": {"kind": "bsdf", "data": {"file": "measured.csv"}},
}

#: A BRDF in our own format: matt, with a broad lobe that grows towards grazing incidence.
MEASURED = "# side: front\n# goes: reflection\ntheta_i,theta_s,phi_s,bsdf\n" + "".join(
    f"{i},{s},{p},{0.12 + 0.05 * np.cos(np.radians(p)) * np.sin(np.radians(s)) * np.sin(np.radians(i)):.5f}\n"
    for i in (0, 30, 60, 85)
    for s in (0, 30, 60, 85)
    for p in (0, 90, 180, 270)
)


def write_rays(path: Path) -> None:
    """A small Zemax ray file: a fan of rays from the origin along z."""
    header = struct.pack("<ii100s", 1010, 50, b"fan")
    header += struct.pack("<7f", 1.0, 1.0, 0.55, 0.0, 0.0, 0.0, 0.0)
    header += struct.pack("<i9f4f", 4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    header += struct.pack("<4i", 0, 0, 0, 0)
    x = np.linspace(-0.3, 0.3, 50)
    rows = np.column_stack([x, 0 * x, 0 * x, x, 0 * x, np.sqrt(1 - x * x), 1 + x]).astype("<f4")
    path.write_bytes(header + rows.tobytes())


def sources() -> dict[str, Any]:
    """Every kind of source, in every form of spectrum."""
    at = {"position_mm": [0.0, 0.0, 12.0], "direction": [0.1, 0.2, -1.0], "flux_w": 1.0}
    return {
        "Point": {"kind": "point", "flux_w": 1.0, "position_mm": [8, 8, 8], "rgb": [1, 0.8, 0.6]},
        "Cone": {**at, "kind": "cone", "half_angle_deg": 40, "spectrum": {"kind": "illuminant", "name": "D65"}},
        "Disc": {**disc_source((-8, 2, 12), (0, 0, -1), 2.0), "spectrum": WARM},
        "Laser": {
            **at, "kind": "gaussian_beam", "waist_radius_mm": 0.5, "divergence_deg": 1.0,
            "spectrum": {"kind": "lines", "wavelength_nm": [532.0, 632.8], "share": [2, 1]},
        },
        "Sun": {**at, "kind": "sun", "radius_mm": 3.0, "ray_share": 0.5},
        "Chip": {
            "kind": "faces", "flux_w": 1.0, "body": "Chip", "faces": ["+z"],
            "spectrum": {"kind": "table", "wavelength_nm": [430, 450, 470], "value": [0, 1, 0]},
        },
        "Spot": {
            "kind": "faces", "flux_w": 1.0, "body": "Chip", "faces": ["-z"],
            "emission": {"kind": "cosine_power", "exponent": 5},
        },
        "Batwing": {
            "kind": "faces", "flux_w": 1.0, "body": "Chip", "faces": ["+x"],
            "emission": {"kind": "table", "angle_deg": [0, 40, 80], "value": [0.5, 1, 0]},
        },
        "Luminaire": {
            "kind": "luminaire", "flux_w": 1.0, "position_mm": [0, -8, 12],
            "intensity": {
                "c_deg": [0, 180, 360], "gamma_deg": [0, 30, 60], "candela": [[3, 2, 0], [3, 1, 0], [3, 2, 0]]
            },
        },
        "Rays": {"kind": "rays", "flux_w": 1.0, "file": "fan.dat", "position_mm": [0, 0, 13], "z_axis": [0, 0, -1]},
        "Replay": {"kind": "crossings", "flux_w": 1.0, "map": "first.raymap", "detector": "Exit"},
    }  # fmt: skip


def bodies() -> dict[str, Any]:
    """Bodies of every surface property and medium, none touching another, in a white room."""
    spots = [(x, y) for x in (-10, -5, 0, 5, 10) for y in (-10, -5, 0, 5, 10)]
    kinds = [
        ("polished", "glass"), ("polished", "water"), ("polished", "tinted"), ("polished", "milk"),
        ("polished", "metal"), ("ground", "glass"), ("brushed", "metal"), ("satin", "glass"),
        ("coated", "glass"), ("coated", "metal"),
        ("filter", "glass"), ("filter", None), ("stained", "glass"), ("stained", None), ("scratched", None),
        ("measured", None), ("mirror", None), ("black", None), ("red", None), ("white", None),
    ]  # fmt: skip
    found = {
        f"{surface}_{medium}": body(ball(1.7, 2).moved(x, y, 2.0), surface, medium)
        for (surface, medium), (x, y) in zip(kinds, spots, strict=False)
    }
    found["Chip"] = body(box((9, 9, 5), (11, 11, 5.5)), "white")
    found["Room"] = body(box((-15, -15, -1), (15, 15, 15)).inside_out, "white", plus_x="scratched", minus_x="measured")
    return found


def write_everything(folder: Path, **settings: Any) -> Path:
    """Write the scene with all its files; returns the path of the scene file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "measured.csv").write_text(MEASURED, encoding="utf-8")
    write_rays(folder / "fan.dat")
    first = write_scene(
        folder, {}, name="first", sources={"Beam": disc_source((0, 0, 0), (0, 0, 1), 1.0)},
        detectors={"Exit": rectangle((0, 0, 5), 4, 4, side="both")},
    )  # fmt: skip
    simulate(first, folder / "first.raymap", rays=500, threads=1)
    detectors = {
        "Plane": rectangle((0, 0, 6), 25, 25, side="both"),
        "Glow": {"kind": "face", "body": "Room", "faces": ["-z"], "measure": "absorbed"},
        "Far": {"kind": "far_field"},
    }
    return write_scene(
        folder, bodies(), name="everything", ambient="air", media=MEDIA, surfaces=SURFACES, sources=sources(),
        detectors=detectors, settings={"max_events": 200, **settings},
    )  # fmt: skip
