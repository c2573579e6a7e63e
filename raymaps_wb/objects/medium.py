# SPDX-License-Identifier: LGPL-2.1-or-later
"""Medium: what fills a body."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.catalogue import catalogue_names
from raymaps_wb.objects.properties import Limits, Property, Proxy, make_object, only_added
from raymaps_wb.objects.references import references_property
from raymaps_wb.objects.spectral import TEXT_FILES, outside_property, spectral

#: Common media without dispersion: refractive index near 588 nm.
PRESETS = {
    "Air": 1.000273,
    "Water": 1.333,
    "Fused silica": 1.4585,
    "PMMA": 1.4914,
    "BK7": 1.5168,
    "Polycarbonate": 1.585,
    "SF11": 1.7847,
}

CATALOGUE, OWN, FILE = "Catalogue", "Own values", "File"
KINDS = {
    CATALOGUE: "glass, plastic, liquid or metal of the catalogue that comes with Ray Maps, with dispersion",
    OWN: "index, absorption and scattering that you give",
    FILE: "data of refractiveindex.info (YAML), or a glass of a Zemax catalogue (AGF)",
}
NUMBER, FORMULA, TABLE = "Number", "Formula", "Table file"
INDEX_FORMS = {
    NUMBER: "one refractive index for all wavelengths",
    FORMULA: "a dispersion formula and its coefficients, for wavelengths in µm",
    TABLE: "a file with two columns, wavelength in nm and refractive index",
}
#: Formula as people know it: its name in a scene, equation with its coefficients, and allowed numbers of them.
FORMULAS = {
    "Sellmeier": (
        "sellmeier",
        "n² = 1 + Σ Bλ² / (λ² − C): B1 C1 B2 C2 B3 C3",
        range(2, 21, 2),
    ),
    "Schott": (
        "schott",
        "n² = a0 + a1λ² + a2λ⁻² + a3λ⁻⁴ + ...: a0 a1 a2 a3 a4 a5",
        range(2, 9),
    ),
    "Cauchy": ("cauchy", "n = A + Bλ⁻² + Cλ⁻⁴ + ...: A B C", range(1, 9)),
    "Conrady": ("conrady", "n = n0 + A/λ + B/λ^3.5: n0 A B", range(3, 4)),
    "Herzberger": (
        "herzberger",
        "n = A + BL + CL² + Dλ² + Eλ⁴ + Fλ⁶, L = 1/(λ² − 0.028): A B C D E F",
        range(3, 7),
    ),
    "Sellmeier with powers": (
        "sellmeier_powers",
        "n² = c0 + s1 λ^e1/(λ² − p1) + s2 λ^e2/(λ² − p2) + Σ cλ^e: c0 s1 e1 p1 s2 e2 p2 c1 e1 ...",
        range(7, 16, 2),
    ),
    "Power series": ("power_series", "n = c0 + Σ cλ^e: c0 c1 e1 c2 e2 ...", range(1, 20, 2)),
    "Power series of n²": (
        "power_series_squared",
        "n² = c0 + Σ cλ^e: c0 c1 e1 c2 e2 ...",
        range(1, 20, 2),
    ),
    "Gases": ("gases", "n = 1 + c0 + Σ B/(C − λ⁻²): c0 B1 C1 B2 C2 ...", range(1, 18, 2)),
    "Lorentz-Lorenz": (
        "lorentz_lorenz",
        "(n² − 1)/(n² + 2) = c0 + Bλ²/(λ² − C) + Dλ²: c0 B C D",
        range(4, 5),
    ),
    "Damped": (
        "damped",
        "n² = c0 + B/(λ² − C) + D(λ − E)/((λ − E)² + F): c0 B C D E F",
        range(6, 7),
    ),
}
ISOTROPIC, HENYEY_GREENSTEIN, PHASE_TABLE = "Isotropic", "Henyey-Greenstein", "Table file"
PHASES = (ISOTROPIC, HENYEY_GREENSTEIN, PHASE_TABLE)
SCATTERING = ("ScatteringKinds", "ScatteringPerMm", "ScatteringG", "ScatteringFiles")

_NOT_A_FILE = (CATALOGUE, OWN)


class Medium(Proxy):
    """A clear, absorbing or scattering medium or a metal, inside the bodies that it refers to."""

    TYPE = "RayMaps::Medium"
    SCHEMA = 3
    MIGRATIONS = {1: only_added, 2: only_added}
    PROPERTIES = (
        Property("App::PropertyEnumeration", "Kind", "Where its figures come from", OWN, choices=KINDS),
        Property(
            "App::PropertyEnumeration",
            "Catalogue",
            "Medium of the catalogue; its panel tells the source of each",
            "N-BK7",
            label="Medium",
            choices=catalogue_names,
            keeps_unknown=True,
            shown_for=(CATALOGUE,),
        ),
        Property(
            "App::PropertyFile",
            "MaterialFile",
            "A page of refractiveindex.info as YAML (*.yml), or a glass catalogue of Zemax (*.agf)",
            "",
            label="File",
            form="material",
            filter="Materials (*.yml *.yaml *.agf);;All files (*)",
            shown_for=(FILE,),
        ),
        Property(
            "App::PropertyString",
            "Glass",
            "Which glass of a Zemax catalogue, such as N-BK7; a YAML file holds one only",
            "",
            shown_for=(FILE,),
        ),
        Property(
            "App::PropertyEnumeration",
            "Index",
            "How the refractive index is given",
            NUMBER,
            label="Index given by",
            choices=INDEX_FORMS,
            shown_for=(OWN,),
        ),
        Property(
            "App::PropertyFloat",
            "RefractiveIndex",
            "Refractive index, such as 1.5168 for BK7",
            1.4914,
            shown_for=(OWN,),
            when={"Index": (NUMBER,)},
            limits=Limits(0, 10, low_is_allowed=False),
        ),
        Property(
            "App::PropertyEnumeration",
            "Formula",
            "Dispersion formula, λ in µm",
            "Sellmeier",
            choices={name: equation for name, (_, equation, _) in FORMULAS.items()},
            shown_for=(OWN,),
            when={"Index": (FORMULA,)},
        ),
        Property(
            "App::PropertyFloatList",
            "Coefficients",
            "Coefficients in the order of the formula, for wavelengths in µm; at first those of N-BK7",
            [1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653],
            shown_for=(OWN,),
            when={"Index": (FORMULA,)},
        ),
        Property(
            "App::PropertyFloat",
            "FromNm",
            "Shortest wavelength at which the formula holds, in nm; 0: wherever it gives a physical index",
            0.0,
            label="Holds from (nm)",
            shown_for=(OWN,),
            when={"Index": (FORMULA,)},
            limits=Limits(0, 1e6, " nm"),
        ),
        Property(
            "App::PropertyFloat",
            "ToNm",
            "Longest wavelength at which the formula holds, in nm; 0: wherever it gives a physical index",
            0.0,
            label="Holds to (nm)",
            shown_for=(OWN,),
            when={"Index": (FORMULA,)},
            limits=Limits(0, 1e6, " nm"),
        ),
        Property(
            "App::PropertyFile",
            "IndexFile",
            "Refractive index: a file with two columns, wavelength in nm and index",
            "",
            label="File",
            form="index",
            filter=TEXT_FILES,
            shown_for=(OWN,),
            when={"Index": (TABLE,)},
        ),
        *spectral(
            "AbsorptionPerMm",
            "Absorption coefficient a in 1/mm: exp(-a d) is left after d mm; 0 for a medium of the catalogue: its own",
            [0.0],
            file="AbsorptionFile",
            label="Absorption (1/mm)",
            limits=Limits(0, unit=" 1/mm"),
            shown_for=_NOT_A_FILE,
        ),
        *spectral(
            "Extinction",
            "Imaginary part k of the index n + ik of a metal; 0 for what light can travel in",
            [0.0],
            file="ExtinctionFile",
            label="Extinction k (metals)",
            limits=Limits(0),
            shown_for=(OWN,),
        ),
        Property(
            "App::PropertyStringList",
            "ScatteringKinds",
            f"Scatterers in the medium, a line each: {', '.join(PHASES)}",
            label="Scattering",
            shown_for=_NOT_A_FILE,
        ),
        Property(
            "App::PropertyStringList",
            "ScatteringPerMm",
            "Scattering coefficient of each in 1/mm: one number, three for red, green and blue, or a spectrum file",
            shown_for=_NOT_A_FILE,
        ),
        Property(
            "App::PropertyFloatList",
            "ScatteringG",
            "Mean cosine g of the scattering angle of each, -1 to 1, for Henyey-Greenstein: 0.9 is strongly forward",
            shown_for=_NOT_A_FILE,
        ),
        Property(
            "App::PropertyStringList",
            "ScatteringFiles",
            "Phase function of each that is a table: a file with two columns, angle from 0 to 180 degrees and value",
            shown_for=_NOT_A_FILE,
        ),
        outside_property(_NOT_A_FILE),
        Property(
            "App::PropertyString",
            "Reference",
            "Where your figures come from, for the record",
            "",
            shown_for=(OWN,),
        ),
        Property(
            "App::PropertyInteger",
            "Priority",
            "Where bodies overlap, the medium of the higher priority rules; of equals that of the smaller body",
            0,
            limits=Limits(-100_000, 100_000),
        ),
        references_property("Bodies filled with this medium"),
    )


def make_medium(document, study=None, label=None, preset=None, kind=OWN):
    """Add a new medium, perhaps with the values of a preset."""
    obj = make_object(document, "App::FeaturePython", Medium, label or preset or translate("Medium"), study)
    obj.Kind = kind
    if preset:
        obj.RefractiveIndex = PRESETS[preset]
    return obj


def scatterers(obj):
    """Scatterers of a medium: a list of (kind, coefficient as text, g, phase function file), as far as given."""
    kinds = list(obj.ScatteringKinds)
    columns = [list(getattr(obj, name)) for name in SCATTERING[1:]]
    filled = [
        column + [empty] * (len(kinds) - len(column)) for column, empty in zip(columns, ("", 0.0, ""), strict=True)
    ]
    return list(zip(kinds, *[column[: len(kinds)] for column in filled], strict=True))


def set_scatterers(obj, rows):
    """Set the scatterers from rows of (kind, coefficient as text, g, phase function file)."""
    columns = list(zip(*rows, strict=True)) or [()] * len(SCATTERING)
    for name, column in zip(SCATTERING, columns, strict=True):
        setattr(obj, name, list(column))
