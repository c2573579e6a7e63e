# SPDX-License-Identifier: LGPL-2.1-or-later
"""ViewSource: a source as arrows in its colour."""

import math

import Part

from raymaps_wb.errors import WorkbenchError
from raymaps_wb.viewproviders import glyphs
from raymaps_wb.viewproviders.base import DrawnViewProxy


class ViewSource(DrawnViewProxy):
    """Drawn in the source's own coordinates; emitting faces get an arrow each."""

    ICON = "source"
    REDRAWN_BY = ("Kind", "RGB", "HalfAngle", "Radius", "References")

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
        lines = LINES[obj.Kind](obj, size)
        if not lines:
            return []
        largest = max(obj.RGB, default=0) or 1.0
        rgb = [0.15 + 0.85 * min(1.0, max(0.0, c / largest)) for c in obj.RGB] if len(obj.RGB) == 3 else (1, 1, 1)
        return [*glyphs.style(rgb, 2.5), *glyphs.polylines(lines)]

    def panel(self, obj):
        from raymaps_wb.taskpanels.source import SourcePanel

        return SourcePanel(obj)


def _point(obj, size):
    s = size / math.sqrt(3)
    ends = [(size, 0, 0), (0, size, 0), (0, 0, size)] + [(s, s, s), (s, s, -s), (s, -s, s), (-s, s, s)]
    return [[tuple(-0.5 * c for c in end), tuple(0.5 * c for c in end)] for end in ends]


def _cone(obj, size):
    angle = math.radians(min(float(obj.HalfAngle), 175.0))
    r, z = size * math.sin(angle), size * math.cos(angle)
    rim = glyphs.circle(r, z)
    return [rim] + [[(0, 0, 0), rim[i]] for i in (0, 12, 24, 36)] + glyphs.arrow((0, 0, 0), (0, 0, size))


def _disc(obj, size):
    radius = float(obj.Radius)
    lines = [glyphs.circle(radius)] + glyphs.arrow((0, 0, 0), (0, 0, size))
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        lines += glyphs.arrow((0.7 * radius * x, 0.7 * radius * y, 0), (0.7 * radius * x, 0.7 * radius * y, 0.7 * size))
    return lines


def _faces(obj, size):
    """An arrow from the middle of each emitting face, in global coordinates: such a source has no placement."""
    from raymaps_wb.export.bodies import resolve_all, shape_of

    lines = []
    try:
        for place, name in resolve_all(obj):
            shape = shape_of(place)
            for face in shape.Faces if name is None else [shape.Faces[int(name[4:]) - 1]]:
                start = face.CenterOfMass
                u, v = face.Surface.parameter(start)
                length = min(size, 2 * math.sqrt(face.Area))
                lines += glyphs.arrow(start, start + face.normalAt(u, v) * length)
    except (WorkbenchError, Part.OCCError, RuntimeError):
        return []  # the check command says in words what is wrong with the references
    return lines


LINES = {"Point": _point, "Cone": _cone, "Disc": _disc, "Faces": _faces}
