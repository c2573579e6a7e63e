# SPDX-License-Identifier: LGPL-2.1-or-later
"""Absorption in media: Beer-Lambert's law, Born & Wolf, Principles of Optics, 7th ed., section 4.11 (eq. 2).

Media here have the index of their surroundings, so nothing is reflected and closed forms are exact.
"""

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
    disc,
    disc_source,
    follows,
    share_agrees,
    traced,
)

SURFACES = {"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}}
OPTICAL_DEPTHS = [0.001, 0.01, 0.1, 0.5, 1.0, 2.0, 4.0, 8.0]
THICKNESS_MM = 10.0


def slab_scene(folder, absorption, rays, *, rgb=(1, 1, 1), tilt_rad=0.0):
    """A beam through a slab for each absorption coefficient, side by side."""
    bodies, sources, media = {}, {}, {}
    for k, coefficient in enumerate(absorption):
        x = 100.0 * k
        bodies[f"Slab{k}"] = body(box((x - 40, -40, 0), (x + 40, 40, THICKNESS_MM)), "polished", f"m{k}")
        media[f"m{k}"] = {"refractive_index": 1.0, "absorption_per_mm": coefficient}
        direction = np.array([0, math.sin(tilt_rad), math.cos(tilt_rad)])
        sources[f"S{k}"] = disc_source(np.array([x, 0, 0]) - direction, direction, 0.5, rgb=rgb)
    return traced(folder, bodies, rays=rays, sources=sources, media=media, surfaces=SURFACES)


@pytest.mark.parametrize("tilt_deg", [0, 60])
def test_transmission_and_mean_depth_of_slabs(tmp_path, tilt_deg):
    """Transmission exp(-a d / cos); the depth of what is absorbed follows the exponential cut off at d, with the mean
    1/a - d exp(-a d) / (1 - exp(-a d)).
    """
    tilt = math.radians(tilt_deg)
    path = THICKNESS_MM / math.cos(tilt)
    absorption = np.array(OPTICAL_DEPTHS) / THICKNESS_MM
    h = slab_scene(tmp_path, list(absorption), 400_000, tilt_rad=tilt)
    n = np.bincount(h.ray_source)
    through = np.bincount(h.ray_source[h.kind[h.last] == EventKind.LEFT], minlength=len(n))
    share_agrees("transmitted share", through, n, np.exp(-absorption * path))

    absorbed = h.kind == EventKind.MEDIUM_ABSORPTION
    assert h.count_kind(EventKind.FRESNEL_REFLECTION) == 0
    for k, a in enumerate(absorption):
        rows = absorbed & (h.medium == h.index("media", f"m{k}"))
        depth = h.position[rows, 2] / math.cos(tilt)
        through = math.exp(-a * path)
        mean = 1 / a - path * through / (1 - through)
        agrees(f"mean depth at a d = {a * path:.3g}", depth.mean(), depth.std() / math.sqrt(len(depth)), mean)
        if len(depth) > 1000:
            follows(f"depth at a d = {a * path:.3g}", -np.expm1(-a * depth) / -math.expm1(-a * path))


def test_coloured_absorption_acts_band_by_band(tmp_path):
    """Expected light of band b behind the slab is l_b exp(-a_b d); each absorbed ray's depth has the density
    sum(l_b a_b exp(-a_b z)); rays on their way keep all their light, only recoloured.
    """
    absorption, rgb = np.array([0.01, 0.08, 0.4]), np.array([0.5, 0.3, 0.2])
    h = slab_scene(tmp_path, [list(absorption)], 200_000, rgb=tuple(rgb))
    left = h.kind == EventKind.LEFT
    flux, stderr = h.flux_w(h.per_ray(left, h.light[left]))
    agrees("flux of each band", flux, stderr, rgb * np.exp(-absorption * THICKNESS_MM))
    assert np.abs(h.light[left].sum(axis=1) - 1).max() < 1e-6

    depth = h.position[h.kind == EventKind.MEDIUM_ABSORPTION, 2]
    edges = np.linspace(0, THICKNESS_MM, 31)
    gone = (rgb * -np.expm1(-absorption * edges[:, None])).sum(axis=1)
    expected = np.diff(gone) / gone[-1] * len(depth)
    chi_square_agrees("depths", np.histogram(depth, edges)[0], expected)


def test_coloured_absorption_over_several_media(tmp_path):
    """Three slabs one behind the other, with colours of their own: the optical depths of each band add up."""
    absorption = np.array([[0.05, 0.0, 0.02], [0.0, 0.2, 0.01], [0.03, 0.03, 0.0]])
    bodies, media = {}, {}
    for k, coefficients in enumerate(absorption):
        bodies[f"Slab{k}"] = body(box((-40, -40, 20 * k), (40, 40, 20 * k + THICKNESS_MM)), "polished", f"m{k}")
        media[f"m{k}"] = {"refractive_index": 1.0, "absorption_per_mm": list(coefficients)}
    h = traced(
        tmp_path,
        bodies,
        rays=200_000,
        media=media,
        surfaces=SURFACES,
        sources={"S": disc_source((0, 0, -5), (0, 0, 1), 1)},
    )
    left = h.kind == EventKind.LEFT
    flux, stderr = h.flux_w(h.per_ray(left, h.light[left]))
    agrees("flux of each band", flux, stderr, np.exp(-absorption.sum(axis=0) * THICKNESS_MM) / 3)


@pytest.mark.parametrize("optical_depth", [0.3, 3.0])
def test_point_source_in_an_absorbing_ball(tmp_path, optical_depth):
    """From the centre of a ball a share exp(-a R) gets out. The ball's facets lie up to 1 - cos(half an edge) = 2e-4 R
    too near, which adds at most 2e-4 a R of it: allowed for beside five standard errors.
    """
    radius = 25.0
    h = traced(
        tmp_path,
        {"Ball": body(ball(radius, 5), "polished", "ink")},
        rays=200_000,
        surfaces=SURFACES,
        media={"ink": {"refractive_index": 1.0, "absorption_per_mm": optical_depth / radius}},
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}},
    )
    expected = math.exp(-optical_depth)
    agrees(
        "transmitted share",
        (h.kind[h.last] == EventKind.LEFT).mean(),
        math.sqrt(expected * (1 - expected) / h.n_rays),
        expected,
        rounding=2e-4 * optical_depth,
    )


def exponential_integral_3(x):
    """E3(x) from the series of E1: M. Abramowitz, I. Stegun: Handbook of Mathematical Functions, eq. 5.1.11 and
    5.1.14.
    """
    e1 = -np.euler_gamma - math.log(x) - sum((-x) ** k / (k * math.factorial(k)) for k in range(1, 40))
    e2 = math.exp(-x) - x * e1
    return 0.5 * (math.exp(-x) - x * e2)


@pytest.mark.parametrize("optical_depth", [0.1, 0.5, 1.0, 2.0])
def test_lambertian_light_through_a_wide_slab(tmp_path, optical_depth):
    """Lambertian light gets through a plane layer with the share 2 E3(a d) (J. Howell et al.: Thermal Radiation Heat
    Transfer, 5th ed., section on plane layers; E3(1) = 0.10969 in Abramowitz & Stegun, table 5.4). The emitting disc
    stands inside the medium; the layer ends so far away that less than 1e-8 of the light gets there.
    """
    assert exponential_integral_3(1.0) == pytest.approx(0.10969, abs=1e-5)
    absorption = optical_depth / THICKNESS_MM
    wide = 20 / absorption
    h = traced(
        tmp_path,
        {
            "Layer": body(box((-wide, -wide, -1), (wide, wide, THICKNESS_MM)), "polished", "ink"),
            "Lamp": body(disc(1, 16), "black"),
        },
        rays=200_000,
        surfaces=SURFACES,
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Lamp"}},
        media={"ink": {"refractive_index": 1.0, "absorption_per_mm": absorption}},
    )
    share_agrees(
        "transmitted share",
        (h.kind[h.last] == EventKind.LEFT).sum(),
        h.n_rays,
        2 * exponential_integral_3(optical_depth),
    )
