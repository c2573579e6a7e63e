# SPDX-License-Identifier: LGPL-2.1-or-later
"""Task panels: each kind shows its own fields, and what is typed becomes what the object holds."""

import json
import os

import data
import FreeCADGui

from gui.window import WindowTest, spin, wait_until
from raymaps_wb.compat import QtCore, QtWidgets, flags_as_int
from raymaps_wb.export.check import check_study
from raymaps_wb.export.fingerprint import fingerprint
from raymaps_wb.objects import medium as media
from raymaps_wb.objects import source as sources
from raymaps_wb.objects import surface_property as surfaces
from raymaps_wb.objects.detector import make_detector
from raymaps_wb.objects.medium import make_medium, scatterers
from raymaps_wb.objects.references import reference_list
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import members
from raymaps_wb.objects.surface_property import make_surface_property
from raymaps_wb.taskpanels.findings import finding
from raymaps_wb.tracer.explain import Effect


class PanelTest(WindowTest):
    def setUp(self):
        super().setUp()
        self.study_, self.lens, self.plate = self.full_study()
        self.addCleanup(FreeCADGui.Control.closeDialog)

    def file(self, name, content):
        return data.write(self.folder, name, content)

    def panel_of(self, obj, name=""):
        """The open task panel of an object."""
        FreeCADGui.Control.closeDialog()
        panel = obj.ViewObject.Proxy.panel(obj)
        panel.begin(False)
        FreeCADGui.Control.showDialog(panel)
        spin(0.05)
        return panel

    def picture_of(self, panel, name):
        """Keep a picture of a panel where pictures are wanted."""
        folder = os.environ.get("RAYMAPS_PICTURES")
        if folder:
            spin(0.2)
            panel.form.grab().save(os.path.join(folder, f"panel_{name}.png".replace(" ", "_")))

    def choose(self, panel, **choices):
        for name, choice in choices.items():
            panel.editors[name].widget.setCurrentText(choice)
        spin(0.02)

    def shown(self, panel):
        return {name for name, row in panel._rows.items() if row.isVisibleTo(panel.form)}


class KindsTest(PanelTest):
    def test_sources(self):
        source = make_source(self.document, self.study_, "lamp")
        panel = self.panel_of(source)
        always = {"Kind", "FluxW", "Spectrum", "RGB", "RayShare"}
        fields = {
            "Point": set(),
            "Cone": {"HalfAngle"},
            "Disc": {"Radius"},
            "Gaussian beam": {"WaistRadius", "Divergence"},
            "Sun": {"Radius", "AngularRadius"},
            "Luminaire": {"LuminaireFile"},
            "Ray file": {"RayFile"},
            "Crossings": {"MapFolder", "MapDetector"},
            "Faces": {"References", "Emission"},
        }
        self.assertEqual(set(fields), set(sources.KINDS))
        for kind, own in fields.items():
            self.choose(panel, Kind=kind)
            self.assertEqual(self.shown(panel), always | own, kind)
            self.assertEqual(panel._place.isVisibleTo(panel.form), kind != "Faces")
            self.picture_of(panel, f"source_{kind}")
        self.choose(panel, Emission="Cosine power")
        self.assertEqual(self.shown(panel), always | {"References", "Emission", "Exponent"})
        for spectrum, own in (
            ("Lines", {"LinesNm", "LineShares"}),
            ("Black body", {"TemperatureK"}),
            ("Illuminant", {"Illuminant"}),
            ("Table file", {"SpectrumFile"}),
        ):
            self.choose(panel, Kind="Point", Spectrum=spectrum)
            self.assertEqual(self.shown(panel), (always - {"RGB"}) | own)
            self.picture_of(panel, f"spectrum_{spectrum}")

    def test_surface_properties(self):
        prop = make_surface_property(self.document, self.study_, "coat")
        panel = self.panel_of(prop)
        both, always = {"Reflectance", "Transmittance"}, {"Kind", "References"}
        shares = {f"{how}{what}" for how in ("Specular", "Diffuse") for what in ("Reflectance", "Transmittance")}
        fields = {
            "Absorber": set(),
            "Mirror": {"Reflectance"},
            "Lambertian": both,
            "Fresnel": set(),
            "Rough": {"Roughness"},
            "Coefficients": shares,
            "Thin film": {"LayerMedia"},
            "Gaussian": both | {"ScatteredShare", "Sigma"},
            "ABg": both | {"AbgA", "AbgB", "AbgG"},
            "BSDF": {"BsdfFile"},
            "Mixture": set(),
        }
        self.assertEqual(set(fields), set(surfaces.KINDS))
        for kind, own in fields.items():
            self.choose(panel, Kind=kind)
            self.assertEqual(self.shown(panel), always | own, kind)
            self.assertEqual(panel._table.isVisibleTo(panel.form), kind == "Mixture")
            self.picture_of(panel, f"surface_{kind}")

    def test_media(self):
        medium = make_medium(self.document, self.study_, "stuff")
        panel = self.panel_of(medium)
        always = {"Kind", "Priority", "References"}
        mixed = {"AbsorptionPerMm", "ScatteringKinds"}
        own = mixed | {"Index", "Extinction", "Reference"}
        self.choose(panel, Kind=media.CATALOGUE)
        self.assertEqual(self.shown(panel), always | mixed | {"Catalogue"})
        self.picture_of(panel, "medium_catalogue")
        self.choose(panel, Kind=media.FILE)
        self.assertEqual(self.shown(panel), always | {"MaterialFile", "Glass"})
        self.picture_of(panel, "medium_file")
        for index, more in (
            ("Number", {"RefractiveIndex"}),
            ("Formula", {"Formula", "Coefficients", "FromNm", "ToNm"}),
            ("Table file", {"IndexFile", "OutsideTables"}),
        ):
            self.choose(panel, Kind=media.OWN, Index=index)
            self.assertEqual(self.shown(panel), always | own | more)
            self.picture_of(panel, f"medium_{index}")

    def test_detectors(self):
        detector = make_detector(self.document, self.study_, "eye")
        panel = self.panel_of(detector)
        for kind, own in (
            ("Rectangle", {"Width", "Height", "ResolutionX", "ResolutionY", "Side", "MaxAngle"}),
            ("Faces", {"References", "Measure"}),
            ("Far field", {"ResolutionC", "ResolutionGamma"}),
        ):
            self.choose(panel, Kind=kind)
            self.assertEqual(self.shown(panel), {"Kind"} | own, kind)
            self.picture_of(panel, f"detector_{kind}")

    def test_every_panel_writes_back_what_it_showed(self):
        spectrum, ies = self.file("s.csv", data.SPECTRUM), self.file("l.ies", data.IES)
        milk = make_medium(self.document, self.study_, "milk")
        media.set_scatterers(milk, [("Isotropic", "0.5", 0.0, ""), ("Henyey-Greenstein", spectrum, 0.9, "")])
        glass = make_medium(self.document, self.study_, "glass", kind=media.CATALOGUE)
        glass.AbsorptionFile = spectrum
        page = make_medium(self.document, self.study_, "page", kind=media.FILE)
        page.MaterialFile, page.Glass = self.file("small.agf", data.AGF), "N-SF11"
        film = make_surface_property(self.document, self.study_, "film", "Thin film")
        film.LayerMedia, film.LayerThicknessNm = [glass, milk, glass], [10.5, 20, 30]
        white = make_surface_property(self.document, self.study_, "white", "Coefficients")
        white.DiffuseReflectanceFile, white.SpecularReflectance = spectrum, [0.01, 0.02, 0.03]
        lamp = make_source(self.document, self.study_, "lamp", "Luminaire")
        lamp.LuminaireFile, lamp.Spectrum, lamp.Illuminant = ies, "Illuminant", "LED-B3"
        laser = make_source(self.document, self.study_, "laser", "Gaussian beam")
        laser.Spectrum, laser.LinesNm, laser.LineShares = "Lines", [632.8123456, 700], [1, 2]
        sky = make_detector(self.document, self.study_, "sky", "Far field")
        sky.ResolutionC = 24
        self.study_.Store, self.study_.SpectrumToNm, self.study_.Without = "Spectral", 790, ["dispersion"]
        self.study_.Surfaces, milk.Priority, glass.Priority = "Faceted", -3, 7
        self.document.recompute()
        before = fingerprint(self.study_)
        for obj in [self.study_, *self.study_.Group]:
            panel = self.panel_of(obj)
            self.assertTrue(panel.accept(), f"{obj.Label}: {panel._message.text()}")
        self.assertEqual(fingerprint(self.study_), before)


class EditorsTest(PanelTest):
    def test_a_value_changes_its_form(self):
        mirror = make_surface_property(self.document, self.study_, "m", "Mirror")
        panel = self.panel_of(mirror)
        editor = panel.editors["Reflectance"]
        editor.forms.setCurrentIndex(editor.COLOUR)
        self.assertEqual(editor.widget.text(), "0.9 0.9 0.9")
        editor.widget.setText("0.9 0.6 0.3")
        self.assertTrue(panel.accept())
        self.assertEqual((list(mirror.Reflectance), mirror.ReflectanceFile), ([0.9, 0.6, 0.3], ""))

        panel = self.panel_of(mirror)
        editor = panel.editors["Reflectance"]
        self.assertEqual(editor.forms.currentIndex(), editor.COLOUR)
        editor.forms.setCurrentIndex(editor.FILE)
        self.assertFalse(panel.accept())
        self.assertEqual(panel._message.text(), "Reflectance: choose a file.")
        editor._file.widget.setText(self.file("silver.csv", data.SPECTRUM))
        self.assertEqual(editor._file.about.text(), "3 rows, 380 to 780 nm, values 0.2 to 0.8")
        self.picture_of(panel, "value_file")
        self.assertTrue(panel.accept())
        self.assertTrue(mirror.ReflectanceFile.endswith("silver.csv"))

        panel = self.panel_of(mirror)
        editor = panel.editors["Reflectance"]
        self.assertEqual(editor.forms.currentIndex(), editor.FILE)
        editor.forms.setCurrentIndex(editor.NUMBER)
        self.assertEqual(editor.widget.text(), "0.6")
        self.assertTrue(panel.accept())
        self.assertEqual((list(mirror.Reflectance), mirror.ReflectanceFile), ([0.6], ""))

    def test_numbers_that_are_not_shown_are_not_asked_for(self):
        source = make_source(self.document, self.study_, "s", "Cone")
        panel = self.panel_of(source)
        panel.editors["RGB"].widget.setText("red")
        self.assertFalse(panel.accept())
        self.choose(panel, Spectrum="Black body")
        self.assertTrue(panel.accept())
        self.assertEqual((list(source.RGB), source.Spectrum), ([1, 1, 1], "Black body"))

    def test_the_catalogue_is_searched(self):
        before = len(members(self.study_, "RayMaps::Medium"))
        FreeCADGui.Selection.clearSelection()
        FreeCADGui.Selection.addSelection(self.document.Name, self.plate.Name)
        FreeCADGui.runCommand("RayMaps_Medium")
        medium = members(self.study_, "RayMaps::Medium")[before]
        self.assertEqual((medium.Kind, medium.Catalogue), (media.CATALOGUE, "N-BK7"))
        FreeCADGui.getDocument(self.document.Name).resetEdit()
        panel = self.panel_of(medium)
        panel._is_new, panel._given = True, panel._name.text()
        editor = panel.editors["Catalogue"]
        self.assertIn("n = 1.5168", editor._about.text())
        editor.widget.setText("metal silver")
        visible = [name for name, item in editor._items.items() if not item.isHidden() and not item.parent().isHidden()]
        self.assertEqual(visible, ["silver"])
        self.picture_of(panel, "catalogue_search")
        editor.choose("silver")
        self.assertEqual(panel._name.text(), "silver")
        self.assertIn("metal", editor._about.text())
        editor.widget.setText("")
        self.assertTrue(panel.accept())
        self.assertEqual((medium.Catalogue, medium.Label), ("silver", "silver"))
        self.assertEqual(reference_list(medium), [(self.plate, "")])

    def test_scatterers(self):
        milk = make_medium(self.document, self.study_, "milk")
        panel = self.panel_of(milk)
        editor = panel.editors["ScatteringKinds"]
        editor.add()
        editor.add()
        kinds, coefficient, _ = (editor.widget.cellWidget(1, i) for i in range(3))
        kinds.setCurrentText("Table file")
        coefficient.setText("0.1 0.2 0.3")
        self.assertFalse(panel.accept())
        self.assertIn("choose the file", panel._message.text())
        editor.widget.cellWidget(1, 2).detail._file.setText(self.file("phase.txt", data.PHASE))
        self.picture_of(panel, "medium_scattering")
        self.assertTrue(panel.accept())
        self.assertEqual(
            [row[:3] for row in scatterers(milk)],
            [("Henyey-Greenstein", "0.1", 0.8), ("Table file", "0.1 0.2 0.3", 0.8)],
        )
        panel = self.panel_of(milk)
        editor = panel.editors["ScatteringKinds"]
        editor.widget.selectRow(0)
        editor._remove()
        self.assertTrue(panel.accept())
        self.assertEqual([row[0] for row in scatterers(milk)], ["Table file"])

    def test_layers_bring_their_media(self):
        film = make_surface_property(self.document, self.study_, "film", "Thin film")
        panel = self.panel_of(film)
        editor = panel.editors["LayerMedia"]
        self.assertEqual([row[1:] for row in editor.rows()], [("MgF2", "99.6")])
        editor._remove()
        self.assertFalse(panel.accept())
        self.assertIn("add its layers", panel._message.text())
        for _ in range(3):
            editor.add()
        pmma = editor.widget.cellWidget(1, 0)
        pmma.setCurrentIndex(pmma.findText("PMMA"))
        editor.widget.cellWidget(1, 1).setText("60,5")
        editor.widget.selectRow(1)
        editor._move(-1)
        self.picture_of(panel, "surface_layers")
        self.assertTrue(panel.accept())
        self.assertEqual([layer.Label for layer in film.LayerMedia], ["PMMA", "MgF2", "MgF2"])
        self.assertEqual(list(film.LayerThicknessNm), [60.5, 99.6, 99.6])
        self.assertEqual(film.LayerMedia[1].Catalogue, "MgF2")
        self.assertEqual(film.LayerMedia[0], members(self.study_, "RayMaps::Medium")[0])
        self.assertEqual([p.text for p in check_study(self.study_) if p.blocks], [])
        self.document.undo()
        self.assertEqual(len(members(self.study_, "RayMaps::Medium")), 1)

    def test_glasses_and_detectors_of_files_are_offered(self):
        medium = make_medium(self.document, self.study_, "g", kind=media.FILE)
        panel = self.panel_of(medium)
        panel.editors["MaterialFile"].widget.setText(self.file("small.agf", data.AGF))
        glass = panel.editors["Glass"].widget
        self.assertEqual([glass.itemText(i) for i in range(glass.count())], ["N-BK7", "N-SF11"])
        glass.setCurrentText("N-SF11")
        self.assertTrue(panel.accept())
        self.assertEqual(medium.Glass, "N-SF11")
        folder = os.path.join(self.folder, "lamp.raymap")
        os.mkdir(folder)
        data.write(folder, "manifest.json", json.dumps({"names": {"detectors": ["Exit", "Wall"]}}))
        source = make_source(self.document, self.study_, "again", "Crossings")
        panel = self.panel_of(source)
        panel.editors["MapFolder"].widget.setText(folder)
        self.assertEqual(panel.editors["MapDetector"].widget.currentText(), "Exit")
        self.picture_of(panel, "source_crossings_chosen")
        self.assertTrue(panel.accept())
        self.assertEqual((source.MapFolder, source.MapDetector), (folder, "Exit"))

    def test_what_a_file_holds_is_told(self):
        for name, content, form, words, is_right in (
            ("a.csv", data.SPECTRUM, "spectrum", "3 rows, 380 to 780 nm", True),
            ("b.csv", data.ANGLES, "share", "3 rows, 0 to 90°, values 0.04 to 1", True),
            ("c.csv", data.COATING, "share", "3 wavelengths", True),
            ("d.csv", "0 0.1\n80 0.2\n", "share", "begins with a line such as angle_deg", False),
            ("e.ies", data.IES, "luminaire", "IES LM-63", True),
            ("f.ies", "hello", "luminaire", "neither an IES file", False),
            ("g.dat", data.zemax_rays(12345), "rays", "Zemax source file, 12\u202f345 rays", True),
            ("h.agf", data.AGF, "material", "glass catalogue of Zemax, 2 glasses", True),
            ("i.yml", data.YAML, "material", "page of refractiveindex.info", True),
            ("j.yml", "a: b", "material", "neither", False),
            ("k.csv", data.BSDF, "bsdf", "BSDF as text", True),
            ("l.csv", "400 1\n300 1\n", "spectrum", "300 follows 400", False),
        ):
            text, right = finding(self.file(name, content), form)
            self.assertIn(words, text)
            self.assertEqual(right, is_right, name)
        self.assertEqual(finding(os.path.join(self.folder, "gone"), "map"), ("there is no such file", False))


class EffectsTest(PanelTest):
    def test_effects_of_a_study(self):
        self.study_.Without = ["fresnel", "magic"]
        panel = self.panel_of(self.study_)
        editor = panel.editors["Without"]
        self.assertTrue(wait_until(lambda: editor.widget.topLevelItemCount() > 0, 30), editor._about.text())
        found = [editor.widget.topLevelItem(i) for i in range(editor.widget.topLevelItemCount())]
        items = {item.text(0): item for item in found}
        self.assertEqual(items["crossings"].checkState(0), QtCore.Qt.Checked)
        self.assertIn("body 'Lens'", items["fresnel"].text(1))
        self.assertEqual(items["fresnel"].checkState(0), QtCore.Qt.Unchecked)
        self.assertFalse(flags_as_int(items["absorber"].flags() & QtCore.Qt.ItemIsUserCheckable))
        self.assertIn("2 effects; switched off: fresnel. There is no effect 'magic'", editor._about.text())
        self.assertNotIn("mirror", items)
        self.picture_of(panel, "study")
        items["fresnel"].setCheckState(0, QtCore.Qt.Checked)
        items["crossings"].setCheckState(0, QtCore.Qt.Unchecked)
        self.assertTrue(panel.accept())
        self.assertEqual(list(self.study_.Without), ["crossings"])

    def test_effects_as_they_come(self):
        panel = self.panel_of(self.study_)
        editor = panel.editors["Without"]
        editor.show(
            [
                Effect("fresnel", "smooth interfaces", True, ("a", "b", "c"), ""),
                Effect("abg", "polished surfaces", False, (), ""),
                Effect("dispersion", "index over wavelength", False, (), "one index"),
            ]
        )
        first, last = editor.widget.topLevelItem(0), editor.widget.topLevelItem(1)
        self.assertEqual((first.text(1), first.childCount()), ("a (+2)", 3))
        self.assertEqual((last.text(0), last.childCount()), ("not needed", 2))
        self.assertEqual(editor._about.text(), "A run simulates 1 effect.")

    def test_a_study_that_can_not_be_written(self):
        members(self.study_, "RayMaps::Source")[0].RGB = [1]
        panel = self.panel_of(self.study_)
        self.assertIn("RGB takes three values", panel.editors["Without"]._about.text())
        self.assertIsNotNone(panel.form.findChild(QtWidgets.QTreeWidget))
