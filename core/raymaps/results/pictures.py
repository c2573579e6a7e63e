# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of a model with its rays: a PNG drawn off-screen with pyvista, or a page that can be turned in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import Criterion
from raymaps.errors import MissingPackageError
from raymaps.results.colours import paper_colours
from raymaps.results.files import check_suffix, new_file
from raymaps.results.model_view import ModelView, Shape, build_view
from raymaps.results.offscreen import prepare_offscreen
from raymaps.scene import Scene

if TYPE_CHECKING:
    from raymaps.store import RayMap

__all__ = ["draw_view", "view"]

Float = NDArray[np.float64]

_LONG_SIDE_PX = 1500
_INK, _PALE, _EDGE = "#30343b", "#6b7280", (70, 76, 86)
#: From where the camera looks, seen from the middle of the scene: with z up, and with z to the right and y up.
_CAMERA = np.array([1.0, -1.55, 0.85])
_CAMERA_OF_TUBES = np.array([-1.0, 0.42, -0.42])
#: A model so much longer along z than across is shown lying.
_LONG_FROM = 1.6
#: So many names stand in the legend at most.
_LEGEND = 24


def view(
    what: str | Path | Scene | RayMap,
    output: str | Path,
    where: Criterion | str | None = None,
    rays: int = 300,
) -> Path:
    """Draw a scene, or a map with the rays that match a criterion.

    Parameters
    ----------
    what : Scene, RayMap, or the path of one
    output : path of a ``.png`` or ``.html`` file
        The page holds everything that it needs and can be turned, moved and zoomed.
    where : Criterion or str, optional
        Which rays to show; a scene has none.
    rays : int
        How many rays to show at most.

    Raises
    ------
    RayMapsError
        If the scene or map can't be read, the criterion not understood, or the file not written.
    MissingPackageError
        If a PNG is wanted and pyvista is not installed.
    """
    suffix = check_suffix(output, (".png", ".html"), "A view")
    content = build_view(what, where, rays)
    if suffix == ".html":
        from raymaps.results.view_page import write_page

        return write_page(content, output)
    figure = draw_view(content)
    with new_file(output) as making:
        figure.savefig(making, dpi=150)
    return Path(output)


def draw_view(content: ModelView) -> Any:
    """A matplotlib figure: the model with its rays, a title, and a legend of bodies, sources and detectors."""
    try:
        import pyvista
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackageError("pyvista", "pictures", "A picture of the model") from None
    prepare_offscreen()
    right, up, toward = _camera_axes(content.bounds_mm)
    centre, width, height = _fitted(content, right, up)
    aspect = float(np.clip(width / height, 0.62, 1.9))
    window = (
        (_LONG_SIDE_PX, round(_LONG_SIDE_PX / aspect)) if aspect > 1 else (round(_LONG_SIDE_PX * aspect), _LONG_SIDE_PX)
    )

    plotter = pyvista.Plotter(off_screen=True, window_size=list(window))
    plotter.set_background("white")
    for shape in content.shapes:
        _add_shape(plotter, pyvista, shape)
    if content.rays is not None and content.rays.n_segments:
        lines = _line_mesh(pyvista, content.rays.segments_mm.astype(np.float64))
        lines.cell_data["rgba"] = paper_colours(content.rays.light)
        plotter.add_mesh(lines, scalars="rgba", rgba=True, line_width=1.6, lighting=False)
    plotter.enable_depth_peeling(8)
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_parallel_projection()
    plotter.camera_position = [centre + toward * 10 * np.ptp(content.bounds_mm, axis=0).max(), centre, up]
    plotter.camera.parallel_scale = 0.5 * 1.05 * max(height, width / aspect)
    plotter.reset_camera_clipping_range()
    image = plotter.screenshot(return_img=True)
    plotter.close()
    return _framed(Figure, content, image)


def _camera_axes(bounds_mm: Float) -> tuple[Float, Float, Float]:
    """Right, up and toward the viewer: z up, or lying to the right where the model is a long tube along z."""
    size = np.ptp(bounds_mm, axis=0)
    lies = size[2] > _LONG_FROM * max(size[0], size[1])
    toward, vertical = (_CAMERA_OF_TUBES, np.array([0.0, 1.0, 0.0])) if lies else (_CAMERA, np.array([0.0, 0.0, 1.0]))
    toward = toward / np.linalg.norm(toward)
    right = np.cross(vertical, toward)
    right /= np.linalg.norm(right)
    return right, np.cross(toward, right), toward


def _fitted(content: ModelView, right: Float, up: Float) -> tuple[Float, float, float]:
    """Middle, width and height in mm of what is seen of all shapes."""
    points = content.points_mm
    middle = content.bounds_mm.mean(axis=0)
    across, along = (points - middle) @ right, (points - middle) @ up
    width, height = float(np.ptp(across)), float(np.ptp(along))
    smallest = 1e-9 + 1e-2 * max(width, height)
    offset = (across.max() + across.min()) / 2 * right + (along.max() + along.min()) / 2 * up
    return middle + offset, max(width, smallest), max(height, smallest)


def _add_shape(plotter: Any, pyvista: Any, shape: Shape) -> None:
    colour = tuple(band / 255 for band in shape.rgb)
    if len(shape.triangles_mm):
        n = len(shape.triangles_mm)
        faces = np.hstack([np.full((n, 1), 3), np.arange(3 * n).reshape(n, 3)])
        mesh = pyvista.PolyData(shape.triangles_mm.reshape(-1, 3), faces.ravel())
        plotter.add_mesh(
            mesh,
            color=colour,
            opacity=shape.opacity,
            lighting=shape.kind == "body",
            ambient=0.45,
            diffuse=0.6,
            specular=0.0,
        )
    if len(shape.lines_mm):
        strong = shape.kind != "body"
        line_colour = colour if shape.kind == "detector" else tuple(band / 255 for band in _EDGE)
        plotter.add_mesh(
            _line_mesh(pyvista, shape.lines_mm), color=line_colour, line_width=2.4 if strong else 1.5, lighting=False,
            opacity=1.0 if strong else 0.75,
        )  # fmt: skip


def _line_mesh(pyvista: Any, segments_mm: Float) -> Any:
    n = len(segments_mm)
    lines = np.hstack([np.full((n, 1), 2), np.arange(2 * n).reshape(n, 2)])
    return pyvista.PolyData(segments_mm.reshape(-1, 3), lines=lines.ravel())


def _framed(figure_type: Any, content: ModelView, image: NDArray[np.uint8]) -> Any:
    """The image under a title, with a legend below."""
    from matplotlib import rc_context
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    width, height = image.shape[1] / 150, image.shape[0] / 150
    entries: list[Any] = []
    for shape in content.shapes[:_LEGEND]:
        colour = tuple(band / 255 for band in shape.rgb)
        if shape.kind == "detector":
            entries.append(Line2D([], [], color=colour, linewidth=2, label=shape.name))
        else:
            opacity = 1.0 if shape.kind == "source" else 0.55
            entries.append(Patch(facecolor=(*colour, opacity), edgecolor="#464c56", linewidth=0.6, label=shape.name))
    if len(content.shapes) > _LEGEND:
        entries.append(Line2D([], [], linestyle="", label=f"and {len(content.shapes) - _LEGEND} more"))
    columns = max(1, int(width / 1.6))
    rows = -(-len(entries) // columns)
    below = 0.22 * rows + 0.2
    with rc_context({"font.family": "DejaVu Sans", "text.color": _INK}):
        total = height + 0.72 + below
        figure = figure_type(figsize=(width, total), facecolor="white")
        axes = figure.add_axes((0, below / total, 1, height / total))
        axes.imshow(image, interpolation="none")
        axes.set_axis_off()
        figure.text(0.25 / width, 1 - 0.32 / total, content.title, fontsize=14, fontweight="bold")
        figure.text(0.25 / width, 1 - 0.57 / total, _cut(content.subtitle, int(width * 12)), fontsize=9, color=_PALE)
        figure.legend(
            handles=entries, loc="lower left", bbox_to_anchor=(0.12 / width, 0.06 / total), ncols=columns,
            frameon=False, fontsize=8.5, handlelength=1.4, columnspacing=1.4, labelcolor=_INK,
        )  # fmt: skip
    return figure


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"
