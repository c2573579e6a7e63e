# SPDX-License-Identifier: LGPL-2.1-or-later
"""The exact surface of each face is that of FreeCAD: the same places and outward normals, wherever it stands."""

import math
import os

import exact
import FreeCAD
import Part
from support import DocumentTest

from raymaps_wb.export import surfaces
from raymaps_wb.export.bodies import resolve, shape_of
from raymaps_wb.export.surfaces import exact_surface
from raymaps_wb.objects.medium import make_medium
from raymaps_wb.objects.references import set_references

V = FreeCAD.Vector
SAME = 1e-9  # of the size


def spline_curve():
    curve = Part.BSplineCurve()
    curve.interpolate([V(2, 0, 0), V(3, 0, 2), V(5, 0, 3), V(6, 0, 6)])
    return curve


def profile(curve):
    """A face between a curve from (2, 0, 0) to (6, 0, 6) and the z axis."""
    corners = (V(6, 0, 6), V(0, 0, 6), V(0, 0, 0), V(2, 0, 0))
    lines = [Part.LineSegment(a, b).toShape() for a, b in zip(corners, corners[1:], strict=False)]
    return Part.Face(Part.Wire([curve.toShape(), *lines]))


def wavy_bspline():
    made = Part.BSplineSurface()
    made.interpolate([[V(i, j, math.sin(0.7 * i) * math.cos(0.5 * j)) for j in range(6)] for i in range(5)])
    return made


def rational_bezier():
    made = Part.BezierSurface()
    made.increase(3, 2)
    for i in range(4):
        for j in range(3):
            made.setPole(i + 1, j + 1, V(2 * i, 3 * j, math.sin(i * j)))
    made.setWeight(2, 2, 2.0)
    return made


def revolved(curve, *others):
    """The solid that a curve and lines along some points behind it enclose around the z axis."""
    edge = curve.toShape()
    corners = [edge.valueAt(edge.LastParameter), *others, edge.valueAt(edge.FirstParameter)]
    lines = [Part.LineSegment(a, b).toShape() for a, b in zip(corners, corners[1:], strict=False)]
    return Part.Face(Part.Wire([edge, *lines])).revolve(V(0, 0, 0), V(0, 0, 1), 360)


def ellipse(share):
    """An arc of an ellipse from (6, 0, 0), at most to (0, 0, 4)."""
    whole = Part.Ellipse(V(0, 0, 0), 6, 4)
    whole.rotate(FreeCAD.Placement(V(0, 0, 0), V(1, 0, 0), 90))
    return Part.ArcOfEllipse(whole, 0, share * math.pi / 2)


def meridian():
    """A spline from the axis outwards, as of an aspheric lens."""
    curve = Part.BSplineCurve()
    curve.interpolate(
        [V(0, 0, 3), V(2, 0, 2.8), V(4, 0, 2.1), V(6, 0, 0.5)], InitialTangent=V(1, 0, 0), FinalTangent=V(1, 0, -1.1)
    )
    return curve


def block():
    return Part.makeBox(20, 20, 20, V(-10, -10, -10))


#: Name: the solid, and the types of its surfaces.
SOLIDS = {
    "box": (lambda: Part.makeBox(1, 2, 3), {"plane"}),
    "tube": (lambda: Part.makeCylinder(5, 10).cut(Part.makeCylinder(3, 10)), {"plane", "cylinder"}),
    "cone": (lambda: Part.makeCone(5, 2, 7), {"plane", "cone"}),
    "pointed cone": (lambda: Part.makeCone(0, 3, 7), {"plane", "cone"}),
    "slow cone": (lambda: Part.makeCone(5, 4.99, 7), {"plane", "cone"}),
    "steep cone": (lambda: Part.makeCone(50, 2, 7), {"plane", "cone"}),
    "conical hole": (lambda: block().cut(Part.makeCone(2, 5, 30, V(0, 0, -15))), {"plane", "cone"}),
    "ball": (lambda: Part.makeSphere(4), {"sphere"}),
    "part of a ball": (lambda: Part.makeSphere(4, V(0, 0, 0), V(0, 0, 1), -20, 50, 130), {"plane", "sphere"}),
    "hollow": (lambda: block().cut(Part.makeSphere(4)), {"plane", "sphere"}),
    "ring": (lambda: Part.makeTorus(10, 2), {"torus"}),
    "groove": (lambda: block().cut(Part.makeTorus(9, 2)), {"plane", "torus"}),
    "vase": (lambda: profile(spline_curve()).revolve(V(0, 0, 0), V(0, 0, 1), 360), {"plane", "bspline"}),
    "half a vase": (lambda: profile(spline_curve()).revolve(V(0, 0, 0), V(0, 0, 1), 180), {"plane", "bspline"}),
    "ellipsoid": (lambda: revolved(ellipse(1.0), V(0, 0, 0)), {"plane", "bspline"}),
    "part of an ellipsoid": (lambda: revolved(ellipse(0.9), V(0, 0, 2), V(0, 0, 0)), {"plane", "cone", "bspline"}),
    "asphere": (lambda: revolved(meridian(), V(6, 0, -1), V(0, 0, -1)), {"plane", "cylinder", "bspline"}),
    "extruded": (lambda: profile(spline_curve()).extrude(V(0, 5, 0)), {"plane", "bspline"}),
    "B-spline": (lambda: wavy_bspline().toShape().Faces[0].extrude(V(0, 0, 9)), {"plane", "bspline"}),
    "Bezier": (lambda: rational_bezier().toShape().Faces[0].extrude(V(0, 0, 9)), {"plane", "bspline"}),
}


class SurfacesTest(DocumentTest):
    def feature(self, name):
        obj = self.document.addObject("Part::Feature", "Shape")
        obj.Shape = SOLIDS[name][0]().Solids[0]
        return obj

    def shape(self, obj):
        """Shape in global coordinates, as it is exported."""
        self.document.recompute()
        ((place, _),) = resolve(obj, "")
        return shape_of(place)

    def check(self, shape, name, expected):
        """Places of all faces stand on their exact surfaces, whose normals lead out of the solid."""
        self.assertGreater(shape.Volume, 0)
        size, solid, kinds = shape.BoundBox.DiagonalLength, shape.Solids[0], set()
        for number, face in enumerate(shape.Faces, 1):
            data, n_inside = exact_surface(face), 0
            kinds.add(data["type"])
            self.assertNotEqual(data["type"], "other", f"{name} Face{number} {data}")
            for u, v in places(face):
                point = face.valueAt(u, v)
                distance, outward = exact.distance_and_outward(data, point)
                self.assertLess(distance, SAME * size, f"{name} Face{number} {data['type']}")
                if face.isPartOfDomain(u, v):
                    n_inside += 1
                    step, tolerance = V(*outward) * (1e-4 * size), 1e-6 * size
                    sides = [solid.isInside(point + step * side, tolerance, False) for side in (-1, 1)]
                    self.assertEqual(sides, [True, False], f"{name} Face{number} {data['type']}")
            self.assertGreater(n_inside, 0, f"{name} Face{number}")
        if expected is not None:
            self.assertEqual(kinds, expected, name)

    def test_placed_and_rotated(self):
        for name, (_, expected) in SOLIDS.items():
            obj = self.feature(name)
            part = self.document.addObject("App::Part", "Part")
            part.addObject(obj)
            obj.Placement = self.placement(10, 20, 30, (1, 0, 1), 40)
            part.Placement = self.placement(-50, 0, 3, (0, 1, 1), 110)
            self.check(self.shape(obj), name, expected)

    def test_mirrored(self):
        for name, (_, expected) in SOLIDS.items():
            mirror = self.document.addObject("Part::Mirroring", "Mirror")
            mirror.Source, mirror.Normal, mirror.Base = self.feature(name), V(1, 2, 0), V(3, 0, 0)
            self.check(self.shape(mirror), name, expected)

    def test_scaled_links(self):
        for name, (_, expected) in SOLIDS.items():
            link = self.document.addObject("App::Link", "Link")
            link.LinkedObject, link.Placement = self.feature(name), self.placement(0, 5, 7, (1, 1, 0), 30)
            link.Scale = 2.5
            self.check(self.shape(link), name, expected)
        for name in ("tube", "part of a ball", "pointed cone", "vase", "Bezier"):
            for scale in (V(1, 2, 3), V(-1, 1, 1)):
                link = self.document.addObject("App::Link", "Link")
                link.LinkedObject, link.ScaleVector = self.feature(name), scale
                self.check(self.shape(link), name, None)

    def test_scaled_clones(self):
        import Draft

        for name in ("ball", "cone", "vase"):
            clone = Draft.make_clone(self.feature(name))
            clone.Scale = V(1, 2, 0.5)
            self.check(self.shape(clone), name, None)

    def test_triangles_turn_as_the_surface_says(self):
        """Also in a solid whose faces all look inwards, which is turned round."""
        for name, is_turned in (("tube", False), ("vase", False), ("box", True), ("cone", True), ("vase", True)):
            obj = self.document.addObject("Part::Feature", "Shape")
            shape = SOLIDS[name][0]().Solids[0]
            if is_turned:
                shape.reverse()
            self.assertEqual(shape.Volume < 0, is_turned)
            obj.Shape = shape
            study = self.study((obj, ""))
            scene, meshes = self.export(study)
            ((body, (vertices, triangles)),) = meshes.items()
            start = 0
            for face in scene["bodies"][body]["geometry"]["faces"]:
                mine = triangles[start : start + face["triangles"]]
                start += face["triangles"]
                for i in {i for triangle in mine for i in triangle}:
                    self.assertLess(exact.distance_and_outward(face["surface"], vertices[i])[0], 1e-6)
                for triangle in mine[:: max(1, len(mine) // 7)]:
                    a, b, c = (V(*vertices[i]) for i in triangle)
                    middle = (a + b + c) / 3
                    _, outward = exact.distance_and_outward(face["surface"], middle)
                    self.assertGreater((b - a).cross(c - a).dot(V(*outward)), 0, f"{name} {face['name']}")
            self.assertEqual(start, len(triangles))
            for old in (study, obj):
                self.document.removeObject(old.Name)

    def test_offsets(self):
        cone = Part.Cone()
        cone.Radius, cone.SemiAngle = 3.0, -0.4
        torus = Part.Toroid()
        torus.MajorRadius, torus.MinorRadius = 10.0, 2.0
        ball = Part.Sphere()
        ball.Radius, ball.Center = 4.0, V(1, 2, 3)
        for basis, kind, span in (
            (Part.Plane(), "plane", (-1, 2, -3, 4)),
            (Part.Cylinder(), "cylinder", (0.1, 3, -3, 4)),
            (cone, "cone", (0.2, 3, -2, 3)),
            (cone, "cone", (0.2, 3, 12, 15)),  # beyond the apex
            (ball, "sphere", (0, 3, -1, 1)),
            (torus, "torus", (0, 3, -1, 1)),
        ):
            for offset in (0.5, -0.5):
                face = Part.OffsetSurface(basis, offset).toShape(*span).Faces[0]
                self.assertEqual(type(face.Surface).__name__, "OffsetSurface")
                self.check_face(face, kind)
                face.reverse()
                face.Placement = self.placement(1, 2, 3, (1, 1, 0), 50)
                self.check_face(face, kind)

    def check_face(self, face, kind):
        data = exact_surface(face)
        self.assertEqual(data["type"], kind, data)
        for u, v in places(face):
            distance, outward = exact.distance_and_outward(data, face.valueAt(u, v))
            self.assertLess(distance, SAME * face.BoundBox.DiagonalLength, kind)
            self.assertGreater(V(*outward).dot(face.normalAt(u, v)), 0.999, kind)

    def test_what_has_no_exact_form_is_named(self):
        surface = profile(spline_curve()).revolve(V(0, 0, 0), V(0, 0, 1), 360).Faces[0]
        offset = surface.makeOffsetShape(0.5, 1e-3).Faces[0]
        self.assertEqual(type(offset.Surface).__name__, "OffsetSurface")
        data = exact_surface(offset)
        self.assertEqual((data["type"], data["name"]), ("other", "OffsetSurface"))
        self.assertIn("no exact form", data["reason"])
        limit, surfaces.MAX_POLES = surfaces.MAX_POLES, 20
        self.addCleanup(setattr, surfaces, "MAX_POLES", limit)
        for shape in (surface, wavy_bspline().toShape().Faces[0]):
            data = exact_surface(shape)
            self.assertEqual(data["type"], "other")
            self.assertIn("poles, more than 20", data["reason"])

    def test_a_conversion_that_is_not_exact_is_found(self):
        face = profile(spline_curve()).revolve(V(0, 0, 0), V(0, 0, 1), 360).Faces[0]

        class Approximate:
            """A face whose B-spline is a little off."""

            def toNurbs(self):
                nurbs = face.toNurbs()
                moved = nurbs.Faces[0].Surface
                moved.setPole(4, 2, moved.getPole(4, 2) + V(0, 0, 1e-5))
                return moved.toShape()

            def __getattr__(self, name):
                return getattr(face, name)

        self.assertEqual(exact_surface(face)["type"], "bspline")
        data = exact_surface(Approximate())
        self.assertEqual(data["type"], "other", data)
        self.assertRegex(data["reason"], r"nearest is \de-0\d mm off")

    def test_a_torus_that_meets_its_axis(self):
        shape = Part.makeTorus(5, 7)
        face, data = shape.Faces[0], exact_surface(shape.Faces[0])
        self.assertEqual(data["type"], "bspline")
        for u, v in places(face):
            self.assertLess(exact.distance_and_outward(data, face.valueAt(u, v))[0], SAME * 24)

    def test_step_gives_the_same(self):
        for name in SOLIDS:
            if name == "ellipsoid":  # Open CASCADE loses a face that reaches the end of an ellipse's axis
                continue
            obj = self.feature(name)
            obj.Placement = self.placement(1, 2, 3, (1, 2, 3), 40)
            shape = self.shape(obj)
            path = os.path.join(self.folder, "shape.step")
            shape.exportStep(path)
            read = Part.read(path)
            self.assertEqual(len(read.Faces), len(shape.Faces))
            size = shape.BoundBox.DiagonalLength
            for face in shape.Faces:
                same = min(read.Faces, key=lambda other: difference(face, other))
                data, again = exact_surface(face), exact_surface(same)
                self.assertEqual(data["type"], again["type"], name)
                if data["type"] == "bspline":  # its parameters may run another way
                    for u, v in places(same):
                        point = same.valueAt(u, v)
                        (distance, outward), (other, wanted) = (
                            exact.distance_and_outward(one, point) for one in (data, again)
                        )
                        self.assertLess(max(distance, other), SAME * size, name)
                        self.assertGreater(exact.dot(outward, wanted), 1 - 1e-9)
                else:
                    self.assert_same(data, again, size, name)

    def assert_same(self, data, again, size, name):
        """Equal parameters; where these are not unique, equal surfaces."""
        self.assertEqual(set(data), set(again))
        for key in set(data) - {"type", "reversed", "point_mm", "axis", "normal"}:
            pair = [value if isinstance(value, list) else [value] for value in (data[key], again[key])]
            self.assertLess(math.dist(*pair), SAME * max(size, *map(abs, pair[0])), f"{name} {key}")
        direction = "normal" if data["type"] == "plane" else "axis"
        turn = 1.0
        if direction in data:
            turn = math.copysign(1.0, exact.dot(data[direction], again[direction]))
            self.assertLess(math.dist(data[direction], [turn * x for x in again[direction]]), SAME, name)
        if data["type"] == "cone":
            self.assertEqual(turn, 1.0)
        is_other_way = data["type"] == "plane" and turn < 0
        self.assertEqual(data["reversed"] != again["reversed"], is_other_way, name)
        if "point_mm" in data:
            off = exact.minus(again["point_mm"], data["point_mm"])
            along = exact.dot(off, data[direction])
            off = [along] if data["type"] == "plane" else exact.plus(off, data[direction], -along)
            self.assertLess(math.hypot(*off), SAME * size, name)


class CementedTest(DocumentTest):
    """Bodies that touch in a face have the same surface there, however they were made and triangulated."""

    def check(self, first, second, centre, radius):
        study = self.study((first, ""))
        flint = make_medium(self.document, study, "flint", preset="SF11")
        set_references(flint, [(second, "")])
        self.document.recompute()
        scene, meshes = self.export(study)
        cemented = []
        for name in (first.Label, second.Label):
            found = [face["surface"] for face in scene["bodies"][name]["geometry"]["faces"]]
            cemented += [data for data in found if data["type"] == "sphere" and same_sphere(data, centre, radius)]
        self.assertEqual(len(cemented), 2, scene["bodies"])
        one, other = cemented
        self.assertLess(math.dist(one["center_mm"], other["center_mm"]), SAME * radius)
        self.assertLess(abs(one["radius_mm"] - other["radius_mm"]), SAME * radius)
        self.assertNotEqual(one["reversed"], other["reversed"])
        (a, _), (b, _) = meshes[first.Label], meshes[second.Label]
        return {tuple(round(x, 6) for x in vertex) for vertex in a}, {
            tuple(round(x, 6) for x in vertex) for vertex in b
        }

    def feature(self, label, shape):
        obj = self.document.addObject("Part::Feature", label)
        obj.Shape, obj.Placement = shape, self.placement(10, -20, 5, (1, 1, 0), 33)
        return obj

    def test_a_doublet_of_booleans(self):
        """Both of cylinders with spheres of r = 50 mm; the flint is wider, so its triangles are others."""
        ball = Part.makeSphere(50, V(0, 0, -40))
        crown = Part.makeCylinder(10, 20).common(ball)
        flint = Part.makeCylinder(12, 14).cut(ball)
        first, second = self.feature("Crown", crown), self.feature("Flint", flint)
        centre = first.Placement.multVec(V(0, 0, -40))
        a, b = self.check(first, second, centre, 50)
        self.assertNotEqual(a & b, a)

    def test_a_doublet_of_revolutions(self):
        """Two Part revolutions of sketch-like faces whose arcs were given by three points each."""

        def at(x):  # of the sphere around (0, 0, -40)
            return V(x, 0, math.sqrt(2500 - x * x) - 40)

        def revolved(label, arc, corners):
            lines = [Part.LineSegment(p, q).toShape() for p, q in zip(corners, corners[1:], strict=False)]
            face = self.document.addObject("Part::Feature", label + "Profile")
            face.Shape = Part.Face(Part.Wire([arc.toShape(), *lines]))
            obj = self.document.addObject("Part::Revolution", label)
            obj.Source, obj.Axis, obj.Base, obj.Angle = face, V(0, 0, 1), V(0, 0, 0), 360
            obj.Placement = self.placement(1, 2, 3, (0, 1, 0), 20)
            return obj

        crown = revolved("Crown", Part.Arc(at(0), at(4), at(10)), [at(10), V(10, 0, 2), V(0, 0, 2), at(0)])
        flint = revolved("Flint", Part.Arc(at(0), at(7), at(12)), [at(12), V(12, 0, 14), V(0, 0, 14), at(0)])
        self.document.recompute()
        self.check(crown, flint, crown.Placement.multVec(V(0, 0, -40)), 50)


def difference(face, other):
    """How much two faces of a shape differ in place and size."""
    return (other.CenterOfMass - face.CenterOfMass).Length + math.sqrt(abs(other.Area - face.Area))


def same_sphere(data, centre, radius):
    return math.dist(data["center_mm"], centre) < 1e-6 and abs(data["radius_mm"] - radius) < 1e-6


def places(face):
    """(u, v) all over the range of a face, off its poles."""
    u0, u1, v0, v1 = face.ParameterRange
    steps = (0.03, 0.22, 0.5, 0.71, 0.98)
    return [(u0 + s * (u1 - u0), v0 + t * (v1 - v0)) for s in steps for t in steps]
