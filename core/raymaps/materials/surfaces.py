# SPDX-License-Identifier: LGPL-2.1-or-later
"""Surface properties: what light meets on the faces of bodies.

Everything here is a frozen, validated description; `raymaps.compile` and the effects lower it to arrays.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from raymaps.materials.bsdf import BsdfTableOrFile
from raymaps.materials.scatter import abg_total_scatter
from raymaps.materials.spectrum import LONGEST_NM, SHORTEST_NM, AngularShare, AngularTable, SpectralShare, SpectrumTable
from raymaps.materials.values import Name, NonNegative, Number, Positive, Record, Share

__all__ = [
    "AbgScatter",
    "Absorber",
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
    """Rough boundary between two media, or of a metal: microfacets that reflect and refract by Fresnel's equations.

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
    b: Number = Field(ge=1e-15, description="B of the model.")
    g: NonNegative = Field(le=10, description="Exponent g of the model.")

    @model_validator(mode="after")
    def _not_more_than_comes(self) -> AbgScatter:
        check_shares({"reflectance": self.reflectance, "transmittance": self.transmittance})
        # the total integrated scatter is largest at normal incidence, where the lobe stands in the middle of the disc
        scattered = float(abg_total_scatter(0.0, self.a, self.b, self.g)[0])
        for name in ("reflectance", "transmittance"):
            value = getattr(self, name)
            least, most, where = _extremes(value)
            if most > 0 and scattered > least * (1 + 1e-6):
                raise ValueError(
                    f"a, b and g scatter {scattered:.6g} of the light at 0 degrees, more than the {name} of "
                    f"{least:g}{where}: choose a at most {self.a * least / scattered:.6g}"
                )
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


def _extremes(value: Any) -> tuple[float, float, str]:
    """Smallest and largest of a spectral value, and where it is smallest."""
    values = value.value if isinstance(value, SpectrumTable) else value
    least = int(np.argmin(values))
    if isinstance(value, SpectrumTable):
        where = f" at {value.wavelength_nm[least]:g} nm"
    else:
        where = f" in band {'rgb'[least]}" if np.ptp(values) > 0 else ""
    return float(min(values)), float(max(values)), where


def check_shares(shares: dict[str, Any]) -> None:
    """Refuse shares of the light that add up to more than one at some wavelength, band or angle.

    Parameters
    ----------
    shares : dict of str to spectral values, those over the angle too

    Raises
    ------
    ValueError
        With the place where they add up to most.
    """
    tables = [value for value in shares.values() if isinstance(value, SpectrumTable | AngularTable)]
    # all are linear between their nodes, over angle and wavelength, so a sum is largest at a node of one of them
    over_angle = [value for value in tables if isinstance(value, AngularTable)]
    angle_deg = np.unique([angle for value in over_angle for angle in value.angle_deg] or [0.0])
    nodes_nm = np.unique([nm for value in tables for nm in value.wavelength_nm or ()])
    spectra = [value for value in tables if value.wavelength_nm is not None]
    if spectra:  # wavelengths that a table does not speak of can't be simulated
        first = max(_range_nm(value)[0] for value in spectra)
        last = min(_range_nm(value)[1] for value in spectra)
        nodes_nm = nodes_nm[(nodes_nm >= first) & (nodes_nm <= last)]
        if not len(nodes_nm):
            return
    worst, where = 0.0, ""
    for angles in np.array_split(angle_deg, max(1, len(angle_deg) * max(1, len(nodes_nm)) // 100_000)):
        total = np.zeros((len(angles), max(1, len(nodes_nm)), 3))
        for value in shares.values():
            if isinstance(value, AngularTable):
                total += _over_angle_and_wavelength(value, angles, nodes_nm)[:, :, None]
            else:
                total += value.at(nodes_nm)[:, None] if isinstance(value, SpectrumTable) else np.array(value)
        if total.max() > worst:
            worst = float(total.max())
            angle, wavelength, band = np.unravel_index(int(np.argmax(total)), total.shape)
            places = [f"at {angles[angle]:g} degrees"] if len(angle_deg) > 1 else []
            if spectra:
                places.append(f"at {nodes_nm[wavelength]:g} nm")
            if np.ptp(total[angle, wavelength]) > 0:
                places.append(f"in band {'rgb'[band]}")
            where = " ".join(places)
    if worst > 1 + 1e-9:
        names = [name for name, value in shares.items() if value != NOTHING]
        raise ValueError(f"{' + '.join(names)} must be at most 1, got {worst:.6g} {where}".rstrip())


def _range_nm(value: SpectrumTable | AngularTable) -> tuple[float, float]:
    """First and last wavelength that a table speaks of."""
    if isinstance(value, SpectrumTable):
        return value.range_nm
    assert value.wavelength_nm is not None
    return (SHORTEST_NM, LONGEST_NM) if value.outside == "clamp" else (value.wavelength_nm[0], value.wavelength_nm[-1])


def _over_angle_and_wavelength(
    table: AngularTable, angle_deg: NDArray[np.float64], wavelength_nm: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Bilinear values of a table, (n_angles, n_wavelengths or 1); its border values outside."""

    def between(at: NDArray[np.float64], nodes: tuple[float, ...], values: NDArray[np.float64]) -> NDArray[np.float64]:
        if len(nodes) == 1:
            return np.repeat(values, len(at), axis=0)
        at = np.clip(at, nodes[0], nodes[-1])
        after = np.clip(np.searchsorted(nodes, at, side="right"), 1, len(nodes) - 1)
        node = np.array(nodes)
        place = ((at - node[after - 1]) / (node[after] - node[after - 1]))[:, None]
        return values[after - 1] * (1 - place) + values[after] * place

    values = between(angle_deg, table.angle_deg, np.array(table.value))
    return values if table.wavelength_nm is None else between(wavelength_nm, table.wavelength_nm, values.T).T
