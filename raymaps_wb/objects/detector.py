# SPDX-License-Identifier: LGPL-2.1-or-later
"""Detector: registers light and never changes it."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.properties import Limits, Property, Proxy, make_object, only_added
from raymaps_wb.objects.references import references_property

KINDS = {
    "Rectangle": "a virtual rectangle that light passes through, with irradiance over its cells",
    "Faces": "light on faces of a body, told triangle by triangle",
    "Far field": "radiant intensity over all directions of the light that leaves the scene, as in IES and LDT files",
}
SIDES = {
    "Front": "registers light that arrives on the side that the arrow points to",
    "Back": "on the other side",
    "Both": "on both",
}
MEASURES = {"Incident": "all light that arrives", "Absorbed": "what the faces absorb of it"}


class Detector(Proxy):
    """A rectangle around its placement's origin, faces of a body, or all directions around its placement's axes.

    The normal of the rectangle is the z axis, its width runs along the x axis. In the far field gamma is 0 along -z and
    C is 0 along x, as a luminaire hangs.
    """

    TYPE = "RayMaps::Detector"
    SCHEMA = 2
    MIGRATIONS = {1: only_added}
    WITHOUT_PLACEMENT = ("Faces",)
    PROPERTIES = (
        Property("App::PropertyEnumeration", "Kind", "What it registers", "Rectangle", choices=KINDS),
        Property(
            "App::PropertyLength",
            "Width",
            "Size along the local x axis, in mm",
            10.0,
            shown_for=("Rectangle",),
            limits=Limits(0, unit=" mm", low_is_allowed=False),
        ),
        Property(
            "App::PropertyLength",
            "Height",
            "Size along the local y axis, in mm",
            10.0,
            shown_for=("Rectangle",),
            limits=Limits(0, unit=" mm", low_is_allowed=False),
        ),
        Property(
            "App::PropertyInteger",
            "ResolutionX",
            "Number of cells along the width",
            100,
            label="Cells in width",
            shown_for=("Rectangle",),
            limits=Limits(1, 10000),
        ),
        Property(
            "App::PropertyInteger",
            "ResolutionY",
            "Number of cells along the height",
            100,
            label="Cells in height",
            shown_for=("Rectangle",),
            limits=Limits(1, 10000),
        ),
        Property(
            "App::PropertyEnumeration",
            "Side",
            "From which side light is registered",
            "Front",
            choices=SIDES,
            shown_for=("Rectangle",),
        ),
        Property(
            "App::PropertyAngle",
            "MaxAngle",
            "Light at a larger angle to the normal is not registered, in degrees",
            90.0,
            label="Largest angle",
            shown_for=("Rectangle",),
            limits=Limits(0, 90, " degrees", low_is_allowed=False),
        ),
        Property(
            "App::PropertyEnumeration",
            "Measure",
            "Which light on the faces counts",
            "Incident",
            choices=MEASURES,
            shown_for=("Faces",),
        ),
        references_property(
            "Faces of one body on which light is registered; the body itself: all its faces", ("Faces",)
        ),
        Property(
            "App::PropertyInteger",
            "ResolutionC",
            "Number of cells around the axis, over C from 0 to 360 degrees: 72 makes steps of 5 degrees",
            72,
            label="Cells in C",
            shown_for=("Far field",),
            limits=Limits(1, 10000),
        ),
        Property(
            "App::PropertyInteger",
            "ResolutionGamma",
            "Number of cells from the axis, over gamma from 0 to 180 degrees: 36 makes steps of 5 degrees",
            36,
            label="Cells in γ",
            shown_for=("Far field",),
            limits=Limits(1, 10000),
        ),
    )


def make_detector(document, study=None, label=None, kind="Rectangle"):
    """Add a new detector."""
    obj = make_object(document, "App::GeometryPython", Detector, label or translate("Detector"), study)
    obj.Kind = kind
    return obj
