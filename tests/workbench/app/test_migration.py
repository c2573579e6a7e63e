# SPDX-License-Identifier: LGPL-2.1-or-later
"""Documents that an earlier version saved open as they were, and get what is new with values that change nothing.

``documents/schema1.FCStd`` is the example singlet_barrel as schema 1 saved it, with what it exported; never made anew.
"""

import json
import os
import shutil

import FreeCAD
from support import DocumentTest

from app.test_scene import rounded
from raymaps_wb.objects.medium import OWN
from raymaps_wb.objects.study import studies

DOCUMENTS = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "documents")


class MigrationTest(DocumentTest):
    def test_a_document_of_schema_1(self):
        path = shutil.copy(os.path.join(DOCUMENTS, "schema1.FCStd"), self.folder)
        document = FreeCAD.openDocument(path)
        study = studies(document)[0]
        for obj in [study, *study.Group]:
            self.assertEqual(obj.SchemaVersion, obj.Proxy.SCHEMA, obj.Label)
        kinds = {obj.Label: obj.Kind for obj in study.Group if hasattr(obj, "Kind")}
        self.assertEqual((kinds["BK7"], kinds["SensorPlane"], kinds["gloss"]), (OWN, "Rectangle", "Mirror"))
        scene, _ = self.export(study)
        with open(os.path.join(DOCUMENTS, "schema1.scene.json"), encoding="utf-8") as file:
            shipped = json.load(file)
        for key in ("media", "surfaces", "sources", "detectors", "settings"):
            self.assertEqual(rounded(scene[key]), rounded(shipped[key]))
        self.assertEqual(study.Surfaces, "Exact")
        self.assertTrue(all("priority" not in body for body in scene["bodies"].values()))

    def test_it_saves_as_the_present_schema(self):
        document = FreeCAD.openDocument(shutil.copy(os.path.join(DOCUMENTS, "schema1.FCStd"), self.folder))
        study = studies(self.reopened(document))[0]
        detector = next(obj for obj in study.Group if obj.Proxy.TYPE == "RayMaps::Detector")
        self.assertEqual((detector.SchemaVersion, detector.Kind, detector.ResolutionC), (2, "Rectangle", 72))
        self.assertIn("Hidden", detector.getEditorMode("ResolutionC"))
        self.assertNotIn("Hidden", detector.getEditorMode("Width"))

    def test_only_what_matters_is_in_the_property_editor(self):
        study, _, _ = self.full_study()
        medium, source = (next(o for o in study.Group if "RayMaps::" + t == o.Proxy.TYPE) for t in ("Medium", "Source"))

        def shown(obj):
            return {p.name for p in obj.Proxy.PROPERTIES if "Hidden" not in obj.getEditorMode(p.name)}

        self.assertIn("RefractiveIndex", shown(medium))
        self.assertNotIn("Coefficients", shown(medium))
        medium.Index = "Formula"
        self.assertIn("Coefficients", shown(medium))
        self.assertNotIn("RefractiveIndex", shown(medium))
        medium.Kind = "File"
        self.assertEqual(shown(medium), {"Kind", "MaterialFile", "Glass", "Priority", "References"})
        medium.Kind = "Catalogue"
        self.assertIn("Catalogue", shown(medium))
        self.assertNotIn("Index", shown(medium))
        self.assertEqual(shown(source), {"Kind", "FluxW", "Spectrum", "RGB", "RayShare"})
        source.Kind, source.Spectrum = "Sun", "Black body"
        self.assertEqual(
            shown(source), {"Kind", "FluxW", "Spectrum", "TemperatureK", "RayShare", "Radius", "AngularRadius"}
        )
        self.assertNotIn("Hidden", source.getEditorMode("Placement"))
        source.Kind = "Faces"
        self.assertIn("Hidden", source.getEditorMode("Placement"))
        self.assertIn("References", shown(source))
