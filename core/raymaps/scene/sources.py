# SPDX-License-Identifier: LGPL-2.1-or-later
"""Light sources."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from raymaps.materials.values import Name, Number, Positive, Record, Rgb, Vector, nonzero
from raymaps.scene.axes import check_axes, unit_axes
from raymaps.scene.emission import EmissionSpectrum, FaceEmission, Intensity, LambertianEmission

__all__ = [
    "ConeSource",
    "CrossingsSource",
    "DiscSource",
    "FacesSource",
    "GaussianBeamSource",
    "LuminaireSource",
    "PointSource",
    "RaysSource",
    "Source",
    "SunSource",
]


class _SourceBase(Record):
    flux_w: Positive = Field(le=1e100, description="Radiant flux in W, over all wavelengths that are simulated.")
    rgb: Rgb = Field((1.0, 1.0, 1.0), description="Relative flux of the bands; their sum is scaled to one.")
    spectrum: EmissionSpectrum | None = Field(None, description="Spectrum, in place of rgb.")
    ray_share: Positive | None = Field(
        None, le=1e100, description="Share of the rays relative to the other sources; null: by flux_w, in W."
    )

    @field_validator("rgb")
    @classmethod
    def _some_light(cls, rgb: Vector) -> Vector:
        if min(rgb) < 0 or not 1e-100 < sum(rgb) < 1e100:
            raise ValueError("each band must be 0 or more, and their sum above 0 and below 1e100")
        return rgb


class _AimedSource(_SourceBase):
    position_mm: Vector
    direction: Vector

    _direction = field_validator("direction")(nonzero)


class PointSource(_SourceBase):
    """Isotropic point source."""

    kind: Literal["point"] = "point"
    position_mm: Vector


class ConeSource(_AimedSource):
    """Point source with constant intensity inside a circular cone."""

    kind: Literal["cone"] = "cone"
    half_angle_deg: Number = Field(gt=0, le=180)


class DiscSource(_AimedSource):
    """Collimated beam of circular cross-section and constant irradiance."""

    kind: Literal["disc"] = "disc"
    radius_mm: Positive


class GaussianBeamSource(_AimedSource):
    """Beam with Gaussian profiles of irradiance at its waist, where it starts, and of radiant intensity far away.

    Rays leave the waist with place and direction independent; no light goes backwards.
    """

    kind: Literal["gaussian_beam"] = "gaussian_beam"
    waist_radius_mm: Positive = Field(description="Radius at which the irradiance is 1/e² of that in the middle.")
    divergence_deg: Number = Field(0.0, ge=0, le=45, description="Half angle at which the intensity is 1/e².")


class SunSource(_AimedSource):
    """Light of a far disc of constant radiance, such as the sun, through a disc across its mean direction."""

    kind: Literal["sun"] = "sun"
    radius_mm: Positive = Field(description="Radius of the disc that light passes through.")
    angular_radius_deg: Number = Field(0.2665, ge=0, lt=90, description="Angular radius of the sun: 0.2665 degrees.")


class FacesSource(_SourceBase):
    """Emission with constant exitance from faces of a body, outwards; Lambertian unless said otherwise."""

    kind: Literal["faces"] = "faces"
    body: Name
    faces: tuple[Name, ...] | None = Field(None, min_length=1, description="Face names; null: all faces of the body.")
    emission: FaceEmission = Field(
        LambertianEmission(), description="How intensity falls with the angle to the normal."
    )


class LuminaireSource(_SourceBase):
    """Point source with measured intensity; only how it falls over directions counts, not its candela.

    Gamma counts from the direction. C counts around it, from the reference direction, as a right-handed screw along the
    direction turns: for a luminaire that points down, clockwise as seen from above.
    """

    kind: Literal["luminaire"] = "luminaire"
    position_mm: Vector
    direction: Vector = Field((0.0, 0.0, -1.0), description="Where gamma is 0: down for most luminaires.")
    c0_direction: Vector = Field((1.0, 0.0, 0.0), description="Where the half plane C = 0 lies.")
    intensity: Intensity

    _directions = field_validator("direction", "c0_direction")(nonzero)

    @model_validator(mode="after")
    def _axes_differ(self) -> LuminaireSource:
        check_axes(self.direction, self.c0_direction, "direction", "c0_direction")
        return self

    @property
    def axes(self) -> NDArray[np.float64]:
        """Unit vectors of C = 0 and C = 90 at gamma = 90 degrees, and of gamma = 0, (3 axes, 3); right-handed."""
        return unit_axes(self.direction, self.c0_direction)


class _PlacedRays(_SourceBase):
    position_mm: Vector = Field((0.0, 0.0, 0.0), description="Where the file's origin lies.")
    z_axis: Vector = Field((0.0, 0.0, 1.0), description="Where the file's z axis points to.")
    x_axis: Vector = Field((1.0, 0.0, 0.0), description="Where the file's x axis points to, as far as it can.")

    _directions = field_validator("z_axis", "x_axis")(nonzero)

    @model_validator(mode="after")
    def _axes_differ(self) -> _PlacedRays:
        check_axes(self.z_axis, self.x_axis, "z_axis")
        return self

    @property
    def axes(self) -> NDArray[np.float64]:
        """Unit vectors of the file's x, y and z axis, (3 axes, 3); right-handed."""
        return unit_axes(self.z_axis, self.x_axis)

    def as_rays(self, file: str) -> RaysSource:
        """The same source with its rays in a file of their own."""
        return RaysSource(file=file, **{name: getattr(self, name) for name in _PlacedRays.model_fields})


class RaysSource(_PlacedRays):
    """Rays of a file: IES TM-25, Zemax .DAT, or what a Ray Map keeps of them. Drawn by their flux, with replacement.

    The colours that a file tells of its rays count unless the source has a spectrum, or an rgb of its own.
    """

    kind: Literal["rays"] = "rays"
    file: str = Field(min_length=1, description="Ray file, relative to the scene file.")


class CrossingsSource(_PlacedRays):
    """Rays that a detector of another Ray Map registered, each from where it crossed with the light it had there.

    Their colours count unless the source has a spectrum, or an rgb of its own.
    """

    kind: Literal["crossings"] = "crossings"
    map: str = Field(min_length=1, description="Ray Map, relative to the scene file.")
    detector: Name


Source = Annotated[
    PointSource
    | ConeSource
    | DiscSource
    | GaussianBeamSource
    | SunSource
    | FacesSource
    | LuminaireSource
    | RaysSource
    | CrossingsSource,
    Field(discriminator="kind"),
]
