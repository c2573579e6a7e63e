# SPDX-License-Identifier: LGPL-2.1-or-later
"""Detector crossings of rays whose place and angle are known."""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from tests.physics.scenes import agrees, body, box, disc_source, rectangle, share_agrees, traced, unit

RNG_SEED = 7


def oblique_axes(normal, x_axis):
    """x, y and normal as the scene format defines them."""
    n = unit(np.array(normal, float))
    x = unit(np.array(x_axis, float) - (np.array(x_axis, float) @ n) * n)
    return x, np.cross(n, x), n


def test_place_and_angle_of_known_rays(tmp_path):
    """Pencils through chosen points of a tilted detector at chosen angles, from the front and from behind."""
    rng = np.random.default_rng(RNG_SEED)
    normal, x_axis, center = (1, 2, -0.5), (0, 1, 1), np.array([3.0, -4.0, 12.0])
    x, y, n = oblique_axes(normal, x_axis)
    wanted, sources = [], {}
    for k in range(60):
        at = rng.uniform((-9, -4), (9, 4))
        angle, turn = rng.uniform(0, math.radians(89)), rng.uniform(0, 2 * math.pi)
        sign = -1 if k % 2 else 1  # odd ones come from behind
        direction = math.sin(angle) * (math.cos(turn) * x + math.sin(turn) * y) - sign * math.cos(angle) * n
        point = center + at[0] * x + at[1] * y
        sources[f"S{k}"] = disc_source(point - 30 * direction, direction, 1e-9)
        wanted.append((*at, angle if sign > 0 else math.pi - angle))
    h = traced(
        tmp_path,
        {},
        rays=6_000,
        sources=sources,
        detectors={"D": rectangle(center, 20, 10, normal=list(normal), x_axis=list(x_axis), side="both")},
    )
    assert (np.bincount(h.crossing_ray, minlength=h.n_rays) == 1).all()
    wanted = np.array(wanted)[h.ray_source[h.crossing_ray]]
    # a pencil's radius of 1e-9 mm is widened by 1 / cos at most; places are rounded to the grid, angles to 2^-18
    assert np.abs(h.crossing_xy - wanted[:, :2]).max() <= 0.51 * h.raymap.manifest.grid_mm + 1e-7
    assert np.abs(h.crossing_angle - wanted[:, 2]).max() <= 2.0**-18
    assert h.crossing_registered.all()
    assert (h.kind[h.crossing_row] == EventKind.EMISSION).all()


@pytest.mark.parametrize("side", ["front", "back", "both"])
def test_side_and_acceptance_angle(tmp_path, side):
    """Light registers on the chosen side up to the largest angle; what isn't registered still crosses, and stays
    unchanged.
    """
    degrees = [0, 10, 24.99, 25.01, 60, 89]
    sources = {}
    for k, angle in enumerate(degrees):
        for s, name in ((-1, "front"), (1, "back")):
            direction = np.array([math.sin(math.radians(angle)), 0, s * math.cos(math.radians(angle))])
            sources[f"{name}{k}"] = disc_source(-10 * direction, direction, 1e-6)
    h = traced(
        tmp_path,
        {},
        rays=2_400,
        sources=sources,
        detectors={"D": rectangle((0, 0, 0), 4, 4, side=side, max_angle_deg=25)},
    )
    assert len(h.crossing_ray) == h.n_rays
    names = np.array(h.raymap.names.sources)[h.ray_source[h.crossing_ray]]
    expected = {
        f"{name}{k}": angle < 25 and side in (name, "both")
        for k, angle in enumerate(degrees)
        for name in ("front", "back")
    }
    assert (h.crossing_registered == [expected[name] for name in names]).all()
    assert (h.kind[h.last] == EventKind.LEFT).all()
    assert (h.light[h.last] == h.light[h.first]).all()


def test_only_the_rectangle_catches_light(tmp_path):
    """An even beam over a detector smaller than it: the share of areas, even places, none outside."""
    h = traced(
        tmp_path,
        {},
        rays=200_000,
        sources={"S": disc_source((0.5, 0, 9), (0, 0, -1), 5)},
        detectors={"D": rectangle((0, 1, 0), 4, 3)},
    )
    share_agrees("share caught", len(h.crossing_ray), h.n_rays, 4 * 3 / (math.pi * 25))
    assert (np.abs(h.crossing_xy) <= [2, 1.5]).all()
    inside = h.position[h.first] - [0, 1, 9]
    caught = (np.abs(inside[:, :2]) < np.array([2, 1.5]) - 1e-4).all(axis=1)
    assert np.isin(np.flatnonzero(caught), h.crossing_ray).all()
    assert (h.crossing_angle == 0).all()


def test_crossings_stand_in_the_order_of_the_way(tmp_path):
    """Detectors one behind the other, before and after a mirror: once down, once up, each with its own angle."""
    heights = [5.0, 1.0, 3.0]
    h = traced(
        tmp_path,
        {"Mirror": body(box((-50, -50, -1), (50, 50, 0)), "mirror")},
        rays=1_000,
        surfaces={"mirror": {"kind": "mirror", "reflectance": 0.5}},
        sources={"S": disc_source((-6, 0, 10), (0.6, 0, -0.8), 0.1)},
        detectors={f"D{k}": rectangle((0, 0, z), 40, 40, side="both") for k, z in enumerate(heights)},
    )
    assert h.crossing_detector.reshape(-1, 6).tolist() == [[0, 2, 1, 1, 2, 0]] * h.n_rays
    number = h.number[h.crossing_row].reshape(-1, 6)
    assert (number == [0, 0, 0, 1, 1, 1]).all()
    # going down is onto the front, going up onto the back
    down = math.acos(0.8)
    assert np.abs(h.crossing_angle.reshape(-1, 6) - [down, down, down, *[math.pi - down] * 3]).max() < 2.0**-18
    assert np.allclose(h.light[h.crossing_row].sum(axis=1).reshape(-1, 6), [1, 1, 1, 0.5, 0.5, 0.5])


def test_a_detector_changes_no_ray(tmp_path):
    """Rays with and without a detector on their way have the same events."""
    bodies = {"Plate": body(box((-20, -20, -1), (20, 20, 0)), "white")}
    more = {
        "rays": 5_000,
        "surfaces": {"white": {"kind": "lambertian", "reflectance": 0.5}},
        "sources": {"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 10]}},
    }
    with_detector = traced(tmp_path / "a", bodies, detectors={"D": rectangle((0, 0, 5), 30, 30)}, **more)
    without = traced(tmp_path / "b", bodies, **more)
    assert len(with_detector.crossing_row) > 0
    assert (with_detector.kind == without.kind).all()
    assert (with_detector.triangle == without.triangle).all()
    assert (with_detector.position == without.position).all()
    assert (with_detector.light == without.light).all()


def test_acceptance_angle_of_a_lambertian_beam(tmp_path):
    """From even radiance a share sin²(theta) arrives within theta (E. Hecht: Optics, section 13.1.1; sin² law of
    Lambert).
    """
    h = traced(
        tmp_path,
        {"Lamp": body(box((-400, -400, -1), (400, 400, 0)), "black")},
        rays=300_000,
        surfaces={"black": {"kind": "absorber"}},
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Lamp", "faces": ["+z"]}},
        detectors={"D": rectangle((0, 0, 0.5), 200, 200, normal=[0, 0, -1], max_angle_deg=40)},
    )
    inside = h.crossing_registered.sum()
    share_agrees("share within 40 degrees", inside, len(h.crossing_row), math.sin(math.radians(40)) ** 2)
    expected = 200**2 / 800**2
    agrees("flux", *h.flux_w(h.crossings_per_ray(h.crossing_detector == 0)), expected, rounding=1e-4)
