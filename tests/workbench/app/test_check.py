# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is wrong with a study is told in one sentence each, and stops the export."""

import os

import FreeCAD
import Part
from support import DocumentTest, ask_core

from raymaps_wb.errors import ExportError
from raymaps_wb.export.check import check_study
from raymaps_wb.export.writer import file_stem
from raymaps_wb.objects.detector import make_detector
from raymaps_wb.objects.medium import make_medium
from raymaps_wb.objects.references import set_references
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import members
from raymaps_wb.objects.surface_property import make_surface_property


class CheckTest(DocumentTest):
    def blocking(self, study):
        problems = check_study(study)
        for problem in problems:
            self.assertTrue(problem.text.endswith("."), problem.text)
        return " ".join(problem.text for problem in problems if problem.blocks)

    def assert_refused(self, study, *words):
        text = self.blocking(study)
        for word in words:
            self.assertIn(word, text)
        with self.assertRaises(ExportError) as caught:
            self.export(study)
        self.assertTrue(str(caught.exception))

    def test_a_sound_study_has_no_problem(self):
        study, _, _ = self.full_study()
        self.assertEqual(check_study(study), [])

    def test_no_source(self):
        self.assert_refused(self.study((self.box(), ""), source=False), "no source")

    def test_two_media(self):
        box = self.box()
        study = self.study((box, ""))
        set_references(make_medium(self.document, study, "other"), [(box, "")])
        self.assert_refused(study, "'Box'", "'PMMA'", "'other'")

    def test_an_edge_is_not_a_face(self):
        self.assert_refused(self.study((self.box(), "Edge1")), "Edge1", "faces and bodies")

    def test_a_face_that_is_gone(self):
        box = self.box()
        study = self.study((box, ""))
        set_references(make_surface_property(self.document, study, "black"), [(box, "Face9")])
        self.assert_refused(study, "'Face9'", "pick the face again")

    def test_open_shell_with_a_medium(self):
        shell = self.document.addObject("Part::Feature", "Shell")
        shell.Shape = Part.Shell(Part.makeBox(1, 1, 1).Faces[:5])
        self.assert_refused(self.study((shell, "")), "'Shell'", "medium")

    def test_body_with_a_property_on_some_faces_only(self):
        box = self.box()
        study = self.study()
        set_references(make_surface_property(self.document, study, "black"), [(box, "Face1")])
        self.assert_refused(study, "'Box'", "Face2")

    def test_numbers_out_of_range(self):
        study, _, _ = self.full_study()
        source, medium = members(study, "RayMaps::Source")[0], members(study, "RayMaps::Medium")[0]
        black = members(study, "RayMaps::SurfaceProperty")[0]
        black.Kind, black.Reflectance, black.Transmittance = "Lambertian", [0.7], [0.4]
        source.FluxW, medium.RefractiveIndex, study.RouletteThreshold = -1, 0, 2
        text = self.blocking(study)
        for word in (
            "the flux must be above 0 W, got -1 W",
            "refractive index",
            "roulette",
            "together must be at most 1",
        ):
            self.assertIn(word, text)

    def test_not_a_number(self):
        study, _, _ = self.full_study()
        members(study, "RayMaps::Medium")[0].RefractiveIndex = float("nan")
        self.assert_refused(study, "refractive index")

    def test_mixture_without_weights(self):
        study, _, _ = self.full_study()
        mixture = make_surface_property(self.document, study, "mixed", "Mixture")
        self.assert_refused(study, "mixed", "weight")
        mixture.Parts, mixture.Weights = [members(study, "RayMaps::SurfaceProperty")[0]], [0.5]
        self.assertIn("add up to 1", self.blocking(study))

    def test_faces_source_without_faces_and_on_two_bodies(self):
        study, lens, plate = self.full_study()
        source = make_source(self.document, study, "Glow", "Faces")
        self.assert_refused(study, "Glow", "pick the faces")
        set_references(source, [(lens, "Face1"), (plate, "Face1")])
        self.assert_refused(study, "Glow", "more than one body")

    def boxes(self, *widths_and_places):
        """Boxes of some widths along x at some places, 20 by 30 mm across, and a study with PMMA in each."""
        boxes = []
        for i, (width, x) in enumerate(widths_and_places):
            boxes.append(self.box(f"B{i}", (width, 20, 30)))
            boxes[-1].Placement.Base = self.vector(x, 0, 0)
        study = self.study((boxes[0], ""))
        for box in boxes[1:]:
            set_references(make_medium(self.document, study, f"in {box.Label}"), [(box, "")])
        make_detector(self.document, study)
        self.document.recompute()
        return study, members(study, "RayMaps::Medium")

    def test_bodies_with_media_may_touch(self):
        study, _ = self.boxes((10, 0), (10, 10))
        self.assertEqual(check_study(study), [])

    def test_which_of_two_overlapping_bodies_rules_is_told(self):
        for widths, priorities, expected in (
            ((10, 8), (0, 0), "overlap by 600 mm\u00b3, where 'B1' rules: of equal priorities the smaller body does."),
            ((8, 12), (0, 0), "overlap by 600 mm\u00b3, where 'B0' rules: of equal priorities the smaller body does."),
            (
                (10, 10),
                (3, 3),
                "overlap by 600 mm\u00b3, where 'B1' rules: of bodies of one size and priority the later",
            ),
            ((10, 8), (0, -1), "overlap by 600 mm\u00b3, where 'B0' rules: its medium has the higher priority."),
            ((8, 10), (0, 1), "overlap by 600 mm\u00b3, where 'B1' rules: its medium has the higher priority."),
        ):
            study, media = self.boxes((widths[0], 0), (widths[1], widths[0] - 1))
            for medium, priority in zip(media, priorities, strict=True):
                medium.Priority = priority
            (problem,) = check_study(study)
            self.assertIn(expected, problem.text)
            self.assertEqual((problem.blocks, problem.spoils), (False, False))
            self.assertEqual(ruling_of_core(self.export_path(study)), expected.split("'")[1])
            for name in [obj.Name for obj in reversed(self.document.Objects)]:
                self.document.removeObject(name)

    def export_path(self, study):
        self.export(study)
        return os.path.join(self.folder, file_stem(study.Label) + ".scene.json")

    def test_a_body_within_another(self):
        study, _ = self.boxes((10, 0))
        bubble = self.document.addObject("Part::Sphere", "Bubble")
        bubble.Radius, bubble.Placement.Base = 2, self.vector(5, 10, 15)
        set_references(make_medium(self.document, study, "air"), [(bubble, "")])
        self.document.recompute()
        (problem,) = check_study(study)
        self.assertIn("'B0' and 'Bubble' overlap by 33.5 mm\u00b3, where 'Bubble' rules", problem.text)

    def test_faces_without_an_exact_surface_are_told(self):
        curve = Part.BSplineCurve()
        curve.interpolate([FreeCAD.Vector(*p) for p in ((2, 0, 0), (3, 0, 2), (5, 0, 3))])
        free = curve.toShape().extrude(FreeCAD.Vector(0, 5, 0)).makeOffsetShape(0.5, 1e-3)
        sheet = self.document.addObject("Part::Feature", "Sheet")
        sheet.Shape = free
        self.assertEqual([type(face.Surface).__name__ for face in free.Faces], ["OffsetSurface"])
        study, _, _ = self.full_study()
        set_references(make_surface_property(self.document, study, "white"), [(sheet, "")])
        self.document.recompute()
        (problem,) = check_study(study)
        self.assertIn("Body 'Sheet': light meets the triangles of Face1", problem.text)
        self.assertIn("an offset of a free surface has no exact form", problem.text)
        self.assertIn("chord tolerance of 0.02 mm.", problem.text)
        self.assertEqual((problem.blocks, problem.spoils), (False, False))
        scene, _ = self.export(study)
        self.assertEqual(scene["bodies"]["Sheet"]["geometry"]["faces"][0]["surface"]["type"], "other")
        study.Surfaces = "Faceted"
        self.assertEqual(check_study(study), [])

    def test_faulty_faces_are_named(self):
        vectors = [FreeCAD.Vector(*p) for p in ((0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0), (0, 0, 0))]
        hole = [v * 0.5 + FreeCAD.Vector(7, 7, 0) for v in vectors]
        plate = Part.Face([Part.makePolygon(vectors), Part.makePolygon(hole)]).extrude(FreeCAD.Vector(0, 0, 3))
        obj = self.document.addObject("Part::Feature", "Odd")
        obj.Shape = plate
        study, _, _ = self.full_study()
        set_references(make_surface_property(self.document, study, "white"), [(obj, "")])
        self.document.recompute()
        problem = next(problem for problem in check_study(study) if "'Odd'" in problem.text)
        self.assertIn("has faulty geometry in Face9, Face10 (intersecting wires)", problem.text)
        self.assertTrue(problem.spoils)

    def test_a_body_that_crosses_itself(self):
        obj = self.document.addObject("Part::Feature", "Twice")
        boxes = [Part.makeBox(10, 10, 10), Part.makeBox(10, 10, 10, FreeCAD.Vector(5, 5, 5))]
        obj.Shape = Part.makeCompound(boxes)
        study = self.study((obj, ""))
        make_detector(self.document, study)
        (problem,) = check_study(study)
        self.assertIn("Body 'Twice' has faces that meet or cross (Face2 with Face9", problem.text)
        self.assertTrue(problem.spoils)
        self.assertEqual(check_study(study, limit_s=60), [])  # before a run there is no time for it
        obj.Shape = Part.makeCompound([boxes[0], Part.makeBox(10, 10, 10, FreeCAD.Vector(25, 5, 5))])
        self.document.recompute()
        self.assertEqual(check_study(study), [])

    def test_opaque_bodies_may_touch(self):
        study, _, plate = self.full_study()
        chip = self.box("Chip", (1, 1, 1))
        chip.Placement.Base = plate.Placement.Base + self.vector(1, 1, 1)
        set_references(members(study, "RayMaps::SurfaceProperty")[0], [(plate, ""), (chip, "")])
        self.document.recompute()
        self.assertEqual(check_study(study), [])

    def test_a_source_inside_an_opaque_body_is_told(self):
        study, _, plate = self.full_study()
        for kind, inside in (("Point", True), ("Cone", True), ("Disc", True), ("Faces", False)):
            source = make_source(self.document, study, "Buried", kind)
            source.Placement.Base = plate.Placement.Base + self.vector(10, 10, 0.5)
            texts = [problem.text for problem in check_study(study) if problem.spoils]
            self.assertEqual(["inside the body 'Plate'" in text for text in texts], [True] * inside, (kind, texts))
            self.document.removeObject(source.Name)
        # In a medium light is at home.
        members(study, "RayMaps::Source")[0].Placement.Base = self.vector(5, 10, 15)
        self.assertEqual([problem for problem in check_study(study) if problem.spoils], [])

    def test_bodies_left_out_are_told(self):
        study, _, _ = self.full_study()
        self.box("Forgotten").Placement.Base = self.vector(500, 0, 0)
        self.document.recompute()
        texts = [problem.text for problem in check_study(study)]
        self.assertTrue(any("'Forgotten'" in text for text in texts), texts)

    def test_a_boundary_of_media_on_a_body_without_one(self):
        study, _, plate = self.full_study()
        black = members(study, "RayMaps::SurfaceProperty")[0]
        black.Kind = "Rough"
        self.assertIn("'black' is a boundary of two media, and body 'Plate' has none; give", self.blocking(study))
        black.Kind = "Absorber"
        rough = make_surface_property(self.document, study, "rough", "Rough")
        mixed = make_surface_property(self.document, study, "mixed", "Mixture")
        mixed.Parts, mixed.Weights = [black, rough], [0.5, 0.5]
        set_references(mixed, [(plate, "Face6")])
        texts = [problem.text for problem in check_study(study, distances=False) if problem.blocks]
        self.assertEqual(len(texts), 1)
        self.assertIn("'mixed' is a boundary", texts[0])

    def test_an_output_that_can_not_be_written(self):
        study, _, _ = self.full_study()
        with open(self.folder + "/file", "w") as file:
            file.write("in the way")
        self.folder += "/file"
        with self.assertRaises(ExportError) as caught:
            self.export(study)
        self.assertIn("can't be written", str(caught.exception))


def ruling_of_core(path):
    """The body of a scene that the tracer takes for the highest in rank."""
    code = (
        "import raymaps.scene as s, raymaps.geometry as g, raymaps.solids.ranks as r\n"
        f"scene = s.load_scene({path!r})\n"
        "print(list(scene.bodies)[r.rank_solids(scene, g.load_bodies(scene))[0]])"
    )
    return ask_core(code).strip()
