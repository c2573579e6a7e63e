# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bodies: triangles in a file, the medium inside, and surface properties."""

from __future__ import annotations

from pydantic import Field

from raymaps.materials.values import Integer, Name, Positive, Record
from raymaps.scene.exact_surfaces import SurfaceData

__all__ = ["Body", "FaceGroup", "Geometry"]


class FaceGroup(Record):
    """One CAD face: its name, the number of its triangles, and the exact surface that they approximate."""

    name: Name
    triangles: Integer = Field(ge=1)
    surface: SurfaceData | None = Field(None, description="Exact CAD surface: `type` and its parameters in mm.")


class Geometry(Record):
    """Where the triangles of a body stand."""

    file: str = Field(min_length=1, description="STL, PLY, OBJ or GLB file, relative to the scene file.")
    mm_per_unit: Positive = Field(1.0, description="Length of the file's unit in mm.")
    faces: tuple[FaceGroup, ...] | None = Field(None, description="CAD faces, in the order of the file's triangles.")
    smooth_faces: tuple[Name, ...] = Field(
        (), description="Faces without an exact surface that are curved: normals are estimated from their triangles."
    )


class Body(Record):
    """A body: triangles, the medium inside, and a surface property that can be overridden face by face."""

    geometry: Geometry
    medium: Name | None = Field(None, description="Medium inside; null: only the body's surface acts, on both sides.")
    surface: Name = Field(description="Surface property of all faces that are not named in face_surfaces.")
    face_surfaces: dict[Name, Name] = Field(default_factory=dict, description="Face name to surface property.")
    priority: Integer = Field(
        0, ge=-1_000_000, le=1_000_000, description="Where bodies overlap, the one of the highest priority rules."
    )
