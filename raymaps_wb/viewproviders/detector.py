# SPDX-License-Identifier: LGPL-2.1-or-later
"""ViewDetector: a rectangle as a plate with an arrow along its normal; other detectors have nothing to draw."""

from raymaps_wb.viewproviders import glyphs
from raymaps_wb.viewproviders.base import DrawnViewProxy

COLOUR = (0.10, 0.65, 0.60)


class ViewDetector(DrawnViewProxy):
    """Drawn in the detector's own coordinates; FreeCAD applies the placement."""

    ICON = "detector"
    REDRAWN_BY = ("Kind", "Width", "Height", "Side")

    def nodes(self, obj):
        if obj.Kind != "Rectangle":  # faces are there to see, and the far field is everywhere
            return []
        w, h = float(obj.Width) / 2, float(obj.Height) / 2
        corners = [(-w, -h, 0), (w, -h, 0), (w, h, 0), (-w, h, 0)]
        length = 0.3 * min(w, h) or 1.0
        lines = [[*corners, corners[0]]]
        if obj.Side in ("Front", "Both"):
            lines += glyphs.arrow((0, 0, 0), (0, 0, length))
        if obj.Side in ("Back", "Both"):
            lines += glyphs.arrow((0, 0, 0), (0, 0, -length))
        # A tick shows the end of the local x axis.
        lines.append([(w, 0, 0), (w - 0.12 * w, 0, 0)])
        return [
            *glyphs.style(COLOUR, 1.0, 0.82),
            *glyphs.polygon(corners),
            *glyphs.style(COLOUR, 2.0),
            *glyphs.polylines(lines),
        ]

    def panel(self, obj):
        from raymaps_wb.taskpanels.detector import DetectorPanel

        return DetectorPanel(obj)
