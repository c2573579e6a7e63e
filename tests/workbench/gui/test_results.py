# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the panel tells of a run beside its rays: effects that it simulates, and light on detectors of every kind."""

import os

import data
import FreeCAD
import FreeCADGui

from gui.window import WindowTest, spin, wait_until, window_picture
from raymaps_wb.compat import QtCore, QtGui, QtWidgets
from raymaps_wb.gui import false_colours
from raymaps_wb.gui.detector_view import html, spread
from raymaps_wb.gui.effects_view import lines, sentence
from raymaps_wb.gui.result_tabs import DETECTORS
from raymaps_wb.objects.detector import make_detector
from raymaps_wb.objects.files import kept_path
from raymaps_wb.objects.medium import CATALOGUE, make_medium, set_scatterers
from raymaps_wb.objects.references import set_references
from raymaps_wb.objects.result import map_folder, result_of
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import members, studies
from raymaps_wb.objects.surface_property import make_surface_property
from raymaps_wb.tracer.explain import Effect

EFFECTS = [
    Effect("fresnel", "smooth interfaces", True, ("surface 'a' of body 'x'", "b", "c"), "", 0.25),
    Effect("medium_absorption", "absorption in media", True, ("medium 'm'",), "", None),
    Effect("dispersion", "index over wavelength", False, ("medium 'm'",), "one index", None),
    Effect("abg", "polished surfaces", False, (), "", None),
]


class ResultsTest(WindowTest):
    def lit_study(self):
        """A lamp above a plate, with a detector of each kind."""
        study, lens, plate = self.full_study()
        study.Rays = 4000
        lamp = members(study, "RayMaps::Source")[0]
        lamp.Kind, lamp.Placement = "Cone", self.placement(5, 5, -2, (1, 0, 0), 180)
        lamp.HalfAngle = 60
        rectangle = members(study, "RayMaps::Detector")[0]
        rectangle.Placement, rectangle.Width, rectangle.Height = self.placement(5, 5, -8.9), 40, 30
        rectangle.ResolutionX, rectangle.ResolutionY = 20, 15
        white = make_surface_property(self.document, study, "white", "Lambertian")
        black = members(study, "RayMaps::SurfaceProperty")[0]
        set_references(black, [(lens, "Face5")])
        set_references(white, [(plate, "")])
        face = make_detector(self.document, study, "On plate", "Faces")
        set_references(face, [(plate, "Face6")])
        make_detector(self.document, study, "Sky", "Far field")
        self.document.recompute()
        return study

    def measured(self, name):
        """Figures and picture of a detector in its tab."""
        self.panel.detectors.clear()
        self.panel.detectors.names.setCurrentText(name)
        self.panel.tabs.measure()
        self.assertTrue(wait_until(lambda: "asking" not in self.panel.detectors.text.text(), 60))
        return self.panel.detectors.text.text()

    def picture_of(self, widget, name):
        folder = os.environ.get("RAYMAPS_PICTURES")
        if folder:
            spin(0.3)
            widget.grab().save(os.path.join(folder, name))

    def test_detectors_of_every_kind(self):
        study = self.lit_study()
        self.run_to_the_end(study)
        self.ask("true", 200)
        self.panel.tabs.setCurrentIndex(DETECTORS)
        names = self.panel.detectors.names
        self.assertTrue(wait_until(lambda: names.count() == 3, 30))
        self.assertEqual([names.itemText(i) for i in range(3)], ["Detector", "On plate", "Sky"])
        for name, unit, has_picture in (
            ("Detector", "W/mm²", True),
            ("On plate", "W/mm²", False),
            ("Sky", "W/sr", True),
        ):
            text = self.measured(name)
            self.assertIn(unit, text, name)
            self.assertIn("±", text)
            pixmap = self.panel.detectors.picture.pixmap()
            self.assertEqual(pixmap is not None and not pixmap.isNull(), has_picture, name)
            self.picture_of(self.panel, f"detector_{name.replace(' ', '_')}.png")
            self.assertEqual(self.panel.detectors.shown.isVisibleTo(self.panel.detectors), has_picture, name)
            self.panel.detectors.shown.setCurrentIndex(1)
            self.picture_of(self.panel, f"detector_{name.replace(' ', '_')}_error.png")
            self.panel.detectors.shown.setCurrentIndex(0)
        self.ask("~true", 200)
        self.assertTrue(wait_until(lambda: "0 by 0 rays" in self.panel.detectors.text.text(), 30))
        # Far fields are saved as luminaires.
        self.ask("true", 200)
        self.measured("Sky")
        path = os.path.join(self.folder, "sky.ies")
        self.panel.detectors._save(path)
        self.assertTrue(wait_until(lambda: os.path.isfile(path), 30), self.panel.detectors.text.text())
        with open(path, encoding="latin-1") as file:
            self.assertIn("TILT", file.read())

    def test_effects_of_a_run_and_of_a_map_that_is_opened_again(self):
        study = self.lit_study()
        study.Without = ["crossings"]
        self.document.saveAs(os.path.join(self.folder, "lit.FCStd"))
        self.run_to_the_end(study)
        self.assertTrue(wait_until(lambda: "Simulates" in self.panel.effects_line.text(), 30))
        self.assertIn("lambertian", self.panel.effects_line.text())
        self.assertIn("Switched off: crossings (rectangles register nothing)", self.panel.effects_line.text())

        self.panel.tabs.setCurrentIndex(0)
        study = studies(self.reopened(self.document))[0]
        self.panel.show_study(study)
        self.assertEqual(self.panel.effects_line.text(), "")
        self.panel.tabs.setCurrentWidget(self.panel.effects)
        tree = self.panel.effects
        self.assertTrue(wait_until(lambda: tree.topLevelItemCount() and not tree.isColumnHidden(2), 60))
        items = [tree.topLevelItem(i) for i in range(tree.topLevelItemCount())]
        self.assertTrue(any("%" in item.text(2) for item in items))
        self.assertEqual(items[-1].text(0), "not needed")
        self.picture_of(self.panel, "effects_tab.png")
        self.panel.tabs.setCurrentIndex(DETECTORS)
        self.assertTrue(wait_until(lambda: "W/mm²" in self.panel.detectors.text.text(), 60))
        # The study of another document knows nothing of them.
        self.open_example("singlet_barrel")
        self.assertEqual((self.panel.detectors.names.count(), self.panel.effects_line.text()), (0, ""))

    def test_light_of_a_map_shines_again(self):
        study = self.lit_study()
        self.document.saveAs(os.path.join(self.folder, "lit.FCStd"))
        self.run_to_the_end(study)
        first = map_folder(result_of(study))
        for source in members(study, "RayMaps::Source"):
            study.removeObject(source)
        again = make_source(self.document, study, "again", "Crossings")
        again.MapFolder, again.MapDetector = kept_path(self.document, first), "Detector"
        self.assertEqual(again.MapFolder, "lit.raymaps/Study-001.raymap")
        study.Rays = 1000
        self.document.recompute()
        self.run_to_the_end(study)
        self.assertNotEqual(map_folder(result_of(study)), first)
        answer, _ = self.ask("hit(Plate)", 100)
        self.assertEqual(answer["rays"], 1000)  # what crossed the detector downwards meets the plate below it

    def test_a_study_with_much_in_it_runs(self):
        """Spectral light through a coated and a rough body, a turbid one, and a metal; each source of its own kind."""
        study, lens, plate = self.full_study()
        study.Rays, study.Bands = 3000, 8
        medium = members(study, "RayMaps::Medium")[0]
        medium.Kind, medium.Catalogue = CATALOGUE, "N-BK7"
        milk_box, metal_box = self.box("Milk", (5, 5, 5)), self.box("Metal", (5, 5, 5))
        milk_box.Placement.Base, metal_box.Placement.Base = self.vector(15, 0, 0), self.vector(25, 0, 0)
        milk = make_medium(self.document, study, "milk")
        milk.AbsorptionFile, milk.OutsideTables = self.file("absorption.csv", "400 0.01\n700 0.001\n"), "Clamp"
        set_scatterers(
            milk, [("Henyey-Greenstein", "0.5", 0.8, ""), ("Table file", "0.1", 0, self.file("p", data.PHASE))]
        )
        set_references(milk, [(milk_box, "")])
        silver = make_medium(self.document, study, "silver", kind=CATALOGUE)
        silver.Catalogue = "silver"
        set_references(silver, [(metal_box, "")])
        coat = make_surface_property(self.document, study, "coat", "Thin film")
        coat.LayerMedia, coat.LayerThicknessNm = [milk], [100.0]
        set_references(coat, [(lens, "Face6")])
        rough = make_surface_property(self.document, study, "ground", "Rough")
        set_references(rough, [(lens, "Face1")])
        paint = make_surface_property(self.document, study, "paint", "Coefficients")
        paint.SpecularReflectanceFile, paint.DiffuseReflectance = self.file("c.csv", data.COATING), [0.0]
        paint.OutsideTables = "Clamp"
        black = members(study, "RayMaps::SurfaceProperty")[0]
        set_references(black, [(lens, "Face5")])
        set_references(paint, [(plate, "")])
        for kind, spectrum in (("Sun", "Illuminant"), ("Gaussian beam", "Lines"), ("Luminaire", "Black body")):
            source = make_source(self.document, study, kind, kind)
            source.Placement = self.placement(10, 5, 50, (1, 0, 0), 0 if kind == "Luminaire" else 180)
            source.Spectrum, source.Radius = spectrum, 20
        source.LuminaireFile = self.file("lamp.ies", data.IES)
        make_detector(self.document, study, "Sky", "Far field")
        self.document.recompute()
        self.run_to_the_end(study)
        self.assertTrue(wait_until(lambda: "Simulates" in self.panel.effects_line.text(), 30))
        names = {effect.name for effect in self.panel.tabs.known_effects if effect.needed}
        wanted = {"spectral", "dispersion", "medium_scattering", "medium_absorption", "conductor", "thin_film", "rough"}
        self.assertEqual(wanted - names, set())
        self.ask("true", 100)
        self.panel.tabs.setCurrentIndex(DETECTORS)
        self.assertTrue(wait_until(lambda: self.panel.detectors.names.count() == 2, 30))
        self.assertIn("lm", self.measured("Sky"))
        self.picture_of(self.panel, "spectral.png")

    def file(self, name, content):
        return data.write(self.folder, name, content)

    def test_the_words_about_effects(self):
        text = sentence(EFFECTS)
        self.assertTrue(text.startswith("Simulates 2 of 4 effects: fresnel, medium absorption."), text)
        self.assertIn("Switched off: dispersion (one index)", text)
        self.assertEqual(
            lines(EFFECTS),
            [
                "simulates fresnel because of surface 'a' of body 'x', b and 1 more",
                "simulates medium absorption because of medium 'm'",
                "leaves out dispersion: one index",
            ],
        )
        self.panel._show_effects(EFFECTS)
        tree = self.panel.effects
        rows = [(tree.topLevelItem(i).text(0), tree.topLevelItem(i).text(1)) for i in range(tree.topLevelItemCount())]
        self.assertEqual(
            rows,
            [
                ("fresnel", "surface 'a' of body 'x' (+2)"),
                ("medium absorption", "medium 'm'"),
                ("dispersion", "switched off: one index"),
                ("not needed", "1 effects"),
            ],
        )

    def test_figures_of_any_detector(self):
        text = html(
            {"flux_w": 0.5, "flux_stderr_w": 0.01, "mean_w_per_sr": None, "max_w_per_sr": 2.0, "without": ["abg"]}
        )
        for words in ("500 ± 10 mW", "2 ± 0 W/sr", "abg"):
            self.assertIn(words, text)
        self.assertNotIn("mean", text)
        self.assertIn("table", html({}))

    def test_false_colours(self):
        path = data.write(
            self.folder, "map.csv", '# detector: "a"\nx_mm,y_mm,irradiance_w_per_mm2\n0,0,0\n1,0,1\n0,2,\n1,2,4\n'
        )
        shown = false_colours.read_map(path)
        self.assertEqual((shown.x, shown.y, shown.name), ((-0.5, 1.5), (-1, 3), "W/mm²"))
        self.assertEqual((shown.values[0], shown.values[1][1]), ([0, 1], 4))
        image = false_colours.picture(shown, 300).toImage()
        top_right = QtGui.QColor(image.pixel(int(0.75 * 222), 16 + 20))
        self.assertGreater(top_right.red(), 230)
        bottom_left = QtGui.QColor(image.pixel(30, image.height() - 60))
        self.assertLess(bottom_left.red(), 30)
        self.assertIsNone(
            false_colours.read_map(data.write(self.folder, "faces.csv", "x_mm,y_mm,z_mm,flux_w\n1,2,3,4\n"))
        )
        self.assertIsNone(false_colours.read_map(os.path.join(self.folder, "gone.csv")))
        self.assertEqual(false_colours.colour(float("nan")), (128, 128, 128))

    def test_errors_of_cells(self):
        head = "x_mm,y_mm,flux_w,flux_stderr_w,irradiance_w_per_mm2\n"
        path = data.write(self.folder, "map.csv", head + "0,0,0,1,0\n1,0,2,1,2\n0,2,4,0.1,4\n1,2,1,3,1\n")
        maps = false_colours.read_maps(path)
        errors = maps[false_colours.ERROR]
        self.assertEqual(errors.name, "%")
        self.assertTrue(errors.values[0][0] != errors.values[0][0])
        self.assertEqual((errors.values[0][1], errors.values[1]), (50, [2.5, 300]))
        self.assertIn("known to 50 % or better. Grey: 1 cell without light.", spread(errors.values))
        image = false_colours.picture(errors, 300).toImage()
        grey = QtGui.QColor(image.pixel(30, image.height() - 60))
        self.assertEqual((grey.red(), grey.green(), grey.blue()), (128, 128, 128))
        self.assertGreater(QtGui.QColor(image.pixel(int(0.75 * 222), 16 + 20)).red(), 230)  # 100 % and more
        # In the tab it stands beside the light, where there is a map.
        view = self.panel.detectors
        view.show_answer({"flux_w": 7.0, "flux_stderr_w": 1.0}, path)
        self.assertTrue(view.shown.isVisibleTo(view))
        light = view.picture.pixmap().toImage()
        view.shown.setCurrentIndex(1)
        self.assertNotEqual(view.picture.pixmap().toImage(), light)
        self.assertTrue(view.spread.isVisibleTo(view))
        view.clear()
        self.assertFalse(view.shown.isVisibleTo(view) or view.spread.isVisibleTo(view))


class GlyphsTest(WindowTest):
    def test_every_source_is_drawn_where_it_is(self):
        study, lens, plate = self.full_study()
        for obj in (lens, plate):
            obj.Visibility = False
        view = FreeCADGui.activeDocument().activeView()
        view.setAnimationEnabled(False)
        kinds = ("Gaussian beam", "Sun", "Luminaire", "Ray file", "Crossings", "Cone", "Disc", "Point")
        for i, kind in enumerate(kinds):
            source = make_source(self.document, study, kind, kind)
            source.Placement.Base = self.vector(15 * (i % 4), 25 * (i // 4), 0)
            source.Divergence, source.Radius = 8, 3
        study.Group[1].ViewObject.Visibility = False
        self.document.recompute()
        view.viewAxonometric()
        view.fitAll()
        spin(0.3)
        shown = self.picture("glyphs.png")
        folder = os.environ.get("RAYMAPS_PICTURES")
        if folder:
            shown.save(os.path.join(folder, "glyphs.png"))
        for kind in kinds:
            source = next(obj for obj in study.Group if obj.Label == kind)
            source.ViewObject.Visibility = False
            self.assertNotEqual(shown, self.picture("without.png"), kind)
            source.ViewObject.Visibility = True
        red = next(obj for obj in study.Group if obj.Label == "Disc")
        red.Spectrum = "Lines"
        spin(0.1)
        self.assertNotEqual(shown, self.picture("red.png"))

    def test_detectors_without_a_place_are_not_drawn(self):
        study, _, _ = self.full_study()
        for kind, n in (("Rectangle", True), ("Faces", False), ("Far field", False)):
            detector = make_detector(self.document, study, kind, kind)
            self.assertEqual(detector.ViewObject.Proxy.root.getNumChildren() > 0, n, kind)


class PicturesTest(WindowTest):
    def test_picture_of_panels(self):
        folder = os.environ.get("RAYMAPS_PICTURES") or self.folder
        study = self.open_example("led_collimator", rays=100_000 if "RAYMAPS_PICTURES" in os.environ else 10_000)
        self.run_to_the_end(study)
        FreeCAD.closeDocument(self.document.Name)
        self.ask("from(LED_red)", 60)
        self.panel.tabs.setCurrentIndex(DETECTORS)
        self.assertTrue(wait_until(lambda: self.panel.detectors.names.count() == 2, 30))
        self.panel.detectors.names.setCurrentText("Target")
        self.panel.tabs.measure()
        self.assertTrue(wait_until(lambda: "±" in self.panel.detectors.text.text(), 60))
        window = FreeCADGui.getMainWindow()
        for name in ("Report view", "Python console"):
            window.findChild(QtWidgets.QDockWidget, name).hide()
        combo = window.findChild(QtWidgets.QDockWidget, "Combo View")
        if combo is not None:
            window.resizeDocks([combo, self.panel], [340, 400], QtCore.Qt.Horizontal)
        medium = members(study, "RayMaps::Medium")[0]
        medium.Kind, medium.Catalogue = CATALOGUE, "polycarbonate"
        FreeCADGui.getDocument(study.Document.Name).setEdit(medium.Name, 0)
        FreeCADGui.activeDocument().activeView().fitAll()
        window_picture(os.path.join(folder, "panels.png"))
        self.assertGreater(os.path.getsize(os.path.join(folder, "panels.png")), 50_000)
        FreeCADGui.getDocument(study.Document.Name).resetEdit()
        FreeCADGui.Control.closeDialog()
