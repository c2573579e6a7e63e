# SPDX-License-Identifier: LGPL-2.1-or-later
"""Media and surface properties: what light meets inside bodies and on their faces.

Everything here is a frozen, validated description; `raymaps.compile` lowers it to arrays.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, Strict, model_validator

__all__ = [
    "VACUUM",
    "Absorber",
    "FresnelInterface",
    "Integer",
    "Lambertian",
    "Medium",
    "Mirror",
    "Mixture",
    "MixturePart",
    "Name",
    "Number",
    "Record",
    "Rgb",
    "SurfaceProperty",
]


class Record(BaseModel):
    """Base of all parts of a scene: frozen, finite numbers only, unknown fields refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)


def _checked_name(name: str) -> str:
    if not name.strip() or any(ord(c) < 32 or ord(c) == 127 for c in name):
        raise ValueError("a name must be visible text without control characters")
    return name


def _as_three(value: Any) -> Any:
    """Let one number stand for three equal bands."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (value, value, value)
    return value


Name = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_checked_name)]

#: A finite number: neither text that looks like one, nor true or false.
Number = Annotated[float, Strict()]
Integer = Annotated[int, Strict()]

#: A value for each of the bands red, green, blue; a single number stands for all three.
Rgb = Annotated[
    tuple[Number, Number, Number],
    BeforeValidator(_as_three, json_schema_input_type=Number | tuple[Number, Number, Number]),
]
Share = Annotated[Number, Field(ge=0, le=1)]
RgbShare = Annotated[
    tuple[Share, Share, Share],
    BeforeValidator(_as_three, json_schema_input_type=Share | tuple[Share, Share, Share]),
]
NonNegative = Annotated[Number, Field(ge=0)]
RgbNonNegative = Annotated[
    tuple[NonNegative, NonNegative, NonNegative],
    BeforeValidator(_as_three, json_schema_input_type=NonNegative | tuple[NonNegative, NonNegative, NonNegative]),
]


class Medium(Record):
    """A homogeneous, isotropic, clear or absorbing medium.

    ``absorption_per_mm`` is the coefficient a of Beer-Lambert's law: a share exp(-a d) of the light is left after d mm.
    """

    refractive_index: Number = Field(gt=0, le=10, description="Real refractive index, the same for the three bands.")
    absorption_per_mm: RgbNonNegative = Field(
        (0.0, 0.0, 0.0), description="Absorption coefficient in 1/mm: one number, or one for each of r, g, b."
    )


VACUUM = Medium(refractive_index=1.0)


class Absorber(Record):
    """Absorbs all light."""

    kind: Literal["absorber"] = "absorber"


class Mirror(Record):
    """Reflects specularly; the rest is absorbed."""

    kind: Literal["mirror"] = "mirror"
    reflectance: RgbShare = Field((1.0, 1.0, 1.0), description="Share of light that is reflected.")


class Lambertian(Record):
    """Reflects and transmits with constant radiance in all directions; the rest is absorbed."""

    kind: Literal["lambertian"] = "lambertian"
    reflectance: RgbShare = Field((0.0, 0.0, 0.0), description="Share of light that is reflected diffusely.")
    transmittance: RgbShare = Field((0.0, 0.0, 0.0), description="Share of light that is transmitted diffusely.")

    @model_validator(mode="after")
    def _not_more_than_comes(self) -> Lambertian:
        for band, r, t in zip("rgb", self.reflectance, self.transmittance, strict=True):
            if r + t > 1 + 1e-12:
                raise ValueError(
                    f"reflectance + transmittance must be at most 1 in each band, got {r:g} + {t:g} in band {band}"
                )
        return self


class FresnelInterface(Record):
    """Smooth boundary between two media: reflects and refracts by Fresnel's equations, unpolarised."""

    kind: Literal["fresnel"] = "fresnel"


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
    Absorber | Mirror | Lambertian | FresnelInterface | Mixture,
    Field(discriminator="kind"),
]
