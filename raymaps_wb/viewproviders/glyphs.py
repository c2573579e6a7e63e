# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small drawings in the 3D view: lines, arrows, circles, plates."""

import math

from pivy import coin


def style(rgb, width=2.0, transparency=0.0):
    """Colour and line width of what follows."""
    material = coin.SoMaterial()
    material.diffuseColor.setValue(*rgb)
    material.emissiveColor.setValue(*(0.6 * c for c in rgb))
    material.transparency.setValue(transparency)
    draw = coin.SoDrawStyle()
    draw.lineWidth.setValue(width)
    hints = coin.SoShapeHints()
    hints.vertexOrdering.setValue(coin.SoShapeHints.COUNTERCLOCKWISE)
    hints.shapeType.setValue(coin.SoShapeHints.UNKNOWN_SHAPE_TYPE)
    return [material, draw, hints]


def _coordinates(points):
    node = coin.SoCoordinate3()
    node.point.setValues(0, len(points), [tuple(p) for p in points])
    return node


def polylines(lines):
    """Lines through points."""
    node = coin.SoLineSet()
    node.numVertices.setValues(0, len(lines), [len(line) for line in lines])
    return [_coordinates([p for line in lines for p in line]), node]


def polygon(points):
    """A filled polygon."""
    node = coin.SoFaceSet()
    node.numVertices.setValue(len(points))
    return [_coordinates(points), node]


def circle(radius, z=0.0, n=48):
    """Points of a closed circle about the z axis."""
    return [(radius * math.cos(2 * math.pi * i / n), radius * math.sin(2 * math.pi * i / n), z) for i in range(n + 1)]


def arrow(start, end):
    """Lines of an arrow between two points, with a head of four strokes."""
    axis = [e - s for s, e in zip(start, end, strict=True)]
    length = math.sqrt(sum(a * a for a in axis)) or 1.0
    axis = [a / length for a in axis]
    helper = (1, 0, 0) if abs(axis[0]) < 0.8 else (0, 1, 0)
    side = _unit(_cross(axis, helper))
    other = _cross(axis, side)
    lines = [[tuple(start), tuple(end)]]
    for across in (side, other):
        for sign in (1, -1):
            head = [e - 0.28 * length * a + sign * 0.12 * length * c for e, a, c in zip(end, axis, across, strict=True)]
            lines.append([tuple(end), tuple(head)])
    return lines


def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _unit(a):
    length = math.sqrt(sum(x * x for x in a)) or 1.0
    return tuple(x / length for x in a)
