# SPDX-License-Identifier: LGPL-2.1-or-later
"""The property with which an object refers to bodies and faces picked in the 3D view."""

from raymaps_wb.objects.properties import Property


def references_property(text, shown_for=()):
    """A list of (object, sub-object paths) that follows renaming and reaches through parts and links."""
    return Property("App::PropertyXLinkSubList", "References", text, label="Bodies and faces", shown_for=shown_for)


def reference_list(obj):
    """References as a flat list of (object, path); the empty path is the whole object."""
    return [(target, sub) for target, subs in obj.References for sub in (subs or ("",))]


def set_references(obj, pairs):
    """Set the references from a flat list of (object, path), without doubles, in their order."""
    grouped: dict[tuple[str, str], tuple] = {}
    for target, sub in pairs:
        subs = grouped.setdefault((target.Document.Name, target.Name), (target, []))[1]
        if sub not in subs:
            subs.append(sub)
    obj.References = [(target, tuple(subs)) for target, subs in grouped.values()]


def add_references(obj, pairs):
    """Add to the references of an object."""
    set_references(obj, reference_list(obj) + list(pairs))
