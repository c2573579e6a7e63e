# SPDX-License-Identifier: LGPL-2.1-or-later
"""Light on faces of bodies: against rectangles before them, the law of distance, and the energy ledger."""

import math

import numpy as np
import pytest

from raymaps import evaluate_detector, query
from raymaps.results.info import map_info
from tests.physics.scenes import agrees, ball, body, box, disc_source, rectangle, traced

SURFACES = {
    "black": {"kind": "absorber"},
    "grey": {"kind": "lambertian", "reflectance": [0.5, 0.3, 0.1]},
    "clear": {"kind": "fresnel"},
}
POINT = {"kind": "point", "flux_w": 2, "position_mm": [1, 2, 6]}
PLATE = box((-10, -8, -1), (10, 8, 0))


def face(body_name, *faces, **more):
    return {"kind": "face", "body": body_name, "faces": list(faces) or None, **more}


def solid_angle_sr(a, b, distance):
    """Of a rectangle with half sides a and b, seen from before its middle (A. Khadjavi, J. Opt. Soc. Am. 58 (1968),
    p. 1417)."""
    return 4 * math.atan(a * b / (distance * math.sqrt(a * a + b * b + distance * distance)))


def test_a_black_plate_sees_what_a_rectangle_before_it_sees(tmp_path):
    h = traced(
        tmp_path, {"Plate": body(PLATE, "black")}, rays=100_000, surfaces=SURFACES, sources={"S": POINT},
        detectors={"Top": face("Plate", "+z"), "R": rectangle((0, 0, 0), 20, 16),
                   "Gone": face("Plate", "+z", measure="absorbed"), "Below": face("Plate", "-z")},
    )  # fmt: skip
    top, before = evaluate_detector(h.raymap, "Top"), evaluate_detector(h.raymap, "R")
    # the same rays, but for some that rounding puts on the other side of the border
    assert top.crossings == pytest.approx(before.crossings, abs=3)
    assert top.flux_w.value == pytest.approx(before.flux_w.value, rel=1e-4)
    assert top.flux_w.stderr == pytest.approx(before.flux_w.stderr, rel=1e-4)
    assert top.mean_w_per_mm2.value == pytest.approx(before.mean_w_per_mm2.value, rel=1e-4)
    for limit in (20, 45):
        angles = [evaluate_detector(h.raymap, name, max_angle_deg=limit).crossings for name in ("Top", "R")]
        assert angles[0] == pytest.approx(angles[1], abs=3)
    # black: all that arrives is absorbed
    assert evaluate_detector(h.raymap, "Gone").flux_w == top.flux_w
    below = evaluate_detector(h.raymap, "Below")
    assert (below.flux_w.value, below.crossings, below.uniformity) == (0, 0, None)
    assert query(h.raymap, "detector(Top)").rays == top.rays
    assert query(h.raymap, "detector(Top)").ids.tolist() == query(h.raymap, 'hit(Plate."+z")').ids.tolist()


@pytest.mark.parametrize("distance", [5.0, 20.0, 80.0])
def test_inverse_square_law(tmp_path, distance):
    """Flux I omega with the solid angle omega; far away the irradiance is I / d²."""
    h = traced(
        tmp_path, {"Plate": body(box((-2, -3, -1), (2, 3, 0)), "black")}, rays=200_000, surfaces=SURFACES,
        sources={"S": {"kind": "cone", "flux_w": 1, "position_mm": [0, 0, distance], "direction": [0, 0, -1],
                       "half_angle_deg": math.degrees(math.atan2(math.hypot(2, 3) * 1.05, distance))}},
        detectors={"Top": face("Plate", "+z")},
    )  # fmt: skip
    cosine = math.cos(math.atan2(math.hypot(2, 3) * 1.05, distance))
    intensity = 1 / (2 * math.pi * (1 - cosine))
    found = evaluate_detector(h.raymap, "Top")
    agrees("flux", found.flux_w.value, found.flux_w.stderr, intensity * solid_angle_sr(2, 3, distance))
    # each cell: I cos³ / d² at its middle, but for how much that changes over a cell
    middle = found.cells.corners_mm.mean(axis=1)
    expected = intensity * distance / (distance**2 + (middle[:, :2] ** 2).sum(axis=1)) ** 1.5
    error = found.cell_stderr_w / found.cells.area_mm2
    agrees("cells", found.irradiance_w_per_mm2, error, expected, rounding=0.01)
    if distance == 80:
        agrees("mean", found.mean_w_per_mm2.value, found.mean_w_per_mm2.stderr, intensity / distance**2, rounding=2e-3)


def test_absorbed_and_reflected_is_incident(tmp_path):
    """A ball in a box, both grey: what stays is what comes less what goes on, ray by ray, and as the ledger has it."""
    bodies = {
        "Ball": body(ball(3, 3), "grey"),
        "Room": body(box((-9, -9, -9), (9, 9, 9)).inside_out, "grey"),
    }
    h = traced(
        tmp_path, bodies, rays=30_000, surfaces=SURFACES, sources={"S": {**POINT, "position_mm": [0, 0, 6]}},
        detectors={"On": face("Ball"), "Stays": face("Ball", measure="absorbed"),
                   "Walls": face("Room", measure="absorbed")},
    )  # fmt: skip
    incident, absorbed = evaluate_detector(h.raymap, "On"), evaluate_detector(h.raymap, "Stays")
    hits = np.flatnonzero((h.body == h.index("bodies", "Ball")) & (h.number > 0))
    before, after = h.per_ray(hits, h.light_before[hits].sum(axis=1)), h.per_ray(hits, h.light[hits].sum(axis=1))
    for found, per_ray in ((incident, before), (absorbed, before - after)):
        flux, stderr = h.flux_w(per_ray)
        assert found.flux_w.value == pytest.approx(flux, rel=1e-6)
        assert found.flux_w.stderr == pytest.approx(stderr, rel=1e-6)
        assert found.crossings == len(hits)
        assert found.cell_flux_w.sum() == pytest.approx(found.flux_w.value, rel=1e-9)
        assert found.cell_flux_rgb_w.sum() == pytest.approx(found.flux_w.value, rel=1e-6)
    # band by band the share that stays is 1 - reflectance
    bands = absorbed.cell_flux_rgb_w.sum(axis=0) / incident.cell_flux_rgb_w.sum(axis=0)
    assert bands == pytest.approx([0.5, 0.7, 0.9], rel=0.02)
    ledger = map_info(h.raymap).ledger.absorbed_by_body_w
    assert absorbed.flux_w.value == pytest.approx(ledger["Ball"], rel=1e-6)
    assert evaluate_detector(h.raymap, "Walls").flux_w.value == pytest.approx(ledger["Room"], rel=1e-6)


def test_a_clear_face_absorbs_nothing_and_is_hit_from_both_sides(tmp_path):
    """A beam through a block, n = 1.5: the far face sees (1 - R) / (1 - R²) times 1 - R, and what comes back."""
    h = traced(
        tmp_path, {"Block": body(box((-5, -5, -5), (5, 5, 0)), "clear", "glass")}, rays=50_000, surfaces=SURFACES,
        media={"glass": {"refractive_index": 1.5}}, sources={"Beam": disc_source((0.3, 0.2, 30), (0, 0, -1), 2)},
        detectors={"In": face("Block", "+z"), "Out": face("Block", "-z"), "Kept": face("Block", measure="absorbed"),
                   "Side": face("Block", "+x", "-x", "+y", "-y")},
    )  # fmt: skip
    r = 0.04
    inside = (1 - r) / (1 - r * r)  # flux that arrives at the far face, all bounces together
    for name, expected in (("In", 1 + r * inside), ("Out", inside)):
        found = evaluate_detector(h.raymap, name)
        agrees(name, found.flux_w.value, found.flux_w.stderr, expected)
    assert evaluate_detector(h.raymap, "Kept").flux_w.value == pytest.approx(0, abs=1e-12)
    assert evaluate_detector(h.raymap, "Side").crossings == 0


def test_light_in_a_tinted_medium_arrives_tinted(tmp_path):
    """Beer-Lambert: band b arrives at the bottom of a bath with exp(-a_b d), from the surface on."""
    absorption = np.array([0.0, 0.05, 0.4])
    h = traced(
        tmp_path, {"Floor": body(box((-5, -5, -1), (5, 5, 0)), "black")}, rays=100_000, surfaces=SURFACES,
        ambient="tint", media={"tint": {"refractive_index": 1.0, "absorption_per_mm": list(absorption)}},
        sources={"Beam": disc_source((0, 0, 8), (0, 0, -1), 3, flux_w=3.0)}, detectors={"Floor": face("Floor", "+z")},
    )  # fmt: skip
    found = evaluate_detector(h.raymap, "Floor")
    expected = np.exp(-absorption * 8)
    relative = found.flux_w.stderr / found.flux_w.value
    agrees("bands", found.cell_flux_rgb_w.sum(axis=0), relative * expected, expected)


def test_the_region_of_extremes_does_not_shrink_with_triangles(tmp_path):
    """Even light on a ball of 5120 triangles: patches are as noisy as their common area, so no extreme is wild."""
    h = traced(
        tmp_path, {"Ball": body(ball(5, 4).inside_out, "grey")}, rays=200_000, surfaces=SURFACES,
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}}, detectors={"On": face("Ball")},
    )  # fmt: skip
    found = evaluate_detector(h.raymap, "On")
    assert len(found.cell_flux_w) == 5120
    assert found.n_patches > 60
    # about 2000 rays a patch: 2.2 % each, extremes of a hundred within four of it
    assert found.min_w_per_mm2.value > 0.88 * found.mean_w_per_mm2.value
    assert found.max_w_per_mm2.value < 1.12 * found.mean_w_per_mm2.value
    assert evaluate_detector(h.raymap, "On", resolution=(1, 1)).uniformity.value == pytest.approx(1, rel=1e-9)


def test_emitting_is_no_arriving(tmp_path):
    """A face that shines into the open registers nothing; opposite a black wall only the wall does."""
    h = traced(
        tmp_path,
        {"Lamp": body(box((-5, -5, -1), (5, 5, 0)), "black"), "Wall": body(box((-5, -5, 2), (5, 5, 3)), "black")},
        rays=5_000, surfaces=SURFACES, sources={"S": {"kind": "faces", "flux_w": 1, "body": "Lamp", "faces": ["+z"]}},
        detectors={"Lamp": face("Lamp"), "Wall": face("Wall", "-z"), "Kept": face("Lamp", measure="absorbed")},
    )  # fmt: skip
    assert evaluate_detector(h.raymap, "Lamp").crossings == evaluate_detector(h.raymap, "Kept").crossings == 0
    assert query(h.raymap, "detector(Lamp)").rays == 0
    wall = evaluate_detector(h.raymap, "Wall")
    assert wall.crossings == wall.rays == query(h.raymap, "ended(absorbed)").rays > 0


def test_killed_light_arrived_but_is_not_absorbed(tmp_path):
    h = traced(
        tmp_path, {"Plate": body(PLATE, "grey")}, rays=1_000, surfaces=SURFACES, settings={"max_events": 2},
        sources={"Beam": disc_source((0, 0, 9), (0, 0, -1), 2)},
        detectors={"On": face("Plate"), "Kept": face("Plate", measure="absorbed")},
    )  # fmt: skip
    assert query(h.raymap, "event(killed_depth)").rays == 1_000
    assert evaluate_detector(h.raymap, "On").flux_w.value == pytest.approx(1, rel=1e-12)
    assert evaluate_detector(h.raymap, "Kept").flux_w.value == 0


def test_these_detectors_change_nothing_that_is_stored(tmp_path):
    more = {"rays": 2_000, "surfaces": SURFACES, "sources": {"S": POINT}}
    bodies = {"Plate": body(PLATE, "grey")}
    bare = traced(tmp_path / "a", bodies, **more)
    watched = traced(tmp_path / "b", bodies, detectors={"On": face("Plate"), "Far": {"kind": "far_field"}}, **more)
    assert watched.raymap.content_hash == bare.raymap.content_hash
    assert watched.raymap.n_bytes == bare.raymap.n_bytes
