# SPDX-License-Identifier: LGPL-2.1-or-later
"""Surface properties: shares, directions and colours, and that roulette changes no expectation."""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from tests.physics.scenes import (
    agrees,
    ball,
    body,
    box,
    chi_square_agrees,
    disc_source,
    follows,
    share_agrees,
    traced,
    unit,
)

WIDE = box((-500, -500, -1), (500, 500, 0))
SLANTED = unit(np.array([0.6, 0.2, -1.0]))
RGB = np.array([0.5, 0.3, 0.2])
THRESHOLDS = [0.0, 0.1, 0.6, 1.0]


def one_hit(folder, surface, rays, *, surfaces=None, **settings):
    """A coloured, slanted beam onto a wide plate with a surface property."""
    return traced(
        folder,
        {"Plate": body(WIDE, "tested")},
        rays=rays,
        surfaces={**(surfaces or {}), "tested": surface},
        sources={"S": disc_source(-20 * SLANTED, SLANTED, 0.5, rgb=tuple(RGB))},
        settings=settings,
    )


@pytest.mark.parametrize("roulette_threshold", THRESHOLDS)
def test_diffuse_reflection_and_transmission_follow_lamberts_law(tmp_path, roulette_threshold):
    """On both sides sin² of the angle and the azimuth are uniform (constant radiance, E. Hecht: Optics, section
    13.1.1), whatever the direction of incidence; the light of each band is its coefficient's share.
    """
    reflectance, transmittance = np.array([0.7, 0.2, 0.1]), np.array([0.1, 0.6, 0.0])
    wall = {"kind": "lambertian", "reflectance": list(reflectance), "transmittance": list(transmittance)}
    # an open sheet: light that goes through meets nothing else
    sheet = WIDE._replace(triangles=WIDE.triangles[-2:], faces=(("+z", 2),))
    h = traced(
        tmp_path,
        {"Sheet": body(sheet, "white")},
        rays=200_000,
        surfaces={"white": wall},
        sources={"S": disc_source(-20 * SLANTED, SLANTED, 0.5, rgb=tuple(RGB))},
        settings={"roulette_threshold": roulette_threshold},
    )
    first = h.first + 1
    for kind, share, sign in (
        (EventKind.DIFFUSE_REFLECTION, reflectance, 1),
        (EventKind.DIFFUSE_REFRACTION, transmittance, -1),
    ):
        rows = first[h.kind[first] == kind]
        agrees(f"light, {kind.label}", *h.flux_w(h.per_ray(rows, h.light[rows])), RGB * share)
        out = unit(h.way[rows + 1])
        assert (sign * out[:, 2] > 0).all()
        follows(f"sin², {kind.label}", 1 - out[:, 2] ** 2)
        follows(f"azimuth, {kind.label}", np.arctan2(out[:, 1], out[:, 0]) / (2 * math.pi) + 0.5)
    counts = np.bincount(h.kind[first], minlength=20)
    assert counts[[EventKind.DIFFUSE_REFLECTION, EventKind.DIFFUSE_REFRACTION, EventKind.ABSORPTION]].sum() == h.n_rays


@pytest.mark.parametrize("roulette_threshold", THRESHOLDS)
@pytest.mark.parametrize("kind", ["mirror", "lambertian"])
def test_coefficients_act_band_by_band(tmp_path, kind, roulette_threshold):
    """A convex plate reflects once: behind it light of band b is l_b rho_b, and absorbed l_b (1 - rho_b)."""
    reflectance = np.array([0.9, 0.4, 0.05])
    h = one_hit(
        tmp_path, {"kind": kind, "reflectance": list(reflectance)}, 100_000, roulette_threshold=roulette_threshold
    )
    left = h.kind == EventKind.LEFT
    agrees("light of each band", *h.flux_w(h.per_ray(left, h.light[left])), RGB * reflectance)
    hits = h.on_body("Plate")
    lost = (h.light_before - h.light)[hits]
    agrees("absorbed in each band", *h.flux_w(h.per_ray(hits, lost)), RGB * (1 - reflectance))

    through = float((RGB * reflectance).sum())  # what a ray keeps while nothing is drawn
    share_agrees("rays that go on", left.sum(), h.n_rays, through / max(through, min(1.0, roulette_threshold)))
    assert np.allclose(h.light[left].sum(axis=1), max(through, min(1.0, roulette_threshold)), rtol=1e-6)


def zones(shares, radius=10.0):
    """A ball, inside out, cut into zones by height with about the given shares of its area; their true shares."""
    shape = ball(radius, 5).inside_out
    height = shape.vertices[shape.triangles].mean(axis=1)[:, 2] / radius
    zone = np.searchsorted(np.cumsum(shares)[:-1], (height + 1) / 2)
    area = np.bincount(zone, shape.areas)
    return shape.grouped(zone, ("floor", "sides", "ceiling")), area / area.sum()


@pytest.mark.parametrize("roulette_threshold", THRESHOLDS)
def test_many_coloured_losses_keep_their_expectation(tmp_path, roulette_threshold):
    """Inside a sphere with zones of area shares f and reflectances rho, light from the wall falls on all zones by their
    area (D. Goebel: Generalized integrating-sphere theory, Appl. Opt. 6 (1967), p. 125): zone k absorbs
    f_k (1 - rho_k) / (1 - sum(f rho)), in each band by itself. Allowed for besides: 1e-3 of the facets (edge / radius
    squared), and without roulette what is left of a ray's light when it is cut off after 200 events, below 1e-4.
    """
    shape, share = zones([0.3, 0.5, 0.2])
    reflectance = np.array([[0.3, 0.6, 0.2], [0.9, 0.7, 0.95], [0.8, 0.95, 0.5]])  # floor, sides, ceiling; by band
    names = ("floor", "sides", "ceiling")
    h = traced(
        tmp_path,
        {"Room": body(shape, "floor", sides="sides", ceiling="ceiling")},
        rays=60_000 if roulette_threshold else 10_000,
        surfaces={
            name: {"kind": "lambertian", "reflectance": list(r)} for name, r in zip(names, reflectance, strict=True)
        },
        sources={"S": {"kind": "faces", "flux_w": 1, "rgb": list(RGB), "body": "Room", "faces": ["floor"]}},
        settings={"roulette_threshold": roulette_threshold, "max_events": 200},
    )
    hits = h.number > 0
    lost = h.light_before - h.light
    expected = RGB * share[:, None] * (1 - reflectance) / (1 - share @ reflectance)
    for k, name in enumerate(names):
        rows = hits & (h.face == h.face_index("Room", name))
        agrees(f"absorbed by {name} in each band", *h.flux_w(h.per_ray(rows, lost[rows])), expected[k], rounding=1e-3)
    assert (h.light.sum(axis=1) <= h.light_before.sum(axis=1) + 1e-6)[hits].all()


def test_mixture_draws_its_parts_by_weight(tmp_path):
    """Each part meets its weight's share of the rays and acts as it does alone."""
    parts = {
        "white": {"kind": "lambertian", "reflectance": 0.8, "transmittance": 0.2},
        "mirror": {"kind": "mirror", "reflectance": 1.0},
        "black": {"kind": "absorber"},
    }
    weights = {"white": 0.55, "mirror": 0.3, "black": 0.15}
    mixture = {"kind": "mixture", "parts": [{"weight": w, "surface": name} for name, w in weights.items()]}
    h = one_hit(tmp_path, mixture, 200_000, surfaces=parts, roulette_threshold=1.0)
    kinds = (
        EventKind.DIFFUSE_REFLECTION,
        EventKind.DIFFUSE_REFRACTION,
        EventKind.SPECULAR_REFLECTION,
        EventKind.ABSORPTION,
    )
    counts = np.bincount(h.kind[h.first + 1], minlength=20)[list(kinds)]
    expected = np.array([0.55 * 0.8, 0.55 * 0.2, 0.3, 0.15])
    chi_square_agrees("kinds of events", counts, expected * h.n_rays)
    mirrored = h.first[h.kind[h.first + 1] == EventKind.SPECULAR_REFLECTION] + 2
    assert np.abs(unit(h.way[mirrored]) - SLANTED * [1, 1, -1]).max() < 1e-4


def test_mixture_with_an_interface(tmp_path):
    """A polished face, partly covered: (1 - w) of Fresnel's share is refracted (n = 1.5 at normal incidence: 4 %
    reflected).
    """
    h = traced(
        tmp_path,
        {"Block": body(box((-50, -50, -50), (50, 50, 0)), "black", "glass", plus_z="dirty")},
        rays=100_000,
        media={"glass": {"refractive_index": 1.5}},
        surfaces={
            "polished": {"kind": "fresnel"},
            "black": {"kind": "absorber"},
            "dirty": {
                "kind": "mixture",
                "parts": [{"weight": 0.75, "surface": "polished"}, {"weight": 0.25, "surface": "black"}],
            },
        },
        sources={"S": disc_source((0, 0, 10), (0, 0, -1), 1)},
    )
    kinds = (EventKind.FRESNEL_REFLECTION, EventKind.FRESNEL_REFRACTION, EventKind.ABSORPTION)
    counts = np.bincount(h.kind[h.first + 1], minlength=20)[list(kinds)]
    chi_square_agrees("kinds of events", counts, np.array([0.75 * 0.04, 0.75 * 0.96, 0.25]) * h.n_rays)


def test_draws_of_following_events_are_independent(tmp_path):
    """In a closed white ball the azimuth and sin² of one event tell nothing about those of the next."""
    h = traced(
        tmp_path,
        {"Ball": body(ball(10, 2), "white")},
        rays=30_000,
        settings={"max_events": 5},
        surfaces={"white": {"kind": "lambertian", "reflectance": 1.0}},
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}},
    )
    shape = ball(10, 2)
    a, b, c = np.moveaxis(shape.vertices[shape.triangles], 1, 0)
    normal = unit(np.cross(b - a, c - a))
    squared_sine = []
    for event in (1, 2, 3):
        rows = h.first + event
        cosine = -(unit(h.way[rows + 1]) * normal[h.triangle[rows]]).sum(axis=1)
        squared_sine.append(1 - cosine**2)
        follows(f"sin² after event {event}", squared_sine[-1])
    for one, other in ((0, 1), (1, 2), (0, 2)):
        counts = np.histogram2d(squared_sine[one], squared_sine[other], 12, ((0, 1), (0, 1)))[0]
        chi_square_agrees(f"sin² of events {one}, {other}", counts, np.full((12, 12), h.n_rays / 144))
