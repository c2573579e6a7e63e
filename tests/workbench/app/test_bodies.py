# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bodies of all kinds arrive in the scene with the right shape, place, name and faces."""

import FreeCAD
import Part
from support import DocumentTest, bounds, unpaired_edges, volume_mm3

from raymaps_wb.export.triangles import open_edges, signed_volume_mm3, stand_in
from raymaps_wb.objects.references import add_references, set_references
from raymaps_wb.objects.surface_property import make_surface_property


class BodiesTest(DocumentTest):
    def test_part_box(self):
        study = self.study((self.box(), ""))
        scene, meshes = self.export(study)
        faces = scene["bodies"]["Box"]["geometry"]["faces"]
        self.assertEqual([face["name"] for face in faces], [f"Face{i}" for i in range(1, 7)])
        self.assertEqual([face["triangles"] for face in faces], [2] * 6)
        self.assertEqual(len(meshes["Box"][0]), 8)
        self.assertAlmostEqual(volume_mm3(meshes["Box"]), 6000, places=9)
        self.assertEqual(bounds(meshes["Box"]), [0, 0, 0, 10, 20, 30])

    def test_curved_solids_are_closed_and_outward(self):
        v = self.vector
        block = Part.makeBox(10, 10, 10).cut(Part.makeCylinder(3, 20, v(5, 5, -1)))
        rounded = Part.makeBox(8, 8, 8)
        shapes = {
            "sphere": Part.makeSphere(7),
            "torus": Part.makeTorus(20, 4),
            "cone": Part.makeCone(5, 0, 9),
            "drilled": block.fuse(Part.makeSphere(4, v(12, 5, 5))),
            "rounded": rounded.makeFillet(1, rounded.Edges),
            "hollow": Part.makeBox(10, 10, 10).cut(Part.makeSphere(3, v(5, 5, 5))),
        }
        objects = []
        for i, (label, shape) in enumerate(shapes.items()):
            obj = self.document.addObject("Part::Feature", label)
            obj.Shape = shape
            obj.Placement = self.placement(100.3 * i, -7.7, 1000.1, (1, 2, 3), 37 * i)
            objects.append((obj, ""))
        _, meshes = self.export(self.study(*objects))
        for label, shape in shapes.items():
            with self.subTest(label):
                self.assertEqual(unpaired_edges(meshes[label]), [])
                self.assertLess(abs(volume_mm3(meshes[label]) / shape.Volume - 1), 0.01)

    def test_stand_ins_are_closed_with_all_faces(self):
        for n_faces in range(1, 40):
            mesh = stand_in(n_faces)
            self.assertEqual((open_edges(mesh), len(mesh.faces)), (0, n_faces))
            self.assertGreater(signed_volume_mm3(mesh), 0)
            self.assertEqual(sum(count for _, count in mesh.faces), len(mesh.triangles))
            self.assertTrue(all(count > 0 for _, count in mesh.faces))

    def test_finer_settings_give_finer_triangles(self):
        ball = self.document.addObject("Part::Sphere", "Ball")
        ball.Radius = 10
        study = self.study((ball, ""))
        counts = []
        for angle_deg, chord_mm in ((20, 1), (5, 1), (20, 0.01)):
            study.AngularDeflection, study.ChordTolerance = angle_deg, chord_mm
            counts.append(len(self.export(study)[1]["Ball"][1]))
        self.assertGreater(counts[1], 4 * counts[0])
        self.assertGreater(counts[2], 4 * counts[0])

    def test_part_design_body(self):
        body = self.document.addObject("PartDesign::Body", "Body")
        block = self.document.addObject("PartDesign::AdditiveBox", "Block")
        body.addObject(block)
        block.Length, block.Width, block.Height = 10, 10, 10
        hole = self.document.addObject("PartDesign::SubtractiveCylinder", "Hole")
        body.addObject(hole)
        hole.Radius, hole.Height = 2, 50
        body.Placement = self.placement(0, 0, 100)
        self.document.recompute()
        # Picked as the body, as a face of its last feature, and as that feature itself: one body.
        study = self.study((body, ""))
        black = make_surface_property(self.document, study, "black")
        top = next(i for i, face in enumerate(body.Shape.Faces) if abs(face.CenterOfMass.z - 110) < 1e-6) + 1
        set_references(black, [(body, f"Hole.Face{top}"), (hole, f"Face{top}")])
        scene, meshes = self.export(study)
        self.assertEqual(list(scene["bodies"]), ["Body"])
        self.assertEqual(scene["bodies"]["Body"]["face_surfaces"], {f"Face{top}": "black"})
        self.assertEqual(unpaired_edges(meshes["Body"]), [])
        self.assertLess(abs(volume_mm3(meshes["Body"]) / body.Shape.Volume - 1), 1e-3)
        self.assertEqual(bounds(meshes["Body"])[2::3], [100, 110])

    def test_nested_parts_have_their_global_placement(self):
        inner, outer = (self.document.addObject("App::Part", name) for name in ("Inner", "Outer"))
        outer.addObject(inner)
        box = self.box("Deep", (1, 2, 3), inner)
        box.Placement, inner.Placement, outer.Placement = placements = (
            self.placement(5, 0, 0, (0, 0, 1), 90),
            self.placement(0, 7, 0, (1, 0, 0), 30),
            self.placement(0, 0, -9, (1, 1, 0), 45),
        )
        whole = placements[2].multiply(placements[1]).multiply(placements[0])
        corners = [whole.multVec(self.vector(x, y, z)) for x in (0, 1) for y in (0, 2) for z in (0, 3)]
        # Picked from the outside, and as the box alone: the same body in the same place.
        for reference in ((outer, "Inner.Deep."), (box, ""), (inner, "Deep."), (outer, "")):
            with self.subTest(reference=reference[1]):
                scene, meshes = self.export(self.study(reference))
                self.assertEqual(list(scene["bodies"]), ["Deep"])
                for vertex in meshes["Deep"][0]:
                    self.assertLess(min((self.vector(*vertex) - corner).Length for corner in corners), 1e-9)

    def test_links_are_bodies_of_their_own(self):
        part = self.document.addObject("App::Part", "Pair")
        box = self.box("Box", (1, 1, 1), part)
        ball = self.document.addObject("Part::Sphere", "Ball")
        part.addObject(ball)
        ball.Placement.Base = self.vector(0, 0, 20)
        link = self.document.addObject("App::Link", "Copy")
        link.LinkedObject, link.Placement = part, self.placement(100, 0, 0)
        study = self.study((part, ""), (link, ""))
        black = make_surface_property(self.document, study, "black")
        set_references(black, [(link, "Box.Face6")])
        scene, meshes = self.export(study)
        self.assertEqual(sorted(scene["bodies"]), ["Ball", "Box", "Copy_Ball", "Copy_Box"])
        self.assertEqual(bounds(meshes["Copy_Box"]), [100, 0, 0, 101, 1, 1])
        self.assertEqual(scene["bodies"]["Copy_Box"]["face_surfaces"], {"Face6": "black"})
        self.assertEqual(scene["bodies"]["Box"]["face_surfaces"], {})
        self.assertEqual(box.Label, "Box")

    def test_link_arrays_and_scaled_links(self):
        box = self.box("Unit", (1, 1, 1))
        row = self.document.addObject("App::Link", "Row")
        row.LinkedObject, row.ElementCount = box, 3
        self.document.recompute()
        for i, element in enumerate(row.ElementList):
            element.Placement = self.placement(10 * i, 0, 0)
        large = self.document.addObject("App::Link", "Large")
        large.LinkedObject, large.Scale, large.Placement = box, 3.0, self.placement(0, 50, 0)
        scene, meshes = self.export(self.study((row, ""), (large, "")))
        self.assertEqual(len(scene["bodies"]), 4)
        places = sorted(bounds(mesh)[0] for name, mesh in meshes.items() if name != "Large")
        self.assertEqual(places, [0, 10, 20])
        self.assertAlmostEqual(volume_mm3(meshes["Large"]), 27, places=6)
        self.assertEqual(unpaired_edges(meshes["Large"]), [])

    def test_link_arrays_without_element_objects(self):
        box = self.box("Unit", (1, 1, 1))
        row = self.document.addObject("App::Link", "Row")
        row.LinkedObject, row.ShowElement, row.ElementCount = box, False, 3
        self.document.recompute()
        row.PlacementList = [self.placement(10 * i, 0, 0) for i in range(3)]
        study = self.study((row, ""))
        black = make_surface_property(self.document, study, "black")
        set_references(black, [(row, "1.Face6")])
        scene, meshes = self.export(study)
        self.assertEqual(sorted(bounds(mesh)[0] for mesh in meshes.values()), [0, 10, 20])
        painted = [name for name, body in scene["bodies"].items() if body["face_surfaces"]]
        self.assertEqual([bounds(meshes[name])[0] for name in painted], [10])

    def test_mirrored_link_stays_outward(self):
        ball = self.document.addObject("Part::Box", "Block")
        link = self.document.addObject("App::Link", "Mirrored")
        link.LinkedObject, link.ScaleVector = ball, self.vector(-1, 1, 1)
        _, meshes = self.export(self.study((link, "")))
        self.assertAlmostEqual(volume_mm3(meshes["Mirrored"]), 1000, places=6)
        self.assertEqual(bounds(meshes["Mirrored"]), [-10, 0, 0, 0, 10, 10])

    def test_step_import(self):
        path = self.folder + "/part.step"
        shape = Part.makeCompound([Part.makeSphere(5), Part.makeBox(3, 4, 5, self.vector(20, 0, 0))])
        shape.exportStep(path)
        Part.insert(path, self.document.Name)
        imported = [(obj, "") for obj in self.document.Objects if hasattr(obj, "Shape") and obj.Shape.Solids]
        self.assertTrue(imported)
        scene, meshes = self.export(self.study(*imported))
        self.assertAlmostEqual(
            sum(volume_mm3(mesh) for mesh in meshes.values()), shape.Volume, delta=0.01 * shape.Volume
        )
        for mesh in meshes.values():
            self.assertEqual(unpaired_edges(mesh), [])
        kinds = {face["surface"]["type"] for body in scene["bodies"].values() for face in body["geometry"]["faces"]}
        self.assertEqual(kinds, {"plane", "sphere"})

    def test_booleans_count_once(self):
        part = self.document.addObject("App::Part", "Assembly")
        base, tool = self.box("Base", (10, 10, 10), part), self.box("Tool", (5, 5, 20), part)
        cut = self.document.addObject("Part::Cut", "Result")
        part.addObject(cut)
        cut.Base, cut.Tool = base, tool
        scene, meshes = self.export(self.study((part, "")))
        self.assertEqual(list(scene["bodies"]), ["Result"])
        self.assertAlmostEqual(volume_mm3(meshes["Result"]), 750, places=6)

    def test_same_labels_get_different_names(self):
        parameters = FreeCAD.ParamGet("User parameter:BaseApp/Preferences/Document")
        parameters.SetBool("DuplicateLabels", True)
        self.addCleanup(parameters.RemBool, "DuplicateLabels")
        boxes = [self.box(f"B{i}", (1, 1, 1)) for i in range(3)]
        for i, box in enumerate(boxes):
            box.Label, box.Placement.Base = "lens/1 ä", self.vector(5 * i, 0, 0)
        scene, _ = self.export(self.study(*((box, "") for box in boxes)))
        self.assertEqual(len(scene["bodies"]), 3)
        self.assertEqual(len({body["geometry"]["file"] for body in scene["bodies"].values()}), 3)
        self.assertIn("lens/1 ä", scene["bodies"])

    def test_open_sheet_has_no_medium(self):
        sheet = self.document.addObject("Part::Plane", "Sheet")
        study = self.study()
        black = make_surface_property(self.document, study, "black")
        add_references(black, [(sheet, "")])
        scene, meshes = self.export(study)
        self.assertIsNone(scene["bodies"]["Sheet"]["medium"])
        self.assertEqual(len(meshes["Sheet"][1]), 2)
