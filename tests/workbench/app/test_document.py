# SPDX-License-Identifier: LGPL-2.1-or-later
"""Studies live with their document: saving, renaming, undo, staleness, old files."""

import FreeCAD
from support import DocumentTest

from raymaps_wb.export.fingerprint import fingerprint
from raymaps_wb.gui.active import Transaction
from raymaps_wb.gui.staleness import update_stale
from raymaps_wb.objects.detector import Detector, make_detector
from raymaps_wb.objects.properties import Property
from raymaps_wb.objects.references import reference_list, set_references
from raymaps_wb.objects.result import make_result, map_folder, set_map_folder
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import make_study, members, studies
from raymaps_wb.objects.surface_property import SurfaceProperty, make_surface_property


class DocumentsTest(DocumentTest):
    def test_save_and_reopen(self):
        study, _, _ = self.full_study()
        study.Rays, study.RouletteThreshold = 12345, 0.003
        source = members(study, "RayMaps::Source")[0]
        source.Kind, source.RGB, source.HalfAngle = "Cone", [1, 0.5, 0], 33
        source.Placement = self.placement(1, 2, 3, (1, 0, 0), 30)
        before, (scene, _) = fingerprint(study), self.export(study)
        document = self.reopened(self.document)
        study = studies(document)[0]
        self.assertEqual(fingerprint(study), before)
        again, _ = self.export(study)
        for key in ("media", "surfaces", "sources", "detectors", "settings"):
            self.assertEqual(again[key], scene[key])
        self.assertEqual(list(again["bodies"]), list(scene["bodies"]))
        # Twice: what a reopened document saves is as good.
        document = self.reopened(document)
        self.assertEqual(fingerprint(studies(document)[0]), before)

    def test_a_turned_detector_is_the_same_after_reopening(self):
        study, _, _ = self.full_study()
        detector = members(study, "RayMaps::Detector")[0]
        turned = [FreeCAD.Rotation(self.vector(0, 0, 1), self.vector(*to)) for to in ((0, 0, -1), (0, 1, 0), (1, 2, 3))]
        turned.append(FreeCAD.Rotation(0, 1, 0, 6.1e-17))
        for rotation in turned:
            detector.Placement = FreeCAD.Placement(self.vector(1e-17, 0.1 + 0.2, 1000 / 3), rotation)
            before, (scene, _) = fingerprint(study), self.export(study)
            study = studies(self.reopened(study.Document))[0]
            self.assertEqual(fingerprint(study), before, rotation.Q)
            self.assertEqual(self.export(study)[0]["detectors"], scene["detectors"])
            detector = members(study, "RayMaps::Detector")[0]
        detector.Placement.Rotation = FreeCAD.Rotation(0, 1, 0, 6.1e-17)
        self.assertEqual(self.export(study)[0]["detectors"]["Detector"]["normal"], [0, 0, -1])

    def test_renaming_keeps_references(self):
        study, lens, _ = self.full_study()
        lens.Label = "Front lens"
        scene, _ = self.export(study)
        self.assertEqual(scene["bodies"]["Front lens"]["medium"], "PMMA")
        self.assertEqual(scene["bodies"]["Front lens"]["face_surfaces"], {"Face5": "black"})
        members(study, SurfaceProperty.TYPE)[0].Label = "soot"
        scene, _ = self.export(study)
        self.assertEqual(scene["bodies"]["Front lens"]["face_surfaces"], {"Face5": "soot"})

    def test_creating_can_be_undone(self):
        with Transaction(self.document, "study"):
            study = make_study(self.document)
        with Transaction(self.document, "detector"):
            make_detector(self.document, study)
        self.assertEqual(len(study.Group), 1)
        self.document.undo()
        self.assertEqual(len(studies(self.document)[0].Group), 0)
        self.document.undo()
        self.assertEqual(studies(self.document), [])
        self.document.redo()
        self.document.redo()
        study = studies(self.document)[0]
        self.assertEqual([type(obj.Proxy) for obj in study.Group], [Detector])

    def test_a_failed_step_is_taken_back(self):
        with self.assertRaises(ValueError), Transaction(self.document, "study"):
            make_study(self.document)
            raise ValueError
        self.assertEqual(studies(self.document), [])

    def test_a_step_within_an_open_step_is_a_part_of_it(self):
        self.document.openTransaction("a sketch being edited")
        box = self.box()
        with Transaction(self.document, "result"):
            make_study(self.document)
        self.assertTrue(self.document.HasPendingTransaction)
        self.document.abortTransaction()
        self.assertEqual(self.document.Objects, [])
        self.assertIsNotNone(box)

    def test_every_change_that_matters_makes_a_result_stale(self):
        study, lens, plate = self.full_study()
        source, detector = members(study, "RayMaps::Source")[0], members(study, "RayMaps::Detector")[0]
        medium, black = members(study, "RayMaps::Medium")[0], members(study, SurfaceProperty.TYPE)[0]
        result = make_result(self.document, study)

        def moved(obj):
            obj.Placement = self.placement(0.01, 0, 0).multiply(obj.Placement)

        changes = {
            "geometry": lambda: setattr(lens, "Height", lens.Height.Value + 0.001),
            "placement": lambda: moved(plate),
            "refractive index": lambda: setattr(medium, "RefractiveIndex", 1.5),
            "absorption": lambda: setattr(medium, "AbsorptionPerMm", [0.1]),
            "kind of surface": lambda: setattr(black, "Kind", "Mirror"),
            "coefficient": lambda: setattr(black, "Reflectance", [0.5]),
            "faces": lambda: set_references(black, [(plate, ""), (lens, "Face6")]),
            "flux": lambda: setattr(source, "FluxW", 2.0),
            "colour": lambda: setattr(source, "RGB", [1, 1, 0]),
            "source's placement": lambda: moved(source),
            "detector's size": lambda: setattr(detector, "Width", 11),
            "detector's placement": lambda: moved(detector),
            "seed": lambda: setattr(study, "Seed", 2),
            "fineness": lambda: setattr(study, "AngularDeflection", 3),
            "another source": lambda: make_source(self.document, study),
            "a body's name": lambda: setattr(lens, "Label", "Other"),
        }
        for what, change in changes.items():
            with self.subTest(what):
                result.Fingerprint = fingerprint(study)
                self.assertFalse(update_stale(study))
                change()
                self.document.recompute()
                self.assertTrue(update_stale(study))
                self.assertTrue(result.Stale)

    def test_what_does_not_matter_leaves_a_result_fresh(self):
        study, lens, _ = self.full_study()
        result = make_result(self.document, study)
        result.Fingerprint = fingerprint(study)
        self.box("Unused")
        lens.Visibility = False
        result.Criterion = "from(Source)"
        lens.touch()
        self.document.recompute()
        self.assertFalse(update_stale(study))
        height = lens.Height
        lens.Height = 99
        self.document.recompute()
        self.assertTrue(update_stale(study))
        lens.Height = height
        self.document.recompute()
        self.assertFalse(update_stale(study))

    def test_deleting_a_body_makes_a_result_stale(self):
        study, lens, _ = self.full_study()
        result = make_result(self.document, study)
        result.Fingerprint = fingerprint(study)
        self.document.removeObject(lens.Name)
        self.document.recompute()
        self.assertTrue(update_stale(study))

    def test_map_is_found_beside_a_moved_document(self):
        study, _, _ = self.full_study()
        self.document.saveAs(self.folder + "/a.FCStd")
        result = make_result(self.document, study)
        set_map_folder(result, self.folder + "/a.raymaps/Study-001.raymap")
        self.assertEqual(result.MapPath, "a.raymaps/Study-001.raymap")
        self.assertEqual(map_folder(result), self.folder + "/a.raymaps/Study-001.raymap")

    def test_setting_up_is_idempotent_and_migrates_by_steps(self):
        study, _, _ = self.full_study()
        detector = members(study, "RayMaps::Detector")[0]
        detector.Width = 77
        properties = list(detector.PropertiesList)
        detector.Proxy.set_up(detector)
        self.assertEqual(list(detector.PropertiesList), properties)
        self.assertEqual(float(detector.Width), 77)

        class NewerDetector(Detector):
            SCHEMA = Detector.SCHEMA + 2
            PROPERTIES = (*Detector.PROPERTIES, Property("App::PropertyString", "Note", "A later property", "new"))
            MIGRATIONS = {
                Detector.SCHEMA: lambda obj: setattr(obj, "Width", float(obj.Width) + 1),
                Detector.SCHEMA + 1: lambda obj: setattr(obj, "Width", float(obj.Width) * 10),
            }

        newer = NewerDetector.__new__(NewerDetector)
        newer.onDocumentRestored(detector)
        self.assertEqual(
            (float(detector.Width), detector.SchemaVersion, detector.Note), (780, Detector.SCHEMA + 2, "new")
        )
        newer.onDocumentRestored(detector)
        self.assertEqual(float(detector.Width), 780)

    def test_references_reach_into_parts_after_reopening(self):
        part = self.document.addObject("App::Part", "Part")
        box = self.box("Inside", parent=part)
        study = self.study((part, "Inside.Face2"))
        document = self.reopened(self.document)
        medium = members(studies(document)[0], "RayMaps::Medium")[0]
        self.assertEqual(reference_list(medium), [(document.getObject("Part"), "Inside.Face2")])
        self.assertIsNotNone(study)
        self.assertIsNotNone(box)

    def test_a_mixture_survives(self):
        study, _, plate = self.full_study()
        parts = [make_surface_property(self.document, study, name, "Lambertian") for name in "abc"]
        mixture = make_surface_property(self.document, study, "mixed", "Mixture")
        mixture.Parts, mixture.Weights = [parts[2], parts[0]], [0.25, 0.75]
        document = self.reopened(self.document)
        scene, _ = self.export(studies(document)[0])
        self.assertEqual(
            scene["surfaces"]["mixed"]["parts"], [{"weight": 0.25, "surface": "c"}, {"weight": 0.75, "surface": "a"}]
        )
        self.assertIsNotNone(plate)

    def test_recomputing_does_not_fail(self):
        study, _, _ = self.full_study()
        self.document.recompute(None, True)
        for obj in self.document.Objects:
            self.assertTrue(obj.isValid(), obj.Label)
        self.assertTrue(FreeCAD.ActiveDocument is self.document and study.isValid())
