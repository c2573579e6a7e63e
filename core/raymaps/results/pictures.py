# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of a model with its rays: a PNG drawn off-screen with pyvista, or a page that can be turned in a browser."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import Criterion
from raymaps.errors import MissingPackageError, shortened
from raymaps.results.camera import fit_camera
from raymaps.results.colours import paper_colours
from raymaps.results.files import check_suffix, new_file
from raymaps.results.model_view import EDGE_RGBA, ModelView, Shape, build_view
from raymaps.results.offscreen import prepare_offscreen
from raymaps.results.picture_parts import INK, PALE
from raymaps.scene import Scene

if TYPE_CHECKING:
    from raymaps.store import RayMap

__all__ = ["draw_view", "render", "view"]

Float = NDArray[np.float64]

_LONG_SIDE_PX = 1500
#: So many names stand in the legend at most.
_LEGEND = 24


def view(
    what: str | Path | Scene | RayMap,
    output: str | Path,
    where: Criterion | str | None = None,
    rays: int = 300,
    paint: Sequence[str] = (),
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
    paint : names of detectors, optional
        On which the light of all matching rays is painted in false colours.

    Raises
    ------
    RayMapsError
        If the scene or map can't be read, the criterion not understood, or the file not written.
    MissingPackageError
        If a PNG is wanted and pyvista is not installed.
    """
    suffix = check_suffix(output, (".png", ".html"), "A view")
    content = build_view(what, where, rays, paint)
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
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackageError("matplotlib", "pictures", "A picture of the model") from None
    return _framed(Figure, content, render(content))


def render(content: ModelView, toward: Float | None = None, long_side_px: int = _LONG_SIDE_PX) -> NDArray[np.uint8]:
    """The model with its rays as an image, (height, width, 3) uint8; ``toward`` as of `fit_camera`.

    Raises
    ------
    MissingPackageError
        If pyvista is not installed.
    """
    try:
        import pyvista
    except ImportError:
        raise MissingPackageError("pyvista", "pictures", "A picture of the model") from None
    prepare_offscreen()
    camera = fit_camera(content, toward)
    aspect = float(np.clip(camera.width_mm / camera.height_mm, 0.62, 1.9))
    window = (
        (long_side_px, round(long_side_px / aspect)) if aspect > 1 else (round(long_side_px * aspect), long_side_px)
    )

    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(window))
    plotter.set_background("white")
    for shape in content.shapes:
        _add_shape(plotter, pyvista, shape)
    for painting in content.paintings:
        mesh = _triangle_mesh(pyvista, painting.triangles_mm)
        mesh.cell_data["rgb"] = painting.rgb
        plotter.add_mesh(mesh, scalars="rgb", rgb=True, lighting=False)
    if content.rays is not None and content.rays.n_segments:
        lines = _line_mesh(pyvista, content.rays.segments_mm.astype(np.float64))
        lines.cell_data["rgba"] = paper_colours(content.rays.light)
        plotter.add_mesh(lines, scalars="rgba", rgba=True, line_width=1.6, lighting=False)
    plotter.enable_depth_peeling(8)
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_parallel_projection()
    distance_mm = 10 * float(np.ptp(content.points_mm, axis=0).max())
    plotter.camera_position = [camera.middle_mm + camera.toward * distance_mm, camera.middle_mm, camera.up]
    plotter.camera.parallel_scale = 0.5 * 1.05 * max(camera.height_mm, camera.width_mm / aspect)
    plotter.reset_camera_clipping_range()
    image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return image


def _add_shape(plotter: Any, pyvista: Any, shape: Shape) -> None:
    colour = _share(shape.rgb)
    if len(shape.triangles_mm):
        mesh = _triangle_mesh(pyvista, shape.triangles_mm)
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
        line_colour = colour if shape.kind == "detector" else _share(EDGE_RGBA[:3])
        plotter.add_mesh(
            _line_mesh(pyvista, shape.lines_mm), color=line_colour, line_width=2.4 if strong else 1.5, lighting=False,
            opacity=1.0 if strong else EDGE_RGBA[3] / 255,
        )  # fmt: skip


def _share(rgb: tuple[int, int, int]) -> tuple[float, float, float]:
    """A colour from 0 to 1."""
    red, green, blue = rgb
    return red / 255, green / 255, blue / 255


def _triangle_mesh(pyvista: Any, triangles_mm: Float) -> Any:
    n = len(triangles_mm)
    faces = np.hstack([np.full((n, 1), 3), np.arange(3 * n).reshape(n, 3)])
    return pyvista.PolyData(triangles_mm.reshape(-1, 3), faces.ravel())


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
        colour = _share(shape.rgb)
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
    with rc_context({"font.family": "DejaVu Sans", "text.color": INK}):
        total = height + 0.72 + below
        figure = figure_type(figsize=(width, total), facecolor="white")
        axes = figure.add_axes((0, below / total, 1, height / total))
        axes.imshow(image, interpolation="none")
        axes.set_axis_off()
        figure.text(0.25 / width, 1 - 0.32 / total, content.title, fontsize=14, fontweight="bold")
        figure.text(
            0.25 / width, 1 - 0.57 / total, shortened(content.subtitle, int(width * 12)), fontsize=9, color=PALE
        )
        figure.legend(
            handles=entries, loc="lower left", bbox_to_anchor=(0.12 / width, 0.06 / total), ncols=columns,
            frameon=False, fontsize=8.5, handlelength=1.4, columnspacing=1.4, labelcolor=INK,
        )  # fmt: skip
    return figure
