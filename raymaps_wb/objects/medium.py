# SPDX-License-Identifier: LGPL-2.1-or-later
"""Medium: what fills a body."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.properties import Property, Proxy, make_object
from raymaps_wb.objects.references import references_property

#: Common media: refractive index near 588 nm. Absorption is left to the user: it depends on the grade.
PRESETS = {
    "Air": 1.000273,
    "Water": 1.333,
    "Fused silica": 1.4585,
    "PMMA": 1.4914,
    "BK7": 1.5168,
    "Polycarbonate": 1.585,
    "SF11": 1.7847,
}


class Medium(Proxy):
    """A clear or absorbing medium inside the bodies that it refers to."""

    TYPE = "RayMaps::Medium"
    PROPERTIES = (
        Property("App::PropertyFloat", "RefractiveIndex", "Refractive index", 1.4914),
        Property(
            "App::PropertyFloatList",
            "AbsorptionPerMm",
            "Absorption coefficient in 1/mm: one value, or one for each of red, green and blue",
            [0.0],
        ),
        references_property("Bodies filled with this medium"),
    )


def make_medium(document, study=None, label=None, preset=None):
    """Add a new medium, perhaps with the values of a preset."""
    obj = make_object(document, "App::FeaturePython", Medium, label or preset or translate("Medium"), study)
    if preset:
        obj.RefractiveIndex = PRESETS[preset]
    return obj
