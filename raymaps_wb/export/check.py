# SPDX-License-Identifier: LGPL-2.1-or-later
"""Everything that is wrong with a study, in words, before a run."""

import math
import time
from collections import namedtuple

import Part

from raymaps_wb.errors import ExportError
from raymaps_wb.export.bodies import body_names, label_of, resolve, resolve_all, shape_of
from raymaps_wb.export.description import describe, global_placement
from raymaps_wb.objects.detector import Detector
from raymaps_wb.objects.medium import Medium
from raymaps_wb.objects.references import reference_list
from raymaps_wb.objects.source import Source
from raymaps_wb.objects.study import members
from raymaps_wb.objects.surface_property import SurfaceProperty

#: blocks: whether a run is pointless. text: one sentence. obj: what to select, None for the study as a whole.
#: spoils: whether a run goes through and its figures are most likely wrong.
Problem = namedtuple("Problem", "blocks text obj spoils", defaults=(False,))

TOUCH_MM = 1e-4
INSIDE_MM = 1e-6


def check_study(study, distances=True, limit_s=math.inf):
    """Everything that is wrong with a study.

    Parameters
    ----------
    study : document object
    distances : bool
        Also look for bodies that touch or overlap, which takes a while for many bodies.
    limit_s : float
        Look no longer than this at the distances of bodies.

    Returns
    -------
    list of Problem, those that block a run first
    """
    problems = []
    for member_type, rule in RULES.items():
        for obj in members(study, member_type):
            problems += [Problem(True, f"{obj.Label}: {text}", obj) for text in rule(obj)]
    problems += _settings(study)
    places = _places(study, problems)
    try:
        describe(study)
    except ExportError as error:
        if not any(str(error) == problem.text for problem in problems):
            problems.append(Problem(True, str(error), None))
    names = body_names(places)
    problems += _shapes(study, names)
    problems += _buried_sources(study, names)
    if distances:
        problems += _touching(study, names, limit_s)
    problems += _left_out(study, places)
    if not members(study, Detector.TYPE):
        problems.append(Problem(False, "There is no detector; rays can be asked for, but no irradiance.", None))
    return sorted(problems, key=lambda problem: not problem.blocks)


def _number(value, what, low, high, unit="", low_is_allowed=True):
    inside = math.isfinite(value) and (low <= value if low_is_allowed else low < value) and value <= high
    if inside:
        return []
    allowed = f"{'at least' if low_is_allowed else 'above'} {low:g}" + (
        f" and at most {high:g}" if high < 1e300 else ""
    )
    return [f"{what} must be {allowed}{unit}, got {value:g}{unit}."]


def _bands(values, what, low, high, unit=""):
    if len(values) not in (0, 1, 3):
        return [f"{what} takes one value or three (red, green, blue), got {len(values)}."]
    return [fault for value in values for fault in _number(value, what, low, high, unit)]


def _medium(obj):
    return _number(obj.RefractiveIndex, "the refractive index", 0, 10, low_is_allowed=False) + _bands(
        obj.AbsorptionPerMm, "the absorption coefficient", 0, 1e308, " 1/mm"
    )


def _surface_property(obj):
    faults = []
    if obj.Kind in ("Mirror", "Lambertian"):
        faults += _bands(obj.Reflectance, "reflectance", 0, 1)
    if obj.Kind == "Lambertian":
        faults += _bands(obj.Transmittance, "transmittance", 0, 1)
        bands = [(list(values) * 3)[:3] or [0.0] * 3 for values in (obj.Reflectance, obj.Transmittance)]
        if not faults and any(r + t > 1 + 1e-12 for r, t in zip(*bands, strict=True)):
            faults.append("reflectance and transmittance together must be at most 1 in each colour.")
    if obj.Kind == "Mixture":
        if len(obj.Parts) != len(obj.Weights) or not obj.Parts:
            faults.append(
                f"a mixture needs a weight for each part, got {len(obj.Parts)} parts, {len(obj.Weights)} weights."
            )
        elif abs(math.fsum(obj.Weights) - 1) > 1e-6 or min(obj.Weights) < 0:
            faults.append(f"the weights must be 0 or more and add up to 1, got {math.fsum(obj.Weights):g}.")
        faults += [f"a mixture can't hold the mixture '{part.Label}'." for part in obj.Parts if part.Kind == "Mixture"]
    return faults


def _source(obj):
    faults = _number(obj.FluxW, "the flux", 0, 1e308, " W", low_is_allowed=False)
    if len(obj.RGB) != 3 or min(obj.RGB) < 0 or not sum(obj.RGB) > 0:
        faults.append("RGB takes three values of 0 or more, one of them above 0.")
    if obj.Kind == "Cone":
        faults += _number(float(obj.HalfAngle), "the half angle", 0, 180, " degrees", low_is_allowed=False)
    if obj.Kind == "Disc":
        faults += _number(float(obj.Radius), "the radius", 0, 1e308, " mm", low_is_allowed=False)
    if obj.Kind == "Faces" and not reference_list(obj):
        faults.append("it emits from faces and has none; pick the faces of one body.")
    return faults


def _detector(obj):
    faults = _number(float(obj.Width), "the width", 0, 1e308, " mm", low_is_allowed=False)
    faults += _number(float(obj.Height), "the height", 0, 1e308, " mm", low_is_allowed=False)
    faults += _number(obj.ResolutionX, "resolution X", 1, 10000) + _number(obj.ResolutionY, "resolution Y", 1, 10000)
    return faults + _number(float(obj.MaxAngle), "the largest angle", 0, 90, " degrees", low_is_allowed=False)


RULES = {
    Medium.TYPE: _medium,
    SurfaceProperty.TYPE: _surface_property,
    Source.TYPE: _source,
    Detector.TYPE: _detector,
}


def _settings(study):
    faults = _number(study.Rays, "the number of rays", 1, 1e12) + _number(study.Seed, "the seed", 0, 2**31)
    faults += _number(study.MaxEvents, "the largest number of events", 2, 100_000)
    faults += _number(study.RouletteThreshold, "the roulette threshold", 0, 1)
    faults += _number(float(study.ChordTolerance), "the chord tolerance", 0, 1e308, " mm", low_is_allowed=False)
    faults += _number(float(study.AngularDeflection), "the angular deflection", 0, 90, " degrees", low_is_allowed=False)
    return [Problem(True, f"{study.Label}: {text}", study) for text in faults]


def _places(study, problems):
    """All bodies that the study refers to; a reference that leads nowhere becomes a problem."""
    places = []
    for member_type in (Medium.TYPE, SurfaceProperty.TYPE, Source.TYPE):
        for obj in members(study, member_type):
            try:
                places += [place for place, _ in resolve_all(obj)]
            except ExportError as error:
                problems.append(Problem(True, str(error), obj))
    return list(dict.fromkeys(places))


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
            text = f"Body '{name}' has faulty geometry; see Part's 'Check geometry', light may leak through it."
            problems.append(Problem(False, text, None, True))
    return problems


def _buried_sources(study, names):
    """Sources inside solids without a medium, where their light can't get out."""
    filled = {place for obj in members(study, Medium.TYPE) for place in _resolved(obj)}
    solids = [(name, solid) for place, name in names.items() if place not in filled for solid in shape_of(place).Solids]
    problems = []
    for obj in members(study, Source.TYPE):
        if obj.Kind == "Faces":
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


def _touching(study, names, limit_s):
    """Bodies that touch or overlap where one of them has a medium; to opaque ones it does no harm."""
    filled = {place for obj in members(study, Medium.TYPE) for place in _resolved(obj)}
    end = time.monotonic() + limit_s
    shapes = [(name, shape_of(place), place in filled) for place, name in names.items()]
    problems: list[Problem] = []
    for i, (name_a, a, is_filled) in enumerate(shapes):
        for name_b, b, is_other_filled in shapes[i + 1 :]:
            if not (is_filled or is_other_filled):
                continue
            if time.monotonic() > end:
                return problems
            box = a.BoundBox
            box.enlarge(TOUCH_MM)
            if box.intersect(b.BoundBox) and a.distToShape(b)[0] < TOUCH_MM:
                text = f"Bodies '{name_a}' and '{name_b}' touch or overlap, which is not supported yet"
                problems.append(Problem(False, f"{text}; leave a gap of 0.01 mm or more.", None, True))
    return problems


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
