# SPDX-License-Identifier: LGPL-2.1-or-later
"""Numbers that an object can't have, in words. What it lacks as a whole, the writers of `description` tell."""

import math

from raymaps_wb.export.media import is_given
from raymaps_wb.export.surface_properties import VALUES
from raymaps_wb.export.values import words
from raymaps_wb.objects.medium import FILE, Medium, scatterers
from raymaps_wb.objects.source import RGB, Source
from raymaps_wb.objects.study import Study
from raymaps_wb.objects.surface_property import SurfaceProperty


def faults(obj):
    """A sentence, without the object's name, for each number of an object of ours that is out of range."""
    found = []
    for prop in obj.Proxy.PROPERTIES:
        if prop.limits is None or not prop.matters(lambda name: getattr(obj, name)):
            continue
        if prop.file and getattr(obj, prop.file):
            continue
        value = getattr(obj, prop.name)
        values = list(value) if prop.kind == "App::PropertyFloatList" else [float(value)]
        what = "the " + (prop.label or words(prop.name)).split(" (")[0].lower()
        if prop.bands and len(values) not in (0, 1, 3):
            found.append(f"{what} takes one value or three (red, green, blue), got {len(values)}.")
        else:
            found += [fault for number in values for fault in number_faults(number, what, prop.limits)]
    return found + SPECIAL.get(obj.Proxy.TYPE, lambda obj, found: [])(obj, found)


def number_faults(value, what, limits):
    """One sentence if a number is outside its limits, else none."""
    low, high, unit = limits.low, limits.high, limits.unit
    inside = math.isfinite(value) and (low <= value if limits.low_is_allowed else low < value) and value <= high
    if inside:
        return []
    allowed = f"{'at least' if limits.low_is_allowed else 'above'} {low:g}" + (
        f" and at most {high:g}" if high < 1e90 else ""
    )
    return [f"{what} must be {allowed}{unit}, got {value:g}{unit}."]


def _medium(obj, found):
    faults = []
    if obj.Kind != FILE:
        columns = {name: len(getattr(obj, name)) for name in ("ScatteringPerMm", "ScatteringG", "ScatteringFiles")}
        if any(n > len(obj.ScatteringKinds) for n in columns.values()):
            faults.append("scattering: there are more figures than kinds of scatterers; give each its kind.")
        if len(obj.ScatteringKinds) > 16:
            faults.append(f"scattering: at most 16 scatterers, got {len(scatterers(obj))}.")
    if 0 < obj.ToNm <= obj.FromNm:
        faults.append(
            f"the formula must hold from a shorter to a longer wavelength, got {obj.FromNm:g} to {obj.ToNm:g} nm."
        )
    return faults


def _surface_property(obj, found):
    values = [name for name in VALUES.get(obj.Kind, {}).values() if not getattr(obj, name + "File")]
    bands = [(list(getattr(obj, name)) * 3)[:3] or [0.0] * 3 for name in values]
    faults = []
    if len(values) > 1 and not found and max(map(math.fsum, zip(*bands, strict=True))) > 1 + 1e-12:
        named = " and ".join([", ".join(words(name).lower() for name in values[:-1]), words(values[-1]).lower()])
        faults.append(f"{named} together must be at most 1 in each colour.")
    if obj.Kind == "Mixture" and obj.Parts and len(obj.Parts) == len(obj.Weights):
        if abs(math.fsum(obj.Weights) - 1) > 1e-6 or min(obj.Weights) < 0:
            faults.append(f"the weights must be 0 or more and add up to 1, got {math.fsum(obj.Weights):g}.")
        faults += [f"a mixture can't hold the mixture '{part.Label}'." for part in obj.Parts if part.Kind == "Mixture"]
    return faults


def _source(obj, found):
    if obj.Spectrum == RGB and (len(obj.RGB) != 3 or min(obj.RGB) < 0 or not is_given(list(obj.RGB))):
        return ["RGB takes three values of 0 or more, one of them above 0."]
    return []


def _study(obj, found):
    if not obj.SpectrumFromNm < obj.SpectrumToNm:
        return [
            f"the spectrum must go from a shorter to a longer wavelength, got {obj.SpectrumFromNm:g} to "
            f"{obj.SpectrumToNm:g} nm."
        ]
    return []


SPECIAL = {
    Medium.TYPE: _medium,
    SurfaceProperty.TYPE: _surface_property,
    Source.TYPE: _source,
    Study.TYPE: _study,
}
