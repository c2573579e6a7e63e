# SPDX-License-Identifier: LGPL-2.1-or-later
"""What both example scripts use: parts, colours, views, and writing the document with its scene."""

import os

import FreeCAD
import Part

from raymaps_wb.export.writer import export_study

FOLDER = os.path.dirname(os.path.abspath(__file__))


def vector(x, y, z):
    return FreeCAD.Vector(x, y, z)


def placed(x=0.0, y=0.0, z=0.0, axis=(1, 0, 0), angle_deg=0.0):
    """A placement: turn about an axis, then move."""
    return FreeCAD.Placement(vector(x, y, z), FreeCAD.Rotation(vector(*axis), angle_deg))


def box(document, label, size, corner, parent=None):
    """A Part box by its size and lowest corner."""
    obj = document.addObject("Part::Box", label)
    obj.Length, obj.Width, obj.Height = size
    obj.Placement.Base = vector(*corner)
    if parent is not None:
        parent.addObject(obj)
    return obj


def body_of_revolution(document, label, edges, parent=None):
    """A solid from a closed profile in the xz plane, turned about the z axis."""
    face = Part.Face(Part.Wire(edges))
    obj = document.addObject("Part::Feature", label)
    obj.Shape = face.revolve(vector(0, 0, 0), vector(0, 0, 1), 360).Solids[0]
    if parent is not None:
        parent.addObject(obj)
    return obj


def polygon_edges(points):
    """Edges through (r, z) points in the xz plane, not closed."""
    corners = [vector(r, 0, z) for r, z in points]
    return [Part.LineSegment(a, b).toShape() for a, b in zip(corners, corners[1:], strict=False)]


def look(obj, rgb, transparency=0):
    """Colour and transparency, where there is a window."""
    if FreeCAD.GuiUp:
        obj.ViewObject.ShapeColor = rgb
        obj.ViewObject.Transparency = transparency


def write(document, study, stem):
    """Recompute, save the document and export its scene beside it."""
    document.recompute()
    if FreeCAD.GuiUp:
        import FreeCADGui

        view = FreeCADGui.getDocument(document.Name).activeView()
        view.setAnimationEnabled(False)
        view.viewIsometric()
        view.fitAll()
    document.saveAs(os.path.join(FOLDER, stem + ".FCStd"))
    exported = export_study(study, FOLDER, stem)
    print(f"{stem}: {exported.triangles} triangles, {exported.path}")
