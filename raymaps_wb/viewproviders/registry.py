# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which view provider belongs to which object."""

from raymaps_wb.compat import icon_changed


def view_classes():
    """View provider of each of our types."""
    from raymaps_wb.viewproviders import detector, medium, result, source, study, surface_property

    return {
        "RayMaps::Study": study.ViewStudy,
        "RayMaps::Medium": medium.ViewMedium,
        "RayMaps::SurfaceProperty": surface_property.ViewSurfaceProperty,
        "RayMaps::Source": source.ViewSource,
        "RayMaps::Detector": detector.ViewDetector,
        "RayMaps::Result": result.ViewResult,
    }


def ensure_view(obj):
    """Give an object of ours its view provider if it has none, for instance when it was made without a window."""
    view = obj.ViewObject
    known = view_classes().get(getattr(obj.Proxy, "TYPE", ""))
    if view is not None and known is not None and not isinstance(getattr(view, "Proxy", None), known):
        known(view)
        icon_changed(view)  # from 1.1 on the tree has asked before
