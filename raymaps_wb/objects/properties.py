# SPDX-License-Identifier: LGPL-2.1-or-later
"""Declaring the properties of document objects, and bringing old ones up to date."""

from collections.abc import Callable
from typing import Any

import FreeCAD

SCHEMA_PROPERTY = "SchemaVersion"
READ_ONLY, HIDDEN, OUTPUT, NO_RECOMPUTE = 1, 4, 8, 16  # App::PropertyType flags


class Property:
    """One property of a document object.

    Parameters
    ----------
    kind : str, FreeCAD's property type such as "App::PropertyLength"
    name : str, its name in the document; a quantity without a unit of FreeCAD's carries it in the name
    text : str, tooltip
    default : its first value; None keeps FreeCAD's
    choices : tuple of str, for an enumeration
    shown_for : tuple of str, kinds of the object for which it matters; empty: always
    read_only, hidden : bool
    output : bool
        Nothing depends on it: a change asks for no recompute.
    """

    def __init__(
        self,
        kind,
        name,
        text,
        default=None,
        *,
        choices=(),
        shown_for=(),
        read_only=False,
        hidden=False,
        output=False,
    ):
        self.kind, self.name, self.text, self.default = kind, name, text, default
        self.choices, self.shown_for = choices, shown_for
        self.read_only, self.hidden, self.output = read_only, hidden, output

    def ensure(self, obj, group):
        """Add the property if the object does not have it; never changes a value that is there."""
        if self.name not in obj.PropertiesList:
            flags = (READ_ONLY if self.read_only else 0) | (HIDDEN if self.hidden else 0)
            flags |= OUTPUT | NO_RECOMPUTE if self.output else 0
            obj.addProperty(self.kind, self.name, group, self.text, flags)
            if self.choices:
                setattr(obj, self.name, list(self.choices))
            if self.default is not None:
                setattr(obj, self.name, self.default)
        elif self.choices and self.choices != tuple(obj.getEnumerationsOfProperty(self.name) or ()):
            value = getattr(obj, self.name)
            setattr(obj, self.name, list(self.choices))
            if value in self.choices:
                setattr(obj, self.name, value)


def show_relevant(obj, properties):
    """Show in the property editor only what matters for the object's kind."""
    for prop in properties:
        if prop.shown_for and prop.name in obj.PropertiesList:
            wanted = 0 if obj.Kind in prop.shown_for else 2
            if wanted != (2 if "Hidden" in obj.getEditorMode(prop.name) else 0):
                obj.setEditorMode(prop.name, wanted)


class Proxy:
    """Base of the Python side of all our document objects.

    A subclass names its TYPE, the SCHEMA version of its properties, the PROPERTIES themselves and MIGRATIONS: for each
    older version n the function that lifts an object from n to n + 1.
    """

    TYPE = ""
    SCHEMA = 1
    PROPERTIES: tuple[Property, ...] = ()
    MIGRATIONS: dict[int, Callable[[Any], None]] = {}

    def __init__(self, obj):
        obj.Proxy = self
        self.set_up(obj)

    def set_up(self, obj):
        """Bring an object to the present schema. Does nothing to one that is up to date."""
        if SCHEMA_PROPERTY not in obj.PropertiesList:
            obj.addProperty(
                "App::PropertyInteger",
                SCHEMA_PROPERTY,
                "Base",
                "Version of this object's properties",
                READ_ONLY | HIDDEN,
            )
            obj.SchemaVersion = self.SCHEMA
        if obj.SchemaVersion > self.SCHEMA:
            FreeCAD.Console.PrintWarning(
                f"Ray Maps: '{obj.Label}' was made by a newer Ray Maps (schema {obj.SchemaVersion}, this one knows "
                f"{self.SCHEMA}); update Ray Maps before you change it.\n"
            )
        while obj.SchemaVersion < self.SCHEMA:
            self.MIGRATIONS[obj.SchemaVersion](obj)
            obj.SchemaVersion += 1
        group = self.TYPE.split("::")[-1]
        for prop in self.PROPERTIES:
            prop.ensure(obj, group)
        if "Kind" in obj.PropertiesList:
            show_relevant(obj, self.PROPERTIES)

    def onDocumentRestored(self, obj):
        """FreeCAD calls this after opening a document."""
        obj.Proxy = self
        self.set_up(obj)
        if FreeCAD.GuiUp:
            from raymaps_wb.viewproviders import registry

            registry.ensure_view(obj)

    def onChanged(self, obj, name):
        """FreeCAD calls this after a property changed."""
        if name == "Kind" and SCHEMA_PROPERTY in obj.PropertiesList:
            show_relevant(obj, self.PROPERTIES)

    def execute(self, obj):
        """Nothing to compute: the objects only describe."""

    def dumps(self):
        return None

    def loads(self, state):
        return None

    # FreeCAD 0.20 asks for the older names.
    def __getstate__(self):
        return None

    def __setstate__(self, state):
        return None


def type_of(obj):
    """Our type of a document object, such as "RayMaps::Detector"; empty for those of others."""
    return getattr(getattr(obj, "Proxy", None), "TYPE", "")


def make_object(document, freecad_type, proxy, label, study=None):
    """A new document object with its proxy and, in the window, its view provider."""
    obj = document.addObject(freecad_type, proxy.TYPE.split("::")[-1])
    proxy(obj)
    obj.Label = label
    if FreeCAD.GuiUp:
        from raymaps_wb.viewproviders import registry

        registry.ensure_view(obj)
    if study is not None:
        study.addObject(obj)
    return obj
