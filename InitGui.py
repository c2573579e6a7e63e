# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD reads this at every start with a window: it only registers the workbench."""

import FreeCADGui


class RayMapsWorkbench(FreeCADGui.Workbench):
    """Tag a CAD model with optical properties, simulate, and ask which rays did what."""

    def __init__(self):
        import os

        import raymaps_wb

        folder = os.path.dirname(os.path.dirname(os.path.realpath(raymaps_wb.__file__)))
        self.__class__.Icon = os.path.join(folder, "resources", "icons", "raymaps.svg")
        self.__class__.MenuText = "Ray Maps"
        self.__class__.ToolTip = "Trace light through the model, keep every ray, and ask about them"

    def Initialize(self):
        """FreeCAD calls this when the workbench is first activated."""
        from raymaps_wb.gui import workbench

        workbench.initialize(self)

    def Activated(self):
        """FreeCAD calls this each time the workbench is activated."""
        from raymaps_wb.gui import workbench

        workbench.activated()

    def GetClassName(self):
        return "Gui::PythonWorkbench"


FreeCADGui.addWorkbench(RayMapsWorkbench())
