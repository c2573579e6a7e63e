# SPDX-License-Identifier: LGPL-2.1-or-later
"""The model with its rays as one page that a browser shows and turns: nothing outside the file is needed."""

from __future__ import annotations

import base64
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.results.camera import fit_camera
from raymaps.results.colours import paper_colours
from raymaps.results.files import write_text
from raymaps.results.model_view import EDGE_RGBA, ModelView, Shape

__all__ = ["view_to_html", "write_page"]


def write_page(content: ModelView, path: str | Path) -> Path:
    """Write the page; raises `OutputError`."""
    return write_text(path, view_to_html(content))


def view_to_html(content: ModelView) -> str:
    """The page; geometry is embedded as little-endian float32 relative to the middle of what is seen."""
    camera = fit_camera(content)
    groups = [_shape(shape, camera.middle_mm) for shape in content.shapes]
    groups += [
        _group(
            f"light on {painting.detector}",
            triangles_mm=painting.triangles_mm - camera.middle_mm,
            triangle_rgba=np.column_stack([painting.rgb, np.full(len(painting.rgb), 255)]),
            swatch="linear-gradient(90deg, #000004, #bc3754, #fcffa4)",
            opaque=True,
        )
        for painting in content.paintings
    ]
    if content.rays is not None:
        segments_mm = content.rays.segments_mm.astype(np.float64).reshape(-1, 2, 3) - camera.middle_mm
        rays = _group("rays", lines_mm=segments_mm, line_rgba_each=paper_colours(content.rays.light), line_width=1.5)
        groups.insert(0, {**rays, "swatch": "linear-gradient(90deg, #d33, #2a2, #33d)"})
    data = {
        "title": content.title,
        "subtitle": content.subtitle,
        "right": camera.right.tolist(),
        "up": camera.up.tolist(),
        "toward": camera.toward.tolist(),
        "half_width": 0.56 * camera.width_mm,
        "half_height": 0.56 * camera.height_mm,
        "half_depth": float(np.ptp(content.points_mm, axis=0).max()),
        "groups": groups,
    }
    text = json.dumps(data, ensure_ascii=False).replace("<", "\\u003c")  # no text may end the script
    template = files("raymaps.results").joinpath("view_page.html").read_text(encoding="utf-8")
    return template.replace("@SCENE@", text)


def _shape(shape: Shape, middle_mm: NDArray[np.float64]) -> dict[str, Any]:
    strong = shape.kind != "body"
    return _group(
        shape.name,
        triangles_mm=shape.triangles_mm - middle_mm,
        rgba=[*shape.rgb, round(255 * shape.opacity)],
        lines_mm=shape.lines_mm.reshape(-1, 2, 3) - middle_mm,
        line_rgba=[*shape.rgb, 255] if shape.kind == "detector" else list(EDGE_RGBA),
        line_width=2.0 if strong else 1.2,
        swatch=f"rgba({', '.join(map(str, shape.rgb))}, {0.6 if shape.kind == 'body' else 1})",
        shaded=not strong,
        opaque=shape.opacity >= 1,
    )


def _group(name: str, **values: Any) -> dict[str, Any]:
    """What is switched on and off together, with arrays as text."""
    group: dict[str, Any] = {
        "name": name,
        "triangles": "",
        "lines": "",
        "rgba": [0, 0, 0, 0],
        "line_rgba": [0, 0, 0, 0],
    }
    for key, value in values.items():
        if key.endswith("_mm"):
            group[key.removesuffix("_mm")] = _packed(value.astype("<f4"))
        elif isinstance(value, np.ndarray):
            group[key] = _packed(value.astype(np.uint8))
        else:
            group[key] = value
    return group


def _packed(array: NDArray[Any]) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")
