# SPDX-License-Identifier: LGPL-2.1-or-later
"""What our view providers have in common."""

from raymaps_wb.compat import loaded_icon
from raymaps_wb.paths import icon


class ViewProxy:
    """Base of the Python side of our view providers: an icon in the tree, and a task panel on double click."""

    ICON = "raymaps"

    def __init__(self, view):
        view.Proxy = self

    def attach(self, view):
        """FreeCAD calls this when the object is made and when a document is opened."""
        self.Object = view.Object

    def getIcon(self):
        return loaded_icon(icon(self.ICON))

    def isShow(self):
        """Whether the tree shows the object as visible; what is never drawn is never hidden."""
        return True

    def panel(self, obj):
        """Task panel that edits the object; None if it has none."""

    def edit_new(self, obj):
        """Open the task panel of an object that was just made within a step of undo that is still open."""
        import FreeCADGui

        self._is_new = True
        try:
            FreeCADGui.getDocument(obj.Document.Name).setEdit(obj.Name, 0)
        finally:
            self._is_new = False

    def setEdit(self, view, mode=0):
        import FreeCADGui

        if mode != 0:  # FreeCAD's own modes: transform, cut, colour
            return None
        panel = self.panel(view.Object)
        if panel is None:
            return False
        panel.begin(getattr(self, "_is_new", False))
        FreeCADGui.Control.showDialog(panel)
        return True

    def unsetEdit(self, view, mode=0):
        import FreeCADGui

        if mode != 0:
            return None
        FreeCADGui.Control.closeDialog()
        return True

    def doubleClicked(self, view):
        import FreeCADGui

        document = FreeCADGui.getDocument(view.Object.Document.Name)
        if FreeCADGui.Control.activeDialog():
            FreeCADGui.Control.closeDialog()
        document.setEdit(view.Object.Name, 0)
        return True

    def dumps(self):
        return None

    def loads(self, state):
        return None

    # FreeCAD 0.20 asks for the older names.
    def __getstate__(self):
        return None

    def __setstate__(self, state):
        return None


class DrawnViewProxy(ViewProxy):
    """Base of view providers that draw something in the 3D view with Coin nodes."""

    MODE = "Shaded"
    REDRAWN_BY: tuple[str, ...] = ()

    def attach(self, view):
        from pivy import coin

        super().attach(view)
        self.root = coin.SoGroup()
        view.addDisplayMode(self.root, self.MODE)
        self.redraw(view.Object)

    def isShow(self):
        return self.Object.ViewObject.Visibility

    def getDisplayModes(self, view):
        return [self.MODE]

    def getDefaultDisplayMode(self):
        return self.MODE

    def setDisplayMode(self, mode):
        return mode

    def updateData(self, obj, name):
        if name in self.REDRAWN_BY and getattr(self, "root", None) is not None:
            self.redraw(obj)

    def redraw(self, obj):
        """Fill self.root anew."""
        self.root.removeAllChildren()
        if all(name in obj.PropertiesList for name in self.REDRAWN_BY):
            for node in self.nodes(obj):
                self.root.addChild(node)

    def nodes(self, obj):
        """Coin nodes that show the object, in its own coordinates."""
        return []
