# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every difference between the supported FreeCAD (0.20, 1.0, 1.1) and Qt (5, 6) versions."""

import ctypes
import importlib
import os
from typing import Any

import FreeCAD
from PySide import QtCore

# FreeCAD's PySide package names the binding that FreeCAD itself uses. On 0.20 it has no QtWidgets module.
QtGui: Any = None
QtWidgets: Any = None
if FreeCAD.GuiUp:
    QtGui = importlib.import_module("PySide.QtGui")
    try:
        QtWidgets = importlib.import_module("PySide.QtWidgets")
    except ImportError:
        QtWidgets = importlib.import_module("PySide2.QtWidgets")

__all__ = [
    "QtCore",
    "QtGui",
    "QtWidgets",
    "exec_dialog",
    "flags_as_int",
    "icon_changed",
    "loaded_icon",
    "primary_selection",
    "python_candidates",
    "set_coin_values",
    "translate",
    "user_data_folder",
]


def translate(text, context="RayMaps"):
    """The text in the user's language."""
    return FreeCAD.Qt.translate(context, text) if hasattr(FreeCAD, "Qt") else text


def user_data_folder():
    """Folder for what Ray Maps keeps for this user: its private environment, runs of unsaved documents."""
    return os.path.join(FreeCAD.getUserAppDataDir(), "RayMaps")


def flags_as_int(flags):
    """Flags of Qt as the number that FreeCAD asks for; Qt 6 has them as Python enumerations."""
    return int(getattr(flags, "value", flags))


def exec_dialog(dialog):
    """Run a modal dialog or event loop; Qt 6 calls this exec."""
    run = getattr(dialog, "exec_", None) or dialog.exec
    return run()


def python_candidates():
    """Python interpreters of the system that an environment can be built on, most suitable first.

    FreeCAD's sys.executable is FreeCAD itself. freecad.utils exists from 1.0 on.
    """
    found = []
    try:
        from freecad import utils

        found.append(utils.get_python_exe())
    except (ImportError, AttributeError):
        pass
    # The Python of an AppImage changes its path at every start: no environment may be built on it.
    if os.environ.get("APPIMAGE") or os.environ.get("APPDIR"):
        found = []
    names = ["python3.13", "python3.12", "python3.11", "python3.10", "python3", "python"]
    for folder in os.environ.get("PATH", os.defpath).split(os.pathsep):
        for name in names:
            found.append(os.path.join(folder, name + (".exe" if os.name == "nt" else "")))
    return [path for path in dict.fromkeys(found) if path and os.path.isfile(path) and os.access(path, os.X_OK)]


def loaded_icon(path):
    """Path of an icon for the tree, after FreeCAD has loaded it.

    Without Qt's SVG plugin the tree of 1.1 finds only those icons that FreeCAD has read with its own means.
    """
    import FreeCADGui

    if hasattr(FreeCADGui, "getIcon"):
        FreeCADGui.getIcon(path)
    return path


def icon_changed(view_object):
    """Make the tree ask the view provider for its icon again."""
    signal = getattr(view_object, "signalChangeIcon", None)
    if signal is not None:
        signal()


def primary_selection():
    """What is selected, as (top object, sub-object path) with full paths through parts and links."""
    import FreeCADGui

    picked = []
    for item in FreeCADGui.Selection.getSelectionEx("", 0):
        for sub in item.SubElementNames or ("",):
            picked.append((item.Object, sub))
    return picked


def set_coin_values(field, data, n_values):
    """Fill a multiple-value Coin field from bytes in one copy.

    Parameters
    ----------
    field : pivy field, such as SoVertexProperty.vertex
    data : bytes or memoryview, the values as Coin keeps them in memory
    n_values : int
    """
    field.setNum(n_values)
    if not n_values:
        return
    data = bytes(data)
    pointer = field.startEditing()
    # pivy wraps the pointer in an object with `this` (older) or is a number itself (newer).
    ctypes.memmove(int(getattr(pointer, "this", pointer)), data, len(data))
    field.finishEditing()
