# SPDX-License-Identifier: LGPL-2.1-or-later
"""The integrating sphere: its multiplier, and that Russian roulette changes no expectation.

The sphere is a faceted surface, white inside, with a black port. With the share f of the port in its area and
reflectance rho the wall sends out M = rho / (1 - rho (1 - f)) times the light that first falls on it, and the port
gets f M of it (Labsphere: A Guide to Integrating Sphere Theory and Applications, "The sphere multiplier"; D. Goebel:
Generalized integrating-sphere theory, Appl. Opt. 6 (1967), p. 125).

On a sphere every point sees each area alike; between facets of an icosphere of 20,480 triangles the view factor differs
from that by a share of the order of (edge / radius)² = 1e-3, and much less for a port that is far from most of the
wall.
"""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from tests.physics.scenes import Shape, agrees, ball, body, follows, share_agrees, traced

RADIUS_MM = 50.0
PORT_SHARE = 0.04
REFLECTANCES = [0.5, 0.8, 0.9, 0.98]


def sphere_with_port() -> tuple[Shape, float]:
    """An icosphere whose face Port is a cap at the top; the port's share in its area."""
    shape = ball(RADIUS_MM, 5)
    height = shape.vertices[shape.triangles].mean(axis=1)[:, 2] / RADIUS_MM
    in_port = height > 1 - 2 * PORT_SHARE
    return shape.grouped(in_port.astype(int), ("Wall", "Port")), shape.areas[in_port].sum() / shape.area


def white_sphere(folder, shape, wall, rays, source=None, **settings):
    return traced(
        folder,
        {"Sphere": body(shape, "white", **({"Port": "black"} if len(shape.faces) > 1 else {}))},
        rays=rays,
        surfaces={"white": {"kind": "lambertian", **wall}, "black": {"kind": "absorber"}},
        sources={"S": source or {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}},
        settings=settings,
    )


@pytest.mark.parametrize("roulette_threshold", [0.0, 0.1, 1.0])
@pytest.mark.parametrize("reflectance", REFLECTANCES)
def test_multiplier(tmp_path, reflectance, roulette_threshold):
    """Light sent out by the wall, on the wall in all, and into the port; the beam meets the wall opposite the port."""
    shape, f = sphere_with_port()
    multiplier = reflectance / (1 - reflectance * (1 - f))
    down = {"kind": "cone", "flux_w": 3.0, "position_mm": [0, 0, 0], "direction": [0, 0, -1], "half_angle_deg": 60}
    h = white_sphere(
        tmp_path,
        shape,
        {"reflectance": reflectance},
        30_000,
        down,
        max_events=2000,
        roulette_threshold=roulette_threshold,
    )
    assert not np.isin(h.kind, [EventKind.KILLED_DEPTH, EventKind.KILLED_NUMERICAL, EventKind.LEFT]).any()

    wall = h.face == h.face_index("Sphere", "Wall")
    port = h.face == h.face_index("Sphere", "Port")
    arrives, goes = h.light_before.sum(axis=1), h.light.sum(axis=1)
    allowed = {"rounding": 3e-4}  # of the facets
    agrees("light sent out by the wall", *h.flux_w(h.per_ray(wall, goes[wall])), 3 * multiplier, **allowed)
    agrees("light on the wall", *h.flux_w(h.per_ray(wall, arrives[wall])), 3 * (1 + (1 - f) * multiplier), **allowed)
    agrees("light into the port", *h.flux_w(h.per_ray(port, arrives[port])), 3 * f * multiplier, **allowed)

    # light never grows, and with roulette alone it never shrinks either
    grown = (goes - arrives)[h.number > 0]
    assert grown.max() <= 1e-6
    if roulette_threshold == 1.0:
        assert (np.isclose(goes, arrives, atol=1e-5) | (goes == 0) | (h.number == 0)).all()


@pytest.mark.parametrize("reflectance", REFLECTANCES)
def test_hits_in_a_closed_sphere_are_geometric(tmp_path, reflectance):
    """Without a port and with all losses drawn, a ray meets the wall k times with probability rho^(k - 1) (1 - rho),
    1 / (1 - rho) times in the mean: exact for every closed shape, facets and all.
    """
    h = white_sphere(
        tmp_path, ball(RADIUS_MM, 3), {"reflectance": reflectance}, 40_000, max_events=5000, roulette_threshold=1.0
    )
    assert (h.kind[h.last] == EventKind.ABSORPTION).all()
    hits = np.diff(h.offsets) - 1
    agrees("hits a ray", hits.mean(), hits.std() / math.sqrt(len(hits)), 1 / (1 - reflectance))
    spread = math.sqrt(reflectance) / (1 - reflectance)
    fourth = np.mean((hits - hits.mean()) ** 4)
    variance_stderr = math.sqrt((fourth - hits.var() ** 2) / len(hits))
    agrees("variance of hits", hits.var(), variance_stderr, spread**2)
    share_agrees("rays with one hit", (hits == 1).sum(), len(hits), 1 - reflectance)


@pytest.mark.parametrize("roulette_threshold", [0.0, 0.1, 1.0])
def test_translucent_sphere(tmp_path, roulette_threshold):
    """A closed wall with reflectance rho and transmittance tau lets out tau / (1 - rho), band by band."""
    reflectance, transmittance = np.array([0.6, 0.3, 0.0]), np.array([0.3, 0.3, 0.8])
    rgb = np.array([0.2, 0.3, 0.5])
    h = white_sphere(
        tmp_path,
        ball(RADIUS_MM, 3),
        {"reflectance": list(reflectance), "transmittance": list(transmittance)},
        100_000,
        {"kind": "point", "flux_w": 1, "rgb": list(rgb), "position_mm": [0, 0, 0]},
        roulette_threshold=roulette_threshold,
    )
    left = h.kind == EventKind.LEFT
    expected = rgb * transmittance / (1 - reflectance)
    agrees("light of each band outside", *h.flux_w(h.per_ray(left, h.light[left])), expected)


def test_the_wall_is_lit_evenly(tmp_path):
    """After a reflection all heights of the sphere are hit alike (Archimedes: equal heights, equal areas)."""
    h = white_sphere(tmp_path, ball(RADIUS_MM, 5), {"reflectance": 0.9}, 40_000, roulette_threshold=1.0)
    second = h.number == 2
    for axis, name in enumerate("xyz"):
        follows(f"place along {name}", (h.position[second, axis] / RADIUS_MM + 1) / 2)
