# SPDX-License-Identifier: LGPL-2.1-or-later
"""A study as a scene: everything but the triangles.

`describe` gives the scene's data with, for each body, its place in the document; `raymaps_wb.export.writer` adds the
geometry files and `raymaps_wb.export.fingerprint` a digest of it all.
"""

from collections import namedtuple
from typing import Any

import FreeCAD

from raymaps_wb.errors import ExportError
from raymaps_wb.export.bodies import BodyPlace, body_names, in_document_order, label_of, resolve_all, shape_of
from raymaps_wb.objects.detector import Detector
from raymaps_wb.objects.medium import Medium
from raymaps_wb.objects.source import Source
from raymaps_wb.objects.study import members
from raymaps_wb.objects.surface_property import SurfaceProperty

#: scene: dict without geometry. places: dict of body name to BodyPlace.
Description = namedtuple("Description", "scene places")

DEFAULT_SURFACE = "smooth boundary"  # Fresnel, for bodies with a medium and no property of their own


def describe(study):
    """The scene of a study.

    Raises
    ------
    ExportError
        If it can't be written as a scene: a reference to nothing, two media in a body, no source, no surface property.
    """
    media = unique_names(members(study, Medium.TYPE))
    properties = unique_names(members(study, SurfaceProperty.TYPE))
    sources = unique_names(members(study, Source.TYPE))
    detectors = unique_names(members(study, Detector.TYPE))
    if not sources:
        raise ExportError(f"Study '{study.Label}' has no source; add one.")

    body_media: dict[BodyPlace, Any] = {}
    body_surfaces: dict[BodyPlace, Any] = {}
    face_surfaces: dict[tuple[BodyPlace, str], Any] = {}
    emitting: dict[Any, list] = {}
    for obj in media:
        for place, _ in resolve_all(obj):
            _assign(body_media, place, obj, media, "medium")
    for obj in properties:
        for place, face in resolve_all(obj):
            if face is None:
                _assign(body_surfaces, place, obj, properties, "surface property")
            else:
                _assign(face_surfaces, (place, face), obj, properties, "surface property")
    for obj in sources:
        if obj.Kind == "Faces":
            emitting[obj] = resolve_all(obj)

    places = list(body_media) + list(body_surfaces) + [place for place, _ in face_surfaces]
    places += [place for picked in emitting.values() for place, _ in picked]
    names = body_names(in_document_order(places))
    surfaces = {name: _surface(obj, name, properties) for obj, name in properties.items()}
    bodies = {}
    for place, name in names.items():
        own = {face: properties[obj] for (at, face), obj in face_surfaces.items() if at == place}
        bodies[name] = {
            "medium": media[body_media[place]] if place in body_media else None,
            "surface": _body_surface(place, name, body_media, body_surfaces, own, properties, surfaces),
            "face_surfaces": own,
        }
    ambient = study.AmbientMedium
    if ambient is not None and ambient not in media:
        raise ExportError(
            f"Study '{study.Label}': the ambient medium '{ambient.Label}' is not in the study; move it there."
        )
    scene = {
        "format": "raymaps-scene",
        "version": 1,
        "name": _text(study.Label),
        "ambient": media[ambient] if ambient is not None else None,
        "media": {name: _medium(obj) for obj, name in media.items()},
        "surfaces": surfaces,
        "bodies": bodies,
        "sources": {name: _source(obj, name, names, emitting) for obj, name in sources.items()},
        "detectors": {name: _detector(obj) for obj, name in detectors.items()},
        "settings": {
            "rays": study.Rays,
            "seed": study.Seed,
            "max_events": study.MaxEvents,
            "roulette_threshold": study.RouletteThreshold,
        },
    }
    return Description(scene, {name: place for place, name in names.items()})


def unique_names(objects):
    """Document objects with a name each: the label, with a number behind it where labels repeat."""
    names: dict[Any, str] = {}
    for obj in objects:
        name, n = _text(obj.Label), 1
        while name in names.values():
            n += 1
            name = f"{_text(obj.Label)}_{n}"
        names[obj] = name
    return names


def _text(label):
    return "".join(c for c in label if ord(c) >= 32 and ord(c) != 127).strip()[:150] or "unnamed"


def _assign(assigned, key, obj, names, what):
    other = assigned.setdefault(key, obj)
    if other is not obj:
        place, face = (key, None) if isinstance(key, BodyPlace) else key
        where = label_of(place) + (f".{face}" if face else "")
        raise ExportError(
            f"'{where}' has two of one {what}: '{names[other]}' and '{names[obj]}'; remove it from one of them."
        )


def _body_surface(place, name, body_media, body_surfaces, own, properties, surfaces):
    if place in body_surfaces:
        return properties[body_surfaces[place]]
    if place in body_media:
        surfaces.setdefault(DEFAULT_SURFACE, {"kind": "fresnel"})
        return DEFAULT_SURFACE
    missing = [f"Face{i + 1}" for i in range(len(shape_of(place).Faces)) if f"Face{i + 1}" not in own]
    if missing:
        shown = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")
        raise ExportError(f"Body '{name}' has no surface property on {shown}; give the whole body one, or a medium.")
    return next(iter(own.values()))


def _bands(values, where, what, default):
    values = [float(value) for value in values] or [default]
    if len(values) not in (1, 3):
        raise ExportError(f"{where}: {what} takes one value or three (red, green, blue), got {len(values)}.")
    return values[0] if len(values) == 1 else values


def _medium(obj):
    return {
        "refractive_index": obj.RefractiveIndex,
        "absorption_per_mm": _bands(obj.AbsorptionPerMm, f"Medium '{obj.Label}'", "absorption", 0.0),
    }


def _surface(obj, name, properties):
    where = f"Surface property '{name}'"
    if obj.Kind == "Mirror":
        return {"kind": "mirror", "reflectance": _bands(obj.Reflectance, where, "reflectance", 1.0)}
    if obj.Kind == "Lambertian":
        return {
            "kind": "lambertian",
            "reflectance": _bands(obj.Reflectance, where, "reflectance", 0.0),
            "transmittance": _bands(obj.Transmittance, where, "transmittance", 0.0),
        }
    if obj.Kind == "Mixture":
        if len(obj.Parts) != len(obj.Weights) or not obj.Parts:
            raise ExportError(f"{where}: a mixture needs a weight for each part, got {len(obj.Parts)} parts and "
                              f"{len(obj.Weights)} weights.")  # fmt: skip
        unknown = [part.Label for part in obj.Parts if part not in properties]
        if unknown:
            raise ExportError(f"{where}: '{unknown[0]}' is not a surface property of this study; move it there.")
        parts = zip(obj.Weights, obj.Parts, strict=True)
        return {"kind": "mixture", "parts": [{"weight": weight, "surface": properties[part]} for weight, part in parts]}
    return {"kind": obj.Kind.lower()}


def _source(obj, name, names, emitting):
    where = f"Source '{name}'"
    if len(obj.RGB) != 3:
        raise ExportError(f"{where}: RGB takes three values (red, green, blue), got {len(obj.RGB)}.")
    source = {"kind": obj.Kind.lower(), "flux_w": obj.FluxW, "rgb": [float(value) for value in obj.RGB]}
    if obj.Kind == "Faces":
        return {**source, **_emission(emitting[obj], where, names)}
    placement = global_placement(obj)
    source["position_mm"] = _position_mm(placement)
    if obj.Kind in ("Cone", "Disc"):
        source["direction"] = _direction(placement, 0, 0, 1)
    if obj.Kind == "Cone":
        source["half_angle_deg"] = float(obj.HalfAngle)
    if obj.Kind == "Disc":
        source["radius_mm"] = float(obj.Radius)
    return source


def _emission(picked, where, names):
    places = list(dict.fromkeys(place for place, _ in picked))
    if not places:
        raise ExportError(f"{where}: it emits from faces and has none; pick the faces of one body.")
    if len(places) > 1:
        shown = " and ".join(f"'{names[place]}'" for place in places[:2])
        raise ExportError(f"{where}: its faces are on more than one body ({shown}); make a source for each body.")
    faces = [face for _, face in picked]
    return {
        "body": names[places[0]],
        **({} if None in faces else {"faces": sorted(set(faces), key=lambda f: int(f[4:]))}),
    }


def _detector(obj):
    placement = global_placement(obj)
    return {
        "kind": "rectangle",
        "center_mm": _position_mm(placement),
        "normal": _direction(placement, 0, 0, 1),
        "x_axis": _direction(placement, 1, 0, 0),
        "width_mm": float(obj.Width),
        "height_mm": float(obj.Height),
        "resolution": [obj.ResolutionX, obj.ResolutionY],
        "side": obj.Side.lower(),
        "max_angle_deg": float(obj.MaxAngle),
    }


def _position_mm(placement):
    """Where a placement is, without the noise of its computation."""
    return [round(value, 9) + 0.0 for value in placement.Base]


def _direction(placement, x, y, z):
    """Where a local direction points to; a rotation that a document kept differs in the last digits."""
    return [round(value, 12) + 0.0 for value in placement.Rotation.multVec(FreeCAD.Vector(x, y, z))]


def global_placement(obj):
    """Placement of a source or detector in global coordinates, also inside parts."""
    parent = obj.getParentGeoFeatureGroup()
    return obj.Placement if parent is None else parent.getGlobalPlacement().multiply(obj.Placement)
