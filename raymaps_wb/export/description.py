# SPDX-License-Identifier: LGPL-2.1-or-later
"""A study as a scene: everything but the triangles.

`describe` gives the scene's data with, for each body, its place in the document; `raymaps_wb.export.writer` adds the
geometry files and `raymaps_wb.export.fingerprint` a digest of it all.
"""

from collections import namedtuple
from typing import Any

from raymaps_wb.errors import ExportError
from raymaps_wb.export.bodies import BodyPlace, body_names, in_document_order, label_of, resolve_all, shape_of
from raymaps_wb.export.detectors import detector
from raymaps_wb.export.media import medium
from raymaps_wb.export.scene_files import SceneFiles
from raymaps_wb.export.sources import source
from raymaps_wb.export.surface_properties import surface_property
from raymaps_wb.objects.detector import Detector
from raymaps_wb.objects.medium import Medium
from raymaps_wb.objects.source import Source
from raymaps_wb.objects.study import FACETED, OBSERVERS, SOBOL, members
from raymaps_wb.objects.surface_property import SurfaceProperty

#: scene: dict without geometry. places: dict of body name to BodyPlace. files: SceneFiles that the scene speaks of.
Description = namedtuple("Description", "scene places files")

USUAL_SPECTRUM = {"from_nm": 380.0, "to_nm": 780.0, "bands": 32, "observer": "cie_1931_2deg"}
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
    picked: dict[Any, list] = {}
    for obj in media:
        for place, _ in resolve_all(obj):
            _assign(body_media, place, obj, media, "medium")
    for obj in properties:
        for place, face in resolve_all(obj):
            if face is None:
                _assign(body_surfaces, place, obj, properties, "surface property")
            else:
                _assign(face_surfaces, (place, face), obj, properties, "surface property")
    for obj in (*sources, *detectors):
        if obj.Kind == "Faces":
            picked[obj] = resolve_all(obj)

    places = list(body_media) + list(body_surfaces) + [place for place, _ in face_surfaces]
    places += [place for pairs in picked.values() for place, _ in pairs]
    names = body_names(in_document_order(places))
    files = SceneFiles()
    surfaces = {name: surface_property(obj, name, properties, media, files) for obj, name in properties.items()}
    bodies = {}
    for place, name in names.items():
        own = {face: properties[obj] for (at, face), obj in face_surfaces.items() if at == place}
        bodies[name] = {
            "medium": media[body_media[place]] if place in body_media else None,
            "surface": _body_surface(place, name, body_media, body_surfaces, own, properties, surfaces),
            "face_surfaces": own,
            **_priority(body_media.get(place)),
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
        "media": {name: medium(obj, files) for obj, name in media.items()},
        "surfaces": surfaces,
        "bodies": bodies,
        "sources": {name: source(obj, name, picked.get(obj), names, files) for obj, name in sources.items()},
        "detectors": {name: detector(obj, name, picked.get(obj), names) for obj, name in detectors.items()},
        "settings": _settings(study),
    }
    return Description(scene, {name: place for place, name in names.items()}, files)


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


def _priority(medium):
    """Priority of a body where bodies overlap, from its medium; what is as usual is not named."""
    return {"priority": medium.Priority} if medium is not None and medium.Priority else {}


def _settings(study):
    """Settings of a study; what is as usual is not named."""
    settings = {
        "rays": study.Rays,
        "seed": study.Seed,
        "max_events": study.MaxEvents,
        "roulette_threshold": study.RouletteThreshold,
    }
    spectrum = {
        "from_nm": study.SpectrumFromNm,
        "to_nm": study.SpectrumToNm,
        "bands": study.Bands,
        "observer": OBSERVERS[study.Observer],
    }
    if spectrum != USUAL_SPECTRUM:
        settings["spectrum"] = spectrum
    if study.Store == "Spectral":
        settings["store"] = "spectral"
    if study.Sampling == SOBOL:
        settings["sampling"] = "sobol"
    if study.Surfaces == FACETED:
        settings["surfaces"] = "faceted"
    without = [name.strip() for name in study.Without if name.strip()]
    if without:
        settings["without"] = list(dict.fromkeys(without))
    return settings
