# SPDX-License-Identifier: LGPL-2.1-or-later
"""Everything that is wrong with a study, in words, before a run."""

import math
import time
from collections import namedtuple

import Part

from raymaps_wb.errors import ExportError
from raymaps_wb.export.bodies import body_names, in_document_order, label_of, resolve, resolve_all, shape_of
from raymaps_wb.export.description import describe, unique_names
from raymaps_wb.export.detectors import detector
from raymaps_wb.export.media import medium
from raymaps_wb.export.placing import global_placement
from raymaps_wb.export.rules import faults
from raymaps_wb.export.scene_files import SceneFiles
from raymaps_wb.export.shapes import crosses_itself, crossing_faces, faulty_faces, is_smaller, shared_volume_mm3
from raymaps_wb.export.sources import source
from raymaps_wb.export.surface_properties import surface_property
from raymaps_wb.export.surfaces import exact_surface
from raymaps_wb.objects.detector import Detector
from raymaps_wb.objects.medium import Medium
from raymaps_wb.objects.source import Source
from raymaps_wb.objects.study import FACETED, members
from raymaps_wb.objects.surface_property import SurfaceProperty

#: blocks: whether a run is pointless. text: one sentence. obj: what to select, None for the study as a whole.
#: spoils: whether a run goes through and its figures are most likely wrong.
Problem = namedtuple("Problem", "blocks text obj spoils", defaults=(False,))

INTERFACES = ("fresnel", "rough", "thin_film")  # surface kinds between two media
INSIDE_MM = 1e-6


def check_study(study, distances=True, limit_s=math.inf):
    """Everything that is wrong with a study.

    Parameters
    ----------
    study : document object
    distances : bool
        Also look at surfaces and for bodies that overlap, which takes a while for many bodies.
    limit_s : float
        Look about as long as this at surfaces, and at overlaps; without a limit also for solids that cross themselves.

    Returns
    -------
    list of Problem, those that block a run first
    """
    problems: list[Problem] = []
    places = _places(study, problems)
    names = body_names(places)
    for problem in _own_faults(study, names):
        if not any(problem.text == other.text for other in problems):
            problems.append(problem)
    try:
        problems += _interfaces(describe(study).scene)
    except ExportError as error:
        if not any(str(error) == problem.text for problem in problems):
            problems.append(Problem(True, str(error), None))
    problems += _shapes(study, names)
    problems += _buried_sources(study, names)
    if distances:
        problems += _facets(study, names, limit_s)
        problems += _overlaps(study, names, limit_s)
    if distances and limit_s == math.inf:  # nothing ends this one in time
        problems += _crossings(names)
    problems += _left_out(study, places)
    if not members(study, Detector.TYPE):
        problems.append(Problem(False, "There is no detector; rays can be asked for, but no irradiance.", None))
    return sorted(problems, key=lambda problem: not problem.blocks)


def _own_faults(study, names):
    """What is wrong with each object by itself."""
    media, properties = (unique_names(members(study, kind)) for kind in (Medium.TYPE, SurfaceProperty.TYPE))
    writers = {
        Medium.TYPE: lambda obj, name, picked: medium(obj, SceneFiles()),
        SurfaceProperty.TYPE: lambda obj, name, picked: surface_property(obj, name, properties, media, SceneFiles()),
        Source.TYPE: lambda obj, name, picked: source(obj, name, picked, names, SceneFiles()),
        Detector.TYPE: lambda obj, name, picked: detector(obj, name, picked, names),
    }
    problems = []
    for member_type, write in writers.items():
        for obj, name in unique_names(members(study, member_type)).items():
            problems += [Problem(True, f"{obj.Label}: {text}", obj) for text in faults(obj)]
            try:
                write(obj, name, resolve_all(obj) if obj.Kind == "Faces" else None)
            except ExportError as error:
                problems.append(Problem(True, str(error), obj))
    return problems + [Problem(True, f"{study.Label}: {text}", study) for text in faults(study)]


def _places(study, problems):
    """All bodies that the study refers to; a reference that leads nowhere becomes a problem."""
    places = []
    for member_type in (Medium.TYPE, SurfaceProperty.TYPE, Source.TYPE, Detector.TYPE):
        for obj in members(study, member_type):
            if member_type in (Source.TYPE, Detector.TYPE) and obj.Kind != "Faces":
                continue
            try:
                places += [place for place, _ in resolve_all(obj)]
            except ExportError as error:
                problems.append(Problem(True, str(error), obj))
    return in_document_order(places)


def _interfaces(scene):
    """Boundaries of two media on bodies that have none."""

    def is_interface(name):
        surface = scene["surfaces"][name]
        if surface["kind"] == "mixture":
            return any(is_interface(part["surface"]) for part in surface["parts"])
        return surface["kind"] in INTERFACES

    problems = []
    for name, body in scene["bodies"].items():
        if body["medium"] is None:
            for surface in dict.fromkeys([body["surface"], *body["face_surfaces"].values()]):
                if is_interface(surface):
                    text = f"Surface property '{surface}' is a boundary of two media, and body '{name}' has none"
                    problems.append(Problem(True, f"{text}; give the body a medium, or another property.", None))
    return problems


def _shapes(study, names):
    filled = {place for obj in members(study, Medium.TYPE) for place in _resolved(obj)}
    problems = []
    for place, name in names.items():
        shape = shape_of(place)
        if place in filled and not shape.Solids:
            problems.append(
                Problem(True, f"Body '{name}' has a medium but is not a solid; close it or remove the medium.", None)
            )
        if not shape.isValid():
            faces, words = faulty_faces(shape)
            where = f" in {_some(faces)}" if faces else ""
            what = f" ({', '.join(words)})" if words else ""
            text = f"Body '{name}' has faulty geometry{where}{what}; see Part's 'Check geometry'"
            problems.append(Problem(False, f"{text}, light may leak through it.", None, True))
    return problems


def _crossings(names):
    """Solids whose own faces cross."""
    problems = []
    for place, name in names.items():
        shape = shape_of(place)
        if shape.Solids and shape.isValid() and crosses_itself(shape):
            pairs = [f"{a} with {b}" for a, b in crossing_faces(shape)]
            what = f"has faces that meet or cross ({_some(pairs)})" if pairs else "intersects itself"
            text = f"Body '{name}' {what}; make it one sound solid, light may leak through it."
            problems.append(Problem(False, text, None, True))
    return problems


def _some(words, most=5):
    return ", ".join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")


def _facets(study, names, limit_s):
    """Faces that have no exact surface, so that light meets their triangles."""
    if study.Surfaces == FACETED:
        return []
    end, problems = time.monotonic() + limit_s, []
    for place, name in names.items():
        if time.monotonic() > end:
            break
        reasons: dict[str, list[str]] = {}
        for i, face in enumerate(shape_of(place).Faces, 1):
            data = exact_surface(face)
            if data["type"] == "other":
                reasons.setdefault(f"{data['name']}: {data['reason']}", []).append(f"Face{i}")
        for reason, faces in reasons.items():
            text = f"Body '{name}': light meets the triangles of {_some(faces)}, not the surface ({reason})"
            chord = f"they keep to it within the chord tolerance of {float(study.ChordTolerance):g} mm"
            problems.append(Problem(False, f"{text}; {chord}.", None))
    return problems


def _buried_sources(study, names):
    """Sources inside solids without a medium, where their light can't get out."""
    filled = {place for obj in members(study, Medium.TYPE) for place in _resolved(obj)}
    solids = [(name, solid) for place, name in names.items() if place not in filled for solid in shape_of(place).Solids]
    problems = []
    for obj in members(study, Source.TYPE):
        if obj.Kind in ("Faces", "Ray file", "Crossings"):
            continue
        position = global_placement(obj).Base
        inside = next((name for name, solid in solids if solid.isInside(position, INSIDE_MM, True)), None)
        if inside is not None:
            text = f"{obj.Label}: it stands inside the body '{inside}', which has no medium, so its light can't get out"
            problems.append(Problem(False, f"{text}; move it, or give the body a medium.", obj, True))
    return problems


def _resolved(obj):
    try:
        return [place for place, _ in resolve_all(obj)]
    except ExportError:
        return []


def _overlaps(study, names, limit_s):
    """Pairs of bodies with media that share space: which of them rules there. Bodies that touch are no problem."""
    end = time.monotonic() + limit_s
    problems: list[Problem] = []
    media = {place: obj for obj in members(study, Medium.TYPE) for place in _resolved(obj)}
    solids = [(place, name, shape_of(place)) for place, name in names.items() if place in media]
    solids = [(place, name, shape) for place, name, shape in solids if shape.Solids and shape.isValid()]
    for i, (place_a, name_a, a) in enumerate(solids):
        for place_b, name_b, b in solids[i + 1 :]:
            if time.monotonic() > end:
                return problems
            try:
                volume_mm3 = shared_volume_mm3(a, b)
            except RuntimeError as error:
                text = f"FreeCAD can't tell whether the bodies '{name_a}' and '{name_b}' overlap ({error})."
                problems.append(Problem(False, text, None))
                continue
            if volume_mm3 > 0:
                first_rules, why = _which_rules(media[place_a], a, media[place_b], b)
                ruling = name_a if first_rules else name_b
                text = f"Bodies '{name_a}' and '{name_b}' overlap by {volume_mm3:.3g} mm\u00b3, where '{ruling}' rules"
                problems.append(Problem(False, f"{text}: {why}.", None))
    return problems


def _which_rules(medium_a, a, medium_b, b):
    """Whether the first of two overlapping bodies rules, and why; the second comes later in the scene."""
    if medium_a.Priority != medium_b.Priority:
        return medium_a.Priority > medium_b.Priority, "its medium has the higher priority"
    for shape, other, is_first in ((a, b, True), (b, a, False)):
        if is_smaller(abs(shape.Volume), abs(other.Volume)):
            return is_first, "of equal priorities the smaller body does"
    return False, "of bodies of one size and priority the later one does"


def _left_out(study, places):
    """Visible solids of the document that nothing of the study refers to."""
    used = set(places)
    tops = [obj for obj in study.Document.RootObjects if obj.Visibility and hasattr(obj, "getSubObjectList")]
    problems = []
    for obj in tops:
        try:
            found = [place for place, _ in resolve(obj, "")]
        except (
            ExportError,
            Part.OCCError,
            AttributeError,
            RuntimeError,
        ):  # what can't be resolved has no shape to leave out
            continue
        for place in found:
            if place not in used and shape_of(place).Solids:
                text = f"'{label_of(place)}' is a solid without a medium or surface property: light does not see it."
                problems.append(Problem(False, text, None))
    return problems
