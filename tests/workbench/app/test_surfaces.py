# SPDX-License-Identifier: LGPL-2.1-or-later
"""The exact surface of each face is the one that its triangles stand on, in global coordinates."""

import math

import FreeCAD
import Part
from support import DocumentTest

V = FreeCAD.Vector


def distance_mm(surface, point):
    """Distance of a point to an exact surface, from its written parameters alone."""
    kind = surface["type"]
    if kind == "plane":
        return abs((point - V(*surface["point_mm"])).dot(V(*surface["normal"])))
    if kind == "sphere":
        return abs((point - V(*surface["center_mm"])).Length - surface["radius_mm"])
    if kind == "bspline":
        return point.distanceToPoint(spline(surface).value(*spline(surface).parameter(point)))
    origin = V(*surface[{"cylinder": "point_mm", "cone": "apex_mm", "torus": "center_mm"}[kind]])
    axis = V(*surface["axis"])
    along = (point - origin).dot(axis)
    across = (point - origin - axis * along).Length
    if kind == "cylinder":
        return abs(across - surface["radius_mm"])
    if kind == "cone":
        angle = math.radians(surface["half_angle_deg"])
        return abs(across * math.cos(angle) - along * math.sin(angle))
    return abs(math.hypot(across - surface["major_radius_mm"], along) - surface["minor_radius_mm"])


def spline(surface):
    made = Part.BSplineSurface()
    weights = surface["weights"] or [[1.0] * len(row) for row in surface["poles_mm"]]
    made.buildFromPolesMultsKnots(
        [[V(*pole) for pole in row] for row in surface["poles_mm"]],
        *surface["multiplicities"],
        *surface["knots"],
        *surface["periodic"],
        *surface["degrees"],
        weights,
    )
    return made


def own_normal(surface, point):
    """The surface's own normal at a point, as documented."""
    kind = surface["type"]
    if kind == "plane":
        return V(*surface["normal"])
    if kind == "sphere":
        return point - V(*surface["center_mm"])
    if kind == "bspline":
        made = spline(surface)
        return made.normal(*made.parameter(point))
    origin = V(*surface[{"cylinder": "point_mm", "cone": "apex_mm", "torus": "center_mm"}[kind]])
    axis = V(*surface["axis"])
    radial = point - origin - axis * (point - origin).dot(axis)
    return radial if kind != "torus" else point - origin - radial * (surface["major_radius_mm"] / radial.Length)


class SurfacesTest(DocumentTest):
    def check(self, shape, expected):
        for name in [old.Name for old in self.document.Objects]:
            if self.document.getObject(name) is not None:
                self.document.removeObject(name)
        obj = self.document.addObject("Part::Feature", "Shape")
        obj.Shape = shape
        part = self.document.addObject("App::Part", "Part")
        part.addObject(obj)
        obj.Placement = self.placement(10, 20, 30, (1, 0, 1), 40)
        part.Placement = self.placement(-50, 0, 3, (0, 1, 1), 110)
        scene, meshes = self.export(self.study((obj, "")))
        (vertices, triangles), start, kinds = meshes["Shape"], 0, set()
        for face in scene["bodies"]["Shape"]["geometry"]["faces"]:
            surface = face["surface"]
            kinds.add(surface["type"])
            mine = triangles[start : start + face["triangles"]]
            start += face["triangles"]
            # Every vertex of the face's triangles stands on the exact surface.
            for i in {i for triangle in mine for i in triangle}:
                self.assertLess(distance_mm(surface, V(*vertices[i])), 1e-6, f"{face['name']} {surface['type']}")
            # The triangles turn the way that "reversed" says.
            for triangle in mine[:: max(1, len(mine) // 7)]:
                a, b, c = (V(*vertices[i]) for i in triangle)
                normal = (b - a).cross(c - a)
                side = normal.dot(own_normal(surface, a + (b - a) / 3 + (c - a) / 3))
                self.assertEqual(side < 0, surface["reversed"], f"{face['name']} {surface['type']}")
        self.assertEqual(start, len(triangles))
        self.assertEqual(kinds, expected)

    def test_plane(self):
        self.check(Part.makeBox(1, 2, 3), {"plane"})

    def test_cylinder_outside_and_inside(self):
        self.check(Part.makeCylinder(5, 10).cut(Part.makeCylinder(3, 10)), {"plane", "cylinder"})

    def test_cone_both_ways(self):
        self.check(Part.makeCone(5, 2, 7), {"plane", "cone"})
        self.check(Part.makeBox(20, 20, 6, V(-10, -10, 0)).cut(Part.makeCone(2, 5, 7)), {"plane", "cone"})

    def test_sphere_outside_and_inside(self):
        self.check(Part.makeSphere(4), {"sphere"})
        self.check(Part.makeBox(20, 20, 20, V(-10, -10, -10)).cut(Part.makeSphere(4)), {"plane", "sphere"})

    def test_torus(self):
        self.check(Part.makeTorus(10, 2), {"torus"})

    def test_revolved_spline_is_a_rational_bspline(self):
        curve = Part.BSplineCurve()
        curve.interpolate([V(2, 0, 0), V(3, 0, 2), V(5, 0, 3), V(6, 0, 6)])
        edges = [curve.toShape()]
        edges += [Part.LineSegment(a, b).toShape() for a, b in ((V(6, 0, 6), V(0, 0, 6)), (V(0, 0, 6), V(0, 0, 0)))]
        edges.append(Part.LineSegment(V(0, 0, 0), V(2, 0, 0)).toShape())
        solid = Part.Face(Part.Wire(edges)).revolve(V(0, 0, 0), V(0, 0, 1), 360).Solids[0]
        self.check(solid, {"plane", "bspline"})

    def test_extruded_spline(self):
        curve = Part.BSplineCurve()
        curve.interpolate([V(0, 0, 0), V(4, 3, 0), V(9, 0, 0)])
        edges = [curve.toShape(), Part.LineSegment(V(9, 0, 0), V(0, 0, 0)).toShape()]
        self.check(Part.Face(Part.Wire(edges)).extrude(V(0, 0, 5)), {"plane", "bspline"})

    def test_scaled_link(self):
        ball = self.document.addObject("Part::Cylinder", "Ball")
        link = self.document.addObject("App::Link", "Link")
        link.LinkedObject, link.Scale, link.Placement = ball, 2.0, self.placement(0, 0, 7)
        scene, meshes = self.export(self.study((link, "")))
        vertices, triangles = meshes["Link"]
        start = 0
        for face in scene["bodies"]["Link"]["geometry"]["faces"]:
            for triangle in triangles[start : start + face["triangles"]]:
                for i in triangle:
                    self.assertLess(distance_mm(face["surface"], V(*vertices[i])), 1e-6)
            start += face["triangles"]
