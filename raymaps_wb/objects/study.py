# SPDX-License-Identifier: LGPL-2.1-or-later
"""Study: the container of everything that one simulation needs, and its settings."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.properties import Property, Proxy, make_object, type_of


class Study(Proxy):
    """A group of media, surface properties, sources, detectors and a result."""

    TYPE = "RayMaps::Study"
    PROPERTIES = (
        Property("App::PropertyInteger", "Rays", "Number of rays to simulate", 100_000),
        Property("App::PropertyInteger", "Seed", "Seed of all random numbers: the same seed gives the same rays", 1),
        Property(
            "App::PropertyInteger", "MaxEvents", "A ray with more events than this is ended, and recorded so", 1000
        ),
        Property(
            "App::PropertyFloat",
            "RouletteThreshold",
            "Share of its light (0 to 1) below which losses on surfaces end a ray by chance instead of dimming it",
            0.1,
        ),
        Property(
            "App::PropertyLength", "ChordTolerance", "Largest distance of the triangles to the CAD surface, in mm", 0.02
        ),
        Property(
            "App::PropertyAngle", "AngularDeflection", "Largest angle between neighbouring triangles, in degrees", 6.0
        ),
        Property("App::PropertyLinkGlobal", "AmbientMedium", "Medium outside all bodies; none: vacuum"),
    )


def make_study(document, label=None):
    """Add a new study to a document."""
    return make_object(document, "App::DocumentObjectGroupPython", Study, label or translate("Study"))


def studies(document):
    """All studies of a document."""
    return [obj for obj in document.Objects if type_of(obj) == Study.TYPE] if document is not None else []


def study_of(obj):
    """The study that an object belongs to (or is); None if there is none."""
    if type_of(obj) == Study.TYPE:
        return obj
    for parent in obj.InList:
        if type_of(parent) == Study.TYPE and obj in parent.Group:
            return parent
    return None


def members(study, member_type):
    """Members of a study with one of our types, in the order of the tree, also those in sub-groups."""
    found, queue = [], list(study.Group)
    while queue:
        obj = queue.pop(0)
        if type_of(obj) == member_type:
            found.append(obj)
        elif obj.isDerivedFrom("App::DocumentObjectGroup") and type_of(obj) != Study.TYPE:
            queue = list(obj.Group) + queue
    return found
