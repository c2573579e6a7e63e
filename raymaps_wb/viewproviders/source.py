# SPDX-License-Identifier: LGPL-2.1-or-later
"""ViewSource: a source as arrows in its colour."""

from raymaps_wb.viewproviders import glyphs
from raymaps_wb.viewproviders.base import DrawnViewProxy
from raymaps_wb.viewproviders.source_glyphs import colour_of, lines_of


class ViewSource(DrawnViewProxy):
    """Drawn in the source's own coordinates; emitting faces get an arrow each."""

    ICON = "source"
    REDRAWN_BY = (
        *("Kind", "References", "HalfAngle", "Radius", "WaistRadius", "Divergence"),
        *("Spectrum", "RGB", "LinesNm", "TemperatureK"),
    )

    def __init__(self, view):
        super().__init__(view)
        self._ensure_size(view)

    def attach(self, view):
        self._ensure_size(view)
        super().attach(view)

    @staticmethod
    def _ensure_size(view):
        if "GlyphSize" not in view.PropertiesList:
            view.addProperty("App::PropertyLength", "GlyphSize", "Ray Maps", "Size of the arrows in the 3D view, in mm")
            view.GlyphSize = 6.0

    def onChanged(self, view, name):
        if name == "GlyphSize" and getattr(self, "root", None) is not None:
            self.redraw(view.Object)

    def nodes(self, obj):
        size = float(obj.ViewObject.GlyphSize)
        lines = lines_of(obj, size)
        return [*glyphs.style(colour_of(obj), 2.5), *glyphs.polylines(lines)] if lines else []

    def panel(self, obj):
        from raymaps_wb.taskpanels.source import SourcePanel

        return SourcePanel(obj)
