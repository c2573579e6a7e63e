# SPDX-License-Identifier: LGPL-2.1-or-later
"""ViewResult: the matching rays as one set of lines; the icon tells whether they still belong to the document."""

from raymaps_wb.compat import icon_changed, loaded_icon
from raymaps_wb.gui.overlay import Overlay
from raymaps_wb.paths import icon
from raymaps_wb.viewproviders.base import DrawnViewProxy


class ViewResult(DrawnViewProxy):
    """Hiding the result in the tree hides the rays."""

    MODE = "Rays"

    def attach(self, view):
        super().attach(view)
        self.overlay: Overlay | None = None
        if "LineWidth" not in view.PropertiesList:
            view.addProperty("App::PropertyFloat", "LineWidth", "Ray Maps", "Width of the drawn rays, in pixels")
            view.LineWidth = 1.0

    def redraw(self, obj):
        """The rays come from the tracer, not from the object."""

    def getIcon(self):
        stale = getattr(getattr(self, "Object", None), "Stale", False)
        return loaded_icon(icon("result_stale" if stale else "result"))

    def updateData(self, obj, name):
        if name == "Stale" and getattr(obj, "ViewObject", None) is not None:
            icon_changed(obj.ViewObject)

    def onChanged(self, view, name):
        overlay = getattr(self, "overlay", None)
        if name == "LineWidth" and overlay is not None:
            overlay.set_line_width(view.LineWidth)

    def show_overlay(self, view, path, n_segments):
        """Draw the segments of an overlay file instead of what is drawn now."""
        if self.overlay is None:
            self.overlay = Overlay()
            self.root.addChild(self.overlay.node)
        self.overlay.set_line_width(view.LineWidth)
        self.overlay.load(path, n_segments)

    def clear_overlay(self):
        """Draw nothing."""
        if self.overlay is not None:
            self.overlay.clear()

    def panel(self, obj):
        return None

    def doubleClicked(self, view):
        from raymaps_wb.gui import dock

        dock.show(view.Object)
        return True
