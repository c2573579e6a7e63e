# SPDX-License-Identifier: LGPL-2.1-or-later
"""Opens an example in FreeCAD with the workbench active; `make freecad` starts it.

    freecad examples/open_example.py

RAYMAPS_EXAMPLE names another example than led_collimator. The document is a copy under out/examples, so that
whatever one tries there leaves the shipped one as it is.
"""

import os
import shutil
import sys

import FreeCAD
import FreeCADGui
from PySide import QtCore

FOLDER = os.path.dirname(os.path.abspath(__file__))


def copy_of(name):
    """Path of a copy of an example's document; one that is there already is kept with its results."""
    folder = os.path.join(os.path.dirname(FOLDER), "out", "examples")
    os.makedirs(folder, exist_ok=True)
    path = os.path.join(folder, name + ".FCStd")
    if not os.path.exists(path):
        shutil.copyfile(os.path.join(FOLDER, name + ".FCStd"), path)
    return path


def main():
    try:
        document = FreeCAD.openDocument(copy_of(os.environ.get("RAYMAPS_EXAMPLE", "led_collimator")))
        FreeCADGui.activateWorkbench("RayMapsWorkbench")
    except Exception as error:
        FreeCAD.Console.PrintError(f"Ray Maps: the example can't be opened: {error}\n")
        raise
    view = FreeCADGui.getDocument(document.Name).activeView()
    view.viewIsometric()
    view.fitAll()
    FreeCAD.Console.PrintMessage("Ray Maps: press Run in the panel on the right, then Apply a criterion.\n")


if "FreeCADGui" in sys.modules:
    QtCore.QTimer.singleShot(0, main)
