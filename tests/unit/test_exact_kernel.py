# SPDX-License-Identifier: LGPL-2.1-or-later
"""Kernels of quadrics and tori against the slow reference and against closed forms: any pose, size, chord, grazing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from raymaps.exact import Cone, Cylinder, Plane, Sphere, Torus
from raymaps.frame import Frame
from raymaps.kernels.exact import height, meet, normal, settle
from tests.exact_surfaces import lowered

KINDS = ("plane", "sphere", "cylinder", "cone", "torus")
X, Y, Z = np.eye(3)
ORIGIN = np.zeros(3)


def tables(surface, near, frame=None):
    """Tables of a surface; its triangle stands at its points nearest to three given ones."""
    corners = surface.nearest(np.asarray(near, float))[None]
    return lowered(surface, corners) if frame is None else lowered(surface, corners, frame)


def posed(seed, scale=1.0):
    """A surface of each kind, turned and moved at random within the frame, and points near it."""
    rng = np.random.default_rng(seed)
    center = scale * rng.uniform(-0.4, 0.4, 3)
    axis = np.ascontiguousarray(Rotation.random(random_state=seed).as_matrix()[2])
    made = {
        "plane": Plane(center, axis),
        "sphere": Sphere(center, scale * rng.uniform(0.05, 0.5)),
        "cylinder": Cylinder(center, axis, scale * rng.uniform(0.05, 0.5)),
        "cone": Cone(center, axis, math.radians(rng.uniform(3, 87))),
        "torus": Torus(center, axis, scale * rng.uniform(0.2, 0.4), scale * rng.uniform(0.02, 0.19)),
    }
    return made, center + scale * (0.3 * axis + 0.1 * rng.normal(size=(3, 3)))


def directions(rng, n):
    d = rng.normal(size=(n, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def nearest_of(surface, origin, direction, guess, towards):
    """From the reference: the crossing with an orientation that is nearest to a guess, or NaN."""
    t = surface.crossings(origin, direction)
    t = t[np.sign(surface.normal(origin + t[:, None] * direction) @ direction) == towards]
    return t[np.argmin(np.abs(t - guess))] if len(t) else math.nan


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(8))
def test_crossings_are_those_of_the_reference(kind, seed):
    made, near = posed(seed)
    surface = made[kind]
    exact = tables(surface, near)
    rng = np.random.default_rng(100 + seed)
    origins, ways = rng.uniform(-1, 1, (400, 3)), directions(rng, 400)
    origins[200:] = surface.nearest(origins[200:]) + 0.05 * rng.normal(size=(200, 3)) - ways[200:]
    met = 0
    for origin, way in zip(origins, ways, strict=True):
        for towards in (-1, 1):
            guess = rng.uniform(-2, 2)
            expected = nearest_of(surface, origin, way, guess, towards)
            t, nx, ny, nz = meet(exact, 0, 0, guess, towards, False, *origin, *way)
            assert math.isnan(t) == math.isnan(expected)
            if math.isnan(t):
                continue
            met += 1
            point, n = origin + t * way, np.array([nx, ny, nz])
            assert abs(t - expected) * abs(n @ way) < 2e-14 * max(1, abs(expected))
            assert abs(surface.height(point[None])[0]) < 2e-14 * max(1, abs(expected))
            assert n @ n == pytest.approx(1, abs=1e-14)
            assert np.sign(n @ way) == towards
    assert met > 100


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_height_normal_and_nearest_point_are_those_of_the_reference(kind, seed):
    made, near = posed(seed)
    surface = made[kind]
    exact = tables(surface, near)
    rng = np.random.default_rng(200 + seed)
    points = surface.nearest(rng.uniform(-0.9, 0.9, (300, 3)))
    if kind == "cone":
        points = points[np.linalg.norm(points - surface.apex, axis=1) > 0.1]
    points += 0.01 * surface.normal(points) * rng.uniform(-1, 1, (len(points), 1))
    found = np.array([height(exact, 0, *p) for p in points])
    np.testing.assert_allclose(found, surface.height(points), atol=2e-15)
    found = np.array([normal(exact, 0, *p) for p in points])
    np.testing.assert_allclose(found, surface.normal(points), atol=1e-13)
    found = np.array([settle(exact, 0, -1, *p) for p in points])
    np.testing.assert_allclose(found, surface.nearest(points), atol=3e-15)


@pytest.mark.parametrize("unit_mm", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("kind", KINDS)
def test_a_scene_of_any_size_and_place_is_the_same_in_its_frame(kind, unit_mm):
    made, near = posed(3)
    far = np.array([3.0, -7.0, 5.0]) * unit_mm
    there, there_near = posed(3, unit_mm)
    surface, moved = made[kind], there[kind]
    moved = type(moved)(**{**vars(moved), _place(moved): getattr(moved, _place(moved)) + far})
    here, there_ = tables(surface, near), tables(moved, there_near + far, Frame(far, unit_mm, unit_mm * 2.0**-20))
    rng = np.random.default_rng(5)
    for origin, way in zip(rng.uniform(-1, 1, (200, 3)), directions(rng, 200), strict=True):
        a = meet(here, 0, 0, 0.0, 1, False, *origin, *way)
        b = meet(there_, 0, 0, 0.0, 1, False, *origin, *way)
        if math.isnan(a[0]) or abs(np.dot(a[1:], way)) < 0.05:
            continue
        np.testing.assert_allclose(a, b, atol=3e-13, rtol=3e-13)


def _place(surface):
    return {Plane: "point", Cylinder: "point", Cone: "apex"}.get(type(surface), "center")


LENGTHS = [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5]


@pytest.mark.parametrize("length", LENGTHS)
def test_chords_of_a_sphere(length):
    """A chord of length L makes the angle asin(L / 2 R) with the tangent plane."""
    rng = np.random.default_rng(1)
    radius, center = 0.4, np.array([0.1, -0.3, 0.2])
    exact = tables(Sphere(center, radius), center + np.eye(3))
    for n, other in zip(directions(rng, 200), directions(rng, 200), strict=True):
        tangent = np.cross(n, other) / np.linalg.norm(np.cross(n, other))
        sine = length / (2 * radius)
        way = math.sqrt(1 - sine * sine) * tangent - sine * n
        t, *end = meet(exact, 0, 0, 3.0, 1, True, *(center + radius * n), *way)
        assert abs(t - length) < 5e-16
        assert abs(t - 2 * radius * np.dot(end, way)) < 5e-16
        assert math.isnan(meet(exact, 0, 0, 0.0, -1, True, *(center + radius * n), *way)[0])


@pytest.mark.parametrize("length", LENGTHS)
def test_chords_across_a_cylinder_and_a_torus(length):
    """Chords in a plane across the axis are those of circles: of a cylinder, of a torus's tube and of its equator."""
    major, minor = 0.35, 0.15
    circles = {
        "cylinder": (Cylinder(ORIGIN, Z, 0.4), 0.4, ORIGIN, X, Y),
        "tube": (Torus(ORIGIN, Z, major, minor), minor, major * X, X, Z),
        "equator": (Torus(ORIGIN, Z, major, minor), major + minor, ORIGIN, X, Y),
    }
    for surface, radius, center, right, up in circles.values():
        if length > 2 * radius:
            continue
        exact = tables(surface, np.eye(3) + Z)
        for angle in np.linspace(0, 2 * math.pi, 50):
            out = math.cos(angle) * right + math.sin(angle) * up
            along = math.cos(angle) * up - math.sin(angle) * right
            sine = length / (2 * radius)
            way = math.sqrt(1 - sine * sine) * along - sine * out
            t = meet(exact, 0, 0, length, 1, True, *(center + radius * out), *way)[0]
            assert abs(t - length) < 2e-15


@pytest.mark.parametrize("length", LENGTHS)
def test_chords_of_a_cone_from_side_to_side(length):
    """Across the axis at height z the chord of a cone is that of a circle of radius z tan(half angle)."""
    exact = tables(Cone(ORIGIN, Z, math.radians(30)), np.eye(3) + Z)
    z = 0.6
    radius = z * math.tan(math.radians(30))
    for angle in np.linspace(0, 2 * math.pi, 50):
        out = np.array([math.cos(angle), math.sin(angle), 0.0])
        along = np.array([-math.sin(angle), math.cos(angle), 0.0])
        sine = length / (2 * radius)
        way = math.sqrt(1 - sine * sine) * along - sine * out
        t = meet(exact, 0, 0, length, 1, True, *(radius * out + z * Z), *way)[0]
        assert abs(t - length) < 1e-15


def test_the_inside_of_a_torus_from_point_to_point():
    """Light that stands on a torus may cross its tube, or the hole and enter the other side."""
    exact = tables(Torus(ORIGIN, Z, 0.3, 0.1), np.eye(3))
    assert meet(exact, 0, 0, 0.2, 1, True, 0.4, 0, 0, -1, 0, 0)[0] == pytest.approx(0.2, abs=1e-15)
    assert meet(exact, 0, 0, 0.6, -1, True, 0.4, 0, 0, -1, 0, 0)[0] == pytest.approx(0.6, abs=1e-15)
    assert meet(exact, 0, 0, 0.8, 1, True, 0.4, 0, 0, -1, 0, 0)[0] == pytest.approx(0.8, abs=1e-15)
    assert meet(exact, 0, 0, 0.4, -1, True, 0.2, 0, 0, -1, 0, 0)[0] == pytest.approx(0.4, abs=1e-15)


def test_only_the_outer_part_of_a_torus_that_crosses_itself():
    exact = tables(Torus(ORIGIN, Z, 0.1, 0.3), np.eye(3))
    assert meet(exact, 0, 0, 0.0, -1, False, 0.05, 0, 1, 0, 0, -1)[0] == pytest.approx(
        1 - math.sqrt(0.3**2 - 0.05**2), abs=1e-15
    )
    assert meet(exact, 0, 0, 1.0, -1, False, 0.05, 0, 1, 0, 0, -1)[0] < 0.9


@pytest.mark.parametrize("gap", [1e-2, 1e-6, 1e-10, 1e-13])
def test_lines_that_graze(gap):
    """A line at R (1 - gap) from the centre leaves a half chord of R sqrt(2 gap - gap²); at R (1 + gap) it misses."""
    radius = 0.4
    shapes = [
        Sphere(ORIGIN, radius),
        Cylinder(ORIGIN, Z, radius),
        Torus(ORIGIN, Z, 0.3, radius - 0.3),
        Cone(np.array([0, 0, -radius * math.sqrt(3)]), Z, math.radians(30)),
    ]
    for surface in shapes:
        exact = tables(surface, np.eye(3))
        for towards in (-1, 1):
            t, nx, _, _ = meet(exact, 0, 0, 0.8, towards, False, -0.8, radius * (1 - gap), 0, 1, 0, 0)
            half = radius * math.sqrt(2 * gap - gap * gap)
            assert abs(t - 0.8 - towards * half) < 2e-16 * radius / math.sqrt(gap) + 5e-16
            point = np.array([[t - 0.8, radius * (1 - gap), 0]])
            assert abs(surface.height(point)[0]) < 3e-16
            assert towards * nx >= 0
            assert math.isnan(meet(exact, 0, 0, 0.8, towards, False, -0.8, radius * (1 + gap), 0, 1, 0, 0)[0])


@pytest.mark.parametrize("radius", [1e-3, 1.0, 1e3, 1e6, 1e9])
def test_spheres_and_cylinders_from_tiny_to_nearly_flat(radius):
    """The sagitta at r from the vertex, R - sqrt(R² - r²) = r² / (R + sqrt(R² - r²)), to the last digits."""
    rng = np.random.default_rng(2)
    for surface in (Sphere(radius * X, radius), Cylinder(radius * X, Z, radius)):
        exact = tables(surface, np.zeros((3, 3)))
        for r in rng.uniform(0, min(0.5, 0.9 * radius), 50):
            t, _, ny, nz = meet(exact, 0, 0, 1.0, -1, False, -1.0, r, 0, 1, 0, 0)
            assert t == pytest.approx(1 + r * r / (radius + math.sqrt(radius * radius - r * r)), abs=7e-16)
            np.testing.assert_allclose([ny, nz], [r / radius, 0], atol=3e-16)


def test_the_pole_of_a_sphere_and_the_apex_of_a_cone():
    exact = tables(Sphere(ORIGIN, 0.5), np.eye(3))
    assert meet(exact, 0, 0, 0, -1, False, 0, 0, 1, 0, 0, -1) == pytest.approx((0.5, 0, 0, 1), abs=1e-16)
    exact = tables(Cone(ORIGIN, Z, math.radians(45)), np.eye(3) + Z)
    for side in (1e-9, 1e-12, -1e-12):
        t, nx, ny, nz = meet(exact, 0, 0, 1, -1, False, side, 0, -1, 0, 0, 1)
        assert t == pytest.approx(1 + abs(side), abs=3e-16)
        np.testing.assert_allclose([nx, ny, nz], [math.copysign(math.sqrt(0.5), side), 0, -math.sqrt(0.5)], atol=1e-15)
    assert math.isnan(meet(exact, 0, 0, 1, 1, False, 0.2, 0, -1, 0, 0, 1)[0])  # the other nappe does not count
    assert meet(exact, 0, 0, 1, 1, False, 0, 0, -1, *(Z + X) / math.sqrt(2)) == pytest.approx(
        (math.nan, 0, 0, 0), nan_ok=True
    )  # along the edge


def test_lines_along_a_cylinder_and_a_plane_meet_nothing():
    exact = tables(Cylinder(ORIGIN, Z, 0.5), np.eye(3))
    for x in (0.0, 0.3, 0.5, 0.7):
        for stands_on in (False, True):
            assert math.isnan(meet(exact, 0, 0, 0, 1, stands_on, x, 0, 0, 0, 0, 1)[0])
    exact = tables(Plane(ORIGIN, Z), np.eye(3))
    assert math.isnan(meet(exact, 0, 0, 0, 1, False, 0, 0, 0.5, 1, 0, 0)[0])
    assert math.isnan(meet(exact, 0, 0, 0, 1, True, 0, 0, 0, 0, 0, 1)[0])


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "torus"])
def test_ten_thousand_reflections_stay_on_the_surface(kind):
    """Light that creeps along the inside of a surface does not drift off it."""
    surface = {
        "sphere": Sphere(ORIGIN, 0.5),
        "cylinder": Cylinder(ORIGIN, Z, 0.5),
        "torus": Torus(ORIGIN, Z, 0.3, 0.2),
    }[kind]
    exact = tables(surface, np.eye(3))
    position, way = np.array([0.5, 0, 0]), np.array([-1e-3, 1, 1e-6])
    way /= np.linalg.norm(way)
    for _ in range(10_000):
        t, *n = meet(exact, 0, 0, 1e-3, 1, True, *position, *way)
        assert 0 < t < 0.1
        position, n = position + t * way, np.array(n)
        way = way - 2 * (way @ n) * n
        way /= np.linalg.norm(way)
    assert abs(surface.height(position[None])[0]) < 1e-12
