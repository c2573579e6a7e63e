# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a picture of a scene shows, as triangles, segments and colours: the same for a picture and for a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import RGB_BANDS
from raymaps.criterion import Criterion, format_criterion
from raymaps.errors import SceneError
from raymaps.geometry import BodyMesh, load_bodies
from raymaps.results.colours import false_colours, light_colours
from raymaps.results.detector import evaluate_detector
from raymaps.results.detector_map import DetectorMap
from raymaps.results.edges import feature_edges_mm
from raymaps.results.face_detector import FaceMap
from raymaps.results.overlay import Overlay, overlay
from raymaps.scene import (
    ConeSource,
    CrossingsSource,
    Detector,
    DiscSource,
    FaceDetector,
    FacesSource,
    FarFieldDetector,
    GaussianBeamSource,
    LuminaireSource,
    PointSource,
    RaysSource,
    RectangleDetector,
    Scene,
    Source,
    SunSource,
    load_scene,
)
from raymaps.store import RayMap
from raymaps.units import format_quantity

__all__ = ["EDGE_RGBA", "ModelView", "Painting", "Shape", "build_view", "face_painting"]

Float = NDArray[np.float64]

#: Colours of bodies with a medium, which light passes through, and of the others; taken in turn.
_CLEAR = ((86, 160, 211), (98, 186, 172), (140, 150, 220), (120, 190, 130), (196, 150, 210))
_SOLID = ((128, 134, 145), (176, 152, 120), (108, 128, 150), (150, 138, 160), (120, 148, 130), (168, 128, 128))
_CLEAR_OPACITY, _SOLID_OPACITY = 0.16, 0.16
#: Edges of bodies and outlines of sources.
EDGE_RGBA = (70, 76, 86, 190)
_DETECTOR_COLOUR = (32, 150, 94)
_RING = 48


@dataclass(frozen=True)
class Shape:
    """Something to be drawn in one colour.

    Attributes
    ----------
    name, kind : str
        Kind is ``body``, ``source`` or ``detector``.
    rgb : (red, green, blue), 0 to 255
    opacity : float
        Of the triangles.
    triangles_mm : (n, 3 corners, 3) float64
    lines_mm : (n, 6) float64
    """

    name: str
    kind: str
    rgb: tuple[int, int, int]
    opacity: float
    triangles_mm: Float = field(repr=False)
    lines_mm: Float = field(repr=False)


@dataclass(frozen=True)
class Painting:
    """The light on a detector in false colours, in its place: triangles (n, 3, 3) in mm, and their colours (n, 3)."""

    detector: str
    triangles_mm: Float = field(repr=False)
    rgb: NDArray[np.uint8] = field(repr=False)


@dataclass(frozen=True)
class ModelView:
    """Everything that a picture shows.

    Attributes
    ----------
    title, subtitle : str
    shapes : tuple of Shape
    rays : Overlay or None
    paintings : tuple of Painting
    """

    title: str
    subtitle: str
    shapes: tuple[Shape, ...]
    rays: Overlay | None
    paintings: tuple[Painting, ...] = ()

    @property
    def points_mm(self) -> Float:
        """Ends and corners of all shapes, (n, 3)."""
        return _points_mm(self.shapes)


def build_view(
    what: str | Path | Scene | RayMap,
    where: Criterion | str | None = None,
    rays: int = 300,
    paint: Sequence[str] = (),
) -> ModelView:
    """Collect what a picture of a scene, or of a map with matching rays, shows.

    Parameters
    ----------
    what : Scene, RayMap, or the path of one
    where : Criterion or str, optional
        Which rays to show; a scene has none.
    rays : int
        How many rays to show at most.
    paint : names of detectors, optional
        On which the light of all matching rays is painted in false colours; needs matplotlib.

    Raises
    ------
    RayMapsError
        If the scene or map can't be read, or the criterion can't be understood.
    """
    if isinstance(what, str | Path):
        what = RayMap.open(what) if Path(what).is_dir() else load_scene(what)
    if isinstance(what, RayMap):
        shown = overlay(what, where, rays)
        painted = (_painting(evaluate_detector(what, name, where=where), what.scene) for name in paint)
        paintings = tuple(painting for painting in painted if painting is not None)
        words = _what_is_shown(what, where, shown)
        return _view(Path(what.path).stem, words, what.scene, what.meshes, shown, paintings)
    if where is not None or paint:
        raise SceneError("A scene has no rays yet that could be shown: trace it, then look at its Ray Map.")
    flux = format_quantity(sum(source.flux_w for source in what.sources.values()), "W")
    words = f"{len(what.sources)} sources with {flux}{_switched_off(what)}"
    return _view(what.name, words, what, load_bodies(what), None)


def _switched_off(scene: Scene) -> str:
    """What a picture says of effects that are switched off."""
    without = scene.settings.without
    return f"  (without {', '.join(without)})" if without else ""


def _what_is_shown(raymap: RayMap, where: Criterion | str | None, shown: Overlay) -> str:
    off = _switched_off(raymap.scene)
    if where is None:
        return f"the first {shown.rays} of {raymap.n_rays} rays{off}"
    criterion = where if isinstance(where, str) else format_criterion(where)
    found = f"{shown.rays} rays where {criterion}"
    return f"{found}  ({shown.matching} match of {shown.scanned} looked at){off}"


def _view(
    title: str,
    subtitle: str,
    scene: Scene,
    meshes: tuple[BodyMesh, ...],
    rays: Overlay | None,
    paintings: tuple[Painting, ...] = (),
) -> ModelView:
    bodies = _bodies(scene, meshes)
    painted = {painting.detector for painting in paintings}
    detectors = [
        shape
        for name, detector in scene.detectors.items()
        if (shape := _detector_shape(name, detector, name not in painted, meshes)) is not None
    ]
    size_mm = max(_diagonal_mm([*bodies, *detectors]), 1e-9)
    sources = [_source_shape(name, source, meshes, size_mm) for name, source in scene.sources.items()]
    return ModelView(title, subtitle, (*bodies, *detectors, *sources), rays, paintings)


def _bodies(scene: Scene, meshes: tuple[BodyMesh, ...]) -> list[Shape]:
    shapes = []
    counts = {True: 0, False: 0}
    for mesh, body in zip(meshes, scene.bodies.values(), strict=True):
        clear = body.medium is not None
        palette = _CLEAR if clear else _SOLID
        rgb = palette[counts[clear] % len(palette)]
        counts[clear] += 1
        opacity = _CLEAR_OPACITY if clear else _SOLID_OPACITY
        shapes.append(Shape(mesh.name, "body", rgb, opacity, mesh.corners_mm, feature_edges_mm(mesh)))
    return shapes


def _detector_shape(name: str, detector: Detector, tinted: bool, meshes: tuple[BodyMesh, ...]) -> Shape | None:
    """A detector in its place; None of the far field, which is nowhere."""
    if isinstance(detector, FarFieldDetector):
        return None
    if isinstance(detector, FaceDetector):
        mesh = next(mesh for mesh in meshes if mesh.name == detector.body)
        chosen = np.isin(mesh.triangle_face, mesh.face_indices(detector.faces, f"Detector '{name}'"))
        triangles = mesh.corners_mm[chosen] if tinted else np.zeros((0, 3, 3))
        outline = _outline_mm(mesh.triangles[chosen], mesh)
        lines = outline if len(outline) else feature_edges_mm(mesh)  # faces that close up have no border
        return Shape(name, "detector", _DETECTOR_COLOUR, 0.16, triangles, lines)
    return _rectangle_shape(name, detector, tinted)


def _outline_mm(triangles: NDArray[np.int64], mesh: BodyMesh) -> Float:
    """Borders of some triangles: sides that belong to one of them only, as segments, (n, 6)."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    distinct, count = np.unique(sides, axis=0, return_counts=True)
    return mesh.vertices_mm[distinct[count == 1]].reshape(-1, 6)


def _rectangle_shape(name: str, detector: RectangleDetector, tinted: bool) -> Shape:
    x, y, normal = detector.axes
    centre = np.array(detector.center_mm)
    x, y = x * detector.width_mm / 2, y * detector.height_mm / 2
    corners = np.array([centre - x - y, centre + x - y, centre + x + y, centre - x + y])
    ring = np.hstack([corners, np.roll(corners, -1, axis=0)])
    # a short arrow on the side that registers light
    length = 0.08 * min(detector.width_mm, detector.height_mm)
    tips = {"front": (normal,), "back": (-normal,), "both": (normal, -normal)}[detector.side]
    arrows = np.array([[*centre, *(centre + tip * length)] for tip in tips])
    triangles = corners[[[0, 1, 2], [0, 2, 3]]] if tinted else np.zeros((0, 3, 3))
    return Shape(name, "detector", _DETECTOR_COLOUR, 0.10, triangles, np.vstack([ring, arrows]))


def _painting(lit: object, scene: Scene) -> Painting | None:
    """What a detector registered in its place: two triangles a cell of a rectangle, the cells of faces."""
    if isinstance(lit, FaceMap):
        return face_painting(lit)
    if not isinstance(lit, DetectorMap):
        return None
    detector = scene.detectors[lit.detector]
    assert isinstance(detector, RectangleDetector)
    x, y, _ = detector.axes
    centre = np.array(detector.center_mm)
    corners = centre + lit.x_edges_mm[None, :, None] * x + lit.y_edges_mm[:, None, None] * y
    a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]
    triangles = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2)
    irradiance = np.nan_to_num(lit.irradiance_w_per_mm2)
    rgb = false_colours(irradiance / (irradiance.max() or 1.0))
    return Painting(lit.detector, triangles.reshape(-1, 3, 3), np.repeat(rgb.reshape(-1, 3), 2, axis=0))


def face_painting(lit: FaceMap, brightest: float | None = None) -> Painting:
    """The cells of faces in false colours up to a brightest irradiance."""
    irradiance = np.nan_to_num(lit.irradiance_w_per_mm2)
    rgb = false_colours(np.clip(irradiance / (brightest or irradiance.max() or 1.0), 0.0, 1.0))
    return Painting(lit.detector, lit.cells.corners_mm, rgb)


def _source_shape(name: str, source: Source, meshes: tuple[BodyMesh, ...], size_mm: float) -> Shape:
    """A source as faces that shine, a disc with an arrow, a cone, or a small ball, with an arrow if it is aimed."""
    red, green, blue = (int(band) for band in light_colours(_light_of(source)[None])[0])
    if isinstance(source, FacesSource):
        mesh = next(mesh for mesh in meshes if mesh.name == source.body)
        chosen = np.isin(mesh.triangle_face, mesh.face_indices(source.faces, f"Source '{name}'"))
        return Shape(name, "source", (red, green, blue), 1.0, mesh.corners_mm[chosen], np.zeros((0, 6)))
    centre, reach = np.array(source.position_mm), 0.10 * size_mm
    way = _way_of(source)
    lines = np.zeros((0, 6)) if way is None else np.array([[*centre, *(centre + way * reach)]])
    if way is None or isinstance(source, LuminaireSource | RaysSource | CrossingsSource):
        return Shape(name, "source", (red, green, blue), 1.0, _octahedron_mm(centre, 0.012 * size_mm), lines)
    if isinstance(source, ConeSource):
        angle = np.radians(min(source.half_angle_deg, 89.0))
        rim = _ring_mm(centre + way * reach * np.cos(angle), way, reach * np.sin(angle))
        spokes = np.hstack([np.tile(centre, (4, 1)), rim[:: _RING // 4, :3]])
        lines = np.vstack([lines, rim, spokes])
    rim = _ring_mm(centre, way, _radius_mm(source, 0.012 * size_mm))
    triangles = np.stack([np.tile(centre, (_RING, 1)), rim[:, :3], rim[:, 3:]], axis=1)
    return Shape(name, "source", (red, green, blue), 1.0, triangles, np.vstack([lines, rim]))


def _light_of(source: Source) -> Float:
    """Red, green and blue of a source, (3,), adding up to 1; white if its spectrum can't be told."""
    try:
        return RGB_BANDS.light_of(source)
    except SceneError:
        return np.full(3, 1 / 3)


def _way_of(source: Source) -> Float | None:
    """Where a source shines, as a unit vector; None of one that shines all around."""
    if isinstance(source, FacesSource | PointSource):
        return None
    aim = source.z_axis if isinstance(source, RaysSource | CrossingsSource) else source.direction
    return np.array(aim) / np.linalg.norm(aim)


def _radius_mm(source: Source, smallest_mm: float) -> float:
    if isinstance(source, DiscSource | SunSource):
        return source.radius_mm
    return max(source.waist_radius_mm, smallest_mm) if isinstance(source, GaussianBeamSource) else smallest_mm


def _ring_mm(centre: Float, way: Float, radius_mm: float) -> Float:
    """A circle around an axis as segments, (n, 6)."""
    across = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
    across /= np.linalg.norm(across)
    turn = 2 * np.pi * np.arange(_RING)[:, None] / _RING
    points = centre + radius_mm * (np.cos(turn) * across + np.sin(turn) * np.cross(way, across))
    return np.hstack([points, np.roll(points, -1, axis=0)])


def _octahedron_mm(centre: Float, radius_mm: float) -> Float:
    axes = np.eye(3)
    faces = [(sx * axes[0], sy * axes[1], sz * axes[2]) for sx in (1, -1) for sy in (1, -1) for sz in (1, -1)]
    return centre + radius_mm * np.array(faces)


def _points_mm(shapes: list[Shape] | tuple[Shape, ...]) -> Float:
    parts = [shape.triangles_mm.reshape(-1, 3) for shape in shapes] + [
        shape.lines_mm.reshape(-1, 3) for shape in shapes
    ]
    return np.concatenate([np.zeros((0, 3)), *parts])


def _diagonal_mm(shapes: list[Shape]) -> float:
    points = _points_mm(shapes)
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 1.0
