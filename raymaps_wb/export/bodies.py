# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which bodies a study refers to: one name for each place of a solid in the document, however it was picked.

A body is reached through parts and links: the same solid behind two links is two bodies. Picked as ``Part.Box.Face1``
of an assembly, as ``Face1`` of the box itself or through a PartDesign body's last feature, it is the same body.
"""

from collections import namedtuple

import Part

from raymaps_wb.errors import ExportError
from raymaps_wb.objects.references import reference_list

#: A place of a shape in the document: the outermost object and the dotted path from it, such as "" or "Part.Box.".
BodyPlace = namedtuple("BodyPlace", "document top path")

MAX_DEPTH = 64


def resolve(obj, sub):
    """The bodies and the faces that one reference means.

    Parameters
    ----------
    obj : document object
    sub : str, path with an element such as "Part.Box.Face1", "Face1", "Box." or ""

    Returns
    -------
    list of (BodyPlace, str or None), the face's name; None is the whole body

    Raises
    ------
    ExportError
        If the reference names an edge or vertex, something without faces, or what is no longer there.
    """
    names = [part for part in sub.split(".") if part and not part.startswith((";", "?"))]
    face = None
    if names and not sub.endswith(".") and _is_element(names[-1]):
        face = names.pop()
        if not face.startswith("Face"):
            raise ExportError(
                f"'{obj.Label}.{sub}': light meets faces and bodies; pick one of these instead of {face}."
            )
    top, names = _to_outermost(obj, names)
    places = _expand(top, [], names)
    if not places:
        raise ExportError(
            f"'{obj.Label}{'.' + sub if sub else ''}': there is no body with faces; pick a solid or a face."
        )
    if face is not None:
        if len(places) > 1:
            raise ExportError(f"'{obj.Label}.{sub}': {face} is in a group of bodies; pick the face of one body.")
        if not face[4:].isdigit() or not 1 <= int(face[4:]) <= len(shape_of(places[0]).Faces):
            raise ExportError(f"'{label_of(places[0])}' has no face '{face}' any more; pick the face again.")
    return [(place, face) for place in places]


def resolve_all(obj):
    """All bodies and faces that an object of ours refers to, as a list of (BodyPlace, face name or None)."""
    found = []
    for target, sub in reference_list(obj):
        try:
            found += resolve(target, sub)
        except ExportError as error:
            raise ExportError(f"{obj.Label}: {error}") from error
    return found


def shape_of(place):
    """Shape of a body in global coordinates."""
    return Part.getShape(_top(place), place.path, needSubElement=False, transform=True)


def leaf_of(place):
    """The document object that a body's place leads to."""
    return _chain(place)[-1]


def label_of(place):
    """Label of a body as the tree shows it."""
    return leaf_of(place).Label


def in_document_order(places):
    """Bodies without doubles, in the order of their documents' objects, whatever order they were picked in."""

    def key(place):
        position = [obj.Name for obj in _top(place).Document.Objects].index(place.top)
        return (place.document, position, place.path)

    return sorted(set(places), key=key)


def body_names(places):
    """A unique name for each body, in their order.

    The name is the body's label; where labels repeat, with that of its parent before it or a number behind it. Bodies
    that are reached without a link take the short names first.
    """
    names: dict[BodyPlace, str] = {}
    for place in sorted(places, key=lambda place: any(obj.isDerivedFrom("App::Link") for obj in _chain(place))):
        chain = [obj.Label for obj in _chain(place)]
        candidates = [_clean("_".join(chain[-n:])) for n in range(1, len(chain) + 1)]
        candidates += [f"{candidates[-1]}_{i}" for i in range(2, len(places) + 2)]
        names[place] = next(name for name in candidates if name not in names.values())
    return {place: names[place] for place in places}


def _clean(label):
    text = "".join(c if ord(c) >= 32 and ord(c) != 127 else " " for c in label).strip()
    return text[:150] or "Body"


def _top(place):
    import FreeCAD

    return FreeCAD.getDocument(place.document).getObject(place.top)


def _chain(place):
    top = _top(place)
    return list(top.getSubObjectList(place.path)) if place.path else [top]


def _is_element(name):
    return name.rstrip("0123456789") in ("Face", "Edge", "Vertex", "Wire", "Shell", "Solid") and name[-1].isdigit()


def _to_outermost(obj, names):
    """Lengthen a path upwards until it starts at an object that is in no part or body."""
    names = list(names)
    for _ in range(MAX_DEPTH):
        parent = obj.getParentGeoFeatureGroup()
        if parent is None:
            break
        names.insert(0, obj.Name)
        obj = parent
    return obj, names


def _expand(top, walked, names):
    """Follow names from top; below the last name take every body of a container."""
    path = "".join(name + "." for name in walked)
    here = top.getSubObjectList(path)[-1] if path else top
    if not _is_container(here):
        # What a path says behind a shape, such as the last feature of a PartDesign body, is the same shape.
        place = BodyPlace(top.Document.Name, top.Name, path)
        return [place] if len(shape_of(place).Faces) else []
    if len(walked) > MAX_DEPTH:
        raise ExportError(f"'{top.Label}': parts and links are nested more than {MAX_DEPTH} deep.")
    if names:
        child = _child(top, path, names[0])
        if child is None:
            raise ExportError(f"'{here.Label}' has no '{names[0]}' any more; pick it again.")
        walked = walked if _is_plain_group(child) else walked + [names[0]]
        return _expand(top, walked, names[1:])
    found = []
    for sub in here.getSubObjects():
        name = sub.rstrip(".")
        child = _child(top, path, name)
        if child is None or _is_plain_group(child) or not _can_have_faces(child) or _is_consumed(child):
            continue
        found += _expand(top, walked + [name], [])
    return found


def _child(top, path, name):
    try:
        chain = top.getSubObjectList(f"{path}{name}.")
    except (RuntimeError, ValueError, ReferenceError):
        return None
    return chain[-1] if len(chain) > (len(top.getSubObjectList(path)) if path else 1) else None


def _linked(obj):
    return obj.getLinkedObject(True) or obj


def _is_container(obj):
    if getattr(obj, "ElementCount", 0) and obj.isDerivedFrom("App::Link"):
        return True
    linked = _linked(obj)
    return linked.isDerivedFrom("App::Part") or linked.isDerivedFrom("App::LinkGroup") or _is_plain_group(linked)


def _is_plain_group(obj):
    return obj.isDerivedFrom("App::DocumentObjectGroup")


def _can_have_faces(obj):
    linked = _linked(obj)
    return _is_container(obj) or (hasattr(linked, "Shape") and bool(linked.Shape.Faces))


def _is_consumed(obj):
    """Whether another feature was made from this object, such as a cut from its tool."""
    for user in obj.InList:
        if user.isDerivedFrom("Part::Feature") and not user.hasExtension("App::GeoFeatureGroupExtension"):
            return True
    return False
