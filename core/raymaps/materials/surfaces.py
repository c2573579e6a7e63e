# SPDX-License-Identifier: LGPL-2.1-or-later
"""Surface properties: what light meets on the faces of bodies.

Everything here is a frozen, validated description; `raymaps.compile` and the effects lower it to arrays.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from raymaps.materials.bsdf import BsdfTableOrFile
from raymaps.materials.spectrum import AngularShare, AngularTable, SpectralShare, SpectrumTable
from raymaps.materials.values import Name, NonNegative, Number, Positive, Record, Share

__all__ = [
    "Absorber",
    "AbgScatter",
    "Coefficients",
    "FresnelInterface",
    "GaussianScatter",
    "Lambertian",
    "Mirror",
    "Mixture",
    "MixturePart",
    "RoughInterface",
    "SurfaceProperty",
    "TabulatedBsdf",
    "ThinFilm",
    "ThinFilmLayer",
]

NOTHING = (0.0, 0.0, 0.0)


class Absorber(Record):
    """Absorbs all light."""

    kind: Literal["absorber"] = "absorber"


class Mirror(Record):
    """Reflects specularly; the rest is absorbed."""

    kind: Literal["mirror"] = "mirror"
    reflectance: SpectralShare = Field((1.0, 1.0, 1.0), description="Share of light that is reflected.")


class Lambertian(Record):
    """Reflects and transmits with constant radiance in all directions; the rest is absorbed."""

    kind: Literal["lambertian"] = "lambertian"
    reflectance: SpectralShare = Field(NOTHING, description="Share of light that is reflected diffusely.")
    transmittance: SpectralShare = Field(NOTHING, description="Share of light that is transmitted diffusely.")

    @model_validator(mode="after")
    def _not_more_than_comes(self) -> Lambertian:
        check_shares({"reflectance": self.reflectance, "transmittance": self.transmittance})
        return self


class FresnelInterface(Record):
    """Smooth boundary between two media: reflects and refracts by Fresnel's equations, unpolarised."""

    kind: Literal["fresnel"] = "fresnel"


class RoughInterface(Record):
    """Rough boundary between two media, or of a metal: microfacets that each reflect and refract by Fresnel's equations.

    ``roughness`` is the parameter alpha of the GGX (Trowbridge-Reitz) distribution of their slopes.
    """

    kind: Literal["rough"] = "rough"
    roughness: Number = Field(ge=0.001, le=1, description="Alpha of GGX: the typical slope of the microfacets.")


class Coefficients(Record):
    """Specular and diffuse reflection and transmission by given shares, over the angle of incidence and wavelength.

    What is transmitted specularly is refracted by Snell's law if the body has a medium. The rest is absorbed.
    """

    kind: Literal["coefficients"] = "coefficients"
    specular_reflectance: AngularShare = NOTHING
    specular_transmittance: AngularShare = NOTHING
    diffuse_reflectance: AngularShare = NOTHING
    diffuse_transmittance: AngularShare = NOTHING

    @model_validator(mode="after")
    def _not_more_than_comes(self) -> Coefficients:
        check_shares({name: getattr(self, name) for name in type(self).model_fields if name != "kind"})
        return self


class ThinFilmLayer(Record):
    """A layer of a thin film: a medium of the scene (a metal too), and its thickness."""

    medium: Name
    thickness_nm: Positive = Field(le=1e6)


class ThinFilm(Record):
    """Smooth boundary between two media with a stack of thin layers on it, unpolarised light."""

    kind: Literal["thin_film"] = "thin_film"
    layers: tuple[ThinFilmLayer, ...] = Field(
        min_length=1, max_length=1000, description="From the outside of the body inwards."
    )


class GaussianScatter(Record):
    """Specular reflection and transmission, part of which scatters about the specular direction with a Gaussian lobe.

    The scattered radiance falls as exp(-|b - b0|²/(2 sigma²)), b and b0 being the projections of the scattered and the
    specular direction on the surface.
    """

    kind: Literal["gaussian"] = "gaussian"
    reflectance: SpectralShare = NOTHING
    transmittance: SpectralShare = NOTHING
    scattered_share: Share = Field(1.0, description="Share of what is reflected or transmitted that scatters.")
    sigma: Number = Field(ge=1e-5, le=2, description="Width of the lobe in direction cosines.")

    @model_validator(mode="after")
    def _not_more_than_comes(self) -> GaussianScatter:
        check_shares({"reflectance": self.reflectance, "transmittance": self.transmittance})
        return self


class AbgScatter(Record):
    """Specular reflection and transmission, part of which scatters by the ABg model of polished surfaces.

    The BSDF is A / (B + |b - b0|^g), b and b0 being the projections of the scattered and the specular direction on the
    surface. What scatters is taken from the specular part.
    """

    kind: Literal["abg"] = "abg"
    reflectance: SpectralShare = NOTHING
    transmittance: SpectralShare = NOTHING
    a: NonNegative = Field(description="A of the model in 1/sr.")
    b: Positive = Field(description="B of the model.")
    g: NonNegative = Field(le=10, description="Exponent g of the model.")

    @model_validator(mode="after")
    def _not_more_than_comes(self) -> AbgScatter:
        check_shares({"reflectance": self.reflectance, "transmittance": self.transmittance})
        return self


class TabulatedBsdf(Record):
    """Measured scattering: a table of BRDF and BTDF, with what goes on specularly beside it."""

    kind: Literal["bsdf"] = "bsdf"
    data: BsdfTableOrFile = Field(description="The table, or a file that holds it.")


class MixturePart(Record):
    """A named surface property and the share of the light that meets it."""

    weight: Share
    surface: Name


class Mixture(Record):
    """Several surface properties side by side on the same face, each meeting a share of the light."""

    kind: Literal["mixture"] = "mixture"
    parts: tuple[MixturePart, ...] = Field(min_length=1, max_length=64)

    @model_validator(mode="after")
    def _weights_are_shares(self) -> Mixture:
        total = math.fsum(part.weight for part in self.parts)
        if abs(total - 1) > 1e-6:
            raise ValueError(f"the weights of a mixture must add up to 1, got {total:g}; add an absorber for the rest")
        return self


SurfaceProperty = Annotated[
    Absorber
    | Mirror
    | Lambertian
    | FresnelInterface
    | RoughInterface
    | Coefficients
    | ThinFilm
    | GaussianScatter
    | AbgScatter
    | TabulatedBsdf
    | Mixture,
    Field(discriminator="kind"),
]


def check_shares(shares: dict[str, Any]) -> None:
    """Refuse shares of the light that add up to more than one at some wavelength, band or angle; raises `ValueError`.

    Parameters
    ----------
    shares : dict of str to spectral values, those over the angle too
    """
    tables = [value for value in shares.values() if isinstance(value, SpectrumTable | AngularTable)]
    # sums of functions that are linear between nodes are largest at a node
    angles = sorted({angle for value in tables if isinstance(value, AngularTable) for angle in value.angle_deg} or {0.0})
    wavelengths = sorted({w for value in tables for w in value.wavelength_nm or ()} or {0.0})
    total = np.zeros((len(angles), len(wavelengths), 3))
    for value in shares.values():
        if isinstance(value, AngularTable):
            rows = value.at_angles(angles)
            total += np.array([row.at(wavelengths) if isinstance(row, SpectrumTable) else np.full(len(wavelengths), row)
                               for row in rows])[:, :, None]  # fmt: skip
        elif isinstance(value, SpectrumTable):
            total += value.at(wavelengths)[None, :, None]
        else:
            total += np.array(value)
    if total.max() > 1 + 1e-9:
        angle, wavelength, band = np.unravel_index(int(np.argmax(total)), total.shape)
        places = [f"at {angles[angle]:g} degrees"] if len(angles) > 1 else []
        if wavelengths != [0.0]:
            places.append(f"at {wavelengths[wavelength]:g} nm")
        if np.ptp(total[angle, wavelength]) > 0:
            places.append(f"in band {'rgb'[band]}")
        names = " + ".join(shares)
        raise ValueError(f"{names} must be at most 1, got {total.max():g} {' '.join(places)}".rstrip())
