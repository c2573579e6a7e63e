# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is wrong with a study is told in one sentence each, and stops the export."""

import Part
from support import DocumentTest

from raymaps_wb.errors import ExportError
from raymaps_wb.export.check import check_study
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

    def test_bodies_that_touch_are_told(self):
        boxes = [self.box(f"B{i}") for i in range(2)]
        boxes[1].Placement.Base = self.vector(10, 0, 0)
        texts = [problem.text for problem in check_study(self.study(*((box, "") for box in boxes)))]
        self.assertTrue(any("touch or overlap" in text for text in texts), texts)

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
