# SPDX-License-Identifier: LGPL-2.1-or-later
"""The scene: a frozen, validated description of everything that is simulated, and its JSON file.

Triangles stand in geometry files beside the scene file and are read by `raymaps.geometry`.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, PrivateAttr, ValidationError, field_validator, model_validator

from raymaps.errors import SceneError, unknown_name
from raymaps.kinds import ANGLE_STEP_RAD
from raymaps.materials import VACUUM, Integer, Medium, Mixture, Name, Number, Record, Rgb, SurfaceProperty

__all__ = [
    "SCENE_FORMAT",
    "SCENE_VERSION",
    "Body",
    "ConeSource",
    "DiscSource",
    "FaceGroup",
    "FacesSource",
    "Geometry",
    "PointSource",
    "RectangleDetector",
    "Scene",
    "Settings",
    "Source",
    "load_scene",
    "scene_json_schema",
]

SCENE_FORMAT = "raymaps-scene"
SCENE_VERSION = 1

Vector = tuple[Number, Number, Number]
Positive = Annotated[Number, Field(gt=0)]

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


def _nonzero(vector: Vector) -> Vector:
    if not 1e-150 < math.hypot(*vector) < 1e150:
        raise ValueError("a direction must have a length above zero")
    return vector


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


class _SourceBase(Record):
    flux_w: Positive = Field(le=1e100, description="Radiant flux in W, all three bands together.")
    rgb: Rgb = Field((1.0, 1.0, 1.0), description="Relative flux of the bands; their sum is scaled to one.")

    @field_validator("rgb")
    @classmethod
    def _some_light(cls, rgb: Vector) -> Vector:
        if min(rgb) < 0 or not 1e-100 < sum(rgb) < 1e100:
            raise ValueError("each band must be 0 or more, and their sum above 0 and below 1e100")
        return rgb


class PointSource(_SourceBase):
    """Isotropic point source."""

    kind: Literal["point"] = "point"
    position_mm: Vector


class ConeSource(_SourceBase):
    """Point source with constant intensity inside a circular cone."""

    kind: Literal["cone"] = "cone"
    position_mm: Vector
    direction: Vector
    half_angle_deg: Number = Field(gt=0, le=180)

    _direction = field_validator("direction")(_nonzero)


class DiscSource(_SourceBase):
    """Collimated beam of circular cross-section and constant irradiance."""

    kind: Literal["disc"] = "disc"
    position_mm: Vector
    direction: Vector
    radius_mm: Positive

    _direction = field_validator("direction")(_nonzero)


class FacesSource(_SourceBase):
    """Lambertian emission with constant exitance from faces of a body, outwards."""

    kind: Literal["faces"] = "faces"
    body: Name
    faces: tuple[Name, ...] | None = Field(None, min_length=1, description="Face names; null: all faces of the body.")


Source = Annotated[PointSource | ConeSource | DiscSource | FacesSource, Field(discriminator="kind")]


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
    resolution: tuple[Annotated[Integer, Field(ge=1, le=10000)], Annotated[Integer, Field(ge=1, le=10000)]] = (100, 100)
    side: Literal["front", "back", "both"] = "front"
    max_angle_deg: Number = Field(
        90.0, gt=0, le=90, description="Light at larger angles to the normal isn't registered."
    )

    _directions = field_validator("normal", "x_axis")(_nonzero)

    @model_validator(mode="after")
    def _axes_differ(self) -> RectangleDetector:
        n, x = self.normal, self.x_axis
        cross = (n[1] * x[2] - n[2] * x[1], n[2] * x[0] - n[0] * x[2], n[0] * x[1] - n[1] * x[0])
        if math.hypot(*cross) < 1e-6 * math.hypot(*n) * math.hypot(*x):
            raise ValueError("x_axis must not be parallel to the normal")
        return self

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


class Settings(Record):
    """How the scene is simulated unless a run says otherwise."""

    rays: Integer = Field(100_000, ge=1, le=10**12, description="Number of rays.")
    seed: Integer = Field(1, ge=0, lt=2**64, description="Seed of all random numbers.")
    max_events: Integer = Field(
        1000, ge=2, le=100_000, description="A ray with more events is killed, and recorded so."
    )
    roulette_threshold: Number = Field(
        0.1, ge=0, le=1, description="Below this share of its light a ray's losses on surfaces are drawn."
    )


class Scene(Record):
    """Everything that is simulated.

    Attributes of a loaded scene: ``folder``, the folder that geometry files are relative to.
    """

    format: Literal["raymaps-scene"] = "raymaps-scene"
    version: Literal[1] = 1
    name: Name = "scene"
    ambient: Name | None = Field(None, description="Medium outside all bodies; null: vacuum.")
    media: dict[Name, Medium] = Field(default_factory=dict)
    surfaces: dict[Name, SurfaceProperty] = Field(default_factory=dict)
    bodies: dict[Name, Body] = Field(default_factory=dict)
    sources: dict[Name, Source] = Field(min_length=1)
    detectors: dict[Name, RectangleDetector] = Field(default_factory=dict)
    settings: Settings = Settings()
    origin: FreeData | None = Field(None, description="Where the scene came from; not part of what is simulated.")

    _folder: Path = PrivateAttr(default_factory=Path)

    @property
    def folder(self) -> Path:
        """Folder that the geometry files are relative to."""
        return self._folder

    @property
    def ambient_medium(self) -> Medium:
        """Medium outside all bodies."""
        return VACUUM if self.ambient is None else self.media[self.ambient]

    @model_validator(mode="after")
    def _names_are_known(self) -> Scene:
        def known(where: str, what: str, name: str | None, names: dict[str, Any]) -> None:
            if name is not None and name not in names:
                raise ValueError(f"{where}: {_decapitalised(unknown_name(what, name, names))}")

        known("ambient", "medium", self.ambient, self.media)
        for name, prop in self.surfaces.items():
            for part in prop.parts if isinstance(prop, Mixture) else ():
                known(f"surfaces '{name}'", "surface property", part.surface, self.surfaces)
                if isinstance(self.surfaces[part.surface], Mixture):
                    raise ValueError(f"surfaces '{name}': a mixture can't hold the mixture '{part.surface}'")
        for name, body in self.bodies.items():
            known(f"bodies '{name}'", "medium", body.medium, self.media)
            known(f"bodies '{name}'", "surface property", body.surface, self.surfaces)
            for face, prop_name in body.face_surfaces.items():
                known(f"bodies '{name}', face '{face}'", "surface property", prop_name, self.surfaces)
        for name, source in self.sources.items():
            if isinstance(source, FacesSource):
                known(f"sources '{name}'", "body", source.body, self.bodies)
        return self

    def with_folder(self, folder: Path) -> Scene:
        """The same scene with its geometry files relative to another folder."""
        scene = self.model_copy()
        scene._folder = folder
        return scene


def load_scene(path: str | Path) -> Scene:
    """Read and validate a scene file.

    Parameters
    ----------
    path : path of a ``NAME.scene.json`` file

    Returns
    -------
    Scene; its geometry files are not read yet (see `raymaps.geometry.load_bodies`).

    Raises
    ------
    SceneError
        If the file is missing, is not JSON, is of a newer version, or says something that can't be simulated.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SceneError(f"Scene '{path}': there is no such file.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"Scene '{path}' can't be read: {_reason(error)}.") from error
    try:
        data = json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_no_constant)
    except RecursionError:
        raise SceneError(f"Scene '{path}': it is nested too deeply to be a scene.") from None
    except ValueError as error:
        raise SceneError(f"Scene '{path}' is not valid JSON: {_short(str(error))}.") from None
    return scene_from_dict(data, str(path)).with_folder(path.parent)


def scene_from_dict(data: Any, where: str = "scene") -> Scene:
    """Validate a scene given as plain data; raises `SceneError` with one sentence about the first faults."""
    if not isinstance(data, dict):
        raise SceneError(f"Scene '{where}' must be a JSON object with the fields of a scene.")
    if data.get("format") != SCENE_FORMAT:
        if type(data.get("version")) is int and data["version"] > SCENE_VERSION:
            raise SceneError(_newer(where, data["version"]))
        raise SceneError(f'Scene \'{where}\': "format" must be "{SCENE_FORMAT}"; this is not a scene file.')
    version = data.get("version")
    if type(version) is int and version > SCENE_VERSION:
        raise SceneError(_newer(where, version))
    if type(version) is not int:
        raise SceneError(f"Scene '{where}', version: must be a whole number from 1 to {SCENE_VERSION}.")
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        faults = _faults(where, error)
        more = f" ({len(faults) - 1} more fault{'s' * (len(faults) > 2)})" if len(faults) > 1 else ""
        raise SceneError(f"{faults[0]}{more}.", tuple(f"{fault}." for fault in faults)) from None
    except RecursionError:
        raise SceneError(f"Scene '{where}': it is nested too deeply to be a scene.") from None


def scene_json_schema() -> dict[str, Any]:
    """The published JSON Schema of a scene file."""
    schema = Scene.model_json_schema(mode="validation")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Ray Maps scene",
        **{key: value for key, value in schema.items() if key != "title"},
    }


def _newer(where: str, version: int) -> str:
    return (
        f"Scene '{where}' has version {_short(str(version))}, this program reads up to version {SCENE_VERSION}: "
        "update Ray Maps."
    )


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise ValueError(f"the name '{_short(key)}' stands twice in one section")
        result[key] = value
    return result


def _no_constant(text: str) -> NoReturn:
    raise ValueError(f"{text} is not a number that a scene can hold")


def _faults(where: str, error: ValidationError) -> list[str]:
    """Every fault of a validation; one that all bands share, because one number stands for them, is told once."""
    found = [(fault["loc"], _fault(fault)) for fault in error.errors(include_url=False)]
    bands = [(loc[:-1], text) if loc and isinstance(loc[-1], int) else None for loc, text in found]
    faults = {
        (loc[:-1] if band is not None and bands.count(band) == 3 else loc, text): None
        for (loc, text), band in zip(found, bands, strict=True)
    }
    return [f"Scene '{where}'{_place(loc)}: {text}" for loc, text in faults]


def _fault(fault: Any) -> str:
    """What is wrong, in our words where pydantic's are those of a programmer."""
    context, given = fault.get("ctx", {}), fault.get("input")
    words = {
        "missing": "this field is missing",
        "extra_forbidden": "there is no such field",
        "union_tag_not_found": "the field 'kind' is missing",
        "union_tag_invalid": f"unknown kind '{context.get('tag')}'; known: {context.get('expected_tags')}",
        "too_short": f"at least {context.get('min_length')} must be given",
        "model_type": "must be an object with fields",
        "model_attributes_type": "must be an object with fields",
        "dict_type": "must be an object with names",
        "tuple_type": "must be a list",
    }
    if fault["type"] in words:
        return words[fault["type"]]
    message = _decapitalised(fault["msg"].removeprefix("Value error, ")).replace("input should", "must")
    if fault["type"] == "value_error" or isinstance(given, dict | list | tuple) or given is None:
        return message
    return f"{message}, got {_short(repr(given))}"


def _place(loc: tuple[int | str, ...]) -> str:
    """``('media', 'glass', 'refractive_index')`` as ``, media 'glass', refractive_index``."""
    sections = {"media", "surfaces", "bodies", "sources", "detectors"}
    kinds = {"absorber", "mirror", "lambertian", "fresnel", "mixture", "point", "cone", "disc", "faces"}
    words: list[str] = []
    for i, part in enumerate(loc):
        if i == 1 and loc[0] in sections:
            words[-1] += f" '{part}'"
        elif i == 2 and part in kinds and loc[0] in ("surfaces", "sources"):
            continue
        elif isinstance(part, int):
            words[-1] += f"[{part}]"
        else:
            words.append(str(part))
    return "".join(f", {word}" for word in words)


def _decapitalised(text: str) -> str:
    return (text[:1].lower() + text[1:]).rstrip(".")


def _short(text: str, length: int = 120) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"


def _reason(error: OSError | UnicodeDecodeError) -> str:
    return "it is not UTF-8 text" if isinstance(error, UnicodeDecodeError) else (error.strerror or str(error)).lower()
