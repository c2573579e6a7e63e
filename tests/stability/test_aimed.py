# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays aimed at edges and seams, along faces, at poles and apexes, past and just into round bodies.

A body of the index of its surroundings changes no direction: whatever a ray meets there, it must come out on its far
side where a straight line does, having gone in as often as out.
"""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from tests.physics.scenes import body, disc_source
from tests.physics.scenes_exact import ball, box, cone, pill, ring, rod, sharp_lens, torus, traced
from tests.stability.aiming import aimed, clear, lost, rotation, seams, some_directions, towards

SHAPES = {
    "box": box((-7, -5, -3), (7, 5, 3)),
    "ball": ball(6, 16),
    "rod": rod(4, 10, 16),
    "cone": cone(5, 8, 16),
    "torus": torus(5, 2, 24, 12),
    "pill": pill(3, 8, 16),
    "sharp lens": sharp_lens(6, 40, 16),
}
MIDDLES = {"rod": (0.1, 0.2, 5.3), "cone": (0.1, 0.2, 2.0), "torus": (5.0, 0.1, 0.2), "pill": (0.1, 0.2, 4.3)}
#: How far off the target rays are aimed, in mm: from nothing over float64's and float32's rounding to what is seen.
OFFSETS_MM = (0.0, 1e-15, 1e-12, 1e-9, 1e-7, 1e-6, 1e-5, 1e-3)


def placed(name, exact, turn):
    shape = SHAPES[name].placed(turn=turn)
    return shape if exact else shape.plain


def targets_of(shape, seed=0):
    """Points where triangles meet, each also a little off."""
    points = seams(shape)
    rng = np.random.default_rng(seed)
    if len(points) > 100:
        keep = np.argsort(-np.abs(points[:, 2]))[:4].tolist() + rng.choice(len(points), 80, replace=False).tolist()
        points = points[keep]
    shifts = rng.normal(size=(len(points), 3))
    return np.concatenate([points + d * shifts for d in OFFSETS_MM])


def passed_straight(h, tolerance_mm):
    """Every ray leaves in the medium around, having crossed faces an even number of times, on its line."""
    assert lost(h).all == 0
    assert (h.kind[h.last] == EventKind.LEFT).all()
    crossings = np.diff(h.offsets) - 2
    assert (crossings % 2 == 0).all()
    assert h.count_kind(EventKind.FRESNEL_REFLECTION) == 0
    start, end = h.position[h.first], h.position[h.last]
    along = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
    off = np.cross(h.position - start[h.ray], along[h.ray])
    assert np.abs(off).max() <= tolerance_mm
    return crossings


def goes_straight_through(folder, shape, targets):
    """Light aimed at places of a body of the index around it from all sides; some of it just passes by."""
    origins, directions = towards(targets, some_directions(60), 20.0)
    h = traced(
        folder,
        {"Body": body(shape, "polished", "glass")},
        rays=30_000,
        sources={"S": aimed(folder, "rays", origins, directions)},
        **clear(1.0),
    )
    crossings = passed_straight(h, 4 * h.raymap.manifest.grid_mm)
    assert (crossings > 0).mean() > 0.3


@pytest.mark.parametrize("name", SHAPES)
def test_rays_at_the_middle_of_edges_go_through(tmp_path, name):
    """Edges between faces and between facets of exact surfaces, from 1e-9 mm to 1e-3 mm off.

    Guards: the search in float64 over all faces where Embree's hits do not agree with the solids that a ray is in
    (`SlowSearch`); trimming at borders between faces (`Borders`).
    """
    shape = placed(name, True, rotation())
    corners = shape.vertices[shape.triangles]
    middles = np.unique(((corners + np.roll(corners, 1, axis=1)) / 2).reshape(-1, 3), axis=0)
    rng = np.random.default_rng(3)
    middles = middles[rng.choice(len(middles), min(len(middles), 80), replace=False)]
    targets = np.concatenate([middles + d * rng.normal(size=middles.shape) for d in OFFSETS_MM if d >= 1e-9])
    goes_straight_through(tmp_path, shape, targets)


@pytest.mark.parametrize("exact", [True, False], ids=["exact", "faceted"])
@pytest.mark.parametrize("name", SHAPES)
def test_from_inside_at_edges(tmp_path, name, exact):
    """Mirrors inside: nothing gets out, at whatever edge.

    Guards: as above; for a body without a medium no set of solids tells that an edge was missed, so bodies without one
    that are closed count as solids too.
    """
    shape = placed(name, exact, np.eye(3))
    middle = np.array(MIDDLES.get(name, (0.1, 0.2, 0.3)))
    targets = targets_of(shape)
    h = traced(
        tmp_path,
        {"Body": body(shape, "mirror")},
        rays=20_000,
        settings={"max_events": 50},
        surfaces={"mirror": {"kind": "mirror", "reflectance": 1.0}},
        sources={"S": aimed(tmp_path, "rays", np.broadcast_to(middle, targets.shape), targets - middle)},
    )
    assert lost(h).all == 0
    assert (h.kind[h.last] == EventKind.KILLED_DEPTH).all()


def test_along_the_faces_of_a_box(tmp_path):
    """Rays in the plane of a face, in the seam between its triangles, along an edge, through the diagonal: they pass
    or go in, as their last bits will have it, but come out again.

    Guards: a cosine of 0 between ray and facet (division by it).
    """
    shape = SHAPES["box"]
    x, y, z = 7.0, 5.0, 3.0
    starts, ways = [], []
    for offset in (0.0, 1e-15, 1e-9, 1e-7, -1e-7, 1e-5, -1e-5):
        starts += [
            (-20, 0.5, z + offset), (-20, y + offset, 0.3), (0.2, -20, z + offset), (x + offset, -20, 0.1),
            (-20, y + offset, z + offset), (x, -20, z + offset), (x, y + offset, -20),  # along edges
        ]  # fmt: skip
        ways += [(1, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        starts += [(-2 * x, -2 * y, z + offset), (-2 * x, -2 * y, -2 * z + offset)]  # a seam, and the diagonal
        ways += [(x, y, 0), (x, y, z)]
    for n in (1.0, 1.5):
        h = traced(
            tmp_path,
            {"Body": body(shape, "polished", "glass")},
            rays=4_000,
            name=f"n{n}",
            sources={"S": aimed(tmp_path, f"rays{n}", starts, ways)},
            **clear(n),
        )
        if n == 1.0:
            passed_straight(h, 4 * h.raymap.manifest.grid_mm)
        else:
            assert lost(h).all == 0


@pytest.mark.parametrize("exact", [True, False], ids=["exact", "faceted"])
def test_a_beam_on_the_pole_and_on_the_apex(tmp_path, exact):
    """A beam as fine as float32 on the pole of a ball, where five triangles meet, and on the apex of a cone.

    Guards: the normal of a cone at its apex, of which there is none (no NaN), and its other nappe.
    """
    for name, shape, top in (("ball", SHAPES["ball"], 6.0), ("cone", SHAPES["cone"], 8.0)):
        for radius in (1e-12, 1e-7, 1e-3):
            h = traced(
                tmp_path,
                {"Body": body(shape if exact else shape.plain, "polished", "glass")},
                rays=2_000,
                name=f"{name}{radius}",
                sources={"S": disc_source((0, 0, top + 5), (0, 0, -1), radius)},
                **clear(1.5),
            )
            assert lost(h).all == 0
            assert (np.diff(h.offsets) > 2).mean() > 0.99  # they met it


@pytest.mark.parametrize("off", [0.0, *(s * 10.0**-e for e in range(2, 17, 2) for s in (1, -1))])
def test_tangent_to_a_cylinder(tmp_path, off):
    """Rays that pass a rod of the index around it at its radius times 1 + off: beside it they meet nothing, and a chord
    is as long as it should be.

    Guards: the silhouette. Light that meets a facet of the bounding mesh and finds no exact surface goes on unharmed;
    the two roots of the quadratic, which nearly coincide, are told apart by which way the surface is crossed.
    """
    radius = 4.0
    angle = np.linspace(0, 2 * math.pi, 97)
    foot = radius * (1 + off) * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    along = np.column_stack([-np.sin(angle), np.cos(angle), 0.3 * np.sin(5 * angle)])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    h = traced(
        tmp_path,
        {"Body": body(rod(radius, 30, 12).moved(0, 0, -15), "polished", "glass")},
        rays=2_000,
        sources={"S": aimed(tmp_path, "rays", foot - 12 * along, along)},
        **clear(1.0),
    )
    crossings = passed_straight(h, 4 * h.raymap.manifest.grid_mm)
    if off >= 1e-14:
        assert (crossings == 0).all()
    if off <= -1e-12:
        assert (crossings == 2).all()
        chord = np.linalg.norm(h.way[h.first + 2], axis=1)
        way = h.way[h.last] / np.linalg.norm(h.way[h.last], axis=1, keepdims=True)
        expected = 2 * radius * math.sqrt(-off * (2 + off)) / np.hypot(way[:, 0], way[:, 1])
        # the chord follows from the root of what float64 keeps of radius² - foot²
        slack = math.sqrt(2 * radius**2 * 1e-15) + 2 * h.raymap.manifest.grid_mm
        assert np.abs(chord - expected).max() <= slack * 4


def test_out_of_a_plate_right_behind_the_rim_of_its_hole(tmp_path):
    """Into the wall of a hole 1e-8 mm to 1e-3 mm below the plate's upper face, out of that face, on to a black board.
    Nothing but the events tells that a way out was missed: the board is no part of the plate.

    Guards: the search in float64 over all faces (`SlowSearch`).
    """
    plate, n = ring(5, 2, 1, 24), 20_000
    top = plate.vertices[:, 2].max()
    rng = np.random.default_rng(5)
    turn, aside = rng.uniform(0, 2 * math.pi, n), rng.normal(0, 0.3, n)
    below = 10.0 ** rng.uniform(-8, -3, n)
    rim = np.column_stack([2 * np.cos(turn), 2 * np.sin(turn), top - below])
    ways = np.column_stack([np.cos(turn + aside), np.sin(turn + aside), rng.uniform(0.1, 2, n)])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    h = traced(
        tmp_path,
        {
            "Plate": body(plate, "polished", "glass"),
            "Board": body(box((-60, -60, top + 1), (60, 60, top + 2)), "black"),
        },
        rays=n,
        surfaces={"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}},
        sources={"S": aimed(tmp_path, "rays", rim - 0.5 * ways, ways)},
        media=clear(1.0)["media"],
    )
    assert lost(h).all == 0
    assert (np.diff(h.offsets) == 4).all()
    assert (h.kind[h.last] == EventKind.ABSORPTION).all()


def test_a_smooth_seam_is_where_it_is(tmp_path):
    """Through a pill of eight facets around, of the index around it: each event lies on its cylinder between the seams
    and on its spheres beyond them, though facets of the one reach over the other.

    Guards: which of two faces that go on smoothly into each other is crossed (`_is_past_edge`).
    """
    radius, length, n = 3.0, 8.0, 20_000
    rng = np.random.default_rng(2)
    turn, height = rng.uniform(0, 2 * math.pi, n), rng.choice([0.0, length], n) + rng.normal(0, 0.3, n)
    targets = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])
    ways = rng.normal(size=(n, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    h = traced(
        tmp_path,
        {"Body": body(pill(radius, length, 8), "polished", "glass")},
        rays=n,
        sources={"S": aimed(tmp_path, "rays", targets - 20 * ways, ways)},
        **clear(1.0),
    )
    crossings = passed_straight(h, 4 * h.raymap.manifest.grid_mm)
    assert (crossings > 0).mean() > 0.9
    met = h.position[h.triangle >= 0]
    on_axis = np.zeros_like(met)
    on_axis[:, 2] = np.clip(met[:, 2], 0, length)
    assert np.linalg.norm(met - on_axis, axis=1) == pytest.approx(radius, abs=3 * h.raymap.manifest.grid_mm)
