# SPDX-License-Identifier: LGPL-2.1-or-later
"""Study: the container of everything that one simulation needs, and its settings."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.properties import Limits, Property, Proxy, make_object, only_added, type_of

OBSERVERS = {
    "CIE 1931, 2°": "cie_1931_2deg",
    "CIE 1964, 10°": "cie_1964_10deg",
}
STORES = {
    "RGB": "the light of each event in three bands: small",
    "Spectral": "in all bands of a spectral simulation: larger, and spectra can be asked for afterwards",
}
RANDOM, SOBOL = "Random", "Sobol"
SAMPLING = {
    RANDOM: "rays are independent of each other",
    SOBOL: "rays are spread evenly by Sobol's sequence; where light takes few steps, fewer rays do",
}
EXACT, FACETED = "Exact", "Faceted"
SURFACES = {
    EXACT: "light meets the exact surfaces of CAD faces; where one has none, its triangles",
    FACETED: "light meets the flat triangles of all faces",
}


class Study(Proxy):
    """A group of media, surface properties, sources, detectors and a result."""

    TYPE = "RayMaps::Study"
    SCHEMA = 4
    MIGRATIONS = {1: only_added, 2: only_added, 3: only_added}
    PROPERTIES = (
        Property("App::PropertyInteger", "Rays", "Number of rays to simulate", 100_000, limits=Limits(1, 1e12)),
        Property(
            "App::PropertyInteger",
            "Seed",
            "Seed of all random numbers: the same seed gives the same rays",
            1,
            limits=Limits(0, 2**31),
        ),
        Property(
            "App::PropertyEnumeration",
            "Sampling",
            "How rays are drawn",
            RANDOM,
            choices=SAMPLING,
        ),
        Property(
            "App::PropertyInteger",
            "MaxEvents",
            "A ray with more events than this is ended, and recorded so",
            1000,
            limits=Limits(2, 100_000),
        ),
        Property(
            "App::PropertyFloat",
            "RouletteThreshold",
            "Share of its light (0 to 1) below which losses on surfaces end a ray by chance instead of dimming it",
            0.1,
            limits=Limits(0, 1),
        ),
        Property(
            "App::PropertyEnumeration",
            "Surfaces",
            "What light meets where a face is curved",
            EXACT,
            choices=SURFACES,
        ),
        Property(
            "App::PropertyLength",
            "ChordTolerance",
            "Largest distance of the triangles to the CAD surface, in mm",
            0.02,
            limits=Limits(0, unit=" mm", low_is_allowed=False),
        ),
        Property(
            "App::PropertyAngle",
            "AngularDeflection",
            "Largest angle between neighbouring triangles, in degrees",
            6.0,
            limits=Limits(0, 90, " degrees", low_is_allowed=False),
        ),
        Property("App::PropertyLinkGlobal", "AmbientMedium", "Medium outside all bodies; none: vacuum"),
        Property(
            "App::PropertyFloat",
            "SpectrumFromNm",
            "Shortest wavelength of a spectral simulation, in nm; light of shorter ones is left out",
            380.0,
            label="Spectrum from (nm)",
            limits=Limits(10, 1e6, " nm"),
        ),
        Property(
            "App::PropertyFloat",
            "SpectrumToNm",
            "Longest wavelength of a spectral simulation, in nm",
            780.0,
            label="Spectrum to (nm)",
            limits=Limits(10, 1e6, " nm"),
        ),
        Property(
            "App::PropertyInteger",
            "Bands",
            "Number of equal bands in which a spectral simulation carries light; 32 makes 12.5 nm from 380 to 780 nm",
            32,
            label="Bands",
            limits=Limits(1, 1000),
        ),
        Property(
            "App::PropertyEnumeration",
            "Observer",
            "Standard observer behind the colours of a spectral simulation",
            next(iter(OBSERVERS)),
            choices=tuple(OBSERVERS),
        ),
        Property("App::PropertyEnumeration", "Store", "What is stored of a spectral simulation", "RGB", choices=STORES),
        Property(
            "App::PropertyStringList",
            "Without",
            "Effects that are switched off, by name, such as fresnel; the panel of the study lists them",
            [],
            label="Effects that a run simulates",
        ),
    )


def make_study(document, label=None):
    """Add a new study to a document."""
    return make_object(document, "App::DocumentObjectGroupPython", Study, label or translate("Study"))


def studies(document):
    """All studies of a document."""
    return [obj for obj in document.Objects if type_of(obj) == Study.TYPE] if document is not None else []


def study_of(obj):
    """The study that an object belongs to (or is); None if there is none."""
    if type_of(obj) == Study.TYPE:
        return obj
    for parent in obj.InList:
        if type_of(parent) == Study.TYPE and obj in parent.Group:
            return parent
    return None


def members(study, member_type):
    """Members of a study with one of our types, in the order of the tree, also those in sub-groups."""
    found, queue = [], list(study.Group)
    while queue:
        obj = queue.pop(0)
        if type_of(obj) == member_type:
            found.append(obj)
        elif obj.isDerivedFrom("App::DocumentObjectGroup") and type_of(obj) != Study.TYPE:
            queue = list(obj.Group) + queue
    return found
