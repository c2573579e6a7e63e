# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which solid rules where several are, where bodies come close, and what is said of bodies that touch and overlap."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
import trimesh

from raymaps.errors import SceneError
from raymaps.frame import Frame
from raymaps.geometry import BodyMesh, winding_number
from raymaps.kinds import CONTACT
from raymaps.names import Names
from raymaps.scene import Scene
from raymaps.solids import lower_solids, medium_at, medium_of, rank_solids, solids_at
from raymaps.solids.contacts import body_layers
from raymaps.solids.facets import facet_slack
from raymaps.solids.overlaps import overlaps
from raymaps.solids.shells import crossing_triangles, double_triangles, oddities
from raymaps.solids.sweep import Boxes
from tests.physics.scenes import ball, revolved
from tests.store.small_scenes import BOX_FACES, box, mesh, sheet

MEDIA = ("air", "glass", "water", "oil")


def scene_of(meshes: list[BodyMesh], media: dict[str, str | None], priority: dict[str, int] | None = None) -> Scene:
    """Bodies of meshes; those that are not named are of glass."""
    return Scene.model_validate(
        {
            "format": "raymaps-scene",
            "version": 1,
            "ambient": "air",
            "media": {name: {"refractive_index": 1 + i / 10} for i, name in enumerate(MEDIA)},
            "surfaces": {"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}},
            "bodies": {
                m.name: {
                    "geometry": {"file": "none.ply"},
                    "medium": media.get(m.name, "glass"),
                    "surface": "polished" if media.get(m.name, "glass") else "black",
                    "priority": (priority or {}).get(m.name, 0),
                }
                for m in meshes
            },
            "sources": {"P": {"kind": "point", "flux_w": 1, "position_mm": [99, 0, 0]}},
        }
    )


def names_of(scene: Scene, meshes: list[BodyMesh]) -> Names:
    faces = tuple((i, face) for i, m in enumerate(meshes) for face in m.face_names)
    return Names(("P",), tuple(scene.bodies), tuple(scene.surfaces), tuple(scene.media), (), faces)


#: A frame unit is 16 mm, so contact is 7.6e-6 mm.
FRAME = Frame(np.zeros(3), 16.0, 1e-5)
CONTACT_MM = CONTACT * FRAME.unit_mm


def lowered(meshes: list[BodyMesh], exact: bool = False, reach_mm: float = 0.0, **media):
    scene = scene_of(meshes, media)
    names = names_of(scene, meshes)
    corners = FRAME.to_units(np.concatenate([m.corners_mm for m in meshes]))
    reach = np.full(len(corners), reach_mm / FRAME.unit_mm)
    return lower_solids(scene, tuple(meshes), names, FRAME, np.full(len(names.faces), exact), corners, reach)


def close_faces(meshes: list[BodyMesh], **options) -> set[str]:
    """``Body.Face`` of the triangles that are close."""
    close = lowered(meshes, **options).close
    labels = [f"{m.name}.{m.face_names[face]}" for m in meshes for face in m.triangle_face]
    return {label for label, is_close in zip(labels, close, strict=True) if is_close}


def ruling(meshes: list[BodyMesh], point: tuple[float, float, float], priority=None, **media) -> str:
    """Name of the medium at a point."""
    scene = scene_of(meshes, media, priority)
    return MEDIA[medium_at(scene, tuple(meshes), MEDIA, 0, np.array([point], float))[0]]


def icosphere(name: str, radius: float, center=(0, 0, 0), subdivisions: int = 3) -> BodyMesh:
    shape = ball(radius, subdivisions).moved(*center)
    return mesh(name, shape.vertices, shape.triangles)


def turned(body: BodyMesh) -> BodyMesh:
    """About an odd axis, so that nothing is parallel to an axis any more."""
    matrix = trimesh.transformations.rotation_matrix(0.7, (1, 2, 3))[:3, :3]
    return dataclasses.replace(body, vertices_mm=body.vertices_mm @ matrix.T)


def tiled(name: str, body: BodyMesh, times: int) -> BodyMesh:
    """A body whose triangles are cut into 4 each, some times."""
    vertices, triangles = body.vertices_mm, body.triangles
    for _ in range(times):
        vertices, triangles = trimesh.remesh.subdivide(vertices, triangles)
    counts = np.bincount(body.triangle_face) * 4**times
    return mesh(name, vertices, triangles, dict(zip(body.face_names, counts.tolist(), strict=True)))


# ------------------------------------------------------------------------------------------------- priority


def ranked(meshes: list[BodyMesh], priority=None, **media) -> list[str]:
    return [meshes[i].name for i in rank_solids(scene_of(meshes, media, priority), tuple(meshes))]


def test_the_smaller_volume_comes_first():
    assert ranked([box("S", 0, 1), box("L", 0, 3), box("M", 0, 2)]) == ["S", "M", "L"]


def test_of_equal_volumes_the_later_comes_first():
    assert ranked([box("A", 0, 1), box("B", (5, 0, 0), 1), box("C", (0, 9, 1 / 3), 1)]) == ["C", "B", "A"]


@pytest.mark.parametrize("at", [(0, 0, 0), (1 / 3, 1e3, -77.7), (1e4, 0.1, 0.7)])
def test_equal_volumes_are_equal_wherever_the_bodies_stand(at):
    """Though their last digits differ."""
    twins = [turned(box("A", at, 1)), box("B", 0, 1), turned(box("C", 0, 1))]
    assert len({m.volume_mm3 for m in twins}) > 1
    assert ranked(twins) == ["C", "B", "A"]


def test_slightly_different_volumes_are_different():
    assert ranked([box("A", 0, 1), box("B", 0, 1 + 1e-6)]) == ["A", "B"]


def test_a_priority_comes_before_the_volume():
    bodies = [box("S", 0, 1), box("L", 0, 3), box("M", 0, 2)]
    assert ranked(bodies, {"L": 1}) == ["L", "S", "M"]
    assert ranked(bodies, {"S": -1}) == ["M", "L", "S"]
    assert ranked(bodies, {"S": 2, "M": 2, "L": 2}) == ["S", "M", "L"]


def test_open_shells_have_no_rank():
    bodies = [sheet("A", (0, 0, 0), 1, 1), box("B", 0, 3), box("C", 0, 2)]
    assert ranked(bodies, A=None) == ["C", "B"]
    tables = lowered(bodies, A=None, B="water")
    assert tables.face_solid.tolist() == [-1] + [1] * 6 + [0] * 6
    assert [MEDIA[m] for m in tables.medium] == ["glass", "water"]


def inside_out(body: BodyMesh) -> BodyMesh:
    return dataclasses.replace(body, triangles=body.triangles[:, ::-1])


def test_closed_bodies_without_a_medium_come_last():
    """Rays know on which side of them they are; they say nothing of the medium."""
    bodies = [box("A", 0, 1), box("B", 0, 3), box("C", 0, 2)]
    assert ranked(bodies, {"A": 5}, A=None) == ["C", "B", "A"]
    tables = lowered(bodies, A=None, B="water")
    assert tables.face_solid.tolist() == [2] * 6 + [1] * 6 + [0] * 6
    assert tables.medium.tolist() == [MEDIA.index("glass"), MEDIA.index("water"), -1]
    assert tables.reaches_far.tolist() == [False] * 3
    assert ruling(bodies, (0, 0, 0), A=None) == "glass"


def test_behind_walls_that_look_inwards_is_all_around():
    """A room: its inside is before its walls, outside is behind them."""
    room = [inside_out(box("Room", 0, 4)), box("Table", 0, 1)]
    assert lowered(room, Room=None).reaches_far.tolist() == [False, True]
    bits = solids_at(scene_of(room, {"Room": None}), tuple(room), np.array([[0, 0, 0], [1, 0, 0], [9.0, 0, 0]]))
    assert bits[:, 0].tolist() == [0b01, 0b00, 0b10]
    assert ruling(room, (9, 0, 0), Room=None) == "air"


def test_no_bodies():
    tables = lower_solids(
        scene_of([], {}), (), names_of(scene_of([], {}), []), FRAME, np.zeros(0, bool), np.zeros((0, 3, 3)), np.zeros(0)
    )
    assert not any(len(array) for array in tables)
    assert solids_at(scene_of([], {}), (), np.zeros((2, 3))).tolist() == [[0], [0]]


def test_a_point_on_a_face_an_edge_or_a_corner_is_before_it():
    """The winding number is a half there, or a quarter, an eighth, seven eighths in a notch."""
    room = [box("A", 0, 2)]
    points = np.array([[1, 0.2, 0.3], [1, 1, 0.1], [1, 1, 1], [0.999999, 0.2, 0.3]])
    assert solids_at(scene_of(room, {}), tuple(room), points).reshape(-1).tolist() == [0, 0, 0, 1]


# ------------------------------------------------------------------------------------------------- media at points


def test_nested_bodies():
    """A body in a body in a body: inside is whatever is smallest."""
    nest = [box("Outer", 0, 9), box("Inner", 0, 3), box("Middle", 0, 6)]
    media = {"Outer": "water", "Middle": "oil", "Inner": "glass"}
    at = {0.0: "glass", 2.0: "oil", 4.0: "water", 5.0: "air"}
    assert {x: ruling(nest, (x, 0, 0), **media) for x in at} == at
    assert ruling(nest, (0, 0, 0), {"Outer": 1}, **media) == "water"


def test_a_bubble_in_a_block():
    """Air that is named as a medium displaces glass."""
    bodies = [box("Block", 0, 10), icosphere("Bubble", 2, (1, 0, 0))]
    assert ruling(bodies, (1, 0, 0), Bubble="air") == "air"
    assert ruling(bodies, (-2, 0, 0), Bubble="air") == "glass"
    assert ruling(bodies, (1, 0, 0), {"Block": 1}, Bubble="air") == "glass"


def test_immersed_half_way():
    """A rod that stands in a pool: glass below the level and above it, water around it."""
    bodies = [box("Rod", (0, 0, 0), (1, 1, 8)), box("Pool", (0, 0, -5), 10)]
    places = {(0, 0, -2): "glass", (0, 0, 2): "glass", (2, 0, -2): "water", (2, 0, 2): "air"}
    assert {place: ruling(bodies, place, Pool="water") for place in places} == places
    assert ruling(bodies, (0, 0, -2), {"Pool": 1}, Pool="water") == "water"
    assert ruling(bodies, (0, 0, 2), {"Pool": 1}, Pool="water") == "glass"


def test_more_solids_than_bits_of_a_word():
    """70 boxes, each in the next: at x the smallest that is larger than x rules."""
    nest = [box(f"B{k}", 0, 2.0 * (k + 1)) for k in range(70)]
    media = {f"B{k}": MEDIA[k % 4] for k in range(70)}
    scene = scene_of(nest, media)
    x = np.array([0.5, 63.5, 64.5, 69.5, 70.5])
    bits = solids_at(scene, tuple(nest), np.stack([x, 0 * x, 0 * x], axis=1))
    assert bits.shape == (5, 2)
    sets = [{r for r in range(70) if int(row[r // 64]) >> (r % 64) & 1} for row in bits]
    assert sets == [set(range(70)), set(range(63, 70)), set(range(64, 70)), {69}, set()]
    medium = np.array([k % 4 for k in range(70)], np.int16)
    assert medium_of(bits, medium, 3).tolist() == [0, 63 % 4, 0, 69 % 4, 3]


def test_the_kernel_tells_winding_numbers_as_the_reference():
    body = turned(icosphere("A", 2, (1, 2, 3), 1))
    points = np.random.default_rng(3).uniform(-2, 6, (200, 3))
    expected = [winding_number(body.corners_mm, point) > 0.5 for point in points]
    assert 0 < sum(expected) < 200
    bits = solids_at(scene_of([body], {}), (body,), points)
    assert (bits[:, 0] == 1).tolist() == expected


# ------------------------------------------------------------------------------------------------- close triangles


@pytest.mark.parametrize("times", [(0, 0), (0, 3), (3, 2)])
def test_plates_that_touch_are_close_where_they_touch(times):
    """With the same triangles and with others; their sides too, which meet the contact in an edge."""
    lower = tiled("Lower", box("Lower", (0, 0, -1), (4, 4, 2)), times[0])
    upper = tiled("Upper", box("Upper", (0, 0, 1), (2, 2, 2)), times[1])
    faces = close_faces([lower, upper])
    assert faces == {"Lower.top", "Upper.bottom", "Upper.left", "Upper.right", "Upper.front", "Upper.back"}
    close = lowered([lower, upper]).close
    high = np.concatenate([lower.corners_mm, upper.corners_mm])[close][:, :, 2].max()
    assert high <= 2 / 2 ** times[1]  # only triangles that reach down to the contact
    if times[0] > 1:
        far = np.abs(lower.corners_mm).min(axis=1)[:, :2].max(axis=1) > 1
        assert not close[: len(far)][far].any()


@pytest.mark.parametrize(("gap_mm", "is_close"), [(0.0, True), (0.5, True), (1.5, False), (-0.5, True)])
def test_contact_tolerance(gap_mm, is_close):
    """In units of it; below a fifth of a millionth of the scene, faces are one."""
    pair = [box("A", (-1, 0, 0), 2), box("B", (1 + gap_mm * CONTACT_MM, 0.1, 0.2), 2)]
    assert ("A.right" in close_faces(pair)) == is_close
    assert ("B.left" in close_faces(pair)) == is_close


def test_a_gap_of_a_thousandth_of_a_millimetre_is_a_gap():
    assert close_faces([box("A", (-1, 0, 0), 2), box("B", (1 + 1e-3, 0, 0), 2)]) == set()


def test_reach_adds_to_the_tolerance():
    """Of both triangles: 0.001 mm are covered by 0.0006 mm of each, not by 0.0004 mm."""
    pair = [box("A", (-1, 0, 0), 2), box("B", (1 + 1e-3, 0, 0), 2)]
    assert "A.right" in close_faces(pair, reach_mm=6e-4)
    assert close_faces(pair, reach_mm=4e-4) == set()


def test_boxes_that_overlap_are_not_close_bodies():
    """Two slanted plates that are 0.1 mm apart: their boxes overlap, and those of their triangles."""
    plates = [turned(box("A", (0, 0, 0), (8, 8, 1))), turned(box("B", (0, 0, 1.1), (8, 8, 1)))]
    assert list(Boxes(*_boxes(plates)).body_pairs()) == [(0, 1)]
    assert close_faces(plates) == set()


def _boxes(meshes: list[BodyMesh]):
    corners = np.concatenate([m.corners_mm for m in meshes])
    return corners, np.zeros(len(corners)), [len(m.triangles) for m in meshes]


def test_nested_bodies_are_not_close():
    assert close_faces([icosphere("A", 5), icosphere("B", 4)]) == set()


def test_a_sphere_in_its_socket():
    """Ball and socket with different facets: all triangles on the sphere are close, those of the box are not."""
    angle = np.linspace(0, np.pi, 40)
    hollow = revolved(np.stack([3 * np.sin(angle), 3 * np.cos(angle)], axis=1), 48)
    block = box("Block", 0, 10)
    vertices = np.vstack([block.vertices_mm, hollow.vertices])
    triangles = np.vstack([block.triangles, hollow.triangles[:, ::-1] + 8])
    socket = mesh("Socket", vertices, triangles, {"outside": 12, "sphere": len(hollow.triangles)})
    ball_ = icosphere("Ball", 3, subdivisions=3)
    close = lowered([socket, ball_]).close
    assert not close[:12].any()
    assert close[12:].all()
    # exact faces have no slack: what is close then is only what crosses
    crossing = lowered([socket, ball_], exact=True).close
    assert 0 < crossing.sum() < close.sum()


def test_bodies_without_a_medium_are_close_to_solids_only():
    stack = [box("A", (0, 0, 0), 2), box("B", (0, 0, 2), 2), box("C", (0, 0, 4), 2)]
    assert {"A.top", "B.bottom", "B.top", "C.bottom"} <= close_faces(stack, A=None, C=None)
    assert close_faces(stack, A=None, B=None, C=None) == set()
    assert "A.top" not in close_faces(stack, A=None, B=None)


def test_pairs_of_boxes_are_those_of_all_against_all():
    """Of two lists and of one, in portions of any size."""
    rng = np.random.default_rng(1)
    corners = rng.uniform(-1, 1, (300, 1, 3)) + rng.uniform(-0.2, 0.2, (300, 3, 3))
    corners[::3] = np.round(corners[::3], 1)  # boxes that begin together
    boxes = Boxes(corners, np.full(300, 0.01), [100, 200])
    overlap = ((boxes.low[:, None] <= boxes.high) & (boxes.low <= boxes.high[:, None])).all(axis=2)
    two = [tuple(pair) for part in boxes.pairs(np.arange(100), np.arange(100, 300)) for pair in part.tolist()]
    assert sorted(two) == [(i, j) for i in range(100) for j in range(100, 300) if overlap[i, j]]
    one = [tuple(sorted(pair)) for part in boxes.pairs(np.arange(300)) for pair in part.tolist()]
    assert sorted(one) == [(i, j) for i, j in itertools.combinations(range(300), 2) if overlap[i, j]]


def test_portions_of_pairs_join(monkeypatch):
    boxes = Boxes(np.random.default_rng(1).uniform(-1, 1, (60, 3, 3)), np.zeros(60), [60])
    whole = np.concatenate(list(boxes.pairs(np.arange(20), np.arange(20, 60))))
    monkeypatch.setattr("raymaps.solids.sweep.BATCH", 7)
    parts = [part.copy() for part in boxes.pairs(np.arange(20), np.arange(20, 60))]
    assert len(parts) > 10
    np.testing.assert_array_equal(np.concatenate(parts), whole)


def test_closeness_is_the_distance_between_triangles():
    """Against the smallest distance between dense points of both."""
    from raymaps.solids.mesh_kernel import are_close

    rng = np.random.default_rng(5)
    u, v = (x.reshape(-1) for x in np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 1, 20)))
    weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)
    n_crossing = 0
    for _ in range(150):
        a, b = rng.uniform(-1, 1, (2, 3, 3))
        b += rng.uniform(-1.5, 1.5, 3)
        p, q = weights @ a, weights @ b
        sampled = np.sqrt(((p[:, None] - q) ** 2).sum(axis=2).min())
        step = 0.25  # the dense points are nearer to each other than this
        assert are_close(a, b, sampled + 1e-9)
        if sampled > step:
            assert not are_close(a, b, sampled - step)
        n_crossing += bool(are_close(a, b, 0.0))
    assert 5 < n_crossing < 145


# ------------------------------------------------------------------------------------------------- slack


@pytest.mark.parametrize("subdivisions", [2, 3, 4])
def test_slack_of_a_sphere(subdivisions):
    """It covers the true distance, at most twice."""
    body = icosphere("A", 5, subdivisions=subdivisions)
    true = 5 - np.linalg.norm(body.corners_mm.mean(axis=1), axis=1)
    slack = facet_slack(body)
    assert (slack > true).all()
    assert (slack < 2 * true).all()


@pytest.mark.parametrize("segments", [12, 24, 64])
def test_slack_of_a_cylinder(segments):
    """Its caps are flat; strips rise R (1 - cos(pi / n))."""
    shape = revolved(np.array([[0, 5], [2, 5], [2, -5], [0, -5.0]]), segments)
    body = mesh("A", shape.vertices, shape.triangles)
    slack = facet_slack(body)
    cap = np.ptp(body.corners_mm[:, :, 2], axis=1) == 0
    assert (slack[cap] == 0).all()
    true = 2 * (1 - np.cos(np.pi / segments))
    assert (slack[~cap] > true).all()
    assert (slack[~cap] < 2 * true).all()


def test_flat_faces_and_creases_have_no_slack():
    """Even where a whole box is one face."""
    whole = turned(box("A", 0, 4))
    assert (facet_slack(mesh("A", whole.vertices_mm, whole.triangles)) == 0).all()


def test_faces_that_meet_at_a_small_angle_have_no_slack():
    """A bar with twelve flat sides, each a face of its own."""
    shape = revolved(np.array([[0, 5], [2, 5], [2, -5], [0, -5.0]]), 12)
    x, y, z = shape.vertices[shape.triangles].mean(axis=1).T
    side = np.where(np.abs(z) > 4.9, 12, np.floor(np.arctan2(y, x) / (np.pi / 6)).astype(int) % 12)
    bar = shape.grouped(side, tuple(f"F{k}" for k in range(13)))
    assert facet_slack(mesh("A", bar.vertices, bar.triangles, dict(bar.faces))).max() < 1e-9
    assert facet_slack(mesh("A", bar.vertices, bar.triangles)).max() > 0.05


def test_a_flat_face_with_a_rounded_edge_keeps_little_slack():
    """One face of a plate and its rounding: the wide triangles get no more than the narrow ones next to them."""
    angle = np.linspace(np.pi / 2, 0, 10)
    profile = np.stack([10 + np.sin(np.pi / 2 - angle), np.sin(angle)], axis=1)
    shape = revolved(np.vstack([[0, 1], profile, [11, -3], [0, -3]]), 128)
    slack = facet_slack(mesh("A", shape.vertices, shape.triangles))
    assert slack.max() < 0.02


def test_exact_faces_have_no_slack():
    body = icosphere("A", 5)
    assert (lowered([body], exact=True).slack == 0).all()
    np.testing.assert_allclose(lowered([body]).slack * FRAME.unit_mm, facet_slack(body))


# ------------------------------------------------------------------------------------------------- layers


def test_layers_are_a_proper_colouring():
    rng = np.random.default_rng(7)
    for n in (1, 2, 5, 40):
        pairs = [pair for pair in itertools.combinations(range(n), 2) if rng.random() < 0.3]
        layers = body_layers(n, pairs)
        assert all(layers[a] != layers[b] for a, b in pairs)
        most = max((sum(i in pair for pair in pairs) for i in range(n)), default=0)
        assert set(layers) <= set(range(most + 1))


def test_bodies_on_a_board_need_two_layers():
    assert len(set(body_layers(1000, [(0, i) for i in range(1, 1000)]))) == 2


def test_layers_of_a_stack():
    stack = [box(f"B{k}", (0, 0, 2 * k - 6), 2) for k in range(7)] + [box("Far", (8, 0, 0), 2)]
    tables = lowered(stack)
    of_body = [set(tables.layer[12 * k : 12 * k + 12].tolist()) - {-1} for k in range(8)]
    assert all(len(layers) == 1 for layers in of_body[:7])
    assert of_body[7] == set()
    assert all(a != b for a, b in itertools.pairwise(of_body[:7]))
    assert ((tables.layer >= 0) == tables.close).all()


def test_layers_of_three_bodies_around_an_edge():
    """All triangles of the last pair are known to be close from the pairs before."""
    sides = [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]
    low, high = ([(0, -1, 0), (0, 1, 0), (2, 0, 0), (1, 0, z)] for z in (-2, 2))
    wedges = [mesh("B", low, [side[::-1] for side in sides]), mesh("C", high, sides)]
    assert all(wedge.volume_mm3 > 0 for wedge in wedges)
    layer = lowered([box("A", (-2, 0, 0), 4), *wedges]).layer
    assert (layer[12:] >= 0).all()
    assert sorted({layer[:12].max(), layer[12], layer[16]}) == [0, 1, 2]


def test_too_many_layers_are_refused():
    with pytest.raises(SceneError, match="127 bodies"):
        body_layers(128, list(itertools.combinations(range(128), 2)))
    body_layers(127, list(itertools.combinations(range(127), 2)))


# ------------------------------------------------------------------------------------------------- overlaps


def told(meshes: list[BodyMesh], priority=None, **media):
    return list(overlaps(scene_of(meshes, media, priority), tuple(meshes), FRAME))


def test_clear_bodies_are_not_told():
    assert told([box("A", (-1, 0, 0), 2), box("B", (1 + 1e-3, 0, 0), 2)]) == []
    assert told([turned(box("A", 0, (8, 8, 1))), turned(box("B", (0, 0, 1.1), (8, 8, 1)))]) == []


@pytest.mark.parametrize("times", [(0, 0), (0, 3), (3, 2)])
@pytest.mark.parametrize("turn", [lambda body: body, turned])
def test_plates_that_touch(times, turn):
    lower = turn(tiled("Lower", box("Lower", (0, 0, -1), (4, 4, 2)), times[0]))
    upper = turn(tiled("Upper", box("Upper", (0.3, 0, 1), (2, 2, 2)), times[1]))
    (found,) = told([lower, upper])
    assert (found.first, found.second, found.kind, found.ruling) == (0, 1, "touch", 1)
    assert found.faces[0] == ("top",)
    assert "bottom" in found.faces[1]
    assert "top" not in found.faces[1]
    assert found.depth_mm == 0


def test_a_foil_on_a_plate():
    """Thinner than the contact tolerance: what is just below its top is not in the plate."""
    foil = box("Foil", (0, 0, 0.4 * CONTACT_MM), (2, 2, 0.8 * CONTACT_MM))
    (found,) = told([box("Plate", (0, 0, -1), (4, 4, 2)), foil])
    assert found.kind == "touch"


def test_lenses_that_are_cemented():
    """Two caps of one sphere with different facets."""

    def lens(name: str, segments: int, n: int, z: float) -> BodyMesh:
        half = 5 / 20
        angle = np.linspace(0, np.arcsin(half), n)
        profile = np.stack([20 * np.sin(angle), 20 * (1 - np.cos(angle))], axis=1)
        rim = [[5, z], [0, z]]
        shape = revolved(np.vstack([profile, rim]) if z < 0 else np.vstack([rim[::-1], profile[::-1]]), segments)
        flat = np.ptp(shape.vertices[shape.triangles][:, :, 2], axis=1) == 0
        high = np.abs(shape.vertices[shape.triangles][:, :, 2] - z).min(axis=1) == 0
        which = np.where(flat, 0, np.where(high, 1, 2))
        shape = shape.grouped(which, ("flat", "rim", "cap"))
        return mesh(name, shape.vertices, shape.triangles, dict(shape.faces))

    (found,) = told([lens("Crown", 64, 12, 4.0), lens("Flint", 48, 9, -3.0)])
    assert found.kind == "touch"
    assert found.faces == (("cap", "rim"), ("cap", "rim")) or found.faces == (("rim", "cap"), ("rim", "cap"))
    assert 0.005 < found.within_mm < 0.1


@pytest.mark.parametrize("depth_mm", [1.5, 0.3, 0.01])
def test_the_depth_of_an_overlap(depth_mm):
    """Within a factor of two."""
    pair = [box("A", (-2, 0, 0), 4), box("B", (1 - depth_mm, 0.2, 0.3), 2)]
    (found,) = told(pair)
    assert found.kind == "overlap"
    assert found.ruling == 1
    assert depth_mm / 2 < found.depth_mm < 2 * depth_mm
    assert told(pair, {"A": 1})[0].ruling == 0


def test_bars_that_cross():
    """No corner of either is in the other."""
    (found,) = told([box("A", 0, (9, 1, 1)), box("B", 0, (1, 9, 1.5))])
    assert found.kind == "overlap"


def test_a_corner_that_pokes_through_a_face():
    """Of a thousandth of the body."""
    corner = turned(box("A", 0, 4))
    high = corner.vertices_mm[:, 2].max()
    plate = box("B", (0, 0, high + 1 - 0.01), (14, 14, 2))
    (found,) = told([corner, plate])
    assert found.kind == "overlap"
    assert 0.003 < found.depth_mm < 0.03


def test_a_body_inside_another():
    for order in (1, -1):
        pair = [box("Block", 0, 10), icosphere("Bubble", 2, (1, 0, 0))][::order]
        (found,) = told(pair)
        assert found.kind == "inside"
        assert (pair[found.first].name, pair[found.second].name) == ("Bubble", "Block")
        assert pair[found.ruling].name == "Bubble"
        assert found.faces == ((), ())


def test_inside_with_a_face_in_common():
    (found,) = told([box("Block", 0, 10), box("Inlay", (0, 0, 4), 2)])
    assert found.kind == "inside"
    assert found.faces[1] == ("top",)
    assert "top" in found.faces[0]


def test_twice_the_same_body():
    """The later one rules."""
    (found,) = told([box("A", 0, 3), box("Copy", 0, 3)])
    assert found.kind == "overlap"
    assert found.ruling == 1
    assert set(found.faces[0]) == set(BOX_FACES)


def test_bodies_without_a_medium_are_no_solids():
    assert told([box("A", 0, 3), box("B", 1, 3)], B=None) == []


# ------------------------------------------------------------------------------------------------- odd triangles


def test_sound_bodies_are_not_odd():
    for body in (box("A", 0, 3), turned(box("A", 0, 3)), icosphere("A", 4), tiled("A", box("A", 0, 2), 3)):
        assert list(oddities(body)) == []


def test_neighbours_do_not_go_through_each_other():
    """On a saddle those that share a corner stand on both sides of each other, and rounding may cross them there."""
    for subdivision in range(8, 40, 3):
        torus = trimesh.creation.torus(5, 2, major_sections=subdivision, minor_sections=subdivision // 2)
        assert len(crossing_triangles(turned(mesh("A", torus.vertices, torus.faces)))) == 0


def test_a_body_that_goes_through_itself():
    """Two bars in one shell: the ends are clear."""
    a, b = box("A", 0, (9, 1, 1)), box("B", 0, (1, 9, 1.5))
    both = mesh(
        "A",
        np.vstack([a.vertices_mm, b.vertices_mm]),
        np.vstack([a.triangles, b.triangles + 8]),
        {f"{which}.{face}": 2 for which in "ab" for face in BOX_FACES},
    )
    crossing = {both.face_names[i] for i in both.triangle_face[crossing_triangles(both)]}
    assert crossing == {"a.front", "a.back", "a.bottom", "a.top", "b.left", "b.right"}
    (text,) = oddities(both)
    assert "goes through itself" in text
    assert "b.left" in text
    assert "a.left" not in text


def test_double_triangles():
    whole = box("A", 0, 2)
    double = mesh("A", whole.vertices_mm, np.vstack([whole.triangles, np.roll(whole.triangles[4:5], 1, axis=1)]))
    assert double_triangles(double).tolist() == [12]
    assert any("corners of an earlier one" in text for text in oddities(double))


def test_boxes_that_share_an_edge():
    """An edge of four triangles."""
    a, b = box("A", (-1, -1, 0), 2), box("B", (1, 1, 0), 2)
    both = mesh(
        "A",
        np.vstack([a.vertices_mm, b.vertices_mm]),
        np.vstack([a.triangles, b.triangles + 8]),
        {f"{which}.{face}": 2 for which in "ab" for face in BOX_FACES},
    )
    (text,) = oddities(both)
    assert "edge that more than two share (faces a.right, a.back, b.left, b.front)" in text


def test_open_turned_and_inside_out_bodies():
    assert any("open shell" in text for text in oddities(sheet("S", (0, 0, 0), 1, 1)))
    whole = box("A", 0, 2)
    triangles = whole.triangles.copy()
    assert any("inside out" in t for t in oddities(mesh("A", whole.vertices_mm, triangles[:, ::-1])))
    triangles[0] = triangles[0, ::-1]
    (text,) = oddities(mesh("A", whole.vertices_mm, triangles, dict.fromkeys(BOX_FACES, 2)))
    assert "do not agree" in text
    assert "left" in text
    assert "right" not in text
