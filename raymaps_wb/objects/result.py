# SPDX-License-Identifier: LGPL-2.1-or-later
"""Result: the Ray Map of a study, what was asked of it, and whether it still belongs to the document."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.files import absolute_path, kept_path
from raymaps_wb.objects.properties import Property, Proxy, make_object
from raymaps_wb.objects.study import members


class Result(Proxy):
    """Names a map on disk. The map itself is never stored in the document."""

    TYPE = "RayMaps::Result"
    PROPERTIES = (
        Property(
            "App::PropertyString",
            "MapPath",
            "Folder of the Ray Map, relative to the document where possible",
            output=True,
        ),
        Property(
            "App::PropertyString", "Fingerprint", "Of all that was exported for this map", read_only=True, output=True
        ),
        Property("App::PropertyInteger", "Rays", "Number of rays in the map", read_only=True, output=True),
        Property("App::PropertyInteger", "Events", "Number of events in the map", read_only=True, output=True),
        Property(
            "App::PropertyBool",
            "Stale",
            "The document has changed since the map was made",
            False,
            read_only=True,
            output=True,
        ),
        Property("App::PropertyString", "Criterion", "Which rays are shown", "true", output=True),
        Property("App::PropertyStringList", "History", "Criteria asked before, latest first", output=True),
        Property("App::PropertyInteger", "MaxRays", "Largest number of rays drawn", 150, output=True),
        Property(
            "App::PropertyInteger",
            "MatchingRays",
            "Number of rays that match the criterion",
            read_only=True,
            output=True,
        ),
        Property(
            "App::PropertyFloat", "FluxW", "Light of the matching rays as emitted, in W", read_only=True, output=True
        ),
        Property("App::PropertyFloat", "FluxStderrW", "Standard error of FluxW, in W", read_only=True, output=True),
    )


def make_result(document, study, label=None):
    """Add a new, empty result."""
    return make_object(document, "App::FeaturePython", Result, label or translate("Result"), study)


def result_of(study):
    """The result of a study, None if it has none."""
    found = members(study, Result.TYPE)
    return found[0] if found else None


def map_folder(result):
    """Absolute path of the result's map; empty if it names none."""
    return absolute_path(result.Document, result.MapPath)


def set_map_folder(result, folder):
    """Remember a map, relative to the document where the map stands below the document's folder."""
    result.MapPath = kept_path(result.Document, folder)
