# SPDX-License-Identifier: LGPL-2.1-or-later
"""What `raymaps check` says of bodies: every fault, pairs that meet, odd triangles, faces that stay facets."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from raymaps.check import MAX_ALIKE, Finding, check_scene
from raymaps.geometry import BodyMesh
from tests.store.small_scenes import BOX_FACES, box, geometry, mesh, write_scene


def findings(folder: Path, bodies: list[BodyMesh], priority=None, surfaces=None, **media) -> tuple[Finding, ...]:
    """Of a scene whose bodies are of glass but for those that are named; ``surfaces`` are records of exact surfaces."""
    data = {
        "format": "raymaps-scene",
        "version": 1,
        "media": {name: {"refractive_index": 1.5} for name in sorted({"glass", *media.values()} - {None})},
        "surfaces": {"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}},
        "bodies": {
            b.name: {
                "geometry": geometry(folder, b),
                "medium": media.get(b.name, "glass"),
                "surface": "polished" if media.get(b.name, "glass") else "black",
                "priority": (priority or {}).get(b.name, 0),
            }
            for b in bodies
        },
        "sources": {"P": {"kind": "point", "flux_w": 1, "position_mm": [30, 0, 0]}},
    }
    for body, records in (surfaces or {}).items():
        for face in data["bodies"][body]["geometry"]["faces"]:
            face["surface"] = records.get(face["name"])
    return check_scene(write_scene(folder, data))


def texts(*arguments, **options) -> list[str]:
    """What is told that is no fault and is not about materials."""
    found = findings(*arguments, **options)
    assert not any(finding.is_fault for finding in found), found
    return [finding.text for finding in found if "is not used" not in finding.text]


def test_bodies_that_are_clear_of_each_other(tmp_path):
    assert texts(tmp_path, [box("A", (-1, 0, 0), 2), box("B", (1.001, 0, 0), 2)]) == []


def test_bodies_that_touch(tmp_path):
    (text,) = texts(tmp_path, [box("A", (-1, 0, 0), 2), box("B", (2, 0, 0), (4, 6, 8))])
    assert text.startswith("Bodies 'A' and 'B' touch at ")
    assert "left of 'B'" in text
    assert "right" in text.partition("of 'A'")[0]
    assert "one interface" in text


def test_bodies_that_overlap(tmp_path):
    pair = [box("A", (-1, 0, 0), 2), box("B", (1.5, 0, 0), (4, 6, 8))]
    (text,) = texts(tmp_path, pair)
    assert "overlap by about 0.5 mm" in text
    assert "'A' rules there, as it is smaller" in text
    (text,) = texts(tmp_path, pair, {"B": 1})
    assert "'B' rules there, as its priority is higher" in text
    (text,) = texts(tmp_path, [box("A", (-1, 0, 0), 2), box("B", (0.5, 0, 0), 2)])
    assert "'B' rules there, as it is later in the scene" in text


def test_a_body_inside_another(tmp_path):
    pair = [box("Block", 0, 10), box("Bubble", (1, 0, 0), 2)]
    (text,) = texts(tmp_path, pair, Bubble="air")
    assert text == "Body 'Bubble' stands inside body 'Block': 'Bubble' rules there, as it is smaller."
    (text,) = texts(tmp_path, pair, {"Block": 1}, Bubble="air")
    assert "'Block' rules there" in text
    assert "Nothing of it is left" in text


def test_opaque_bodies_are_not_told(tmp_path):
    assert texts(tmp_path, [box("A", (-1, 0, 0), 2), box("B", (1, 0, 0), 2)], A=None) == []


def test_of_many_pairs_the_first_are_told(tmp_path):
    row = [box(f"B{k}", (2 * k - 24, 0, 0), 2) for k in range(MAX_ALIKE + 4)]
    told = texts(tmp_path, row)
    assert len(told) == MAX_ALIKE + 1
    assert told[-1] == "3 more pairs of bodies touch, overlap or stand in each other."


def test_all_faulty_bodies_are_told(tmp_path):
    """An open one and one inside out: two faults, with the faces."""
    whole = box("x", (0, 0, 0), 2)
    holed = mesh("Open", whole.vertices_mm, whole.triangles[2:], dict.fromkeys(BOX_FACES[1:], 2))
    flipped = mesh("Turned", whole.vertices_mm, whole.triangles[:, ::-1], dict.fromkeys(BOX_FACES, 2))
    found = findings(tmp_path, [holed, flipped])
    first, second = [finding.text for finding in found if finding.is_fault]
    assert "'Open'" in first
    assert "faces front, back, bottom, top;" in first
    assert "'Turned'" in second
    assert "inside out" in second


def test_odd_triangles_are_told(tmp_path):
    a, b = box("a", 0, (9, 1, 1)), box("b", 0, (1, 9, 1.5))
    both = mesh("Cross", np.vstack([a.vertices_mm, b.vertices_mm]), np.vstack([a.triangles, b.triangles + 8]))
    (text,) = texts(tmp_path, [both])
    assert "'Cross' goes through itself" in text


def test_faces_that_stay_facets_are_told_by_reason(tmp_path):
    other = {"type": "other", "name": "Part::GeomOffsetSurface", "reason": "offset surfaces are not described"}
    off = {"type": "plane", "point_mm": [0, 0, 7], "normal": [0, 0, 1]}
    sound = {"type": "plane", "point_mm": [0, 0, -1], "normal": [0, 0, 1]}
    records = {"left": other, "right": other, "top": off, "bottom": sound}
    told = texts(tmp_path, [box("A", 0, 2)], surfaces={"A": records})
    assert len(told) == 2
    assert "facets of left, right as offset surfaces are not described." in told[0]
    assert "facets of top as its triangles" in told[1]
    assert "off the plane" in told[1]
