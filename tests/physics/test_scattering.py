# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scattering in media, end to end: free paths, where rays end, mean path lengths, several scatterers, the ledger.

Media here have the index of their surroundings unless a test says otherwise.
"""

import math
from collections import Counter

import numpy as np
import pytest

from raymaps.criterion import query
from raymaps.kinds import EventKind
from raymaps.on_the_way import _through
from raymaps.results.detector import evaluate_detector
from raymaps.store import RayMap
from tests.physics.adding_doubling import h_function
from tests.physics.scenes import (
    Histories,
    agrees,
    ball,
    body,
    box,
    disc_source,
    follows,
    rectangle,
    share_agrees,
    traced,
)

SURFACES = {"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}, "side": {"kind": "mirror"}}
POINT = {"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}}
SCATTERING, ABSORPTION = EventKind.MEDIUM_SCATTERING, EventKind.MEDIUM_ABSORPTION


def milk(scattering, absorption=0.0, g=0.0, index=1.0):
    phase = {"kind": "henyey_greenstein", "g": g}
    return {
        "refractive_index": index,
        "absorption_per_mm": absorption,
        "scattering": [{"coefficient_per_mm": scattering, "phase": phase}],
    }


def in_a_ball(folder, medium, *, radius=100.0, rays=50_000, **sections) -> Histories:
    """A point source in the middle of a ball."""
    return traced(
        folder,
        {"Ball": body(ball(radius, 3), "polished", "milk")},
        rays=rays,
        media={"milk": medium},
        surfaces=SURFACES,
        **{"sources": POINT, **sections},
    )


# ----------------------------------------------------------------------------------------- free paths, kinds of events


def test_free_paths_are_exponential_and_tell_nothing_of_what_happens_at_their_end(tmp_path):
    """The first event comes after the distance r with the density m exp(-m r), m = scattering + absorption; whether it
    is scattering has the probability of the albedo, whatever r; so do all later ones.
    """
    h = in_a_ball(tmp_path, milk(0.6, 0.2), rays=300_000)
    first = h.first + 1
    r = np.linalg.norm(h.position[first], axis=1)
    agrees("mean free path", r.mean(), r.std() / math.sqrt(len(r)), 1 / 0.8)
    follows("free paths", -np.expm1(-0.8 * r))
    is_scattering = h.kind[first] == SCATTERING
    share_agrees("albedo", is_scattering.sum(), len(first), 0.75)
    for half, chosen in (("near", r < 0.8), ("far", r >= 0.8)):
        share_agrees(f"albedo {half}", is_scattering[chosen].sum(), chosen.sum(), 0.75)
    later = np.isin(h.kind, (SCATTERING, ABSORPTION)) & (h.number > 3)
    share_agrees("albedo later on", (h.kind[later] == SCATTERING).sum(), later.sum(), 0.75)


def test_number_of_scatterings_is_geometric(tmp_path):
    """With the albedo w a ray is scattered k times with probability (1 - w) w^k before it is absorbed."""
    h = in_a_ball(tmp_path, milk(2.0, 0.5))
    n = h.per_ray(h.kind == SCATTERING)
    for k in range(12):
        share_agrees(f"{k} times", (n == k).sum(), h.n_rays, 0.2 * 0.8**k)


@pytest.mark.parametrize("g", [0.0, 0.8, -0.7])
def test_mean_square_distance_to_absorption(tmp_path, g):
    """In an unbounded medium <r²> = 2 / (a (a + s (1 - g))): with m = a + s free paths have the mean 1 / m and the mean
    square 2 / m², the k-th is flown with the probability (s / m)^k, and the cosine between two that are k scatterings
    apart has the mean g^k.
    """
    s, a = 1.0, 0.25
    h = in_a_ball(tmp_path, milk(s, a, g), radius=200, rays=40_000)
    end = h.kind[h.last] == ABSORPTION
    assert end.all()
    square = (h.position[h.last] ** 2).sum(axis=1)
    agrees("<r²>", square.mean(), square.std() / math.sqrt(h.n_rays), 2 / (a * (a + s * (1 - g))))


def test_two_scatterers_side_by_side(tmp_path):
    """Their coefficients add up, and their mean cosines by their shares: <r²> sees g = sum(s g) / sum(s)."""
    angle = [float(x) for x in np.linspace(0, 180, 91)]
    table = {"kind": "table", "angle_deg": angle, "value": [2 + math.cos(math.radians(x)) for x in angle]}
    medium = {
        "refractive_index": 1.0,
        "absorption_per_mm": 0.25,
        "scattering": [
            {"coefficient_per_mm": 0.7, "phase": {"kind": "henyey_greenstein", "g": 0.9}},
            {"coefficient_per_mm": 0.3, "phase": table},  # mean cosine 1/6
        ],
    }
    h = in_a_ball(tmp_path, medium, radius=200, rays=40_000)
    r = np.linalg.norm(h.position[h.first + 1], axis=1)
    agrees("mean free path", r.mean(), r.std() / math.sqrt(len(r)), 1 / 1.25)
    square = (h.position[h.last] ** 2).sum(axis=1)
    expected = 2 / (0.25 * (0.25 + 0.7 * (1 - 0.9) + 0.3 * (1 - 1 / 6)))
    agrees("<r²>", square.mean(), square.std() / math.sqrt(h.n_rays), expected, rounding=2e-4)  # a table of 91 entries


def test_scatterers_of_different_colours(tmp_path):
    """Red is scattered ahead, blue back, green by both: the light after the first scattering, by band and side."""
    medium = {
        "refractive_index": 1.0,
        "scattering": [
            {"coefficient_per_mm": [1.0, 0.5, 0.0], "phase": {"kind": "henyey_greenstein", "g": 0.999999}},
            {"coefficient_per_mm": [0.0, 0.5, 3.0], "phase": {"kind": "henyey_greenstein", "g": -0.999999}},
        ],
    }
    h = traced(
        tmp_path,
        {"Slab": body(box((-5, -5, 0), (5, 5, 0.5)), "polished", "milk")},
        rays=100_000,
        media={"milk": medium},
        surfaces=SURFACES,
        sources={"S": disc_source((0, 0, -1), (0, 0, 1), 0.1, rgb=(2, 1, 1))},
    )
    first = h.first + 2  # after the interface
    scattered = h.kind[first] == SCATTERING
    ahead = np.zeros(h.n_rays, bool)
    ahead[scattered] = h.way[first[scattered] + 1, 2] > 0
    rgb, all_scattered = np.array([0.5, 0.25, 0.25]), -np.expm1(-0.5 * np.array([1, 1, 3]))
    for what, chosen, share in (("ahead", scattered & ahead, [1, 0.5, 0]), ("back", scattered & ~ahead, [0, 0.5, 1])):
        light = np.where(chosen[:, None], h.light[first], 0)
        agrees(what, light.mean(axis=0), light.std(axis=0) / math.sqrt(h.n_rays), rgb * all_scattered * share)


# --------------------------------------------------------------------------------------------------- bodies as a whole


@pytest.mark.parametrize(("scattering", "g"), [(0.0, 0.0), (0.5, 0.0), (5.0, 0.0), (2.0, 0.8)])
def test_mean_path_length_does_not_depend_on_scattering(tmp_path, scattering, g):
    """Even light from all sides stays in a body for the mean path 4 V / S, however it is scattered there: S. Blanco,
    R. Fournier: An invariance property of diffusive random walks, Europhys. Lett. 61 (2003), p. 168.

    The inside of a Lambertian box is evenly lit; the body stands somewhere in it.
    """
    low, high = (-1.0, -2.0, -0.5), (1.0, 1.0, 0.5)
    h = traced(
        tmp_path,
        {
            "Body": body(box(low, high).turned(0.4, (1, 2, 3)), "polished", "milk"),
            "Lamp": body(box((-3, -3, -3), (3, 3, 3)).inside_out, "black"),
        },
        rays=60_000,
        media={"milk": milk(scattering, 0.0, g)},
        surfaces=SURFACES,
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Lamp"}},
        settings={"max_events": 100_000},
    )
    assert (h.kind[h.last] == EventKind.ABSORPTION).all()
    inside = np.zeros(len(h.kind), bool)
    inside[1:] = h.medium[:-1] == h.index("media", "milk")
    inside[h.first] = False
    path = h.per_ray(inside, np.linalg.norm(h.way[inside], axis=1))
    path = path[path > 0]
    volume, surface = 2 * 3 * 1, 2 * (2 * 3 + 3 * 1 + 2 * 1)
    agrees("mean path", path.mean(), path.std() / math.sqrt(len(path)), 4 * volume / surface, rounding=1e-5)


def test_a_white_box_loses_nothing(tmp_path):
    """A medium of albedo 1 between mirrors and Lambertian faces of reflectance 1: all light comes out of the hole."""
    sides = {"minus_x": "side", "minus_y": "white", "plus_y": "white", "minus_z": "side", "plus_z": "white"}
    h = traced(
        tmp_path,
        {"Box": body(box((-1, -1, -1), (1, 1, 1)), "polished", "milk", **sides)},
        rays=20_000,
        media={"milk": milk([3.0, 1.0, 0.3], 0.0, 0.3, 1.4)},
        surfaces={**SURFACES, "white": {"kind": "lambertian", "reflectance": 1.0}},
        sources=POINT,
        settings={"max_events": 100_000},
    )
    assert (h.kind[h.last] == EventKind.LEFT).all()
    total = h.light[h.last].sum(axis=1)
    assert total == pytest.approx(1, abs=1e-4)  # float32, some hundred recolourings
    light = h.light[h.last]
    agrees("bands", light.mean(axis=0), light.std(axis=0) / math.sqrt(h.n_rays), 1 / 3, rounding=1e-5)


def test_fog_outside_of_all_bodies(tmp_path):
    """An ambient medium scatters and absorbs up to the box that rays leave."""
    h = traced(
        tmp_path,
        {"Wall": body(box((-1, -1, 3), (1, 1, 3.5)), "black")},
        rays=50_000,
        ambient="fog",
        media={"fog": milk(0.4, 0.1)},
        surfaces=SURFACES,
        sources={"S": disc_source((0, 0, 0), (0, 0, 1), 0.2)},
    )
    straight = h.kind[h.first + 1] == EventKind.ABSORPTION
    expected = math.exp(-0.5 * 3)
    share_agrees("unscattered", straight.sum(), h.n_rays, expected)
    assert set(h.kind[h.last]) == {EventKind.ABSORPTION, ABSORPTION, EventKind.LEFT}


# -------------------------------------------------------------------------------------------- hard cases, bookkeeping


@pytest.mark.parametrize("depth", [1e2, 1e4, 1e6])
def test_thick_media_do_not_leak(tmp_path, depth):
    """Mean free paths down to 1e-8 of the scene, far below the steps of float32 away from the scene's middle: only the
    optical depth counts, ray for ray, and none slips through a surface.
    """
    turn, far = (0.7, (1.0, 2.0, 0.5)), np.array([30.0, 27.0, -24.0])
    sides = dict.fromkeys(("plus_x", "minus_x", "plus_y", "minus_y"), "side")
    lamp = box((-0.01, -0.01, 0.5), (0.01, 0.01, 0.52)).turned(*turn).moved(*far)
    h = traced(
        tmp_path,
        {
            "Slab": body(box((-4, -4, -1), (4, 4, 0)).turned(*turn).moved(*far), "polished", "milk", **sides),
            "Lamp": body(lamp, "black"),
            "Far": body(box((-1, -1, 0), (1, 1, 1)).moved(*-far), "black"),
        },
        rays=4_000,
        media={"milk": milk(0.99 * depth, 0.01 * depth)},
        surfaces=SURFACES,
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Lamp", "faces": ["-z"]}},
        settings={"max_events": 100_000},
    )
    assert set(h.kind[h.last]) <= {EventKind.LEFT, ABSORPTION, EventKind.ABSORPTION}
    returned = h.kind[h.last] != ABSORPTION
    # a cosine-distributed source: the spherical albedo of a half space, from 1 - sqrt(1 - w) times the mean of H
    x, w = np.polynomial.legendre.leggauss(40)
    m = (x + 1) / 2
    expected = 1 - math.sqrt(0.01) * float((w * m * h_function(0.99, m)).sum())
    share_agrees("reflected", returned.sum(), h.n_rays, expected)


def test_rays_that_are_scattered_too_often_are_killed_with_all_their_light(tmp_path):
    h = in_a_ball(tmp_path, milk([10.0, 5.0, 1.0]), rays=2_000, settings={"max_events": 20})
    killed = h.kind[h.last] == EventKind.KILLED_DEPTH
    assert killed.any()
    assert h.light[h.last[killed]].sum(axis=1) == pytest.approx(1, abs=1e-5)
    assert ledger_of(h.raymap)["killed"] == pytest.approx(killed.mean(), abs=1e-5)


def ledger_of(raymap: RayMap) -> Counter:
    """Light that went each way, relative to all."""
    sums: Counter = Counter()
    for portion in raymap.portions:
        for entry in portion.summary.ledger:
            sums[entry.what] += entry.light / raymap.n_rays
    return sums


def test_the_ledger_closes(tmp_path):
    """Coloured scattering, absorption and an index step: what is emitted is absorbed, escapes or is killed."""
    medium = milk([3.0, 1.0, 0.3], [0.1, 0.0, 0.4], 0.6, 1.4)
    h = in_a_ball(tmp_path, medium, radius=3, rays=20_000)
    ledger = ledger_of(h.raymap)
    emitted = h.light[h.first].sum(axis=1).mean()
    assert sum(ledger.values()) == pytest.approx(emitted, abs=1e-9)
    assert ledger["body"] == 0  # an interface takes nothing
    absorbed = h.kind[h.last] == ABSORPTION
    assert ledger["medium"] == pytest.approx(absorbed.mean(), abs=1e-5)
    agrees("each band", h.light[h.first].mean(axis=0), 0, 1 / 3, rounding=1e-6)


def test_criteria_and_reports_know_scattering(tmp_path):
    """medium(milk, scattering) and event(medium_scattering) match the rays that were scattered, and only those."""
    h = in_a_ball(tmp_path, milk(0.5, 0.1), radius=2, rays=5_000)
    scattered = h.per_ray(h.kind == SCATTERING) > 0
    absorbed = h.per_ray(h.kind == ABSORPTION) > 0
    for text, expected in (
        ("medium(milk, scattering)", scattered),
        ("event(medium_scattering)", scattered),
        ("medium(milk, absorption) & ~medium(milk, scattering)", absorbed & ~scattered),
        ("medium(vacuum, scattering)", np.zeros(h.n_rays, bool)),
    ):
        assert query(h.raymap, text).rays == expected.sum(), text


def test_colours_at_a_detector_inside_the_medium(tmp_path):
    """A detector in the middle of a slab sees the light recoloured up to itself by absorption and scattering. What is
    scattered goes on as if nothing had been, so that the expectation of band b there is l_b exp(-a_b t).
    """
    scattering, absorption, rgb = np.array([2.0, 0.5, 0.0]), np.array([0.0, 0.5, 1.5]), np.array([0.5, 0.3, 0.2])
    h = traced(
        tmp_path,
        {"Slab": body(box((-5, -5, 0), (5, 5, 1)), "polished", "milk")},
        rays=100_000,
        media={"milk": milk(list(scattering), list(absorption), 0.999999999)},
        surfaces=SURFACES,
        sources={"S": disc_source((0, 0, -1), (0, 0, 1), 0.1, rgb=tuple(rgb))},
        detectors={"D": {"kind": "rectangle", **rectangle((0, 0, 0.6), 4, 4, side="both", resolution=[1, 1])}},
    )
    light = evaluate_detector(h.raymap, "D").cell_flux_rgb_w.sum(axis=(0, 1))
    expected = rgb * np.exp(-absorption * 0.6)
    agrees("bands", light, np.sqrt(expected / h.n_rays), expected)


def test_colours_of_what_hardly_gets_through():
    """Optical depths of a million leave the colour of what they differ by; no light stays no light."""
    light = np.array([[0.5, 0.3, 0.2], [0.0, 0.5, 0.5], [0.0, 0.0, 0.0]])
    depth = np.array([[1e6, 1e6 + 1, 2e6], [1.0, 1e5, 2e5], [1.0, 2.0, 3.0]])
    weight = np.array([0.5, 0.3 * math.exp(-1), 0])
    assert _through(light, depth) == pytest.approx(np.array([weight / weight.sum(), [0, 1, 0], [0, 0, 0]]), rel=1e-9)
