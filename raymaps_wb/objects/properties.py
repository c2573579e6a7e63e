# SPDX-License-Identifier: LGPL-2.1-or-later
"""Declaring the properties of document objects, and bringing old ones up to date."""

import math
from collections.abc import Callable
from typing import Any

import FreeCAD

SCHEMA_PROPERTY = "SchemaVersion"
READ_ONLY, HIDDEN, OUTPUT, NO_RECOMPUTE = 1, 4, 8, 16  # App::PropertyType flags


class Limits:
    """Which numbers a property may hold: from ``low`` to ``high``, with the unit that people read."""

    def __init__(self, low, high=math.inf, unit="", low_is_allowed=True):
        self.low, self.high, self.unit, self.low_is_allowed = low, high, unit, low_is_allowed


class Property:
    """One property of a document object.

    Parameters
    ----------
    kind : str, FreeCAD's property type such as "App::PropertyLength"
    name : str, its name in the document; a quantity without a unit of FreeCAD's carries it in the name
    text : str, tooltip
    default : its first value; None keeps FreeCAD's
    label : str, what panels call it; made from the name if empty
    choices : tuple of str, dict of str to a sentence about each, or a function that gives a tuple; for an enumeration
    shown_for : tuple of str, kinds of the object for which it matters; empty: always
    when : dict of str to tuple of str, the values of other enumerations for which it matters
    limits : Limits of the number, or of each of several
    bands : bool
        The list holds one number, or one for each of red, green and blue.
    is_exact : bool
        Panels show all digits of the quantity; the user's usual number of them is too few.
    file : str
        Name of the property with a file that is used in place of this one's numbers.
    filter : str
        Which files a dialog offers, as Qt writes it.
    form : str
        What a file holds, of `raymaps_wb.export.tables`; panels tell what they find in it.
    read_only, hidden : bool
    output : bool
        Nothing depends on it: a change asks for no recompute.
    keeps_unknown : bool
        A choice that is not known any more stays; else the first takes its place.
    """

    def __init__(
        self,
        kind,
        name,
        text,
        default=None,
        *,
        label="",
        choices=(),
        shown_for=(),
        when=None,
        limits=None,
        bands=False,
        is_exact=False,
        file="",
        filter="",
        form="",
        read_only=False,
        hidden=False,
        output=False,
        keeps_unknown=False,
    ):
        self.kind, self.name, self.default, self.label = kind, name, default, label
        self._choices = choices
        self.choice_texts = dict(choices) if isinstance(choices, dict) else {}
        self.text = "\n".join([text, *(f"{choice}: {said}" for choice, said in self.choice_texts.items())])
        self.shown_for = shown_for
        self.conditions = {**({"Kind": shown_for} if shown_for else {}), **(when or {})}
        self.limits, self.bands, self.file, self.filter, self.form = limits, bands, file, filter, form
        self.is_exact = is_exact
        self.read_only, self.hidden, self.output = read_only, hidden, output
        self.keeps_unknown = keeps_unknown

    @property
    def choices(self):
        """Words of an enumeration; empty for other properties."""
        return tuple(self._choices() if callable(self._choices) else self._choices)

    def matters(self, value_of):
        """Whether the property matters, where ``value_of(name)`` is the present choice of another."""
        return all(value_of(name) in wanted for name, wanted in self.conditions.items())

    def ensure(self, obj, group):
        """Add the property if the object does not have it; never changes a value that is there."""
        if self.name not in obj.PropertiesList:
            flags = (READ_ONLY if self.read_only else 0) | (HIDDEN if self.hidden else 0)
            flags |= OUTPUT | NO_RECOMPUTE if self.output else 0
            obj.addProperty(self.kind, self.name, group, self.text, flags)
            if self.kind == "App::PropertyEnumeration":
                setattr(obj, self.name, list(self.choices or (self.default,)))
            if self.default is not None and (not self.choices or self.default in self.choices):
                setattr(obj, self.name, self.default)
        elif self.choices:
            value = getattr(obj, self.name)
            wanted = self.choices
            if self.keeps_unknown and value and value not in wanted:
                wanted = (*wanted, value)
            if wanted != tuple(obj.getEnumerationsOfProperty(self.name) or ()):
                setattr(obj, self.name, list(wanted))
                if value in wanted:
                    setattr(obj, self.name, value)


def show_relevant(obj, proxy):
    """Show in the property editor only what matters for the object's kind."""
    present = obj.PropertiesList
    wanted = {prop.name: prop.matters(lambda name: getattr(obj, name)) for prop in proxy.PROPERTIES if prop.conditions}
    if "Placement" in present:
        wanted["Placement"] = obj.Kind not in proxy.WITHOUT_PLACEMENT
    for name, shown in wanted.items():
        if name in present and shown == ("Hidden" in obj.getEditorMode(name)):
            obj.setEditorMode(name, 0 if shown else 2)


class Proxy:
    """Base of the Python side of all our document objects.

    A subclass names its TYPE, the SCHEMA version of its properties, the PROPERTIES themselves and MIGRATIONS: for each
    older version n the function that lifts an object from n to n + 1.
    """

    TYPE = ""
    SCHEMA = 1
    PROPERTIES: tuple[Property, ...] = ()
    MIGRATIONS: dict[int, Callable[[Any], None]] = {}
    #: Kinds that stand nowhere in particular.
    WITHOUT_PLACEMENT: tuple[str, ...] = ()

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
            show_relevant(obj, self)

    def onDocumentRestored(self, obj):
        """FreeCAD calls this after opening a document."""
        obj.Proxy = self
        self.set_up(obj)
        if FreeCAD.GuiUp:
            from raymaps_wb.viewproviders import registry

            registry.ensure_view(obj)

    def onChanged(self, obj, name):
        """FreeCAD calls this after a property changed."""
        if name in self._deciding() and all(prop.name in obj.PropertiesList for prop in self.PROPERTIES):
            show_relevant(obj, self)

    def _deciding(self):
        """Properties on whose choice depends which others matter."""
        return {name for prop in self.PROPERTIES for name in prop.conditions}

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


def only_added(obj):
    """Migration to a schema that has properties which the older one has not: setting up adds them."""


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
