# SPDX-License-Identifier: LGPL-2.1-or-later
"""What faces registered, painted on them in false colours: rendered by pyvista, framed by matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import MissingPackageError, shortened
from raymaps.results.face_detector import FaceMap
from raymaps.results.model_view import EDGE_RGBA, ModelView, Shape, face_painting
from raymaps.results.picture_parts import INK, LOOK, PALE, colour_bar, with_error

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_face_map"]

Float = NDArray[np.float64]

#: Height of the images and width of the bar with its words, in inches.
_IMAGE_INCH, _BAR_INCH = 4.6, 1.15
#: Faces that look so much in one direction are shown from there only, others from two sides.
_ONE_WAY = 0.3
#: Cells below this share of the middle one's area set no colour: their figures are noise.
_SLIVER = 0.2


def draw_face_map(face_map: FaceMap) -> Figure:
    """A figure of the faces in false colours, with a colour bar in W/mm², the flux and its error on top.

    Raises
    ------
    MissingPackageError
        If matplotlib or pyvista is not installed.
    """
    try:
        from matplotlib import colormaps, rc_context
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackageError("matplotlib", "pictures", "The picture of a detector") from None
    from raymaps.results.colours import FALSE_COLOURS
    from raymaps.results.pictures import render

    brightest = _brightest(face_map)
    # the faces once more, unseen: they and the edges of the body are what the camera fits
    body = Shape(face_map.body, "body", EDGE_RGBA[:3], 0.0, face_map.cells.corners_mm, face_map.edges_mm)
    content = ModelView(face_map.detector, "", (body,), None, (face_painting(face_map, brightest),))
    images = [_trimmed(render(content, toward, 1100)) for toward in _ways(face_map)]
    widths = [_IMAGE_INCH * image.shape[1] / image.shape[0] for image in images]
    width, top, bottom = max(sum(widths) + 0.25 * len(widths) + _BAR_INCH + 0.3, 6.0), 1.15, 0.25
    height = _IMAGE_INCH + top + bottom
    with rc_context(LOOK):
        figure = Figure(figsize=(width, height), facecolor="white")
        at = 0.3
        for image, inches in zip(images, widths, strict=True):
            axes = figure.add_axes((at / width, bottom / height, inches / width, _IMAGE_INCH / height))
            axes.imshow(image, interpolation="antialiased")
            axes.set_axis_off()
            at += inches + 0.25
        drawn = ScalarMappable(Normalize(0.0, brightest or 1.0), colormaps[FALSE_COLOURS])
        colour_bar(
            figure, drawn, (1 - _BAR_INCH / width, 0.1 + bottom / height, 0.17 / width, 0.85 * _IMAGE_INCH / height),
            "irradiance" if face_map.measure == "incident" else "absorbed", "W/mm²",
        )  # fmt: skip
        _write_title(figure, face_map)
    return figure


def _brightest(face_map: FaceMap) -> float:
    """Irradiance of the brightest colour."""
    area = face_map.cells.area_mm2
    sound = face_map.irradiance_w_per_mm2[area >= _SLIVER * np.median(area)]
    return float(np.nanmax(sound)) if len(sound) else 0.0


def _ways(face_map: FaceMap) -> list[Float]:
    """From where the faces are looked at."""
    a, b, c = np.moveaxis(face_map.cells.corners_mm, 1, 0)
    vectors = 0.5 * np.cross(b - a, c - a)
    normal = vectors.sum(axis=0)
    if np.linalg.norm(normal) < _ONE_WAY * face_map.area_mm2:
        return [np.array([1.0, -1.55, 0.85]), np.array([-1.0, 1.55, -0.85])]
    normal = normal / np.linalg.norm(normal)
    aside = np.array([0.25, -0.45, 0.15])
    return [normal + aside - 0.5 * (aside @ normal) * normal]


def _trimmed(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """An image without its white margins."""
    inked = np.asarray((image < 250).any(axis=2))
    rows, columns = np.flatnonzero(inked.any(axis=1)), np.flatnonzero(inked.any(axis=0))
    if not len(rows):
        return image
    return image[max(rows[0] - 4, 0) : rows[-1] + 5, max(columns[0] - 4, 0) : columns[-1] + 5]


def _write_title(figure: Figure, face_map: FaceMap) -> None:
    inch = 1.0 / figure.get_figheight()
    left, letters = 0.3 / figure.get_figwidth(), int(12.5 * figure.get_figwidth())
    figure.text(left, 1 - 0.34 * inch, face_map.detector, fontsize=13, fontweight="bold", color=INK)
    line = with_error(face_map.flux_w, "W")
    line += f"   {with_error(face_map.flux_lm, 'lm')}" if face_map.flux_lm is not None else ""
    line += f"   {face_map.crossings:,} hits".replace(",", "\u2009")
    figure.text(left, 1 - 0.57 * inch, shortened(line, letters), fontsize=9.5)
    conditions = [f"without {', '.join(face_map.without)}"] if face_map.without else []
    faces = f"{len(face_map.faces)} faces" if len(face_map.faces) > 3 else ", ".join(face_map.faces)
    conditions += [f"{faces} of {face_map.body}", f"{len(face_map.cell_flux_w)} cells", *face_map.conditions()]
    figure.text(left, 1 - 0.77 * inch, shortened(",  ".join(conditions), letters), fontsize=8, color=PALE)
    line = f"mean {with_error(face_map.mean_w_per_mm2, 'W/mm²')}"
    line += f" or {with_error(face_map.mean_lx, 'lx')}" if face_map.mean_lx is not None else ""
    if face_map.uniformity:
        line += f",  min/mean {face_map.uniformity.value:.2f} ± {face_map.uniformity.stderr:.2f}"
    figure.text(left, 1 - 0.94 * inch, shortened(line, letters), fontsize=8, color=PALE)
