# SPDX-License-Identifier: LGPL-2.1-or-later
"""The scene says what the study says, and the shipped examples are what their documents export."""

import json
import os
import re
import shutil

import FreeCAD
from support import EXAMPLES, DocumentTest, check_scene, unpaired_edges, volume_mm3

from raymaps_wb.export.fingerprint import fingerprint
from raymaps_wb.export.rules import faults
from raymaps_wb.export.writer import export_study
from raymaps_wb.objects.medium import make_medium
from raymaps_wb.objects.references import set_references
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import members, studies


class SceneTest(DocumentTest):
    def test_sources_and_detectors(self):
        study, lens, _ = self.full_study()
        cone = make_source(self.document, study, "Spot", "Cone")
        cone.HalfAngle, cone.FluxW, cone.Placement = 20, 2.5, self.placement(1, 2, 3, (1, 0, 0), 90)
        disc = make_source(self.document, study, "Beam", "Disc")
        disc.Radius = 4
        glow = make_source(self.document, study, "Glow", "Faces")
        set_references(glow, [(lens, "Face6"), (lens, "Face2")])
        scene, _ = self.export(study)
        sources = scene["sources"]
        self.assertEqual(sources["Spot"]["kind"], "cone")
        self.assertEqual(sources["Spot"]["position_mm"], [1, 2, 3])
        for got, expected in zip(sources["Spot"]["direction"], (0, -1, 0), strict=True):
            self.assertAlmostEqual(got, expected, places=12)
        self.assertEqual((sources["Spot"]["half_angle_deg"], sources["Spot"]["flux_w"]), (20, 2.5))
        self.assertEqual((sources["Beam"]["kind"], sources["Beam"]["radius_mm"]), ("disc", 4))
        self.assertEqual((sources["Glow"]["body"], sources["Glow"]["faces"]), ("Lens", ["Face2", "Face6"]))
        detector = scene["detectors"]["Detector"]
        self.assertEqual((detector["normal"], detector["x_axis"]), ([0, 0, 1], [1, 0, 0]))
        self.assertEqual((detector["side"], detector["resolution"]), ("front", [100, 100]))

    def test_placements_inside_a_part(self):
        study, _, _ = self.full_study()
        part = self.document.addObject("App::Part", "Moved")
        part.Placement = self.placement(100, 0, 0, (0, 1, 0), 90)
        part.addObject(study)
        source = make_source(self.document, study, "Inside", "Disc")
        source.Placement = self.placement(0, 0, 5)
        part.addObject(source)
        study.addObject(source)
        scene, _ = self.export(study)
        inside = scene["sources"]["Inside"]
        position, direction = [105, 0, 0], [1, 0, 0]
        for got, wanted in zip(inside["position_mm"] + inside["direction"], position + direction, strict=True):
            self.assertAlmostEqual(got, wanted, places=9)

    def test_ambient_medium(self):
        study, _, _ = self.full_study()
        study.AmbientMedium = make_medium(self.document, study, preset="Water")
        scene, _ = self.export(study)
        self.assertEqual(scene["ambient"], "Water")

    def test_settings(self):
        study, _, _ = self.full_study()
        study.Rays, study.Seed, study.MaxEvents, study.RouletteThreshold = 7, 8, 9, 0.25
        scene, _ = self.export(study)
        self.assertEqual(scene["settings"], {"rays": 7, "seed": 8, "max_events": 9, "roulette_threshold": 0.25})

    def test_sampling(self):
        study, _, _ = self.full_study()
        scene, _ = self.export(study)
        self.assertEqual(study.Sampling, "Random")
        self.assertNotIn("sampling", scene["settings"])
        study.Sampling = "Sobol"
        exported = export_study(study, self.folder)
        with open(exported.path, encoding="utf-8") as file:
            self.assertEqual(json.load(file)["settings"]["sampling"], "sobol")
        self.assertEqual(check_scene(exported.path), [])

    def test_faceted_surfaces_and_priorities(self):
        study, _, _ = self.full_study()
        before = fingerprint(study)
        scene, _ = self.export(study)
        self.assertNotIn("surfaces", scene["settings"])
        self.assertEqual([body.get("priority") for body in scene["bodies"].values()], [None, None])
        study.Surfaces, members(study, "RayMaps::Medium")[0].Priority = "Faceted", -2
        self.assertNotEqual(fingerprint(study), before)
        exported = export_study(study, self.folder)
        self.assertEqual(check_scene(exported.path), [])
        with open(exported.path, encoding="utf-8") as file:
            scene = json.load(file)
        self.assertEqual(scene["settings"]["surfaces"], "faceted")
        self.assertEqual(
            {name: body.get("priority") for name, body in scene["bodies"].items()}, {"Lens": -2, "Plate": None}
        )
        medium = members(study, "RayMaps::Medium")[0]
        medium.Priority = 2_000_000
        self.assertIn("the priority must be at least -100000 and at most 100000, got 2e+06.", faults(medium))

    def test_examples_are_what_their_documents_export(self):
        for name in ("led_collimator", "singlet_barrel"):
            with self.subTest(name):
                shutil.copy(os.path.join(EXAMPLES, name + ".FCStd"), self.folder)
                document = FreeCAD.openDocument(os.path.join(self.folder, name + ".FCStd"))
                scene, meshes = self.export(studies(document)[0])
                with open(os.path.join(EXAMPLES, name + ".scene.json"), encoding="utf-8") as file:
                    text = file.read()
                shipped = json.loads(text)
                for key in ("name", "ambient", "media", "surfaces", "sources", "detectors", "settings"):
                    self.assertEqual(rounded(scene[key]), rounded(shipped[key]))
                self.assertEqual(list(scene["bodies"]), list(shipped["bodies"]))
                self.assertIsNone(re.search(r'"(/|[A-Za-z]:\\\\|file:)', text), "an absolute path")
                for body, mesh in meshes.items():
                    self.assertEqual(unpaired_edges(mesh), [], body)
                    self.assertGreater(volume_mm3(mesh), 0, body)


def rounded(data):
    if isinstance(data, float):
        return round(data, 9) + 0.0
    if isinstance(data, dict):
        return {key: rounded(value) for key, value in data.items()}
    return [rounded(value) for value in data] if isinstance(data, list) else data
