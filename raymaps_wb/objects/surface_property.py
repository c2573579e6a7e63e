# SPDX-License-Identifier: LGPL-2.1-or-later
"""SurfaceProperty: what light meets on a face."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.properties import Limits, Property, Proxy, make_object, only_added
from raymaps_wb.objects.references import references_property
from raymaps_wb.objects.spectral import outside_property, spectral

KINDS = {
    "Absorber": "absorbs all light",
    "Mirror": "reflects specularly, and absorbs the rest",
    "Lambertian": "matte: reflects and transmits diffusely, equally bright from all sides",
    "Fresnel": "polished: the smooth boundary of a body with a medium, clear or metal",
    "Rough": "ground or brushed: the rough boundary of a body with a medium, clear or metal (GGX)",
    "Coefficients": "given shares of specular and diffuse reflection and transmission, over wavelength and angle",
    "Thin film": "polished with a stack of thin layers: antireflection coating, dielectric mirror, filter",
    "Gaussian": "part of what is reflected or transmitted scatters about that direction with a Gaussian lobe",
    "ABg": "a polished surface that scatters a little about the specular direction, by the ABg model",
    "BSDF": "measured scattering from a file: own CSV, Klems XML of WINDOW, or ASTM E1392",
    "Mixture": "several surface properties side by side, each meeting a share of the light",
}
#: Name of each kind in a scene.
SCENE_KINDS = {kind: kind.lower().replace(" ", "_") for kind in KINDS}

_BOTH = ("Lambertian", "Gaussian", "ABg")
_SPECTRAL = ("Mirror", "Coefficients", *_BOTH)


def _share(name, text, default):
    return spectral(name, text, default, file=name + "File", shown_for=("Coefficients",), form="share")


class SurfaceProperty(Proxy):
    """Optical property of the bodies and faces that it refers to; on a face it wins over that of the face's body."""

    TYPE = "RayMaps::SurfaceProperty"
    SCHEMA = 2
    MIGRATIONS = {1: only_added}
    PROPERTIES = (
        Property("App::PropertyEnumeration", "Kind", "What it does with light", "Absorber", choices=KINDS),
        *spectral(
            "Reflectance",
            "Share of the light that is reflected, 0 to 1",
            [0.9],
            file="ReflectanceFile",
            shown_for=("Mirror", *_BOTH),
        ),
        *spectral(
            "Transmittance",
            "Share of the light that passes, 0 to 1",
            [0.0],
            file="TransmittanceFile",
            shown_for=_BOTH,
        ),
        *_share("SpecularReflectance", "Share that is reflected as by a mirror, 0 to 1", [0.05]),
        *_share("DiffuseReflectance", "Share that is reflected diffusely, 0 to 1", [0.8]),
        *_share("SpecularTransmittance", "Share that passes and is refracted, 0 to 1", [0.0]),
        *_share("DiffuseTransmittance", "Share that passes diffusely, 0 to 1", [0.0]),
        Property(
            "App::PropertyFloat",
            "Roughness",
            "Typical slope of the microfacets, alpha of GGX: 0.05 satin, 0.2 brushed, 0.5 ground",
            0.2,
            shown_for=("Rough",),
            limits=Limits(0.001, 1),
        ),
        Property(
            "App::PropertyFloat",
            "ScatteredShare",
            "Share of what is reflected or transmitted that scatters, 0 to 1; the rest goes on specularly",
            1.0,
            shown_for=("Gaussian",),
            limits=Limits(0, 1),
        ),
        Property(
            "App::PropertyFloat",
            "Sigma",
            "Width of the lobe in direction cosines: 0.1 is about 6 degrees at normal incidence",
            0.1,
            label="Lobe width σ",
            shown_for=("Gaussian",),
            limits=Limits(1e-5, 2),
        ),
        Property(
            "App::PropertyFloat",
            "AbgA",
            "A of BSDF = A / (B + |β - β0|^g), in 1/sr; with B = 0.0001 and g = 2, A = 0.0003 scatters 0.9 %",
            0.0003,
            label="A (1/sr)",
            shown_for=("ABg",),
            limits=Limits(0),
        ),
        Property(
            "App::PropertyFloat",
            "AbgB",
            "B of BSDF = A / (B + |β - β0|^g); the lobe is flat inside |β - β0| = B^(1/g)",
            0.0001,
            label="B",
            shown_for=("ABg",),
            limits=Limits(0, low_is_allowed=False),
        ),
        Property(
            "App::PropertyFloat",
            "AbgG",
            "Exponent g of BSDF = A / (B + |β - β0|^g): 1 to 3 for polished surfaces",
            2.0,
            label="g",
            shown_for=("ABg",),
            limits=Limits(0, 10),
        ),
        Property(
            "App::PropertyFile",
            "BsdfFile",
            "Measured BSDF: own CSV, Klems XML of WINDOW, or ASTM E1392",
            "",
            label="File",
            form="bsdf",
            filter="BSDF (*.csv *.xml *.txt *.asm *.astm *.dat);;All files (*)",
            shown_for=("BSDF",),
        ),
        Property(
            "App::PropertyLinkListGlobal",
            "LayerMedia",
            "Medium of each layer, from the outside of the body inwards; metals too",
            label="Layers, from the outside inwards",
            shown_for=("Thin film",),
        ),
        Property(
            "App::PropertyFloatList",
            "LayerThicknessNm",
            "Thickness of each layer in nm, in the order of the media: a quarter wave of MgF2 at 550 nm is 99.6",
            shown_for=("Thin film",),
        ),
        Property(
            "App::PropertyLinkListGlobal",
            "Parts",
            "Surface properties that the mixture is made of",
            shown_for=("Mixture",),
        ),
        Property(
            "App::PropertyFloatList",
            "Weights",
            "Share of the light that meets each part, in the order of the parts; they add up to 1",
            shown_for=("Mixture",),
        ),
        outside_property(_SPECTRAL),
        references_property("Bodies and faces with this property"),
    )


def make_surface_property(document, study=None, label=None, kind="Absorber"):
    """Add a new surface property."""
    obj = make_object(document, "App::FeaturePython", SurfaceProperty, label or translate("Surface"), study)
    obj.Kind = kind
    return obj
