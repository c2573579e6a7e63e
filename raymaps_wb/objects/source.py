# SPDX-License-Identifier: LGPL-2.1-or-later
"""Source: where light comes from."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.properties import Property, Proxy, make_object
from raymaps_wb.objects.references import references_property

KINDS = ("Faces", "Point", "Cone", "Disc")


class Source(Proxy):
    """A light source. Cone and disc shine along the z axis of their placement."""

    TYPE = "RayMaps::Source"
    PROPERTIES = (
        Property(
            "App::PropertyEnumeration",
            "Kind",
            "Faces: Lambertian emission from faces of a body; Point: the same in all directions; "
            "Cone: a point into a cone; Disc: a parallel beam",
            "Point",
            choices=KINDS,
        ),
        Property("App::PropertyFloat", "FluxW", "Radiant flux in W, all colours together", 1.0),
        Property(
            "App::PropertyFloatList", "RGB", "Relative flux of red, green and blue; white is 1, 1, 1", [1.0, 1.0, 1.0]
        ),
        Property(
            "App::PropertyAngle",
            "HalfAngle",
            "Angle between the axis and the edge of the cone, in degrees",
            10.0,
            shown_for=("Cone",),
        ),
        Property("App::PropertyLength", "Radius", "Radius of the beam, in mm", 5.0, shown_for=("Disc",)),
        references_property("Faces of one body that emit"),
    )

    def set_up(self, obj):
        """As everywhere, and hide what the kind does not use."""
        super().set_up(obj)
        self._hide_unused(obj)

    def onChanged(self, obj, name):
        super().onChanged(obj, name)
        if name == "Kind":
            self._hide_unused(obj)

    def _hide_unused(self, obj):
        faces = obj.Kind == "Faces"
        for name, hidden in (("Placement", faces), ("References", not faces)):
            if name in obj.PropertiesList:
                obj.setEditorMode(name, 2 if hidden else 0)


def make_source(document, study=None, label=None, kind="Point"):
    """Add a new source."""
    obj = make_object(document, "App::GeometryPython", Source, label or translate("Source"), study)
    obj.Kind = kind
    return obj
