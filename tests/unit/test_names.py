# SPDX-License-Identifier: LGPL-2.1-or-later
from __future__ import annotations

import json

import pytest

from raymaps.names import Names

NAMES = Names(
    sources=("LED 1",),
    bodies=("Lens", 'Größe "quoted"'),
    surfaces=("polished", "black"),
    media=("air", "PMMA"),
    detectors=(),
    faces=((0, "Face1"), (0, "Face2"), (1, "Face1")),
)


def test_round_trip_through_json():
    assert Names.from_dict(json.loads(json.dumps(NAMES.to_dict()))) == NAMES


def test_faces_are_counted_through_all_bodies():
    assert [NAMES.face_label(i) for i in range(3)] == ["Lens.Face1", "Lens.Face2", 'Größe "quoted".Face1']


def test_frozen():
    with pytest.raises(AttributeError):
        NAMES.bodies = ()


@pytest.mark.parametrize("field", ["sources", "bodies", "surfaces", "media", "detectors", "faces"])
def test_a_missing_field_is_damage(field):
    data = NAMES.to_dict()
    del data[field]
    with pytest.raises(KeyError):
        Names.from_dict(data)


@pytest.mark.parametrize("faces", [[[2, "Face1"]], [[-1, "Face1"]], [["x", "Face1"]], [[0]], [3], 7])
def test_damaged_faces(faces):
    with pytest.raises((TypeError, ValueError)):
        Names.from_dict({**NAMES.to_dict(), "faces": faces})
