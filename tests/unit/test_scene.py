# SPDX-License-Identifier: LGPL-2.1-or-later
"""The scene file: every fault is one sentence that says where, what, the value, and what is allowed."""

from __future__ import annotations

import copy
import json
import math
import re

import numpy as np
import pytest
from pydantic import ValidationError

from raymaps.errors import SceneError
from raymaps.scene import SCENE_VERSION, RectangleDetector, Scene, load_scene, scene_from_dict
from tests.store.small_scenes import changed, write_scene

GOOD = {
    "format": "raymaps-scene",
    "version": 1,
    "name": "two words, Größe",
    "ambient": "air",
    "media": {
        "air": {"refractive_index": 1.0},
        "glass": {"refractive_index": 1.5, "absorption_per_mm": [0.1, 0.2, 0.3]},
    },
    "surfaces": {
        "black": {"kind": "absorber"},
        "mirror": {"kind": "mirror", "reflectance": 0.92},
        "white": {"kind": "lambertian", "reflectance": [0.9, 0.8, 0.7], "transmittance": 0.05},
        "polished": {"kind": "fresnel"},
        "satin": {
            "kind": "mixture",
            "parts": [{"weight": 0.7, "surface": "white"}, {"weight": 0.3, "surface": "mirror"}],
        },
    },
    "bodies": {
        "Lens": {
            "geometry": {
                "file": "g/Lens.ply",
                "mm_per_unit": 1.0,
                "faces": [{"name": "Face1", "triangles": 12, "surface": {"type": "sphere", "radius_mm": 20}}],
            },
            "medium": "glass",
            "surface": "polished",
            "face_surfaces": {"Face1": "satin"},
        }
    },
    "sources": {
        "LED": {"kind": "faces", "flux_w": 1.0, "rgb": [1, 1, 1], "body": "Lens", "faces": ["Face1"]},
        "P": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]},
        "Spot": {"kind": "cone", "flux_w": 1, "position_mm": [0, 0, 0], "direction": [0, 0, 1], "half_angle_deg": 10},
        "Beam": {"kind": "disc", "flux_w": 1, "position_mm": [0, 0, 0], "direction": [0, 0, 2], "radius_mm": 5},
    },
    "detectors": {
        "Sensor": {
            "kind": "rectangle",
            "center_mm": [0, 0, 9],
            "normal": [0, 0, 1],
            "x_axis": [1, 0, 0],
            "width_mm": 10,
            "height_mm": 8,
            "resolution": [100, 80],
            "side": "front",
            "max_angle_deg": 90,
        }
    },
    "settings": {"rays": 100000, "seed": 1, "max_events": 1000, "roulette_threshold": 0.1},
    "origin": {"document": "led.FCStd", "fingerprint": "0a1b"},
}


def sentence_about(data) -> str:
    with pytest.raises(SceneError) as caught:
        scene_from_dict(data, "here.scene.json")
    text = str(caught.value)
    assert text.startswith("Scene 'here.scene.json'")
    assert text.endswith(".")
    assert "\n" not in text
    assert len(text) < 500
    assert not re.search(r"pydantic|Traceback|\bstr_type|\bmodel_", text, re.IGNORECASE)
    return text


def test_a_good_scene_is_read():
    scene = scene_from_dict(GOOD)
    assert scene.media["glass"].absorption_per_mm == (0.1, 0.2, 0.3)
    assert scene.surfaces["mirror"].reflectance == (0.92, 0.92, 0.92)
    assert scene.bodies["Lens"].geometry.faces[0].surface == {"type": "sphere", "radius_mm": 20}
    assert scene.sources["P"].rgb == (1.0, 1.0, 1.0)
    assert scene.ambient_medium is scene.media["air"]


#: Place, bad value, and what the sentence about it must hold, beside the place's own last name.
BAD_VALUES = [
    # numbers out of range
    ("media.glass.refractive_index", 0, ["media 'glass'", "greater than 0", "got 0"]),
    ("media.glass.refractive_index", -1.5, ["media 'glass'", "greater than 0", "-1.5"]),
    ("media.glass.refractive_index", 11, ["media 'glass'", "less than or equal to 10", "11"]),
    ("media.glass.absorption_per_mm", -0.1, ["media 'glass'", "greater than or equal to 0", "-0.1"]),
    ("media.glass.absorption_per_mm", [0, 0, -1], ["media 'glass'", "greater than or equal to 0", "-1"]),
    ("surfaces.mirror.reflectance", 1.01, ["surfaces 'mirror'", "less than or equal to 1", "1.01"]),
    ("surfaces.mirror.reflectance", -0.01, ["surfaces 'mirror'", "greater than or equal to 0", "-0.01"]),
    ("surfaces.mirror.reflectance", [0.5, 0.5, 2], ["surfaces 'mirror'", "less than or equal to 1", "2"]),
    ("surfaces.white.reflectance", 1.5, ["surfaces 'white'", "less than or equal to 1", "1.5"]),
    ("surfaces.white.transmittance", -1, ["surfaces 'white'", "greater than or equal to 0", "-1"]),
    ("surfaces.satin.parts.0.weight", 1.2, ["surfaces 'satin'", "less than or equal to 1", "1.2"]),
    ("surfaces.satin.parts.0.weight", -0.2, ["surfaces 'satin'", "greater than or equal to 0", "-0.2"]),
    ("bodies.Lens.geometry.mm_per_unit", 0, ["bodies 'Lens'", "geometry", "greater than 0"]),
    ("bodies.Lens.geometry.faces.0.triangles", 0, ["bodies 'Lens'", "faces[0]", "greater than or equal to 1"]),
    ("bodies.Lens.geometry.faces.0.triangles", 1.5, ["bodies 'Lens'", "faces[0]", "1.5"]),
    ("sources.LED.flux_w", 0, ["sources 'LED'", "greater than 0"]),
    ("sources.LED.flux_w", -3, ["sources 'LED'", "greater than 0", "-3"]),
    ("sources.Spot.half_angle_deg", 0, ["sources 'Spot'", "greater than 0"]),
    ("sources.Spot.half_angle_deg", 181, ["sources 'Spot'", "less than or equal to 180", "181"]),
    ("sources.Beam.radius_mm", -5, ["sources 'Beam'", "greater than 0", "-5"]),
    ("detectors.Sensor.width_mm", 0, ["detectors 'Sensor'", "greater than 0"]),
    ("detectors.Sensor.height_mm", -8, ["detectors 'Sensor'", "greater than 0", "-8"]),
    ("detectors.Sensor.resolution", [0, 10], ["detectors 'Sensor'", "greater than or equal to 1"]),
    ("detectors.Sensor.resolution", [10, 10001], ["detectors 'Sensor'", "less than or equal to 10000", "10001"]),
    ("detectors.Sensor.max_angle_deg", 0, ["detectors 'Sensor'", "greater than 0"]),
    ("detectors.Sensor.max_angle_deg", 91, ["detectors 'Sensor'", "less than or equal to 90", "91"]),
    ("settings.rays", 0, ["settings", "greater than or equal to 1"]),
    ("settings.rays", 10**13, ["settings", "less than or equal to 1000000000000"]),
    ("settings.rays", 1.5, ["settings", "1.5"]),
    ("settings.seed", -1, ["settings", "greater than or equal to 0", "-1"]),
    ("settings.seed", 2**64, ["settings", "less than 18446744073709551616"]),
    ("settings.max_events", 1, ["settings", "greater than or equal to 2", "1"]),
    ("settings.max_events", 100_001, ["settings", "less than or equal to 100000"]),
    ("settings.roulette_threshold", 1.1, ["settings", "less than or equal to 1", "1.1"]),
    ("settings.roulette_threshold", -0.1, ["settings", "greater than or equal to 0", "-0.1"]),
    # not finite
    ("media.glass.refractive_index", math.nan, ["media 'glass'", "finite", "nan"]),
    ("media.glass.absorption_per_mm", [0, math.inf, 0], ["media 'glass'", "finite", "inf"]),
    ("sources.P.position_mm", [0, 0, math.nan], ["sources 'P'", "finite", "nan"]),
    ("sources.P.flux_w", math.inf, ["sources 'P'", "finite", "inf"]),
    ("detectors.Sensor.center_mm", [math.inf, 0, 0], ["detectors 'Sensor'", "finite", "inf"]),
    # of another type
    ("media.glass.refractive_index", "heavy", ["media 'glass'", "number", "heavy"]),
    ("media.glass.refractive_index", None, ["media 'glass'", "number"]),
    ("media.glass.refractive_index", [1.5], ["media 'glass'", "number"]),
    ("media.glass", 1.5, ["media 'glass'"]),
    ("media", [], ["object"]),
    ("surfaces.black", "black", ["surfaces 'black'"]),
    ("bodies.Lens.geometry", "Lens.ply", ["bodies 'Lens'"]),
    ("bodies.Lens.surface", 3, ["bodies 'Lens'", "string"]),
    ("bodies.Lens.surface", None, ["bodies 'Lens'", "string"]),
    ("bodies.Lens.face_surfaces", ["Face1"], ["bodies 'Lens'"]),
    ("sources.P.position_mm", 0, ["sources 'P'", "list"]),
    ("sources.P.position_mm", [0, 0], ["sources 'P'"]),
    ("sources.P.position_mm", [0, 0, 0, 0], ["sources 'P'"]),
    ("sources.LED.rgb", [1, 1], ["sources 'LED'"]),
    ("sources.LED.faces", [], ["sources 'LED'", "at least 1"]),
    ("sources.LED.faces", "Face1", ["sources 'LED'"]),
    ("detectors.Sensor.resolution", 100, ["detectors 'Sensor'"]),
    ("settings", 3, ["settings"]),
    ("origin", "led.FCStd", ["origin"]),
    ("name", 7, ["name", "string", "7"]),
    # choices
    ("surfaces.black.kind", "shiny", ["surfaces 'black'", "shiny", "'absorber'", "'mixture'", "'fresnel'"]),
    ("sources.P.kind", "laser", ["sources 'P'", "laser", "'point'", "'disc'"]),
    ("detectors.Sensor.kind", "sphere", ["detectors 'Sensor'", "'rectangle'", "sphere"]),
    ("detectors.Sensor.side", "left", ["detectors 'Sensor'", "'front'", "'back'", "'both'", "left"]),
    # light and directions
    ("sources.LED.rgb", [0, 0, 0], ["sources 'LED'", "above 0"]),
    ("sources.LED.rgb", [1, 1, -1], ["sources 'LED'", "0 or more"]),
    ("sources.Spot.direction", [0, 0, 0], ["sources 'Spot'", "length above zero"]),
    ("sources.Beam.direction", [0, 0, 0], ["sources 'Beam'", "length above zero"]),
    ("detectors.Sensor.normal", [0, 0, 0], ["detectors 'Sensor'", "length above zero"]),
    ("detectors.Sensor.x_axis", [0, 0, 0], ["detectors 'Sensor'", "length above zero"]),
    ("detectors.Sensor.x_axis", [0, 0, -3], ["detectors 'Sensor'", "parallel to the normal"]),
    # sums
    ("surfaces.white.transmittance", [0.1, 0.2, 0.31], ["surfaces 'white'", "at most 1", "1.01 in band b", "band b"]),
    ("surfaces.satin.parts.0.weight", 0.6, ["surfaces 'satin'", "add up to 1", "got 0.9"]),
    ("surfaces.satin.parts", [], ["surfaces 'satin'", "at least 1"]),
    # names
    ("ambient", "water", ["ambient", "unknown medium 'water'", "'air', 'glass'"]),
    ("bodies.Lens.medium", "water", ["bodies 'Lens'", "unknown medium 'water'", "'air', 'glass'"]),
    ("bodies.Lens.surface", "gold", ["bodies 'Lens'", "unknown surface property 'gold'", "'black'"]),
    ("bodies.Lens.face_surfaces", {"Face1": "gold"}, ["bodies 'Lens'", "'Face1'", "unknown surface property 'gold'"]),
    ("sources.LED.body", "Chip", ["sources 'LED'", "unknown body 'Chip'", "'Lens'"]),
    ("surfaces.satin.parts.0.surface", "gold", ["surfaces 'satin'", "unknown surface property 'gold'"]),
    ("surfaces.satin.parts.0.surface", "satin", ["surfaces 'satin'", "mixture"]),
    ("name", "", ["name"]),
    ("name", "  ", ["name", "visible"]),
    ("name", "a\nb", ["name", "control characters"]),
    ("name", "\x7f", ["name", "control characters"]),
    ("name", "x" * 201, ["name", "200"]),
    ("bodies.Lens.geometry.file", "", ["bodies 'Lens'", "at least 1"]),
]


@pytest.mark.parametrize(("place", "value", "fragments"), BAD_VALUES, ids=lambda x: str(x)[:40])
def test_a_bad_value_is_one_sentence(place, value, fragments):
    text = sentence_about(changed(GOOD, place, value))
    section, last = place.split(".")[0], place.split(".")[-1]
    for fragment in fragments:
        assert fragment in text
    if not any(word in text for word in ("unknown", "mixture", "add up", "at most 1,")):
        assert section in text
    if not last.isdigit() and not any(w in text for w in ("unknown", "add up", "at most 1,", "x_axis", "tag")):
        assert last in text or f"'{last}'" in text


REQUIRED = [
    "media.glass.refractive_index", "surfaces.black.kind", "surfaces.satin.parts", "surfaces.satin.parts.0.weight",
    "surfaces.satin.parts.0.surface", "bodies.Lens.geometry", "bodies.Lens.geometry.file", "bodies.Lens.surface",
    "bodies.Lens.geometry.faces.0.name", "bodies.Lens.geometry.faces.0.triangles", "sources", "sources.LED.body",
    "sources.LED.flux_w", "sources.LED.kind", "sources.P.position_mm", "sources.Spot.direction",
    "sources.Spot.half_angle_deg", "sources.Beam.radius_mm", "detectors.Sensor.center_mm", "detectors.Sensor.normal",
    "detectors.Sensor.x_axis", "detectors.Sensor.width_mm", "detectors.Sensor.height_mm",
]  # fmt: skip


@pytest.mark.parametrize("place", REQUIRED)
def test_a_missing_field_is_named(place):
    data = copy.deepcopy(GOOD)
    *way, last = place.split(".")
    at = data
    for key in way:
        at = at[int(key)] if isinstance(at, list) else at[key]
    del at[last]
    text = sentence_about(data)
    assert last in text
    if way:
        assert f"{way[0]} '{way[1]}'" in text


OPTIONAL = [
    "name", "ambient", "media.glass.absorption_per_mm", "surfaces.mirror.reflectance", "bodies.Lens.medium",
    "bodies.Lens.face_surfaces", "bodies.Lens.geometry.mm_per_unit", "bodies.Lens.geometry.faces", "sources.LED.rgb",
    "sources.LED.faces", "detectors", "detectors.Sensor.resolution", "detectors.Sensor.side",
    "detectors.Sensor.max_angle_deg", "settings", "settings.rays", "origin",
]  # fmt: skip


@pytest.mark.parametrize("place", OPTIONAL)
def test_other_fields_may_be_left_out(place):
    data = copy.deepcopy(GOOD)
    *way, last = place.split(".")
    at = data
    for key in way:
        at = at[key]
    del at[last]
    scene_from_dict(data)


@pytest.mark.parametrize(
    "place",
    ["extra", "media.glass.abbe", "surfaces.mirror.transmittance", "bodies.Lens.colour", "bodies.Lens.geometry.unit",
     "sources.P.radius_mm", "detectors.Sensor.depth_mm", "settings.threads", "surfaces.satin.parts.0.part"],
)  # fmt: skip
def test_an_unknown_field_is_named(place):
    text = sentence_about(changed(GOOD, place, 1))
    assert place.split(".")[-1] in text
    assert "no such field" in text


def test_more_faults_are_counted():
    data = changed(changed(GOOD, "settings.rays", 0), "media.glass.refractive_index", -1)
    assert "(1 more fault" in sentence_about(data)


def test_a_scene_without_a_source_is_refused():
    assert "sources" in sentence_about(changed(GOOD, "sources", {}))


@pytest.mark.parametrize("rgb", [[1e308, 1e308, 1e308], [1e-320, 0, 0]])
def test_extreme_colours_are_refused_or_finite(rgb):
    """The sum of the bands must neither overflow nor vanish, for it is divided by."""
    try:
        scene = scene_from_dict(changed(GOOD, "sources.LED.rgb", rgb))
    except SceneError:
        return
    share = np.array(scene.sources["LED"].rgb)
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        assert (share / share.sum()).sum() == pytest.approx(1)


@pytest.mark.parametrize("direction", [[0, 0, 1e-200], [1e200, 0, 0]])
def test_directions_of_absurd_length_are_refused(direction):
    assert "sources 'Spot'" in sentence_about(changed(GOOD, "sources.Spot.direction", direction))


@pytest.mark.parametrize("data", [None, [], 3, "scene", {}, {"version": 1}, {"format": "obj"}, {"format": 3}])
def test_something_else_is_told_apart(data):
    with pytest.raises(SceneError) as caught:
        scene_from_dict(data, "x")
    assert "object" in str(caught.value) or "not a scene file" in str(caught.value)


@pytest.mark.parametrize("extra", [{}, {"format": "raymaps-scene"}, {"format": "raymaps-scene", "new_field": 3}])
def test_a_newer_version_is_told(extra):
    with pytest.raises(SceneError, match=rf"version 99, this program reads up to version {SCENE_VERSION}"):
        scene_from_dict({"version": 99, **extra})


@pytest.mark.parametrize("version", [0, -1, "1", 1.5, None, True, [1]])
def test_other_versions_are_refused(version):
    assert "version" in sentence_about(changed(GOOD, "version", version))


# ---------------------------------------------------------------------------------------------------------------------
# The file


def refused_text(tmp_path, text: str | bytes) -> str:
    path = tmp_path / "bad.scene.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    sentence = str(caught.value)
    assert str(path) in sentence
    assert "\n" not in sentence
    assert len(sentence) < 600
    return sentence


BAD_TEXTS = [
    (b"", "not valid JSON"),
    (b"{", "not valid JSON"),
    (b"[]", "must be a JSON object"),
    (b"{}", "not a scene file"),
    (b"\x00\x01", "not valid JSON"),
    (b"\xff\xfe{}", "not UTF-8"),
    ('{"name": "é"}'.encode("latin-1"), "not UTF-8"),
    (b"9" * 5000, "not valid JSON"),
    (b'{"version": 999999}', "version 999999"),
    (b'{"version": 9' + b"9" * 3000 + b"}", "version 999"),
    (b'{"a": 1, "a": 2}', "'a' stands twice"),
    (b'{"media": {"air": {}, "air": {}}}', "'air' stands twice"),
    (b'{"format": "raymaps-scene", "version": 1, "settings": {"rays": NaN}}', "NaN"),
    (b'{"a": Infinity}', "Infinity"),
    (b'{"a": [1, -Infinity]}', "-Infinity"),
    (b"[" * 100_000, "nested too deeply"),
    (b'{"a":' * 100_000, "nested too deeply"),
    (b'{"format": "raymaps-scene", "version": 1, "origin": ' + b'{"a":' * 50_000, "nested too deeply"),
    (b"{'format': 'raymaps-scene'}", "not valid JSON"),
    (b'{"format": "raymaps-scene", "version": 1,}', "not valid JSON"),
]


@pytest.mark.parametrize(("text", "fragment"), BAD_TEXTS, ids=lambda x: repr(x)[:30])
def test_bad_files_are_one_sentence(tmp_path, text, fragment):
    assert fragment in refused_text(tmp_path, text)


@pytest.mark.parametrize("number", ["1e999", "-1e999", "1" + "0" * 400])
def test_numbers_beyond_float64_are_refused(tmp_path, number):
    """1e999 is good JSON and reads as infinity."""
    text = json.dumps(changed(GOOD, "media.glass.refractive_index", 1.25)).replace("1.25", number)
    assert "refractive_index" in refused_text(tmp_path, text)


def test_a_name_with_half_a_surrogate_pair_is_refused(tmp_path):
    """It can't be written as UTF-8, so no map could hold it."""
    text = json.dumps(GOOD).replace("two words", "\\ud800")
    assert "name" in refused_text(tmp_path, text)


@pytest.mark.parametrize("bad", ["\ud800", math.inf, -math.inf, math.nan])
@pytest.mark.parametrize("place", ["origin.document", "bodies.Lens.geometry.faces.0.surface.radius_mm"])
def test_free_values_that_no_file_can_hold_are_refused(place, bad):
    """What is carried along unread is written into the map's own scene file all the same, which must stay readable."""
    assert place.split(".")[0] in sentence_about(changed(GOOD, place, bad))


def test_free_values_nested_deeply_can_be_written_or_are_refused():
    nested: dict = {}
    for _ in range(500):
        nested = {"deeper": nested}
    try:
        scene = scene_from_dict(changed(GOOD, "origin.nested", nested))
    except SceneError:
        return
    assert json.loads(json.dumps(scene.model_dump(mode="json")))["origin"]["nested"] == nested


def test_a_missing_file_and_a_folder(tmp_path):
    with pytest.raises(SceneError, match="there is no such file"):
        load_scene(tmp_path / "none.scene.json")
    with pytest.raises(SceneError, match="can't be read"):
        load_scene(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(SceneError, match="can't be read"):
        load_scene(tmp_path / "file" / "x.scene.json")


def test_a_byte_order_mark_is_told_apart_from_bad_json(tmp_path):
    """Some editors on Windows write one; the sentence says so."""
    assert "BOM" in refused_text(tmp_path, b"\xef\xbb\xbf" + json.dumps(GOOD).encode())


def test_load_keeps_names_order_and_folder(tmp_path):
    scene = load_scene(write_scene(tmp_path, GOOD))
    assert scene.folder == tmp_path
    assert list(scene.surfaces) == list(GOOD["surfaces"])
    assert scene.name == "two words, Größe"


def test_dump_and_load_round_trip(tmp_path):
    scene = scene_from_dict(GOOD)
    path = write_scene(tmp_path, scene.model_dump(mode="json"))
    again = load_scene(path)
    assert again.model_dump() == scene.model_dump()
    assert again.model_dump_json() == scene.model_dump_json()


def test_a_scene_is_frozen():
    scene = scene_from_dict(GOOD)
    for part, field in ((scene, "name"), (scene.media["glass"], "refractive_index"), (scene.sources["P"], "flux_w")):
        with pytest.raises(ValidationError, match="frozen"):
            setattr(part, field, 1)


def test_integers_stand_for_numbers_but_booleans_and_text_do_not():
    assert scene_from_dict(changed(GOOD, "media.glass.refractive_index", 2)).media["glass"].refractive_index == 2.0
    for value in ("1.5", True):
        assert "refractive_index" in sentence_about(changed(GOOD, "media.glass.refractive_index", value))


# ---------------------------------------------------------------------------------------------------------------------
# Detectors


@pytest.mark.parametrize(
    ("side", "max_angle_deg", "accepted"),
    [
        ("front", 90, [True, True, True, False, False, False]),
        ("back", 90, [False, False, False, True, True, True]),
        ("both", 90, [True, True, True, True, True, True]),
        ("front", 45, [True, True, False, False, False, False]),
        ("back", 45, [False, False, False, False, True, True]),
        ("both", 10, [True, False, False, False, False, True]),
    ],
)
def test_side_and_angle_decide_what_is_registered(side, max_angle_deg, accepted):
    angle_rad = np.radians([0, 30, 80, 100, 150, 180])
    data = {**GOOD["detectors"]["Sensor"], "side": side, "max_angle_deg": max_angle_deg}
    assert RectangleDetector(**data).accepts(angle_rad).tolist() == accepted


def test_another_angle_takes_the_place_of_the_detectors_own():
    detector = scene_from_dict(GOOD).detectors["Sensor"]
    assert detector.accepts(np.radians([20.0, 40.0]), math.radians(30)).tolist() == [True, False]


def test_scene_class_itself_validates():
    with pytest.raises(ValidationError):
        Scene(sources={})
