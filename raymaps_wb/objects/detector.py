# SPDX-License-Identifier: LGPL-2.1-or-later
"""Detector: a virtual rectangle that registers light and never changes it."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.properties import Property, Proxy, make_object

SIDES = ("Front", "Back", "Both")


class Detector(Proxy):
    """A rectangle around its placement's origin; its normal is the z axis, its width runs along the x axis."""

    TYPE = "RayMaps::Detector"
    PROPERTIES = (
        Property("App::PropertyLength", "Width", "Size along the local x axis, in mm", 10.0),
        Property("App::PropertyLength", "Height", "Size along the local y axis, in mm", 10.0),
        Property("App::PropertyInteger", "ResolutionX", "Number of cells along the width", 100),
        Property("App::PropertyInteger", "ResolutionY", "Number of cells along the height", 100),
        Property(
            "App::PropertyEnumeration",
            "Side",
            "Front: registers light that arrives on the side that the arrow points to; Back: on the other; Both",
            "Front",
            choices=SIDES,
        ),
        Property(
            "App::PropertyAngle",
            "MaxAngle",
            "Light at a larger angle to the normal is not registered, in degrees",
            90.0,
        ),
    )


def make_detector(document, study=None, label=None):
    """Add a new detector."""
    return make_object(document, "App::GeometryPython", Detector, label or translate("Detector"), study)
