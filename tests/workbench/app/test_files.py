# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files that a study speaks of: copied beside the scene, part of the fingerprint, and told when missing or damaged."""

import os
import shutil

import data
import FreeCAD
from support import DocumentTest

from raymaps_wb.errors import ExportError
from raymaps_wb.export import tables
from raymaps_wb.export.check import check_study
from raymaps_wb.export.fingerprint import ShapeMeasures, fingerprint
from raymaps_wb.objects import medium as media
from raymaps_wb.objects import source as sources
from raymaps_wb.objects.files import absolute_path, kept_path
from raymaps_wb.objects.medium import make_medium, set_scatterers
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import members, studies
from raymaps_wb.objects.surface_property import make_surface_property


class FilesTest(DocumentTest):
    def file(self, name, content):
        return data.write(self.folder, name, content)

    def blocking(self, study):
        return [problem.text for problem in check_study(study, distances=False) if problem.blocks]

    def test_missing_files_are_told_in_one_sentence(self):
        study, _, _ = self.full_study()
        gone = os.path.join(self.folder, "gone.csv")
        medium = make_medium(self.document, study, "glass")
        mirror = make_surface_property(self.document, study, "shiny", "Mirror")
        bsdf = make_surface_property(self.document, study, "paint", "BSDF")
        lamp = make_source(self.document, study, "lamp", "Luminaire")
        cases = [
            (mirror, {"ReflectanceFile": gone}, {"ReflectanceFile": ""}, "Surface property 'shiny'"),
            (bsdf, {"BsdfFile": gone}, {"Kind": "Absorber"}, "Surface property 'paint'"),
            (medium, {"AbsorptionFile": gone}, {"AbsorptionFile": ""}, "Medium 'glass'"),
            (medium, {"Index": "Table file", "IndexFile": gone}, {"Index": "Number"}, "Medium 'glass'"),
            (medium, {"Kind": "File", "MaterialFile": gone}, {"Kind": "Own values"}, "Medium 'glass'"),
            (lamp, {"LuminaireFile": gone}, {"Kind": "Ray file"}, "Source 'lamp'"),
            (lamp, {"RayFile": gone}, {"Kind": "Point"}, "Source 'lamp'"),
            (lamp, {"Spectrum": "Table file", "SpectrumFile": gone}, {"Spectrum": "RGB"}, "Source 'lamp'"),
        ]
        bsdf.BsdfFile = lamp.LuminaireFile = self.file("something.txt", "0 1")
        for obj, wrong, right, where in cases:
            for name, value in wrong.items():
                setattr(obj, name, value)
            (text,) = self.blocking(study)
            self.assertTrue(text.startswith(f"{where}: the file '{gone}' ("), text)
            self.assertTrue(text.endswith(") is not there; put it back, or choose another."), text)
            for name, value in wrong.items():
                setattr(obj, name, "") if value == gone and name.endswith("File") else None
            for name, value in right.items():
                setattr(obj, name, value)
        self.assertEqual(self.blocking(study), [])

    def test_no_file_chosen(self):
        study, _, _ = self.full_study()
        for kind, words in (("Luminaire", "IES or LDT"), ("Ray file", "rays")):
            source = make_source(self.document, study, "lamp", kind)
            self.assertEqual(self.blocking(study), [f"Source 'lamp': it needs a file ({words}); choose one."])
            self.document.removeObject(source.Name)
        source = make_source(self.document, study, "lamp", "Crossings")
        self.assertEqual(
            self.blocking(study), ["Source 'lamp': it starts from a Ray Map and has none; choose its folder."]
        )

    def test_scatterers_in_words(self):
        study, _, _ = self.full_study()
        milk = make_medium(self.document, study, "milk")
        phase = self.file("half.txt", "0 1\n90 1\n")
        cases = [
            ((media.ISOTROPIC, "", 0.0, ""), "needs a coefficient of 0 or more in 1/mm, got ''"),
            ((media.ISOTROPIC, "-1", 0.0, ""), "got '-1'"),
            ((media.ISOTROPIC, "1 2", 0.0, ""), "one value or three"),
            ((media.HENYEY_GREENSTEIN, "1", 1.0, ""), "above -1 and below 1, got 1"),
            ((media.PHASE_TABLE, "1", 0.0, ""), "needs a file (phase function)"),
            ((media.PHASE_TABLE, "1", 0.0, phase), "from 0 to 180 degrees"),
            (("Mie", "1", 0.0, ""), "no kind of scatterers 'Mie'; known: Isotropic, Henyey-Greenstein, Table file"),
            ((media.ISOTROPIC, "mus.csv", 0.0, ""), "is not there"),
        ]
        for row, words in cases:
            set_scatterers(milk, [row])
            (text,) = self.blocking(study)
            self.assertIn(words, text)
            self.assertTrue(text.startswith("Medium 'milk': "), text)

    def test_thin_films_in_words(self):
        study, _, _ = self.full_study()
        film = make_surface_property(self.document, study, "film", "Thin film")
        self.assertIn("needs layers", self.blocking(study)[0])
        film.LayerMedia, film.LayerThicknessNm = [members(study, "RayMaps::Medium")[0]], [0.0]
        self.assertIn("above 0 and at most 1000000 nm, got 0 nm", self.blocking(study)[0])
        film.LayerThicknessNm = [1.0, 2.0]
        self.assertIn("got 1 media and 2 thicknesses", self.blocking(study)[0])
        film.LayerMedia, film.LayerThicknessNm = [make_medium(self.document, None, "elsewhere")], [1.0]
        self.assertIn("'elsewhere' is not a medium of this study", self.blocking(study)[0])

    def test_formulas_in_words(self):
        study, _, _ = self.full_study()
        glass = make_medium(self.document, study, "glass")
        glass.Index, glass.Formula, glass.Coefficients = media.FORMULA, "Conrady", [1.5]
        self.assertIn("the formula Conrady takes 3 coefficients, got 1: n = n0 + A/λ", self.blocking(study)[0])
        glass.Coefficients, glass.FromNm, glass.ToNm = [1.5, 0.01, 0.001], 800, 400
        self.assertIn("from a shorter to a longer wavelength, got 800 to 400 nm", self.blocking(study)[0])

    def test_spectra_of_sources_in_words(self):
        study, _, _ = self.full_study()
        source = members(study, "RayMaps::Source")[0]
        source.Spectrum = sources.LINES
        for lines, shares, words in (
            ([], [], "has none"),
            ([500], [1, 2], "1 lines need as many shares"),
            ([500, 500], [], "stands twice"),
            ([5], [], "must be at least 10 and at most 1e+06 nm, got 5 nm"),
        ):
            source.LinesNm, source.LineShares = lines, shares
            self.assertIn(words, " ".join(self.blocking(study)))
        source.Spectrum, source.TemperatureK = sources.BLACK_BODY, 20
        self.assertIn("the temperature must be at least 500 and at most 100000 K, got 20 K", self.blocking(study)[0])

    def test_shares_in_words(self):
        study, _, _ = self.full_study()
        prop = make_surface_property(self.document, study, "white", "Coefficients")
        prop.DiffuseReflectance, prop.SpecularReflectance = [0.9], [0.1, 0.2, 0.1]
        (text,) = self.blocking(study)
        self.assertTrue(text.endswith("together must be at most 1 in each colour."), text)
        prop.DiffuseReflectance = [1.2]
        self.assertIn("white: the diffuse reflectance must be at least 0 and at most 1, got 1.2.", self.blocking(study))

    def test_damaged_tables(self):
        cases = [
            (tables.spectrum, "", "holds no line with numbers"),
            (tables.spectrum, "nm,value\n", "holds no line with numbers"),
            (tables.spectrum, "400 1\n500 x\n", "line 2: '500 x' is not numbers"),
            (tables.spectrum, "400 1\n500 nan\n", "not finite"),
            (tables.spectrum, "400 1\n500\n", "line 2: 2 numbers are needed, got 1"),
            (tables.spectrum, "400 1 2\n", "two columns are needed"),
            (tables.spectrum, "500 1\n400 1\n", "400 follows 500"),
            (tables.spectrum, "0.4 1\n0.7 1\n", "got 0.4 (1 µm is 1000 nm)"),
            (tables.spectrum, b"\x00\x01\x02", "not a text file"),
            (tables.index_table, "1e9 1.5\n", "from 10 to 1000000"),
            (lambda path: tables.over_angle(path, 90), "0 1\n95 1\n", "from 0 to 90 degrees, got 0 to 95"),
            (lambda path: tables.over_angle(path, 90), "5 1\n90 1\n", "the first angle must be 0, got 5"),
            (tables.share_over_angle, "angle 400 500\n0 1\n", "wavelength in nm of each of the 1 columns"),
            (tables.share_over_angle, "angle value\n0 1 2\n", "wavelength in nm of each of the 2 columns"),
            (tables.share_over_angle, "angle value\n0\n", "an angle and a value"),
        ]
        for reader, content, words in cases:
            path = self.file("damaged.csv", content)
            with self.subTest(words), self.assertRaises(ExportError) as caught:
                reader(path)
            self.assertIn(words, str(caught.exception))

    def test_tables_of_spreadsheets(self):
        self.assertEqual(
            tables.spectrum(self.file("a.csv", "\ufeffWavelength;Value\r\n# mine\r\n400;0.5\r\n500;0.25\r\n")),
            {"wavelength_nm": [400, 500], "value": [0.5, 0.25]},
        )
        self.assertEqual(tables.spectrum(self.file("b.txt", "400\t1\n500\t2\n".encode("utf-16")))["value"], [1, 2])
        self.assertEqual(
            tables.share_over_angle(self.file("c.csv", "AOI,450nm,550nm\n0,0.1,0.2\n45,0.3,0.4\n")),
            {"angle_deg": [0, 45], "wavelength_nm": [450, 550], "value": [[0.1, 0.2], [0.3, 0.4]]},
        )

    def test_the_content_of_a_file_is_part_of_the_fingerprint(self):
        study, _, _ = self.full_study()
        mirror = make_surface_property(self.document, study, "shiny", "Mirror")
        mirror.ReflectanceFile = path = self.file("r.csv", data.SPECTRUM)
        measures = ShapeMeasures()
        before = fingerprint(study, measures)
        self.assertEqual(fingerprint(study, measures), before)
        self.file("r.csv", data.SPECTRUM.replace("0.4", "0.5"))
        os.utime(path, (1, 1))
        self.assertNotEqual(fingerprint(study, measures), before)
        self.file("r.csv", data.SPECTRUM)
        self.assertEqual(fingerprint(study, measures), before)

    def test_files_of_the_same_name_are_told_apart(self):
        study, _, _ = self.full_study()
        for i, value in enumerate((0.1, 0.2)):
            os.mkdir(os.path.join(self.folder, str(i)))
            mirror = make_surface_property(self.document, study, f"m{i}", "Mirror")
            mirror.ReflectanceFile = self.file(f"{i}/R curve.csv", f"400 {value}\n700 {value}\n")
        scene, _ = self.export(study)
        names = [scene["surfaces"][name]["reflectance"]["file"] for name in ("m0", "m1")]
        self.assertEqual(names, ["Study.files/R_curve.csv", "Study.files/R_curve_2.csv"])
        with open(os.path.join(self.folder, names[1])) as file:
            self.assertIn("400 0.2", file.read())

    def test_a_document_moves_with_its_files(self):
        study, _, _ = self.full_study()
        home = os.path.join(self.folder, "a")
        os.makedirs(os.path.join(home, "spectra"))
        path = data.write(home, "spectra/r.csv", data.SPECTRUM)
        self.document.saveAs(os.path.join(home, "test.FCStd"))
        mirror = make_surface_property(self.document, study, "shiny", "Mirror")
        mirror.ReflectanceFile = kept_path(self.document, path)
        self.assertEqual(mirror.ReflectanceFile, "spectra/r.csv")
        self.assertEqual(absolute_path(self.document, "spectra/r.csv"), path)
        elsewhere = data.write(self.folder, "far.csv", data.SPECTRUM)
        self.assertEqual(kept_path(self.document, elsewhere), elsewhere)
        self.document.save()
        FreeCAD.closeDocument(self.document.Name)
        moved = os.path.join(self.folder, "b")
        shutil.move(home, moved)
        study = studies(FreeCAD.openDocument(os.path.join(moved, "test.FCStd")))[0]
        scene, _ = self.export(study)
        self.assertEqual(scene["surfaces"]["shiny"]["reflectance"], {"file": "Study.files/r.csv"})
