# SPDX-License-Identifier: LGPL-2.1-or-later
"""Specular reflection: its law, and closed forms for mirrors together."""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from tests.physics.scenes import agrees, body, box, disc_source, traced, unit

MIRROR = {"mirror": {"kind": "mirror", "reflectance": [0.9, 0.5, 1.0]}, "black": {"kind": "absorber"}}


def test_law_of_reflection_over_all_angles(tmp_path):
    """The angle of reflection is that of incidence, in the plane of incidence (Born & Wolf, section 1.5.1), to the grid
    of stored positions; the light that goes on is the reflectance's share of each band.
    """
    rng = np.random.default_rng(1)
    polar, azimuth = np.radians(np.linspace(0, 89.5, 40)), rng.uniform(0, 2 * math.pi, 40)
    way = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), -np.cos(polar)], axis=1)
    h = traced(
        tmp_path,
        {"Mirror": body(box((-200, -200, -10), (200, 200, 0)), "mirror")},
        rays=8_000,
        surfaces=MIRROR,
        sources={f"S{k}": disc_source(-10 * d, d, 0.01) for k, d in enumerate(way)},
        settings={"roulette_threshold": 0},
    )
    assert (np.diff(h.offsets) == 3).all()
    rows = h.first + 1
    assert (h.kind[rows] == EventKind.SPECULAR_REFLECTION).all()
    out = h.way[rows + 1]
    expected = way[h.ray_source] * [1, 1, -1]
    tolerance = math.sqrt(3) * h.raymap.manifest.grid_mm / np.linalg.norm(out, axis=1)
    assert (np.linalg.norm(unit(out) - expected, axis=1) <= tolerance).all()
    assert np.allclose(h.light[rows], np.array([0.9, 0.5, 1.0]) / 3, rtol=3e-7)


def test_corner_of_three_mirrors_returns_light(tmp_path):
    """Three mirrors at right angles send light back where it came from (E. Hecht: Optics, section 5.5), after
    three reflections with the cube of the reflectance.
    """
    walls = {
        "X": body(box((-1, 0, 0), (0, 60, 60)), "mirror"),
        "Y": body(box((0, -1, 0), (60, 0, 60)), "mirror"),
        "Z": body(box((0, 0, -1), (60, 60, 0)), "mirror"),
    }
    direction = -unit(np.array([1.0, 0.9, 1.2]))
    h = traced(
        tmp_path,
        walls,
        rays=20_000,
        surfaces=MIRROR,
        sources={"S": disc_source(-40 * direction, direction, 6)},
        settings={"roulette_threshold": 0},
    )
    three = np.diff(h.offsets) == 5
    assert three.mean() > 0.99
    out = h.way[h.last[three]]
    tolerance = math.sqrt(3) * h.raymap.manifest.grid_mm / np.linalg.norm(out, axis=1)
    assert (np.linalg.norm(unit(out) + direction, axis=1) <= tolerance).all()
    assert np.allclose(h.light[h.last[three]], np.array([0.9, 0.5, 1.0]) ** 3 / 3, rtol=1e-6)


def test_light_pipe_of_mirrors(tmp_path):
    """In a square pipe a ray with the slopes sx, sy meets the walls floor((L |sx| + x) / a) times and so on: unfold the
    mirrors (W. Cassarly: Uniformity from square light pipes, the kaleidoscope). Its light is the reflectance to that
    power.
    """
    half, length, reflectance = 5.0, 63.0, 0.9
    inside = box((-half, -half, 0), (half, half, length)).inside_out
    h = traced(
        tmp_path,
        {"Pipe": body(inside, "mirror", plus_z="black", minus_z="black")},
        rays=20_000,
        surfaces={"mirror": {"kind": "mirror", "reflectance": reflectance}, "black": {"kind": "absorber"}},
        sources={
            "S": {
                "kind": "cone",
                "flux_w": 1,
                "position_mm": [1.3, -0.7, 1.0],
                "direction": [0, 0, 1],
                "half_angle_deg": 60,
            }
        },
        settings={"roulette_threshold": 0},
    )
    way = h.way[h.first + 1]
    slope = way[:, :2] / way[:, 2:]
    unfolded = np.array([1.3, -0.7]) + slope * (length - 1.0)
    bounces = np.abs(np.floor((unfolded + half) / (2 * half))).sum(axis=1)
    # rays within the grid of a wall's end can fall on either side of it
    sure = (np.abs(unfolded / (2 * half) - 0.5 - np.round(unfolded / (2 * half) - 0.5)) > 1e-3).all(axis=1)
    assert sure.mean() > 0.99
    counted = np.diff(h.offsets) - 2
    assert (counted[sure] == bounces[sure]).all()
    arriving = h.light_before[h.last].sum(axis=1)
    assert np.allclose(arriving[sure], reflectance ** bounces[sure], rtol=1e-5)


@pytest.mark.parametrize("roulette_threshold", [0.0, 0.3, 1.0])
def test_two_parallel_mirrors(tmp_path, roulette_threshold):
    """Five reflections to and fro leave a^5 of each band in expectation, whatever part of the losses is drawn."""
    a = np.array([0.9, 0.5, 0.2])
    n = 5
    angle = math.atan(0.5)  # each crossing of the 10 mm gap moves the beam by 5 mm
    direction = np.array([math.sin(angle), 0, math.cos(angle)])
    h = traced(
        tmp_path,
        {
            "Low": body(box((-100, -10, -11), (100, 10, -10)), "mirror"),
            "High": body(box((-100, -10, 0), (100, 10, 1)), "mirror"),
            "End": body(box((-52.5 + 5 * n, -10, -9.9), (-52 + 5 * n, 10, -0.1)), "black"),
        },
        rays=60_000,
        surfaces={"mirror": {"kind": "mirror", "reflectance": list(a)}, "black": {"kind": "absorber"}},
        sources={"S": disc_source((-52.5, 0, -5), direction, 0.1)},
        settings={"roulette_threshold": roulette_threshold},
    )
    end = h.on_body("End")
    assert (h.number[end] == n + 1).all()
    agrees("light of each band", *h.flux_w(h.per_ray(end, h.light_before[end])), a**n / 3)
