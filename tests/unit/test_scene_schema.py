# SPDX-License-Identifier: LGPL-2.1-or-later
"""The published JSON Schema: in step with the program, and it tells good scenes from bad ones."""

from __future__ import annotations

import copy
import json
import math
import re
from typing import Any

import pytest

from raymaps.errors import SceneError
from raymaps.scene import load_scene, scene_from_dict, scene_json_schema
from tests.store.small_scenes import changed, lamp_in_a_room, workshop

#: Keywords that say nothing about what is valid.
REMARKS = {"title", "description", "default", "$schema", "$defs", "discriminator", "$id", "examples"}
TYPES: dict[str, Any] = {
    "object": lambda x: isinstance(x, dict),
    "array": lambda x: isinstance(x, list),
    "string": lambda x: isinstance(x, str),
    "null": lambda x: x is None,
    "boolean": lambda x: isinstance(x, bool),
    "integer": lambda x: not isinstance(x, bool) and (isinstance(x, int) or (isinstance(x, float) and x.is_integer())),
    "number": lambda x: not isinstance(x, bool) and isinstance(x, int | float) and math.isfinite(x),
}


def valid(value: Any, schema: Any, root: dict[str, Any]) -> bool:
    """Whether JSON data obeys a JSON Schema (draft 2020-12), as far as the schema of scenes goes."""
    if isinstance(schema, bool):
        return schema
    number = isinstance(value, int | float) and not isinstance(value, bool)
    text, array, dictionary = isinstance(value, str), isinstance(value, list), isinstance(value, dict)

    def all_of(pairs: Any) -> bool:
        return all(valid(v, s, root) for v, s in pairs)

    rules: dict[str, Any] = {
        "$ref": lambda s: valid(value, _definition(s, root), root),
        "type": lambda s: TYPES[s](value),
        "const": lambda s: value == s and isinstance(value, bool) == isinstance(s, bool),
        "enum": lambda s: value in s,
        "anyOf": lambda s: any(valid(value, each, root) for each in s),
        "oneOf": lambda s: sum(valid(value, each, root) for each in s) == 1,
        "minimum": lambda s: not number or value >= s,
        "maximum": lambda s: not number or value <= s,
        "exclusiveMinimum": lambda s: not number or value > s,
        "exclusiveMaximum": lambda s: not number or value < s,
        "minLength": lambda s: not text or len(value) >= s,
        "maxLength": lambda s: not text or len(value) <= s,
        "pattern": lambda s: not text or re.search(s, value) is not None,
        "minItems": lambda s: not array or len(value) >= s,
        "maxItems": lambda s: not array or len(value) <= s,
        "minProperties": lambda s: not dictionary or len(value) >= s,
        "required": lambda s: not dictionary or all(key in value for key in s),
        "prefixItems": lambda s: not array or all_of(zip(value, s, strict=False)),
        "items": lambda s: not array or all_of((v, s) for v in value[len(schema.get("prefixItems", ())) :]),
        "properties": lambda s: not dictionary or all_of((value[k], each) for k, each in s.items() if k in value),
        "propertyNames": lambda s: not dictionary or all_of((key, s) for key in value),
        "additionalProperties": lambda s: (
            not dictionary or all_of((v, s) for k, v in value.items() if k not in schema.get("properties", {}))
        ),
    }
    return all(rules[keyword](argument) for keyword, argument in schema.items() if keyword not in REMARKS)


def _definition(reference: str, root: dict[str, Any]) -> Any:
    at: Any = root
    for key in reference.removeprefix("#/").split("/"):
        at = at[key]
    return at


@pytest.fixture(scope="module")
def schema(request) -> dict[str, Any]:
    return json.loads((request.config.rootpath / "docs" / "scene.schema.json").read_text(encoding="utf-8"))


def test_the_file_is_what_the_program_says(schema):
    """After a change:  raymaps schema > docs/scene.schema.json"""
    assert schema == scene_json_schema()


def test_schema_names_its_dialect_and_version(schema):
    assert schema["$schema"].endswith("draft/2020-12/schema")
    assert schema["properties"]["version"]["const"] == 1
    assert schema["properties"]["format"]["const"] == "raymaps-scene"


def test_every_model_refuses_unknown_fields(schema):
    objects = [d for d in [schema, *schema["$defs"].values()] if "properties" in d]
    assert len(objects) > 10
    assert all(d["additionalProperties"] is False for d in objects)


def test_shipped_scenes_are_valid(schema, example_scenes):
    assert len(example_scenes) >= 2
    for path in example_scenes:
        assert valid(json.loads(path.read_text(encoding="utf-8")), schema, schema), path


def test_scenes_as_maps_hold_them_are_valid(schema, tmp_path, example_scenes):
    for path in example_scenes:
        assert valid(json.loads(json.dumps(load_scene(path).model_dump(mode="json"))), schema, schema), path


@pytest.mark.parametrize("make", [workshop, lamp_in_a_room])
def test_small_scenes_are_valid(schema, tmp_path, make):
    assert valid(make(tmp_path), schema, schema)


BAD = [
    ("media.glass.refractive_index", 0), ("media.glass.refractive_index", "1.5"), ("media.glass.abbe", 1),
    ("media.glass.absorption_per_mm", -1), ("media.glass.absorption_per_mm", [0, 0]),
    ("surfaces.mirror.reflectance", 1.5), ("surfaces.mirror.reflectance", [0, 0, 2]), ("surfaces.black.kind", "shiny"),
    ("surfaces.satin.parts", []), ("surfaces.satin.parts.0.weight", 2), ("bodies.Block.surface", None),
    ("bodies.Block.geometry", "Block.ply"), ("bodies.Block.geometry.mm_per_unit", 0), ("bodies.Block.surface", ""),
    ("sources", {}), ("sources.LED.flux_w", 0), ("sources.LED.kind", "laser"), ("sources.LED.faces", []),
    ("sources.Lamp.position_mm", [0, 0]), ("sources.Lamp.position_mm", [0, 0, 0, 0]),
    ("sources.Spot.half_angle_deg", 181), ("detectors.Above.resolution", [0, 1]), ("detectors.Above.side", "left"),
    ("detectors.Above.max_angle_deg", 91), ("settings.rays", 0), ("settings.rays", 1.5), ("settings.max_events", 1),
    ("settings.threads", 2), ("version", 2), ("format", "obj"), ("name", ""), ("extra", 1),
]  # fmt: skip


@pytest.mark.parametrize(("place", "value"), BAD, ids=lambda x: str(x)[:40])
def test_bad_scenes_are_neither_valid_nor_read(schema, tmp_path, place, value):
    data = changed(workshop(tmp_path), place, value)
    assert not valid(data, schema, schema)
    with pytest.raises(SceneError):
        scene_from_dict(data)


@pytest.mark.parametrize("field", ["sources", "format"])
def test_what_must_be_there(schema, tmp_path, field):
    data = copy.deepcopy(workshop(tmp_path))
    del data[field]
    if field == "sources":
        assert not valid(data, schema, schema)
    with pytest.raises(SceneError):
        scene_from_dict(data)
