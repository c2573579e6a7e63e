# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small scenes made of boxes and sheets, written where a test wants them."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.geometry import BodyMesh, write_ply

#: Faces of `box`, two triangles each, in this order.
BOX_FACES = ("left", "right", "front", "back", "bottom", "top")
_BOX_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
_BOX_QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def mesh(name: str, vertices: Any, triangles: Any, faces: dict[str, int] | None = None) -> BodyMesh:
    """A mesh whose faces are runs of triangles: name to number."""
    triangles = np.array(triangles, np.int64).reshape(-1, 3)
    faces = faces or {"Face1": len(triangles)}
    of_triangle = np.repeat(np.arange(len(faces), dtype=np.int32), list(faces.values()))
    return BodyMesh(name, np.array(vertices, float).reshape(-1, 3), triangles, tuple(faces), of_triangle)


def box(name: str, center: Any, size: Any) -> BodyMesh:
    """A closed box with outward triangles and shared corners."""
    size = np.broadcast_to(np.array(size, float), 3)
    triangles = [t for a, b, c, d in _BOX_QUADS for t in ((a, b, c), (a, c, d))]
    return mesh(name, np.array(center) + (_BOX_CORNERS - 0.5) * size, triangles, dict.fromkeys(BOX_FACES, 2))


def sheet(name: str, center: Any, width: float, height: float) -> BodyMesh:
    """An open rectangle in the xy plane that faces +z; its only face is called "sheet"."""
    x, y = width / 2, height / 2
    corners = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]]) + np.array(center)
    return mesh(name, corners, [(0, 1, 2), (0, 2, 3)], {"sheet": 2})


def geometry(folder: Path, body: BodyMesh, file: str | None = None) -> dict[str, Any]:
    """Write a mesh and return the geometry of its body in a scene file."""
    file = file or f"geometry/{body.name}.ply"
    write_ply(folder / file, body)
    counts = np.bincount(body.triangle_face, minlength=len(body.face_names))
    faces = [{"name": n, "triangles": int(c)} for n, c in zip(body.face_names, counts, strict=True)]
    return {"file": file, "faces": faces}


def write_scene(folder: Path, data: dict[str, Any], name: str = "small.scene.json") -> Path:
    """Write a scene file."""
    path = folder / name
    path.write_text(json.dumps(data, indent=1), encoding="utf-8")
    return path


def changed(data: dict[str, Any], place: str, value: Any) -> dict[str, Any]:
    """A copy of nested data with one value set, as in ``changed(scene, "media.glass.refractive_index", 2)``."""
    data = copy.deepcopy(data)
    at: Any = data
    *way, last = place.split(".")
    for key in way:
        at = at[int(key)] if isinstance(at, list) else at[key]
    if isinstance(at, list):
        at[int(last)] = value
    else:
        at[last] = value
    return data


BLOCK_MM, BUBBLE_MM = 10.0, 4.0


def workshop(folder: Path) -> dict[str, Any]:
    """A scene in which every kind of event that is simulated happens, with its geometry written to the folder.

    An absorbing glass cube with a bubble stands between a mirror (below) and a translucent screen (above); an absorbing
    box at the side; a lit chip under the cube. Two detectors: one narrow and one-sided, one that takes all.
    """
    bodies = {
        "Block": (box("Block", (0, 0, 0), BLOCK_MM), "glass", "polished", {"top": "satin"}),
        "Bubble": (box("Bubble", (0, 0, 0.5), BUBBLE_MM), "air", "polished", {}),
        "Mirror": (sheet("Mirror", (0, 0, -15), 40, 40), None, "mirror", {}),
        "Screen": (sheet("Screen", (0, 0, 20), 40, 40), None, "screen", {}),
        "Stop": (box("Stop", (25, 0, 0), (2, 30, 30)), None, "black", {}),
        "Chip": (box("Chip", (0, 0, -12), (4, 4, 1)), None, "white", {}),
    }
    return {
        "format": "raymaps-scene",
        "version": 1,
        "name": "workshop",
        "ambient": "air",
        "media": {
            "air": {"refractive_index": 1.0003},
            "glass": {"refractive_index": 1.5, "absorption_per_mm": [0.05, 0.02, 0.0]},
        },
        "surfaces": {
            "polished": {"kind": "fresnel"},
            "mirror": {"kind": "mirror", "reflectance": [0.9, 0.8, 0.7]},
            "white": {"kind": "lambertian", "reflectance": 0.8},
            "screen": {"kind": "lambertian", "reflectance": 0.3, "transmittance": [0.5, 0.4, 0.3]},
            "black": {"kind": "absorber"},
            "satin": {
                "kind": "mixture",
                "parts": [
                    {"weight": 0.5, "surface": "polished"},
                    {"weight": 0.3, "surface": "screen"},
                    {"weight": 0.2, "surface": "black"},
                ],
            },
        },
        "bodies": {
            name: {"geometry": geometry(folder, m), "medium": medium, "surface": surface, "face_surfaces": faces}
            for name, (m, medium, surface, faces) in bodies.items()
        },
        "sources": {
            "LED": {"kind": "faces", "flux_w": 2.0, "rgb": [1, 2, 1], "body": "Chip", "faces": ["top"]},
            "Lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [-12, 3, 2]},
            "Spot": {
                "kind": "cone", "flux_w": 0.5, "rgb": [0, 0, 1], "position_mm": [0, 1, 0.3], "direction": [1, 0, 0.2],
                "half_angle_deg": 20,
            },
            "Beam": {
                "kind": "disc", "flux_w": 0.25, "rgb": [1, 0, 0], "position_mm": [1, -18, 1], "direction": [0.1, 1, 0],
                "radius_mm": 2,
            },
        },
        "detectors": {
            "Above": {
                "kind": "rectangle", "center_mm": [0, 0, 12], "normal": [0, 0, -1], "x_axis": [1, 0, 0], "width_mm": 24,
                "height_mm": 16, "resolution": [6, 4], "max_angle_deg": 35,
            },
            "Around": {
                "kind": "rectangle", "center_mm": [0, 0, -8], "normal": [0.1, 0, 1], "x_axis": [1, 1, 0],
                "width_mm": 30, "height_mm": 40, "resolution": [3, 5], "side": "both",
            },
        },
        "settings": {"rays": 3000, "seed": 5, "max_events": 12, "roulette_threshold": 0.1},
    }  # fmt: skip


def lamp_in_a_room(folder: Path) -> dict[str, Any]:
    """The smallest useful scene: a point source in a grey box with one detector."""
    return {
        "format": "raymaps-scene",
        "version": 1,
        "name": "room",
        "surfaces": {"grey": {"kind": "lambertian", "reflectance": 0.5}},
        "bodies": {"Room": {"geometry": geometry(folder, box("Room", (0, 0, 0), 10)), "surface": "grey"}},
        "sources": {"Lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 1]}},
        "detectors": {
            "Sensor": {
                "kind": "rectangle", "center_mm": [0, 0, -2], "normal": [0, 0, 1], "x_axis": [1, 0, 0], "width_mm": 6,
                "height_mm": 6, "resolution": [4, 4],
            }
        },
        "settings": {"rays": 2000, "seed": 3},
    }  # fmt: skip


def corners_of(data: dict[str, Any], folder: Path) -> NDArray[np.float64]:
    """Corners of all triangles of a scene in mm, read from its PLY files without the library."""
    return np.concatenate([read_ply(folder / body["geometry"]["file"]) for body in data["bodies"].values()])


def read_ply(path: Path) -> NDArray[np.float64]:
    """Corners of the triangles of a binary PLY with float64 vertices, (n_triangles, 3 corners, 3)."""
    head, _, body = path.read_bytes().partition(b"end_header\n")
    counts = [int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(body, "<f8", 3 * counts[0]).reshape(-1, 3)
    faces = np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<i4", 3)]), counts[1], 24 * counts[0])
    assert (faces["n"] == 3).all()
    return vertices[faces["v"]]
