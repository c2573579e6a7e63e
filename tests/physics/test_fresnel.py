# SPDX-License-Identifier: LGPL-2.1-or-later
"""Snell's law and Fresnel's equations at one flat interface, over all angles and both ways.

A beam meets the one polished face of a thick block whose other faces are black: only the first interface counts.
"""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from tests.physics.scenes import agrees, body, box, disc, disc_source, share_agrees, traced, unit

ANGLES_DEG = [0, 1, 5, 10, 15, 20, 25, 30, 35, 40, 41, 42, 45, 50, 55, 60, 65, 70, 75, 80, 83, 86, 88, 89, 89.5]
#: Ambient index, index of the block.
INDICES = [(1.0, 1.5), (1.33, 1.52), (1.0, 2.4), (1.5, 1.2)]


def closed_form_reflectance(angle_rad, n_i, n_t):
    """M. Born, E. Wolf: Principles of Optics, 7th ed., section 1.5.2, eq. 21 (amplitudes in terms of the angles of
    incidence and refraction); the mean of both polarisations; their limit at normal incidence.
    """
    sin_t = n_i / n_t * math.sin(angle_rad)
    if sin_t >= 1:
        return 1.0
    if angle_rad < 1e-6:
        return ((n_t - n_i) / (n_t + n_i)) ** 2
    t = math.asin(sin_t)
    r_p = math.tan(angle_rad - t) / math.tan(angle_rad + t)
    r_s = math.sin(angle_rad - t) / math.sin(angle_rad + t)
    return 0.5 * (r_p**2 + r_s**2)


def beams_at_interface(folder, n_outside, n_inside, angles_rad, rays, *, from_inside):
    """Beams at several angles, each onto the origin of the polished top of a block; returns histories."""
    sign = 1 if from_inside else -1
    sources = {}
    for k, angle in enumerate(angles_rad):
        direction = np.array([math.sin(angle), 0, sign * math.cos(angle)])
        sources[f"S{k}"] = disc_source(-10 * direction, direction, 0.01)
    return traced(
        folder,
        {"Block": body(box((-200, -200, -100), (200, 200, 0)), "black", "glass", plus_z="polished")},
        rays=rays,
        sources=sources,
        ambient="around",
        media={"glass": {"refractive_index": n_inside}, "around": {"refractive_index": n_outside}},
        surfaces={"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}},
    )


def first_kind(h):
    """Kind of each ray's first event after its emission."""
    return h.kind[h.first + 1]


@pytest.mark.parametrize("from_inside", [False, True])
@pytest.mark.parametrize(("n_outside", "n_inside"), INDICES)
def test_snell_and_fresnel_over_all_angles(tmp_path, n_outside, n_inside, from_inside):
    """Shares follow Born & Wolf, section 1.5.2, eq. 21; directions Snell's law and the law of reflection
    (section 1.5.1), both in the plane of incidence, to the grid of stored positions.
    """
    angles = np.radians(ANGLES_DEG)
    h = beams_at_interface(tmp_path, n_outside, n_inside, angles, 250_000, from_inside=from_inside)
    n_i, n_t = (n_inside, n_outside) if from_inside else (n_outside, n_inside)
    expected = np.array([closed_form_reflectance(a, n_i, n_t) for a in angles])
    n = np.bincount(h.ray_source, minlength=len(angles))
    kind = first_kind(h)
    reflected = np.bincount(h.ray_source[kind == EventKind.FRESNEL_REFLECTION], minlength=len(angles))
    refracted = np.bincount(h.ray_source[kind == EventKind.FRESNEL_REFRACTION], minlength=len(angles))
    assert (reflected + refracted == n).all()
    share_agrees("reflected share", reflected, n, expected)
    assert (refracted[expected == 1] == 0).all()

    # directions after the interface, from the two stored positions
    start, end = h.position[h.first + 1], h.position[h.first + 2]
    length = np.linalg.norm(end - start, axis=1)
    direction = unit(end - start)
    tolerance = math.sqrt(3) * h.raymap.manifest.grid_mm / length
    sign = 1 if from_inside else -1
    angle = angles[h.ray_source]
    law_of_reflection = np.stack([np.sin(angle), 0 * angle, -sign * np.cos(angle)], axis=1)
    sin_t = n_i / n_t * np.sin(angle)
    snell = np.stack([sin_t, 0 * angle, sign * np.sqrt(np.maximum(0, 1 - sin_t**2))], axis=1)
    wanted = np.where((kind == EventKind.FRESNEL_REFLECTION)[:, None], law_of_reflection, snell)
    assert (np.linalg.norm(direction - wanted, axis=1) <= tolerance).all()

    # light changes neither in amount nor in colour, and the medium is that of the side where the ray goes
    assert (h.light[h.first + 1] == h.light[h.first]).all()
    inside = h.medium[h.first + 1] == h.index("media", "glass")
    assert (inside == ((kind == EventKind.FRESNEL_REFLECTION) == from_inside)).all()


@pytest.mark.parametrize("n_glass", [1.5, 2.0])
def test_brewster_angle(tmp_path, n_glass):
    """At tan(theta) = n only the s part is reflected: R = ((n² - 1) / (n² + 1))² / 2, from inside as from outside.

    Born & Wolf, Principles of Optics, 7th ed., section 1.5.3, with eq. 21 of section 1.5.2.
    """
    expected = 0.5 * ((n_glass**2 - 1) / (n_glass**2 + 1)) ** 2
    for from_inside in (False, True):
        angle = math.atan(1 / n_glass if from_inside else n_glass)
        h = beams_at_interface(tmp_path / str(from_inside), 1.0, n_glass, [angle], 100_000, from_inside=from_inside)
        share_agrees("reflected share", (first_kind(h) == EventKind.FRESNEL_REFLECTION).sum(), h.n_rays, expected)


@pytest.mark.parametrize("n_glass", [1.3, 1.5, 2.4])
def test_total_reflection_begins_at_the_critical_angle(tmp_path, n_glass):
    """Beyond sin(theta) = 1/n no ray at all is refracted (Born & Wolf, section 1.5.4); just below it some are."""
    critical = math.asin(1 / n_glass)
    angles = critical + np.radians([-0.01, 1e-6, 0.01, 1, 20])
    h = beams_at_interface(tmp_path, 1.0, n_glass, angles, 50_000, from_inside=True)
    refracted = first_kind(h) == EventKind.FRESNEL_REFRACTION
    assert not refracted[h.ray_source > 0].any()
    below = h.ray_source == 0
    share_agrees(
        "refracted just below",
        refracted[below].sum(),
        below.sum(),
        1 - closed_form_reflectance(angles[0], n_glass, 1.0),
    )


def diffuse_reflectance(n):
    """Reflectance of an interface for Lambertian light from outside: Walsh's closed form, S. Duntley: The optical
    properties of diffusing materials, J. Opt. Soc. Am. 32 (1942), p. 61.
    """
    return (
        0.5
        + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
        + n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * math.log((n - 1) / (n + 1))
        - 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
        + 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * math.log(n)
    )


@pytest.mark.parametrize("n", [1.333, 1.5, 2.0])
def test_diffuse_reflectance_of_an_interface(tmp_path, n):
    """Lambertian light onto an interface from outside: Walsh's closed form; from inside 1 - (1 - R) / n², because
    n² dA cos dOmega is conserved in refraction (W. Welford, R. Winston: High Collection Nonimaging Optics, 1989, app.
    A). The closed form is the integral of Fresnel's reflectance over 2 sin cos: checked here too.
    """
    reflected = diffuse_reflectance(n)
    node, weight = np.polynomial.legendre.leggauss(500)
    squared_sine = (node + 1) / 2
    integral = sum(
        w / 2 * closed_form_reflectance(math.asin(math.sqrt(s)), 1, n)
        for s, w in zip(squared_sine, weight, strict=True)
    )
    assert reflected == pytest.approx(integral, abs=1e-5)

    for inside, expected in ((False, reflected), (True, 1 - (1 - reflected) / n**2)):
        # an emitting disc close to the interface, its rays all meet the polished face first
        lamp = disc(1, 16, up=inside).moved(0, 0, -0.001 if inside else 0.001)
        h = traced(
            tmp_path / str(inside),
            {
                "Block": body(box((-200, -200, -100), (200, 200, 0)), "black", "glass", plus_z="polished"),
                "Lamp": body(lamp, "black"),
            },
            rays=200_000,
            sources={"S": {"kind": "faces", "flux_w": 1, "body": "Lamp"}},
            media={"glass": {"refractive_index": n}},
            surfaces={"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}},
        )
        kind = first_kind(h)
        share_agrees("reflected share", (kind == EventKind.FRESNEL_REFLECTION).sum(), h.n_rays, expected)
        agrees(
            "refracted share",
            (kind == EventKind.FRESNEL_REFRACTION).mean(),
            math.sqrt(expected * (1 - expected) / h.n_rays),
            1 - expected,
        )
