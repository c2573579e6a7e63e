# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bodies: triangles in a file, the medium inside, and surface properties."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from raymaps.materials.values import Integer, Name, Positive, Record

__all__ = ["Body", "FaceGroup", "FreeData", "Geometry"]

#: Levels that data which the program only passes on may be nested.
MAX_FREE_DEPTH = 32


def _is_plain(data: Any, depth: int = 0) -> bool:
    """Whether data can be written as JSON and read again."""
    if depth > MAX_FREE_DEPTH:
        return False
    if isinstance(data, dict):
        return all(
            isinstance(key, str) and _is_plain(key) and _is_plain(value, depth + 1) for key, value in data.items()
        )
    if isinstance(data, list):
        return all(_is_plain(value, depth + 1) for value in data)
    if isinstance(data, str):
        return not any("\ud800" <= c <= "\udfff" for c in data)
    return data is None or (isinstance(data, bool | int | float) and math.isfinite(data))


def _plain(data: dict[str, Any]) -> dict[str, Any]:
    if not _is_plain(data):
        raise ValueError(
            f"only text, finite numbers, lists and objects, {MAX_FREE_DEPTH} levels deep at most, can stand here"
        )
    return data


#: Data that the program passes on without looking at them.
FreeData = Annotated[dict[str, Any], AfterValidator(_plain)]


class FaceGroup(Record):
    """One CAD face: its name, the number of its triangles, and its exact surface as the exporter describes it."""

    name: Name
    triangles: Integer = Field(ge=1)
    surface: FreeData | None = Field(None, description="Exact CAD surface: `type` and its parameters in mm.")


class Geometry(Record):
    """Where the triangles of a body stand."""

    file: str = Field(min_length=1, description="STL, PLY, OBJ or GLB file, relative to the scene file.")
    mm_per_unit: Positive = Field(1.0, description="Length of the file's unit in mm.")
    faces: tuple[FaceGroup, ...] | None = Field(None, description="CAD faces, in the order of the file's triangles.")


class Body(Record):
    """A body: triangles, the medium inside, and a surface property that can be overridden face by face."""

    geometry: Geometry
    medium: Name | None = Field(None, description="Medium inside; null: only the body's surface acts, on both sides.")
    surface: Name = Field(description="Surface property of all faces that are not named in face_surfaces.")
    face_surfaces: dict[Name, Name] = Field(default_factory=dict, description="Face name to surface property.")
