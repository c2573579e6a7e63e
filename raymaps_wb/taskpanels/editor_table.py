# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which editor belongs to which property."""

from raymaps_wb.taskpanels.editors import (
    ChoiceEditor,
    ExactQuantityEditor,
    IntegerEditor,
    NumberEditor,
    NumbersEditor,
    QuantityEditor,
    ReferencesEditor,
    TextEditor,
)
from raymaps_wb.taskpanels.file_editors import FileEditor, SpectralEditor

EDITORS = {
    "App::PropertyFloat": NumberEditor,
    "App::PropertyInteger": IntegerEditor,
    "App::PropertyLength": QuantityEditor,
    "App::PropertyAngle": QuantityEditor,
    "App::PropertyEnumeration": ChoiceEditor,
    "App::PropertyFloatList": NumbersEditor,
    "App::PropertyString": TextEditor,
    "App::PropertyFile": FileEditor,
    "App::PropertyPath": FileEditor,
    "App::PropertyXLinkSubList": ReferencesEditor,
}


def editor_of(obj, prop):
    """The editor of a property; None if it has none, or if that of another edits it too."""
    if any(other.file == prop.name for other in obj.Proxy.PROPERTIES):
        return None
    editor = SpectralEditor if prop.file else ExactQuantityEditor if prop.is_exact else EDITORS.get(prop.kind)
    return editor(obj, prop) if editor is not None else None
