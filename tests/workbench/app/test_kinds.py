# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every kind of medium, surface property, source and detector becomes what a scene has for it; the core accepts it."""

import json
import os
import shutil

import data
from support import DocumentTest, ask_core, check_scene

from raymaps_wb.errors import ExportError
from raymaps_wb.export.check import check_study
from raymaps_wb.export.fingerprint import fingerprint
from raymaps_wb.objects import medium as media
from raymaps_wb.objects import source as sources
from raymaps_wb.objects import surface_property as surfaces
from raymaps_wb.objects.catalogue import catalogue, catalogue_medium, catalogue_names, told
from raymaps_wb.objects.detector import make_detector
from raymaps_wb.objects.medium import make_medium, set_scatterers
from raymaps_wb.objects.references import set_references
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import members, studies
from raymaps_wb.objects.surface_property import make_surface_property


class KindsTest(DocumentTest):
    def setUp(self):
        super().setUp()
        self.data = os.path.join(self.folder, "data")
        os.mkdir(self.data)
        self.folder = os.path.join(self.folder, "exported")

    def file(self, name, content):
        return data.write(self.data, name, content)

    def medium(self, study, label, **values):
        obj = make_medium(self.document, study, label)
        for name, value in values.items():
            setattr(obj, name, value)
        return obj

    def surface(self, study, kind, label=None, **values):
        obj = make_surface_property(self.document, study, label or kind, kind)
        for name, value in values.items():
            setattr(obj, name, value)
        return obj

    def source(self, study, kind, label=None, **values):
        obj = make_source(self.document, study, label or kind, kind)
        for name, value in values.items():
            setattr(obj, name, value)
        return obj

    def accepted(self, study):
        """The scene as written; the core has nothing against it, and its files stand beside it."""
        self.document.recompute()
        self.assertEqual([problem.text for problem in check_study(study, distances=False) if problem.blocks], [])
        scene, _ = self.export(study)
        shutil.rmtree(self.data)  # the scene stands alone
        self.assertEqual(check_scene(os.path.join(self.folder, "Study.scene.json")), [])
        return scene


class MediaTest(KindsTest):
    def test_index_absorption_and_extinction(self):
        study, _, _ = self.full_study()
        spectrum = self.file("absorption.csv", data.SPECTRUM)
        self.medium(study, "number", RefractiveIndex=1.4, AbsorptionPerMm=[0.1, 0.2, 0.3], Reference="a book")
        self.medium(study, "formula", Index=media.FORMULA)
        self.medium(study, "cauchy", Index=media.FORMULA, Formula="Cauchy", Coefficients=[1.5, 0.004], FromNm=300)
        table = self.medium(study, "table", Index=media.TABLE, IndexFile=self.file("n.txt", data.INDEX))
        table.AbsorptionFile, table.OutsideTables = spectrum, "Clamp"
        self.medium(study, "silver", RefractiveIndex=0.05, Extinction=[4.0, 3.5, 2.5])
        written = self.accepted(study)["media"]
        self.assertEqual(
            written["number"],
            {"refractive_index": 1.4, "absorption_per_mm": [0.1, 0.2, 0.3], "reference": "a book"},
        )
        index = written["formula"]["refractive_index"]
        self.assertEqual((index["formula"], len(index["coefficients"]), len(index)), ("sellmeier", 6, 2))
        self.assertEqual(
            written["cauchy"]["refractive_index"], {"formula": "cauchy", "coefficients": [1.5, 0.004], "from_nm": 300}
        )
        self.assertEqual(
            written["table"],
            {
                "refractive_index": {"wavelength_nm": [380, 550, 780], "n": [1.53, 1.51, 1.505], "outside": "clamp"},
                "absorption_per_mm": {"file": "Study.files/absorption.csv", "outside": "clamp"},
            },
        )
        self.assertEqual(written["silver"]["extinction"], [4.0, 3.5, 2.5])
        with open(os.path.join(self.folder, "Study.files", "absorption.csv")) as file:
            self.assertEqual(file.read(), data.SPECTRUM)

    def test_scatterers(self):
        study, lens, _ = self.full_study()
        milk = self.medium(study, "milk", RefractiveIndex=1.35)
        set_references(members(study, "RayMaps::Medium")[0], [])
        set_references(milk, [(lens, "")])
        rows = [
            (media.ISOTROPIC, "0.5", 0.0, ""),
            (media.HENYEY_GREENSTEIN, "0.1 0.2 0.3", 0.85, ""),
            (media.PHASE_TABLE, self.file("mus.csv", data.SPECTRUM), 0.0, self.file("phase.txt", data.PHASE)),
        ]
        set_scatterers(milk, rows)
        self.assertEqual(
            self.accepted(study)["media"]["milk"]["scattering"],
            [
                {"coefficient_per_mm": 0.5, "phase": {"kind": "isotropic"}},
                {"coefficient_per_mm": [0.1, 0.2, 0.3], "phase": {"kind": "henyey_greenstein", "g": 0.85}},
                {
                    "coefficient_per_mm": {"file": "Study.files/mus.csv"},
                    "phase": {"kind": "table", "angle_deg": [0, 90, 180], "value": [10, 1, 2]},
                },
            ],
        )

    def test_files(self):
        study, _, _ = self.full_study()
        self.medium(study, "page", Kind=media.FILE, MaterialFile=self.file("N-BK7.yml", data.YAML))
        self.medium(study, "glass", Kind=media.FILE, MaterialFile=self.file("small.agf", data.AGF), Glass="N-SF11")
        written = self.accepted(study)["media"]
        self.assertEqual(written["page"], {"file": "Study.files/N-BK7.yml"})
        self.assertEqual(written["glass"], {"file": "Study.files/small.agf", "glass": "N-SF11"})

    def test_catalogue(self):
        names = catalogue_names()
        self.assertGreater(len(names), 20)
        study, _, _ = self.full_study()
        self.medium(study, "plain", Kind=media.CATALOGUE, Catalogue="N-BK7")
        tinted = self.medium(study, "tinted", Kind=media.CATALOGUE, Catalogue="N-BK7", AbsorptionPerMm=[0.0, 0.1, 0.2])
        set_scatterers(tinted, [(media.ISOTROPIC, "0.5", 0.0, "")])
        written = self.accepted(study)["media"]
        self.assertEqual(written["plain"], {"catalogue": "N-BK7"})
        self.assertEqual(written["tinted"]["refractive_index"], catalogue_medium("N-BK7")["refractive_index"])
        self.assertEqual(written["tinted"]["absorption_per_mm"], [0.0, 0.1, 0.2])
        self.assertEqual(written["tinted"]["scattering"][0]["phase"], {"kind": "isotropic"})

    def test_catalogue_tells_index_and_source(self):
        for group, known in catalogue().items():
            for name, medium in known.items():
                self.assertRegex(told(medium), r"^n = \d", f"{group}: {name}")
                self.assertIn(medium["reference"], told(medium))
        self.assertTrue(told(catalogue_medium("N-BK7")).startswith("n = 1.5168 at 588 nm"))  # Schott's data sheet
        self.assertIn("n = 1.0003 at 588 nm", told(catalogue_medium("air")))
        self.assertRegex(told(catalogue_medium("silver")), r"^n = 0\.\d+ \+ 3\.\d+ i at 588 nm, metal")

    def test_a_medium_that_the_catalogue_has_no_more_is_kept_and_told(self):
        study, _, _ = self.full_study()
        glass = self.medium(study, "glass", Kind=media.CATALOGUE)
        glass.Catalogue = [*catalogue_names(), "Unobtainium"]
        glass.Catalogue = "Unobtainium"
        study = studies(self.reopened(self.document))[0]
        glass = members(study, "RayMaps::Medium")[1]
        self.assertEqual(glass.Catalogue, "Unobtainium")
        texts = [problem.text for problem in check_study(study) if problem.blocks]
        self.assertIn("Medium 'glass': the catalogue has no medium 'Unobtainium'", texts[0])

    def test_formulas_are_those_of_the_core(self):
        code = "import json; from raymaps.materials.dispersion import FORMULAS as F; "
        code += "print(json.dumps({name: [f.counts.start, f.counts.stop, f.counts.step] for name, f in F.items()}))"
        known = json.loads(ask_core(code))
        ours = {name: [counts.start, counts.stop, counts.step] for name, _, counts in media.FORMULAS.values()}
        self.assertEqual(
            {name: list(range(*r)) for name, r in ours.items()}, {n: list(range(*r)) for n, r in known.items()}
        )


class SurfacesTest(KindsTest):
    def test_every_kind(self):
        study, lens, plate = self.full_study()
        spectrum = self.file("white.csv", data.SPECTRUM)
        self.surface(study, "Mirror", ReflectanceFile=spectrum)
        self.surface(study, "Lambertian", Reflectance=[0.5, 0.6, 0.7], Transmittance=[0.1])
        self.surface(study, "Fresnel")
        self.surface(study, "Rough", Roughness=0.3)
        coefficients = self.surface(study, "Coefficients")
        coefficients.SpecularReflectanceFile = self.file("angles.csv", data.ANGLES)
        coefficients.DiffuseReflectance, coefficients.SpecularTransmittance = [0.0], [0.0]
        coated = self.surface(study, "Coefficients", "coated", DiffuseReflectance=[0.0], OutsideTables="Clamp")
        coated.SpecularReflectanceFile = self.file("coating.csv", data.COATING)
        coated.DiffuseTransmittanceFile = spectrum
        self.surface(study, "Gaussian", Reflectance=[0.8], ScatteredShare=0.5, Sigma=0.05)
        self.surface(study, "ABg", Reflectance=[0.95])
        self.surface(study, "BSDF", BsdfFile=self.file("paint.csv", data.BSDF))
        film = self.surface(study, "Thin film")
        silica, titania = (
            self.medium(study, name, RefractiveIndex=n) for name, n in (("silica", 1.46), ("titania", 2.4))
        )
        film.LayerMedia, film.LayerThicknessNm = [silica, titania, silica], [94.2, 57.3, 10]
        black = members(study, "RayMaps::SurfaceProperty")[0]
        mixture = self.surface(study, "Mixture")
        mixture.Parts, mixture.Weights = [black, members(study, "RayMaps::SurfaceProperty")[2]], [0.25, 0.75]
        set_references(film, [(lens, "Face1")])
        set_references(coated, [(plate, "Face6")])
        self.document.recompute()
        written = self.accepted(study)["surfaces"]
        self.assertEqual(
            {name: prop for name, prop in written.items() if name not in ("black", "smooth boundary")},
            {
                "Mirror": {"kind": "mirror", "reflectance": {"file": "Study.files/white.csv"}},
                "Lambertian": {"kind": "lambertian", "reflectance": [0.5, 0.6, 0.7], "transmittance": 0.1},
                "Fresnel": {"kind": "fresnel"},
                "Rough": {"kind": "rough", "roughness": 0.3},
                "Coefficients": {
                    "kind": "coefficients",
                    "specular_reflectance": {"angle_deg": [0, 60, 90], "value": [[0.04], [0.1], [1]]},
                    "specular_transmittance": 0.0,
                    "diffuse_reflectance": 0.0,
                    "diffuse_transmittance": 0.0,
                },
                "coated": {
                    "kind": "coefficients",
                    "specular_reflectance": {
                        "angle_deg": [0, 60],
                        "wavelength_nm": [380, 550, 780],
                        "value": [[0.02, 0.01, 0.02], [0.1, 0.05, 0.1]],
                        "outside": "clamp",
                    },
                    "specular_transmittance": 0.0,
                    "diffuse_reflectance": 0.0,
                    "diffuse_transmittance": {"file": "Study.files/white.csv", "outside": "clamp"},
                },
                "Gaussian": {
                    "kind": "gaussian",
                    "reflectance": 0.8,
                    "transmittance": 0.0,
                    "scattered_share": 0.5,
                    "sigma": 0.05,
                },
                "ABg": {"kind": "abg", "reflectance": 0.95, "transmittance": 0.0, "a": 0.0003, "b": 0.0001, "g": 2.0},
                "BSDF": {"kind": "bsdf", "data": {"file": "Study.files/paint.csv"}},
                "Thin film": {
                    "kind": "thin_film",
                    "layers": [
                        {"medium": "silica", "thickness_nm": 94.2},
                        {"medium": "titania", "thickness_nm": 57.3},
                        {"medium": "silica", "thickness_nm": 10},
                    ],
                },
                "Mixture": {
                    "kind": "mixture",
                    "parts": [{"weight": 0.25, "surface": "black"}, {"weight": 0.75, "surface": "Lambertian"}],
                },
            },
        )
        self.assertEqual({prop["kind"] for prop in written.values()}, set(surfaces.SCENE_KINDS.values()))

    def test_defaults_are_sound(self):
        study, lens, _ = self.full_study()
        layer = self.medium(study, "MgF2", RefractiveIndex=1.38)
        for kind in surfaces.KINDS:
            if kind not in ("Mixture", "BSDF"):
                obj = self.surface(study, kind)
                if kind == "Thin film":
                    obj.LayerMedia, obj.LayerThicknessNm = [layer], [99.6]
        self.assertEqual(len(self.accepted(study)["surfaces"]), len(surfaces.KINDS))
        self.assertIsNotNone(lens)

    def test_layers_repeat_and_survive(self):
        study, _, _ = self.full_study()
        film = self.surface(study, "Thin film")
        high, low = (self.medium(study, name, RefractiveIndex=n) for name, n in (("H", 2.3), ("L", 1.46)))
        film.LayerMedia, film.LayerThicknessNm = [high, low] * 5, [59.8, 94.2] * 5
        before = fingerprint(study)
        study = studies(self.reopened(self.document))[0]
        self.assertEqual(fingerprint(study), before)
        layers = self.export(study)[0]["surfaces"]["Thin film"]["layers"]
        self.assertEqual([layer["medium"] for layer in layers], ["H", "L"] * 5)


class SourcesTest(KindsTest):
    def test_every_kind(self):
        study, lens, _ = self.full_study()
        place = self.placement(1, 2, 3, (1, 0, 0), 90)  # z turns to -y
        self.source(study, "Cone", HalfAngle=20)
        self.source(study, "Disc", Radius=4)
        self.source(study, "Gaussian beam", WaistRadius=0.25, Divergence=0.5, RayShare=3)
        self.source(study, "Sun", Radius=30)
        self.source(study, "Luminaire", LuminaireFile=self.file("lamp.ies", data.IES))
        self.source(study, "Ray file", RayFile=self.file("led.dat", data.zemax_rays()))
        glow = self.source(study, "Faces", Emission=sources.COSINE_POWER, Exponent=20)
        set_references(glow, [(lens, "Face6"), (lens, "Face2")])
        spot = self.source(study, "Faces", "spot", Emission=sources.TABLE)
        spot.EmissionFile = self.file("emission.csv", data.EMISSION)
        set_references(spot, [(lens, "Face1")])
        for source in members(study, "RayMaps::Source"):
            source.Placement = place
        written = self.accepted(study)["sources"]
        common = {"flux_w": 1.0, "rgb": [1.0, 1.0, 1.0]}
        placed = {**common, "position_mm": [1, 2, 3]}
        aimed = {**placed, "direction": [0, -1, 0]}
        self.assertEqual(
            written,
            {
                "Source": {"kind": "point", **placed},
                "Cone": {"kind": "cone", **aimed, "half_angle_deg": 20},
                "Disc": {"kind": "disc", **aimed, "radius_mm": 4},
                "Gaussian beam": {
                    "kind": "gaussian_beam",
                    **aimed,
                    "ray_share": 3,
                    "waist_radius_mm": 0.25,
                    "divergence_deg": 0.5,
                },
                "Sun": {"kind": "sun", **aimed, "radius_mm": 30, "angular_radius_deg": 0.2665},
                "Luminaire": {
                    "kind": "luminaire",
                    **placed,
                    "direction": [0, 1, 0],
                    "c0_direction": [1, 0, 0],
                    "intensity": {"file": "Study.files/lamp.ies"},
                },
                "Ray file": {
                    "kind": "rays",
                    **placed,
                    "z_axis": [0, -1, 0],
                    "x_axis": [1, 0, 0],
                    "file": "Study.files/led.dat",
                },
                "Faces": {
                    "kind": "faces",
                    **common,
                    "body": "Lens",
                    "faces": ["Face2", "Face6"],
                    "emission": {"kind": "cosine_power", "exponent": 20},
                },
                "spot": {
                    "kind": "faces",
                    **common,
                    "body": "Lens",
                    "faces": ["Face1"],
                    "emission": {"kind": "table", "angle_deg": [0, 45, 90], "value": [1, 0.5, 0]},
                },
            },
        )
        self.assertEqual(
            {source["kind"] for source in written.values()}, set(sources.SCENE_KINDS.values()) - {"crossings"}
        )

    def test_crossings_of_another_map(self):
        study, _, _ = self.full_study()
        folder = os.path.join(self.data, "lamp.raymap")
        os.mkdir(folder)
        with open(os.path.join(folder, "manifest.json"), "w") as file:
            json.dump({"names": {"detectors": ["Exit"]}}, file)
        self.source(study, "Crossings", MapFolder=folder, MapDetector="Exit")
        written = self.export(study)[0]["sources"]["Crossings"]
        self.assertEqual((written["map"], written["detector"]), ("../data/lamp.raymap", "Exit"))
        before = fingerprint(study)
        with open(os.path.join(folder, "manifest.json"), "a") as file:
            file.write("\n")
        self.assertNotEqual(fingerprint(study), before)
        shutil.rmtree(folder)
        with self.assertRaisesRegex(ExportError, "Source 'Crossings': .* is not a Ray Map"):
            self.export(study)

    def test_every_spectrum(self):
        study, _, _ = self.full_study()
        self.source(study, "Point", "coloured", RGB=[1, 0.5, 0])
        self.source(
            study, "Point", "table", Spectrum=sources.SPECTRUM_FILE, SpectrumFile=self.file("led.csv", data.SPECTRUM)
        )
        self.source(study, "Point", "lines", Spectrum=sources.LINES, LinesNm=[632.8, 543.5], LineShares=[3, 1])
        self.source(study, "Point", "laser", Spectrum=sources.LINES)
        self.source(study, "Point", "bulb", Spectrum=sources.BLACK_BODY, TemperatureK=2700)
        self.source(study, "Point", "daylight", Spectrum=sources.ILLUMINANT)
        written = {name: source.get("spectrum") for name, source in self.accepted(study)["sources"].items()}
        self.assertEqual(
            written,
            {
                "Source": None,
                "coloured": None,
                "table": {"kind": "file", "file": "Study.files/led.csv"},
                "lines": {"kind": "lines", "wavelength_nm": [543.5, 632.8], "share": [1, 3]},
                "laser": {"kind": "lines", "wavelength_nm": [632.8]},
                "bulb": {"kind": "black_body", "temperature_k": 2700},
                "daylight": {"kind": "illuminant", "name": "D65"},
            },
        )

    def test_illuminants_are_those_of_the_core(self):
        code = "import json, numpy as np; from raymaps.spectral_data import illuminant; "
        code += (
            f"print(json.dumps([float(illuminant(np.array([560.0]), name)[0]) for name in {sources.ILLUMINANTS!r}]))"
        )
        self.assertTrue(all(value > 0 for value in json.loads(ask_core(code))))


class DetectorsTest(KindsTest):
    def test_every_kind(self):
        study, _, plate = self.full_study()
        lit = make_detector(self.document, study, "Lit", "Faces")
        set_references(lit, [(plate, "Face6")])
        whole = make_detector(self.document, study, "Whole", "Faces")
        set_references(whole, [(plate, "")])
        whole.Measure = "Absorbed"
        sky = make_detector(self.document, study, "Sky", "Far field")
        sky.Placement, sky.ResolutionC = self.placement(5, 6, 7, (1, 0, 0), 180), 24
        written = self.accepted(study)["detectors"]
        self.assertEqual(written["Detector"]["kind"], "rectangle")
        self.assertEqual(written["Lit"], {"kind": "face", "body": "Plate", "faces": ["Face6"], "measure": "incident"})
        self.assertEqual(written["Whole"], {"kind": "face", "body": "Plate", "measure": "absorbed"})
        self.assertEqual(
            written["Sky"], {"kind": "far_field", "axis": [0, 0, 1], "x_axis": [1, 0, 0], "resolution": [24, 36]}
        )

    def test_faces_without_faces(self):
        study, lens, plate = self.full_study()
        lit = make_detector(self.document, study, "Lit", "Faces")
        texts = [problem.text for problem in check_study(study) if problem.blocks]
        self.assertEqual(
            texts, ["Detector 'Lit': it registers light on faces and has none; pick the faces of one body."]
        )
        set_references(lit, [(plate, ""), (lens, "")])
        self.assertIn("more than one body", check_study(study)[0].text)


class SettingsTest(KindsTest):
    def test_spectral_settings(self):
        study, _, _ = self.full_study()
        study.SpectrumFromNm, study.SpectrumToNm, study.Bands = 400, 1000, 60
        study.Observer, study.Store, study.Without = "CIE 1964, 10°", "Spectral", ["dispersion", "dispersion", " "]
        before = fingerprint(study)
        study = studies(self.reopened(self.document))[0]
        self.assertEqual(fingerprint(study), before)
        self.document = study.Document
        self.assertEqual(
            self.accepted(study)["settings"],
            {
                "rays": 100_000,
                "seed": 1,
                "max_events": 1000,
                "roulette_threshold": 0.1,
                "spectrum": {"from_nm": 400.0, "to_nm": 1000.0, "bands": 60, "observer": "cie_1964_10deg"},
                "store": "spectral",
                "without": ["dispersion"],
            },
        )

    def test_a_range_upside_down(self):
        study, _, _ = self.full_study()
        study.SpectrumFromNm = 800
        texts = [problem.text for problem in check_study(study) if problem.blocks]
        self.assertEqual(
            texts, ["Study: the spectrum must go from a shorter to a longer wavelength, got 800 to 780 nm."]
        )
