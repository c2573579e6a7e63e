# SPDX-License-Identifier: LGPL-2.1-or-later
"""Detectors: what registers light and never changes it."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from raymaps.kinds import ANGLE_STEP_RAD
from raymaps.materials.values import Integer, Name, Number, Positive, Record, Vector, nonzero
from raymaps.scene.axes import check_axes, unit_axes

__all__ = ["Detector", "FaceDetector", "FarFieldDetector", "RectangleDetector"]

Cells = Annotated[Integer, Field(ge=1, le=10000)]


class RectangleDetector(Record):
    """Virtual rectangle that registers light and never changes it.

    Its local x axis is ``x_axis`` without its part along the normal, its y axis is normal × x. Light arrives at the
    *front* when it travels against the normal. The angle of incidence is 0 head-on.
    """

    kind: Literal["rectangle"] = "rectangle"
    center_mm: Vector
    normal: Vector
    x_axis: Vector
    width_mm: Positive
    height_mm: Positive
    resolution: tuple[Cells, Cells] = (100, 100)
    side: Literal["front", "back", "both"] = "front"
    max_angle_deg: Number = Field(
        90.0, gt=0, le=90, description="Light at larger angles to the normal isn't registered."
    )

    _directions = field_validator("normal", "x_axis")(nonzero)

    @model_validator(mode="after")
    def _axes_differ(self) -> RectangleDetector:
        check_axes(self.normal, self.x_axis, "normal")
        return self

    @property
    def axes(self) -> NDArray[np.float64]:
        """Unit vectors x, y and normal, (3 axes, 3); right-handed."""
        return unit_axes(self.normal, self.x_axis)

    def accepts(self, angle_rad: NDArray[np.floating], max_angle_rad: float | None = None) -> NDArray[np.bool_]:
        """Which crossings the detector registers.

        Parameters
        ----------
        angle_rad : (n_crossings,) float
            Angle between the light and the way straight onto the front: 0 head-on, pi head-on from behind.
        max_angle_rad : float, optional
            Acceptance angle in place of the detector's own.

        Returns
        -------
        (n_crossings,) bool
        """
        largest = math.radians(self.max_angle_deg) if max_angle_rad is None else max_angle_rad
        largest += ANGLE_STEP_RAD  # stored angles are rounded: light at the very limit is accepted
        front = (angle_rad < math.pi / 2) & (angle_rad <= largest)
        back = (angle_rad > math.pi / 2) & (math.pi - angle_rad <= largest)
        return {"front": front, "back": back, "both": front | back}[self.side]


class FaceDetector(Record):
    """Light on faces of a body, from either side: all that arrives there, or what of it is absorbed."""

    kind: Literal["face"] = "face"
    body: Name
    faces: tuple[Name, ...] | None = Field(None, min_length=1, description="Face names; null: all faces of the body.")
    measure: Literal["incident", "absorbed"] = "incident"


class FarFieldDetector(Record):
    """Radiant intensity of the light that leaves the scene, over all directions.

    Gamma is the angle to the ``axis``, 0 to 180 degrees; C counts around it from ``x_axis``, as in CIE 121 type C.
    """

    kind: Literal["far_field"] = "far_field"
    axis: Vector = Field((0.0, 0.0, -1.0), description="Where gamma is 0: down for most luminaires.")
    x_axis: Vector = Field((1.0, 0.0, 0.0), description="Where C is 0.")
    resolution: tuple[Cells, Cells] = Field(
        (72, 36), description="Half planes C, at equal steps from 0, and steps in gamma from 0 to 180 degrees."
    )

    _directions = field_validator("axis", "x_axis")(nonzero)

    @model_validator(mode="after")
    def _axes_differ(self) -> FarFieldDetector:
        check_axes(self.axis, self.x_axis, "axis")
        return self

    @property
    def axes(self) -> NDArray[np.float64]:
        """Unit vectors x, y and z = axis, (3 axes, 3); right-handed."""
        return unit_axes(self.axis, self.x_axis)


def _detector_kind(value: Any) -> str:
    return str(value.get("kind", "rectangle") if isinstance(value, dict) else getattr(value, "kind", "rectangle"))


#: A detector that does not say its kind is a rectangle.
Detector = Annotated[
    Annotated[RectangleDetector, Tag("rectangle")]
    | Annotated[FaceDetector, Tag("face")]
    | Annotated[FarFieldDetector, Tag("far_field")],
    Discriminator(_detector_kind),
]
