# SPDX-License-Identifier: LGPL-2.1-or-later
"""SurfaceProperty: what light meets on a face."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.properties import Property, Proxy, make_object
from raymaps_wb.objects.references import references_property

KINDS = ("Absorber", "Mirror", "Lambertian", "Fresnel", "Mixture")


class SurfaceProperty(Proxy):
    """Optical property of the bodies and faces that it refers to; on a face it wins over that of the face's body."""

    TYPE = "RayMaps::SurfaceProperty"
    PROPERTIES = (
        Property(
            "App::PropertyEnumeration",
            "Kind",
            "Absorber; Mirror; Lambertian: diffuse reflection and transmission; Fresnel: smooth boundary of two media; "
            "Mixture: several properties side by side",
            "Absorber",
            choices=KINDS,
        ),
        Property(
            "App::PropertyFloatList",
            "Reflectance",
            "Share of the light that is reflected, 0 to 1: one value, or one for each of red, green and blue",
            [0.9],
            shown_for=("Mirror", "Lambertian"),
        ),
        Property(
            "App::PropertyFloatList",
            "Transmittance",
            "Share of the light that passes diffusely, 0 to 1: one value, or one for each of red, green and blue",
            [0.0],
            shown_for=("Lambertian",),
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
        references_property("Bodies and faces with this property"),
    )


def make_surface_property(document, study=None, label=None, kind="Absorber"):
    """Add a new surface property."""
    obj = make_object(document, "App::FeaturePython", SurfaceProperty, label or translate("Surface"), study)
    obj.Kind = kind
    return obj
