# SPDX-License-Identifier: LGPL-2.1-or-later
"""Source: where light comes from."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.properties import Limits, Property, Proxy, make_object, only_added
from raymaps_wb.objects.references import references_property
from raymaps_wb.objects.spectral import TEXT_FILES

KINDS = {
    "Faces": "faces of a body shine outwards",
    "Point": "a point that shines alike in all directions",
    "Cone": "a point that shines evenly into a cone",
    "Disc": "a parallel beam of constant irradiance",
    "Gaussian beam": "a laser beam: Gaussian at its waist, and in angle",
    "Sun": "light of a far disc, such as the sun, through a disc across its way",
    "Luminaire": "a point with measured intensity: IES LM-63 (*.ies) or EULUMDAT (*.ldt)",
    "Ray file": "rays of a source model: IES TM-25 (*.tm25ray) or Zemax (*.dat)",
    "Crossings": "the rays that crossed a detector of another Ray Map, from there on",
}
#: Name of each kind in a scene.
SCENE_KINDS = {**{kind: kind.lower().replace(" ", "_") for kind in KINDS}, "Ray file": "rays"}

LAMBERTIAN, COSINE_POWER, TABLE = "Lambertian", "Cosine power", "Table file"
EMISSIONS = {
    LAMBERTIAN: "equally bright from all sides",
    COSINE_POWER: "intensity falls as a power of the cosine of the angle to the normal; a large one is a narrow beam",
    TABLE: "a file with two columns, angle to the normal in degrees and relative intensity",
}
RGB, SPECTRUM_FILE, LINES, BLACK_BODY, ILLUMINANT = "RGB", "Table file", "Lines", "Black body", "Illuminant"
SPECTRA = {
    RGB: "relative flux of red, green and blue",
    SPECTRUM_FILE: "a file with two columns, wavelength in nm and relative flux per nm",
    LINES: "single wavelengths, as of a laser or a spectral lamp",
    BLACK_BODY: "Planck's spectrum, as of a lamp with a filament",
    ILLUMINANT: "a standard illuminant of the CIE",
}
ILLUMINANTS = (
    *("A", "B", "C", "D50", "D55", "D60", "D65", "D75", "E", "ID50", "ID65"),
    *(f"FL{i}" for i in range(1, 13)),
    *(f"FL3.{i}" for i in range(1, 16)),
    *(f"HP{i}" for i in range(1, 6)),
    *("LED-B1", "LED-B2", "LED-B3", "LED-B4", "LED-B5", "LED-BH1", "LED-RGB1", "LED-V1", "LED-V2"),
)


class Source(Proxy):
    """A light source. All but faces stand at their placement and shine along its z axis, a luminaire along -z."""

    TYPE = "RayMaps::Source"
    SCHEMA = 2
    MIGRATIONS = {1: only_added}
    WITHOUT_PLACEMENT = ("Faces",)
    PROPERTIES = (
        Property("App::PropertyEnumeration", "Kind", "How it shines", "Point", choices=KINDS),
        Property(
            "App::PropertyFloat",
            "FluxW",
            "Radiant flux in W, over all wavelengths that are simulated",
            1.0,
            label="Flux (W)",
            limits=Limits(0, 1e100, " W", low_is_allowed=False),
        ),
        Property(
            "App::PropertyAngle",
            "HalfAngle",
            "Angle between the axis and the edge of the cone, in degrees",
            10.0,
            shown_for=("Cone",),
            limits=Limits(0, 180, " degrees", low_is_allowed=False),
        ),
        Property(
            "App::PropertyLength",
            "Radius",
            "Radius of the beam, in mm; of the sun: of the disc that its light passes through",
            5.0,
            shown_for=("Disc", "Sun"),
            limits=Limits(0, unit=" mm", low_is_allowed=False),
        ),
        Property(
            "App::PropertyLength",
            "WaistRadius",
            "Radius of the waist in mm, where the irradiance is 1/e² of that in the middle",
            0.5,
            shown_for=("Gaussian beam",),
            is_exact=True,
            limits=Limits(0, unit=" mm", low_is_allowed=False),
        ),
        Property(
            "App::PropertyAngle",
            "Divergence",
            "Half angle in degrees at which the intensity is 1/e²; a laser of 0.5 mm waist and 633 nm has 0.023",
            0.0,
            shown_for=("Gaussian beam",),
            is_exact=True,
            limits=Limits(0, 45, " degrees"),
        ),
        Property(
            "App::PropertyAngle",
            "AngularRadius",
            "Angular radius of the far disc in degrees; 0.2665 for the sun",
            0.2665,
            shown_for=("Sun",),
            is_exact=True,
            limits=Limits(0, 89.999, " degrees"),
        ),
        Property(
            "App::PropertyEnumeration",
            "Emission",
            "How the intensity falls with the angle to the normal",
            LAMBERTIAN,
            choices=EMISSIONS,
            shown_for=("Faces",),
        ),
        Property(
            "App::PropertyFloat",
            "Exponent",
            "Exponent of the cosine: 1 is Lambertian, 20 halves the intensity at 15 degrees",
            1.0,
            shown_for=("Faces",),
            when={"Emission": (COSINE_POWER,)},
            limits=Limits(0, 1e6),
        ),
        Property(
            "App::PropertyFile",
            "EmissionFile",
            "Relative intensity: a file with two columns, angle to the normal from 0 to 90 degrees and value",
            "",
            label="File",
            form="emission",
            filter=TEXT_FILES,
            shown_for=("Faces",),
            when={"Emission": (TABLE,)},
        ),
        references_property("Faces of one body that emit", ("Faces",)),
        Property(
            "App::PropertyFile",
            "LuminaireFile",
            "Luminous intensity: IES LM-63 or EULUMDAT; the file's lumens are not used, the flux in W is",
            "",
            label="File",
            form="luminaire",
            filter="Luminaires (*.ies *.ldt);;All files (*)",
            shown_for=("Luminaire",),
        ),
        Property(
            "App::PropertyFile",
            "RayFile",
            "Rays in the coordinates of the placement: IES TM-25 or Zemax .DAT; drawn by their flux, with replacement",
            "",
            label="File",
            form="rays",
            filter="Ray files (*.tm25ray *.dat);;All files (*)",
            shown_for=("Ray file",),
        ),
        Property(
            "App::PropertyPath",
            "MapFolder",
            "Folder of another Ray Map, NAME.raymap, on one of whose detectors the rays start",
            "",
            label="Ray Map",
            form="map",
            shown_for=("Crossings",),
        ),
        Property(
            "App::PropertyString",
            "MapDetector",
            "Which detector of that Ray Map",
            "",
            label="Its detector",
            shown_for=("Crossings",),
        ),
        Property(
            "App::PropertyEnumeration",
            "Spectrum",
            "What colour the light has",
            RGB,
            label="Colour",
            choices=SPECTRA,
        ),
        Property(
            "App::PropertyFloatList",
            "RGB",
            "Relative flux of red, green and blue; white is 1 1 1, and leaves the colours of a ray file as they are",
            [1.0, 1.0, 1.0],
            label="R G B",
            when={"Spectrum": (RGB,)},
        ),
        Property(
            "App::PropertyFile",
            "SpectrumFile",
            "Spectrum: a file with two columns, wavelength in nm and relative flux per nm; zero outside",
            "",
            label="File",
            form="spectrum",
            filter=TEXT_FILES,
            when={"Spectrum": (SPECTRUM_FILE,)},
        ),
        Property(
            "App::PropertyFloatList",
            "LinesNm",
            "Wavelengths of the lines in nm, such as 632.8 for a helium-neon laser",
            [632.8],
            label="Lines (nm)",
            when={"Spectrum": (LINES,)},
            limits=Limits(10, 1e6, " nm"),
        ),
        Property(
            "App::PropertyFloatList",
            "LineShares",
            "Relative flux of each line, in their order; none: all alike",
            [],
            label="Line shares",
            when={"Spectrum": (LINES,)},
            limits=Limits(0, low_is_allowed=False),
        ),
        Property(
            "App::PropertyFloat",
            "TemperatureK",
            "Temperature of the black body in K: 2700 a warm lamp, 5772 the sun",
            2856.0,
            label="Temperature (K)",
            when={"Spectrum": (BLACK_BODY,)},
            limits=Limits(500, 100_000, " K"),
        ),
        Property(
            "App::PropertyEnumeration",
            "Illuminant",
            "Illuminant of the CIE: A a filament lamp, D65 daylight, FL fluorescent, HP high pressure, LED",
            "D65",
            choices=ILLUMINANTS,
            keeps_unknown=True,
            when={"Spectrum": (ILLUMINANT,)},
        ),
        Property(
            "App::PropertyFloat",
            "RayShare",
            "Share of the rays relative to other sources, whose share is their flux in W; 0: by its flux, too",
            0.0,
            label="Ray share",
            limits=Limits(0, 1e100),
        ),
    )


def make_source(document, study=None, label=None, kind="Point"):
    """Add a new source."""
    obj = make_object(document, "App::GeometryPython", Source, label or translate("Source"), study)
    obj.Kind = kind
    return obj
