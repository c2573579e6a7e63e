# SPDX-License-Identifier: LGPL-2.1-or-later
"""Triangles that a careless export makes, and detectors where they should not be."""

import numpy as np
import pytest

from raymaps.errors import SceneError
from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from tests.physics.scenes import Shape, ball, body, box, disc_source, rectangle, traced
from tests.stability.aiming import aimed, clear, lost, rotation

WHITE = {"white": {"kind": "lambertian", "reflectance": 1.0}}
POINT = {"S": {"kind": "point", "flux_w": 1.0, "position_mm": [0.1, 0.2, 0.3]}}


def appended(shape, vertices, triangles):
    """A shape with further triangles on its last face."""
    vertices = np.asarray(vertices, float).reshape(-1, 3)
    more = np.asarray(triangles, np.int64) + len(shape.vertices)
    *faces, (name, count) = shape.faces
    return Shape(
        np.concatenate([shape.vertices, vertices]),
        np.concatenate([shape.triangles, more]),
        (*faces, (name, count + len(more))),
    )


def with_slivers(shape, aspect):
    """Every triangle split at a point so near to one of its edges that a sliver of an aspect is left there."""
    vertices, triangles, faces, start = [shape.vertices], [], [], 0
    n = len(shape.vertices)
    for name, count in shape.faces:
        for a, b, c in shape.triangles[start : start + count]:
            va, vb, vc = shape.vertices[[a, b, c]]
            middle = (va + vb) / 2
            inner = middle + (vc - middle) / aspect
            vertices.append(inner[None])
            triangles += [(a, b, n), (b, c, n), (c, a, n)]
            n += 1
        faces.append((name, 3 * count))
        start += count
    return Shape(np.concatenate(vertices), np.array(triangles), tuple(faces))


def holds_its_light(folder, shape, *, rays=3_000, events=100):
    """A white room that leaks nothing."""
    h = traced(
        folder,
        {"Room": body(shape, "white")},
        rays=rays,
        settings={"max_events": events},
        surfaces=WHITE,
        sources=POINT,
    )
    assert lost(h).all == 0
    assert (h.kind[h.last] == EventKind.KILLED_DEPTH).all()
    assert energy_ledger(h.raymap).killed_by_reason_w["depth"] == 1.0
    return h


# ---------------------------------------------------------------------------------------------------------------------
# Triangles


@pytest.mark.parametrize("aspect", [1e4, 1e6, 1e8])
def test_slivers_in_a_room(tmp_path, aspect):
    """Guards: planes of slivers are computed in float64 from their corners in mm; float32 would have them stand
    askew."""
    h = holds_its_light(tmp_path, with_slivers(box((-10, -7, -4), (10, 7, 4)).turned(0.7, (1, 2, 3)), aspect))
    # all events lie on the six planes of the box
    place = h.position[(h.number > 0)] @ rotation()
    off = np.abs(np.abs(place) - (10, 7, 4)).min(axis=1)
    assert off.max() <= 2 * h.raymap.manifest.grid_mm


def test_triangles_without_an_area_are_not_there(tmp_path):
    """Points, lines, and triangles folded to a line, among those of a room: rays are those of the room without them.

    Guards: triangles keep their numbers though Embree never meets some of them, and their planes are not numbers.
    """
    room = box((-10, -7, -4), (10, 7, 4))
    odd = [(0, 0, 4), (1, 1, 4), (2, 2, 4), (5, 5, 4), (5, 5, 4), (5, 5, 4)]
    h = holds_its_light(tmp_path, appended(room, odd, [(0, 1, 2), (3, 4, 5), (0, 0, 1), (2, 2, 2)]))
    plain = holds_its_light(tmp_path / "plain", room)
    assert np.array_equal(h.kind, plain.kind)
    assert np.array_equal(h.position, plain.position)
    assert h.triangle.max() < 12


def test_triangles_twice(tmp_path):
    """Every triangle of a room twice, a face of it inside out besides: light is reflected once, not caught between.

    Guards: a search that starts on a triangle also passes over what lies in its plane (START_OFFSET); two crossings in
    one place are one interface.
    """
    room = box((-10, -7, -4), (10, 7, 4))
    twice = appended(room, room.vertices, np.concatenate([room.triangles, room.triangles[:2, ::-1]]))
    h = holds_its_light(tmp_path, twice)
    ways = np.linalg.norm(h.way[h.number > 0], axis=1)
    short = ways < 1e-3  # in corners only
    at = h.position[h.number > 0][short]
    assert (np.sort(np.abs(np.abs(at) - (10, 7, 4)), axis=1)[:, 1] < 2e-3).all()
    assert short.mean() < 1e-3


def test_a_seam_through_which_one_can_see_by_float32(tmp_path):
    """Vertices along an edge on one side only (T-junctions): neighbours do not share them.

    Guards: the room's light is held by robust intersection, and by START_OFFSET alone where edges do not fit.
    """
    room = box((-10, -7, -4), (10, 7, 4)).turned(0.7, (1, 2, 3))
    corners = room.vertices[room.triangles[-1]]
    a, b, c = corners
    on_edge = a + (b - a) * np.linspace(0, 1, 12)[1:-1, None] ** 1.3
    points = np.concatenate([[a], on_edge, [b], [c]])
    fan = [(k, k + 1, len(points) - 1) for k in range(len(points) - 2)]
    cut = Shape(room.vertices, room.triangles[:-1], (*room.faces[:-1], (room.faces[-1][0], room.faces[-1][1] - 1)))
    h = traced(
        tmp_path,
        {"Room": body(appended(cut, points, fan), "white")},
        rays=5_000, settings={"max_events": 100}, surfaces=WHITE, sources=POINT,
    )  # fmt: skip
    assert (h.kind[h.last] != EventKind.KILLED_DEPTH).sum() <= 1e-5 * (h.number > 0).sum()


def test_inverted_and_open_shells(tmp_path):
    """A body with a medium must be closed and the right way round; one without need not: from inside a room turned
    inside out light is reflected as from inside one that is not; and from an open one it gets out.

    Guards: `_check_solid`, and that surfaces without a medium act on both sides.
    """
    room = box((-5, -5, -5), (5, 5, 5))
    for name, shape in (("inverted", room.inside_out), ("open", room._replace(triangles=room.triangles[:-1]))):
        if name == "open":
            shape = shape._replace(faces=(*room.faces[:-1], ("+z", 1)))
        with pytest.raises(SceneError, match=r"'Body'.*(inside out|open)") as error:
            traced(
                tmp_path, {"Body": body(shape, "polished", "glass")}, rays=10, name=name, sources=POINT, **clear(1.5)
            )
        assert "\n" not in str(error.value)
        h = traced(
            tmp_path, {"Body": body(shape, "white")}, rays=2_000, name=f"{name}2", surfaces=WHITE, sources=POINT,
            settings={"max_events": 100},
        )  # fmt: skip
        assert lost(h).all == 0
        left = (h.kind[h.last] == EventKind.LEFT).sum()
        assert left == 0 if name == "inverted" else left > 1_000


# ---------------------------------------------------------------------------------------------------------------------
# Detectors


def test_detectors_in_surfaces_and_in_each_other(tmp_path):
    """Detectors in the faces of a plate, several in one place, turned round, and half beside it: each counts each
    passing ray once, whatever lies beside it; so do those in a mirror. All stands askew, so that places on a plane are
    off it by rounding.

    Guards: a segment that starts in a detector's plane does not cross it (`ON_PLANE`); those that end there do.
    """
    turn = rotation()

    def detector(center, normal=(0.0, 0.0, 1.0)):
        axes = {"normal": (turn @ normal).tolist(), "x_axis": (turn @ [1.0, 0.0, 0.0]).tolist()}
        return rectangle(turn @ np.array(center, float), 8, 8, side="both", **axes)

    detectors = {
        "Top": detector((0, 0, 2)),
        "Top again": detector((0, 0, 2)),
        "Top turned": detector((0, 0, 2), (0, 0, -1)),
        "Bottom": detector((0, 0, 0)),
        "Within": detector((0, 0, 1)),
        "Half over": detector((4, 0, 1)),
        "Tilted": detector((0, 0, 1), (0.3, 0, 1)),
    }
    beam = {"S": disc_source(turn @ [0, 0, 10], turn @ [0, 0, -1], 3)}
    plate = box((-5, -5, 0), (5, 5, 2)).turned(0.7, (1, 2, 3))
    mirror = {"mirror": {"kind": "mirror", "reflectance": 1.0}}
    h = traced(
        tmp_path,
        {"Plate": body(plate, "mirror")},
        rays=2_000,
        name="mirror",
        sources=beam,
        surfaces=mirror,
        detectors={name: detectors[name] for name in ("Top", "Top again", "Top turned")},
    )
    for name in ("Top", "Top again", "Top turned"):
        assert (np.bincount(h.crossing_ray[h.through(name)], minlength=h.n_rays) == 1).all(), name

    h = traced(
        tmp_path,
        {"Plate": body(plate, "polished", "glass")},
        rays=5_000,
        sources=beam,
        detectors=detectors,
        **clear(1.0),
    )
    assert lost(h).all == 0
    start = (h.position @ turn)[h.first, 0]
    for name in detectors:
        per_ray = np.bincount(h.crossing_ray[h.through(name)], minlength=h.n_rays)
        expected = (start > 0).astype(int) if name == "Half over" else np.ones(h.n_rays, int)
        assert ((per_ray == expected) | (np.abs(start) < 1e-4)).all(), name


@pytest.mark.parametrize("height", [0.0, 1e-13, 1e-11])
def test_rays_within_a_detector(tmp_path, height):
    """Rays that run in a detector's plane, or start in it, cross nothing; nor do they divide by 0.

    Guards: `ON_PLANE` (before / (before - after) would be anything).
    """
    starts = [(-20, 0, height), (0, -20, height), (0, 0, height), (-20, -20, height)]
    ways = [(1, 0, 0), (0, 1, 0), (1, 2, 0), (1, 1, 0)]
    h = traced(
        tmp_path,
        {},
        rays=1_000,
        sources={"S": aimed(tmp_path, "rays", starts, ways)},
        detectors={"D": rectangle((0, 0, 0), 10, 10, side="both"), "E": rectangle((0, 0, 0), 10, 10)},
    )
    assert len(h.crossing_ray) == 0
    assert (h.kind[h.last] == EventKind.LEFT).all()


def test_a_ray_down_the_edge_of_a_detector(tmp_path):
    """Rays through corners and borders of a detector are counted once or not at all, and their places lie within it.

    Guards: borders belong to the outermost cells.
    """
    corners = [(x, y, 10) for x in (-4, 0, 4) for y in (-4, 0, 4)]
    h = traced(
        tmp_path,
        {},
        rays=2_000,
        sources={"S": aimed(tmp_path, "rays", corners, [(0, 0, -1)])},
        detectors={"D": rectangle((0, 0, 0), 8, 8, side="both", resolution=[3, 3])},
    )
    assert np.bincount(h.crossing_ray, minlength=h.n_rays).max() == 1
    assert np.abs(h.crossing_xy).max() <= 4
    assert len(h.crossing_ray) == h.n_rays


def test_a_mesh_that_names_a_face_of_no_area(tmp_path):
    """A CAD face all of whose triangles have no area: the scene can be traced, the face meets no light.

    Guards: `BodyMesh.degenerate`: the plane of such a triangle is no number, and must not get into the tables.
    """
    room = shape_of_faces(ball(5, 2), [(0, 0, 5), (0, 0, 5), (0, 0, 5)])
    h = traced(
        tmp_path, {"Room": body(room, "white")}, rays=1_000, surfaces=WHITE, sources=POINT, settings={"max_events": 50}
    )
    assert lost(h).all == 0
    assert not (h.face == h.face_index("Room", "Nothing")).any()


def shape_of_faces(shape, odd):
    more = appended(shape, odd, [(0, 1, 2)])
    return more._replace(faces=(*shape.faces, ("Nothing", 1)))
