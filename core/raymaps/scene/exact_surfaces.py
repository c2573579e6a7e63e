# SPDX-License-Identifier: LGPL-2.1-or-later
"""The exact surfaces of CAD faces, as a scene file describes them, in mm.

Each has an *own* normal: ``normal`` of a plane; the direction away from the axis, centre or core circle of a cylinder,
cone, sphere or torus; du x dv of a B-spline. ``reversed`` says whether the normal that points out of the body is
against it; the triangles of the face say the same.

What is no surface of a known type, lacks a field or has an unknown one, is kept as it stands: light then sees the
face's triangles.
"""

from __future__ import annotations

import itertools
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Strict, Tag, field_validator, model_validator

from raymaps.errors import shortened
from raymaps.materials.values import Integer, Number, Positive, Record, Vector, nonzero
from raymaps.scene.free_data import FreeData

__all__ = [
    "BSplineSurface",
    "ConeSurface",
    "CurvedSurface",
    "CylinderSurface",
    "ExactSurface",
    "OtherSurface",
    "PlaneSurface",
    "SphereSurface",
    "SurfaceData",
    "TorusSurface",
    "why_kept",
]

#: Largest degree of a B-spline, as in CAD programs.
MAX_DEGREE = 25


class _Surface(Record):
    """What all exact surfaces have."""

    reversed: Annotated[bool, Strict()] | None = Field(
        None, description="Whether the outward normal is against the surface's own; null: as the triangles say."
    )


class PlaneSurface(_Surface):
    """Plane through a point."""

    type: Literal["plane"]
    point_mm: Vector
    normal: Vector

    _directions = field_validator("normal")(nonzero)


class CylinderSurface(_Surface):
    """Circular cylinder without end."""

    type: Literal["cylinder"]
    point_mm: Vector = Field(description="A point of its axis.")
    axis: Vector
    radius_mm: Positive

    _directions = field_validator("axis")(nonzero)


class ConeSurface(_Surface):
    """Circular cone, from its apex along its axis."""

    type: Literal["cone"]
    apex_mm: Vector
    axis: Vector = Field(description="From the apex into the cone.")
    half_angle_deg: Number = Field(gt=0, lt=90)

    _directions = field_validator("axis")(nonzero)


class SphereSurface(_Surface):
    """Sphere."""

    type: Literal["sphere"]
    center_mm: Vector
    radius_mm: Positive


class TorusSurface(_Surface):
    """Torus: all points at the minor radius from a circle of the major radius."""

    type: Literal["torus"]
    center_mm: Vector
    axis: Vector
    major_radius_mm: Positive
    minor_radius_mm: Positive

    _directions = field_validator("axis")(nonzero)


class BSplineSurface(_Surface):
    """B-spline surface, rational if it has weights, with the knots and poles of Open CASCADE."""

    type: Literal["bspline"]
    degrees: tuple[Annotated[Integer, Field(ge=1, le=MAX_DEGREE)], Annotated[Integer, Field(ge=1, le=MAX_DEGREE)]]
    knots: tuple[tuple[Number, ...], tuple[Number, ...]] = Field(description="Rising, along u and along v.")
    multiplicities: tuple[tuple[Integer, ...], tuple[Integer, ...]]
    periodic: tuple[Annotated[bool, Strict()], Annotated[bool, Strict()]]
    poles_mm: tuple[tuple[Vector, ...], ...] = Field(description="A row along v for each pole along u.")
    weights: tuple[tuple[Positive, ...], ...] | None = Field(None, description="As poles_mm; null: all 1.")

    @model_validator(mode="after")
    def _counts_agree(self) -> BSplineSurface:
        rows = {len(row) for row in self.poles_mm}
        if len(rows) != 1:
            raise ValueError("poles_mm: all rows must have as many poles, at least one")
        for i, n_poles in enumerate((len(self.poles_mm), rows.pop())):
            self._check_direction("uv"[i], i, n_poles)
        if self.weights is not None and [len(row) for row in self.weights] != [len(row) for row in self.poles_mm]:
            raise ValueError("weights: there must be one for each of poles_mm")
        return self

    def _check_direction(self, letter: str, i: int, n_poles: int) -> None:
        degree, knots, times, periodic = self.degrees[i], self.knots[i], self.multiplicities[i], self.periodic[i]
        if len(knots) < 2 or any(not a < b for a, b in itertools.pairwise(knots)):
            raise ValueError(f"knots along {letter}: there must be at least two, each above the one before")
        ends = degree if periodic else degree + 1
        most = [ends, *[degree] * (len(knots) - 2), ends]
        if len(times) != len(knots) or any(not 1 <= m <= limit for m, limit in zip(times, most, strict=True)):
            raise ValueError(
                f"multiplicities along {letter}: there must be one for each knot, from 1 to the degree {degree}"
                + ("" if periodic else ", one more at the ends")
            )
        needed = sum(times[:-1]) if periodic else sum(times) - degree - 1
        if n_poles != needed or (periodic and times[0] != times[-1]):
            raise ValueError(f"poles_mm: along {letter} the knots call for {needed} poles, got {n_poles}")


class OtherSurface(_Surface):
    """A surface that the exporter could only name; light sees its triangles."""

    type: Literal["other"]
    name: str = Field("", description="What the CAD program calls it.")
    reason: str = Field("", description="Why it could not be described.")


CurvedSurface = CylinderSurface | ConeSurface | SphereSurface | TorusSurface | BSplineSurface
ExactSurface = PlaneSurface | CurvedSurface | OtherSurface
_RECORDS: dict[str, type[_Surface]] = {
    "plane": PlaneSurface,
    "cylinder": CylinderSurface,
    "cone": ConeSurface,
    "sphere": SphereSurface,
    "torus": TorusSurface,
    "bspline": BSplineSurface,
    "other": OtherSurface,
}


def _which(data: Any) -> str:
    """The type of a surface that is wholly described, else ``kept``."""
    if isinstance(data, ExactSurface):
        return data.type
    return "kept" if not isinstance(data, dict) or why_kept(data) else str(data["type"])


def why_kept(data: dict[str, Any]) -> str | None:
    """Why data are not read as a surface; None if they are."""
    kind = data.get("type")
    record = _RECORDS.get(kind) if isinstance(kind, str) else None
    if record is None:
        return f"a surface of the type {shortened(repr(kind), 60)} is not known (known are {', '.join(_RECORDS)})"
    needed = {name for name, field in record.model_fields.items() if field.is_required()}
    lacking, unknown = sorted(needed - set(data)), sorted(set(data) - set(record.model_fields))
    if lacking:
        return f"the {kind}'s {lacking[0]} is missing"
    return f"the {kind}'s field '{shortened(unknown[0], 60)}' is not known" if unknown else None


def _either(schema: dict[str, Any]) -> None:
    """What is kept as it stands may look like any surface, so more than one form may fit."""
    schema["anyOf"] = schema.pop("oneOf")


#: A surface of a known type, or data that are kept as they stand.
SurfaceData = Annotated[
    Annotated[PlaneSurface, Tag("plane")]
    | Annotated[CylinderSurface, Tag("cylinder")]
    | Annotated[ConeSurface, Tag("cone")]
    | Annotated[SphereSurface, Tag("sphere")]
    | Annotated[TorusSurface, Tag("torus")]
    | Annotated[BSplineSurface, Tag("bspline")]
    | Annotated[OtherSurface, Tag("other")]
    | Annotated[FreeData, Tag("kept")],
    Discriminator(_which),
    Field(json_schema_extra=_either),
]
