# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scene to flat arrays: everything that the kernels read, and the effects that the scene calls for."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import RGB_BANDS, Bands, spectral_bands
from raymaps.boundary import LoweredBoundary, lower_boundary
from raymaps.effects import EFFECTS, Lowering, needed_effects, scene_without
from raymaps.effects.usage import used_surfaces
from raymaps.errors import SceneError
from raymaps.formats.ray_set import RaySet
from raymaps.frame import Frame
from raymaps.geometry import BodyMesh, load_bodies, mesh_digest, winding_number
from raymaps.kinds import CONTACT, SurfaceKind
from raymaps.materials import (
    VACUUM,
    BsdfTable,
    FresnelInterface,
    Lambertian,
    Medium,
    Mixture,
    Record,
    RoughInterface,
    SpectrumTable,
    SurfaceProperty,
    ThinFilm,
)
from raymaps.names import Names
from raymaps.ray_sets import RayLight, light_of_rays, lines_of_rays, load_ray_sets, placed_box_mm, placed_sample_mm
from raymaps.scene import (
    Body,
    CrossingsSource,
    DiscSource,
    FaceDetector,
    FacesSource,
    GaussianBeamSource,
    RaysSource,
    RectangleDetector,
    Scene,
    Settings,
    SunSource,
)
from raymaps.solids import medium_at, medium_of, solids_at

__all__ = ["CompiledScene", "Tables", "compile_scene"]

#: Name of the medium outside all bodies where a scene names none.
VACUUM_NAME = "vacuum"
#: Points of a source, or of a body's surface, at which it is asked which solids they are in.
PROBES = 32
#: How far before a face such a point lies, in frame units: beyond what is in contact with it.
AHEAD = 4 * CONTACT
#: Waist radii within which a Gaussian beam starts: 32 random bits reach 3.4.
WIDEST_WAIST = 3.5


class Tables(NamedTuple):
    """What all kernels read. Indices count in the order of `Names`; -1 is none; lengths in frame units."""

    plane: NDArray[np.float64]  # (n_triangles, 4) outward unit normal of the bounding mesh, times its points
    triangle_face: NDArray[np.int32]  # (n_triangles,)
    face_body: NDArray[np.int32]  # (n_faces,)
    face_surface: NDArray[np.int16]  # (n_faces,)
    surface_kind: NDArray[np.uint8]  # (n_surfaces,) SurfaceKind
    medium_index: NDArray[np.float64]  # (n_media,) refractive index, of dispersive media that at the d line
    ambient: NDArray[np.int16]  # (1,) medium outside all bodies
    box: NDArray[np.float64]  # (2, 3) lower and upper corner of the box that rays leave


@dataclass(frozen=True)
class CompiledScene:
    """A scene ready to be traced.

    Attributes
    ----------
    scene : Scene
        As described, the effects that it switches off among them.
    meshes : tuple of BodyMesh
    names : Names
    frame : Frame
    bands : Bands
    tables : Tables
    boundary : LoweredBoundary
    effects : dict of str to tuple of str
        Names of the effects that the scene calls for, with the reasons.
    effect_data : dict of str to NamedTuple of arrays
        What the kernel of each of these effects reads.
    source_light : (n_sources, n_bands) float64
        Share of each source's light in each band.
    source_inside : (n_sources, n_words) uint64
        Solids that each source emits in.
    source_media : tuple of int
        Medium that each source emits into.
    ray_sets : dict of str to RaySet
        Rays of the sources that have them from a file or another map.
    ray_light : dict of str to RayLight
        Light of these rays.
    scene_hash : str
        Of everything that decides what happens to a ray: not of names of files, nor of how many rays are asked for.
    """

    scene: Scene
    meshes: tuple[BodyMesh, ...]
    names: Names
    frame: Frame
    bands: Bands
    tables: Tables
    boundary: LoweredBoundary
    effects: dict[str, tuple[str, ...]]
    effect_data: dict[str, Any]
    source_light: NDArray[np.float64]
    source_inside: NDArray[np.uint64]
    source_media: tuple[int, ...]
    ray_sets: dict[str, RaySet]
    ray_light: dict[str, RayLight]
    scene_hash: str


def compile_scene(scene: Scene) -> CompiledScene:
    """Read a scene's geometry, check what can only be checked with it, and lower everything to arrays.

    Raises
    ------
    SceneError
        If geometry can't be used, a surface stands where it can't act, or a source where its light would all be lost.
    """
    meshes = load_bodies(scene)
    ray_sets = load_ray_sets(scene)
    effects = needed_effects(scene)
    acting = scene_without(scene)
    media = _media(acting)
    names = Names(
        sources=tuple(scene.sources),
        bodies=tuple(scene.bodies),
        surfaces=tuple(scene.surfaces),
        media=tuple(media),
        detectors=tuple(scene.detectors),
        faces=tuple((i, face) for i, mesh in enumerate(meshes) for face in mesh.face_names),
    )
    _check_interfaces(acting)
    _check_faces_of_detectors(scene, meshes)
    frame, box = _frame(scene, meshes, ray_sets)
    bands = spectral_bands(acting, lines_of_rays(acting, ray_sets)) if "spectral" in effects else RGB_BANDS
    _check_metals(acting, meshes, names, frame)
    boundary = lower_boundary(acting, meshes, names, frame)
    tables = _tables(acting, meshes, names, boundary, box, tuple(media.values()))
    source_inside = np.concatenate([_solids_of_source(acting, name, meshes, frame, ray_sets) for name in scene.sources])
    source_media = tuple(medium_of(source_inside, boundary.tables.solid_medium, _ambient_index(acting, names)).tolist())
    for source, medium in zip(names.sources, source_media, strict=True):
        _check_is_clear(f"Source '{source}' shines into the medium", names.media[medium], media)
    lowering = Lowering(acting, names, bands, tuple(media.values()), frame)
    data = {effect.name: effect.lower(lowering) for effect in EFFECTS if effect.name in effects}
    source_light = np.array([bands.light_of(source, f"Source '{name}'") for name, source in scene.sources.items()])
    ray_light = {
        name: light_of_rays(acting.sources[name], rays, bands, f"Source '{name}'") for name, rays in ray_sets.items()
    }
    for array in (*tables, source_light, source_inside, *(value for values in data.values() for value in values)):
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    return CompiledScene(
        scene, meshes, names, frame, bands, tables, boundary, effects, data, source_light, source_inside, source_media,
        ray_sets, ray_light, _scene_hash(scene, meshes, ray_sets),
    )  # fmt: skip


def _media(scene: Scene) -> dict[str, Medium]:
    media = dict(scene.media)
    if scene.ambient is None:
        media.setdefault(VACUUM_NAME, VACUUM)
        if media[VACUUM_NAME] != VACUUM:
            raise SceneError(f"Medium '{VACUUM_NAME}' is not vacuum, and the scene names no ambient medium: name one.")
    return media


def _ambient_index(scene: Scene, names: Names) -> int:
    return names.media.index(VACUUM_NAME if scene.ambient is None else scene.ambient)


def _check_interfaces(scene: Scene) -> None:
    """An interface between two media needs a medium behind it."""

    def is_interface(prop: SurfaceProperty) -> bool:
        if isinstance(prop, Mixture):
            return any(is_interface(scene.surfaces[part.surface]) for part in prop.parts)
        return isinstance(prop, FresnelInterface | RoughInterface | ThinFilm)

    bare = {f"body '{name}'" for name, body in scene.bodies.items() if body.medium is None}
    bare |= {f"face '{n}.{face}'" for n, b in scene.bodies.items() if b.medium is None for face in b.face_surfaces}
    for surface, places in used_surfaces(scene).items():
        where = next((place for place in places if place in bare), None)
        if where is not None and is_interface(scene.surfaces[surface]):
            raise SceneError(
                f"Surface '{surface}' of {where} is an interface between two media but the body has no medium: give it "
                "one."
            )


def _check_is_clear(where: str, name: str, media: dict[str, Medium]) -> None:
    """No light can travel in a metal."""
    if media[name].is_conductor:
        raise SceneError(f"{where} '{name}', a metal, in which no light can travel: choose another place or medium.")


def _check_metals(scene: Scene, meshes: tuple[BodyMesh, ...], names: Names, frame: Frame) -> None:
    """Metals fill bodies, not the space around, and no light is scattered into them."""
    media = _media(scene)
    ambient = _ambient_index(scene, names)
    _check_is_clear("The ambient medium is", names.media[ambient], media)
    if not any(medium.is_conductor for medium in media.values()):
        return
    for (name, body), mesh in zip(scene.bodies.items(), meshes, strict=True):
        if body.medium is None:
            continue
        around = medium_at(scene, meshes, names.media, ambient, _points_before(mesh, ~mesh.degenerate, frame))
        if scene.media[body.medium].is_conductor:
            _check_metal(scene, name, "is of metal")
        elif all(media[names.media[medium]].is_conductor for medium in around):
            _check_metal(scene, name, "stands in metal")


def _points_before(mesh: BodyMesh, chosen: NDArray[np.bool_], frame: Frame) -> NDArray[np.float64]:
    """Points in mm just before some of the chosen triangles."""
    some = np.flatnonzero(chosen)
    some = some[np.linspace(0, len(some) - 1, min(len(some), PROBES)).astype(np.int64)]
    area = mesh.area_vectors_mm2[some]
    normal = area / np.linalg.norm(area, axis=1)[:, None]
    return mesh.corners_mm[some].mean(axis=1) + AHEAD * frame.unit_mm * normal


def _check_metal(scene: Scene, body: str, is_of_metal: str) -> None:
    """Surfaces of a body that scatter by Lambert's law transmit nothing."""
    for surface in (scene.bodies[body].surface, *scene.bodies[body].face_surfaces.values()):
        prop = scene.surfaces[surface]
        parts = [part.surface for part in prop.parts] if isinstance(prop, Mixture) else [surface]
        for part in parts:
            scattering = scene.surfaces[part]
            if isinstance(scattering, Lambertian) and any(_numbers(scattering.transmittance)):
                raise SceneError(
                    f"Surface '{part}' of body '{body}' transmits light, but the body {is_of_metal}: set its "
                    "transmittance to 0, or give the body no medium."
                )


def _numbers(value: tuple[float, ...] | SpectrumTable) -> tuple[float, ...]:
    return value.value if isinstance(value, SpectrumTable) else value


def _check_faces_of_detectors(scene: Scene, meshes: tuple[BodyMesh, ...]) -> None:
    """Faces that a detector names must exist."""
    for name, detector in scene.detectors.items():
        if isinstance(detector, FaceDetector):
            mesh = next(mesh for mesh in meshes if mesh.name == detector.body)
            mesh.face_indices(detector.faces, f"Detector '{name}'")


def _frame(
    scene: Scene, meshes: tuple[BodyMesh, ...], ray_sets: dict[str, RaySet]
) -> tuple[Frame, NDArray[np.float64]]:
    """The frame, and the box in frame units that rays leave: all there is and a twentieth more on each side."""
    points = [mesh.vertices_mm[mesh.triangles].reshape(-1, 3) for mesh in meshes]
    for name, source in scene.sources.items():
        if isinstance(source, RaysSource | CrossingsSource):
            points.append(placed_box_mm(source, ray_sets[name]))
        elif not isinstance(source, FacesSource):
            points.append(np.array([source.position_mm]))
        if isinstance(source, DiscSource | SunSource):
            points.append(np.array(source.position_mm) + source.radius_mm * np.array([[-1.0], [1.0]]))
        elif isinstance(source, GaussianBeamSource):
            widest = WIDEST_WAIST * source.waist_radius_mm
            points.append(np.array(source.position_mm) + widest * np.array([[-1.0], [1.0]]))
    for detector in scene.detectors.values():
        if not isinstance(detector, RectangleDetector):
            continue
        x, y, _ = detector.axes
        half = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]]) * (detector.width_mm / 2, detector.height_mm / 2)
        points.append(np.array(detector.center_mm) + half @ np.stack([x, y]))
    cloud = np.concatenate(points)
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    if not (np.isfinite(low).all() and np.isfinite(high).all() and np.ptp(cloud, axis=0).max() < 1e100):
        raise SceneError("The scene is larger than 1e100 mm: check its coordinates and mm_per_unit.")
    size = float((high - low).max())
    center = (low + high) / 2
    if size <= 1e-12 * float(np.abs(center).max()):  # a lone point source: any box will do
        size = max(1.0, 1e-6 * float(np.abs(center).max()))
    half_box = (high - low) / 2 + 0.05 * size
    unit_mm = 2.0 ** math.ceil(math.log2(half_box.max()))
    grid_mm = 2.0 ** round(math.log2(size * 1e-6))
    frame = Frame(center, unit_mm, grid_mm)
    return frame, np.stack([-half_box, half_box]) / unit_mm


def _solids_of_source(
    scene: Scene, name: str, meshes: tuple[BodyMesh, ...], frame: Frame, ray_sets: dict[str, RaySet]
) -> NDArray[np.uint64]:
    """Solids that most of a source's rays start in, (1, n_words) uint64; just before them where they start on faces."""
    source = scene.sources[name]
    if isinstance(source, FacesSource):
        mesh = meshes[tuple(scene.bodies).index(source.body)]
        emitting = np.isin(mesh.triangle_face, mesh.face_indices(source.faces, f"Source '{name}'"))
        if mesh.degenerate[emitting].all():
            faces = ", ".join(source.faces or mesh.face_names)
            raise SceneError(
                f"Source '{name}': the faces '{faces}' of body '{source.body}' are to emit but have no area."
            )
        points = _points_before(mesh, emitting & ~mesh.degenerate, frame)
    elif isinstance(source, RaysSource | CrossingsSource):
        points = placed_sample_mm(source, ray_sets[name], PROBES)
    else:
        points = np.array([source.position_mm])
        way = np.array(getattr(source, "direction", (0.0, 0.0, 0.0)))
        if way.any():
            points = points + AHEAD * frame.unit_mm * way / np.linalg.norm(way)
    if not isinstance(source, FacesSource):
        _check_is_not_shut_in(scene, name, meshes, points)
    sets, counts = np.unique(solids_at(scene, meshes, points), axis=0, return_counts=True)
    return sets[[np.argmax(counts)]]


def _check_is_not_shut_in(scene: Scene, name: str, meshes: tuple[BodyMesh, ...], points: NDArray[np.float64]) -> None:
    for mesh, body in zip(meshes, scene.bodies.values(), strict=True):
        surfaces = {body.face_surfaces.get(face, body.surface) for face in mesh.face_names}
        black = all(scene.surfaces[s].kind == "absorber" for s in surfaces)
        shuts_in = body.medium is None and black and mesh.is_closed
        if shuts_in and all(abs(winding_number(mesh.corners_mm, point)) > 0.5 for point in points):
            raise SceneError(
                f"Source '{name}' lies inside body '{mesh.name}', which absorbs all light: move the source out of the "
                "body, or give the body a medium or another surface."
            )


def _tables(
    scene: Scene,
    meshes: tuple[BodyMesh, ...],
    names: Names,
    boundary: LoweredBoundary,
    box: NDArray[np.float64],
    media: tuple[Medium, ...],
) -> Tables:
    first_face = np.cumsum([0, *(len(mesh.face_names) for mesh in meshes)])
    faces = [mesh.triangle_face + first for mesh, first in zip(meshes, first_face, strict=False)]
    bodies = list(scene.bodies.values())
    property_of_face = [bodies[body].face_surfaces.get(face, bodies[body].surface) for body, face in names.faces]
    return Tables(
        plane=boundary.plane,
        triangle_face=np.concatenate([np.zeros(0, np.int32), *faces]).astype(np.int32),
        face_body=np.array([body for body, _ in names.faces], np.int32),
        face_surface=np.array([names.surfaces.index(name) for name in property_of_face], np.int16),
        surface_kind=np.array([SurfaceKind[prop.kind.upper()] for prop in scene.surfaces.values()], np.uint8),
        medium_index=np.array([medium.index_at_d_line for medium in media]),
        ambient=np.array([_ambient_index(scene, names)], np.int16),
        box=box,
    )


#: Fields that say nothing of what happens to a ray; geometry counts as it was read from its file.
_UNHASHED: dict[type[Record], tuple[str, ...]] = {
    Scene: ("origin", "name"),
    Settings: ("rays", "seed", "store"),
    Body: ("geometry",),
    Medium: ("reference",),
    BsdfTable: ("reference",),
}


def _told(value: Any) -> Any:
    """A part of a scene as plain data.

    What stands at its default is left out, but for the kind of an object: a field that a later version brings changes
    no hash.
    """
    if isinstance(value, Record):
        told = {}
        for name, field in type(value).model_fields.items():
            if name in _UNHASHED.get(type(value), ()):
                continue
            part = _told(getattr(value, name))
            default = None if field.is_required() else _told(field.get_default(call_default_factory=True))
            if name == "kind" or field.is_required() or part != default:
                told[name] = part
        return told
    if isinstance(value, dict):
        return {key: _told(entry) for key, entry in value.items()}
    return [_told(entry) for entry in value] if isinstance(value, tuple) else value


def _scene_hash(scene: Scene, meshes: tuple[BodyMesh, ...], ray_sets: dict[str, RaySet]) -> str:
    sources = {
        name: source.as_rays(ray_sets[name].digest) if isinstance(source, RaysSource | CrossingsSource) else source
        for name, source in scene.sources.items()
    }
    scene = scene.model_copy(update={"sources": sources})
    shapes = {
        name: [[group.name, _told(group.surface)] for group in body.geometry.faces or () if group.surface is not None]
        for name, body in scene.bodies.items()
        if scene.settings.surfaces == "exact"
    }
    smooth = {name: body.geometry.smooth_faces for name, body in scene.bodies.items()}
    told = [_told(scene), [mesh_digest(mesh) for mesh in meshes]]
    told += [{name: part for name, part in parts.items() if part} for parts in (shapes, smooth) if any(parts.values())]
    text = json.dumps(told, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
