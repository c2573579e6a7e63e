# SPDX-License-Identifier: LGPL-2.1-or-later
"""B-spline surfaces and their kernel against the closed forms of the surfaces that they equal."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.spatial.transform import Rotation

from raymaps.exact import Cylinder, Sphere, Torus, exact_surface
from raymaps.exact.bspline import bspline_of
from raymaps.kernels import exact as kernels
from raymaps.kinds import ExactKind
from raymaps.scene import BSplineSurface
from tests.exact_surfaces import ball, lowered, net, paraboloid, ring, tube

ADAPTER = TypeAdapter(BSplineSurface)
X, Y, Z = np.eye(3)


def spline(data):
    return exact_surface(ADAPTER.validate_python(data))


def pose(seed):
    made = np.eye(4)
    made[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    made[:3, 3] = np.random.default_rng(seed).uniform(-0.2, 0.2, 3)
    return made


def shapes(seed):
    """B-splines with the surfaces that they equal."""
    p = pose(seed)
    center, axis = p[:3, 3].copy(), p[:3, 2].copy()
    return {
        "ball": (spline(ball(0.4, p)), Sphere(center, 0.4)),
        "tube": (spline(tube(0.3, 0.6, p)), Cylinder(center, axis, 0.3)),
        "ring": (spline(ring(0.4, 0.15, p)), Torus(center, axis, 0.4, 0.15)),
    }


NAMES = ("ball", "tube", "ring")
#: These are surfaces of revolution: by their profiles, and as the patches of any other B-spline.
profiled = pytest.mark.parametrize("profiles", [True, False], ids=["profile", "patches"])


def tables(made, corners, *, profiles):
    exact = lowered(made, corners, profiles=profiles)
    assert exact.kind.tolist() == [ExactKind.REVOLUTION if profiles else ExactKind.PATCHES]
    return exact


def meet(exact, triangle, guess, towards, stands_on, origin, way):
    """The kernel with the types that it is given while tracing."""
    numbers = (float(x) for x in (*origin, *way))
    return kernels.meet(exact, np.int32(0), np.int32(triangle), float(guess), float(towards), bool(stands_on), *numbers)


def aimed(corners, rng, n):
    """Lines through points of triangles at random: triangle, origin, way, distance."""
    for triangle in rng.integers(len(corners), size=n):
        point = rng.dirichlet([1, 1, 1]) @ corners[triangle]
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        distance = rng.uniform(0.1, 1.0)
        yield int(triangle), point - distance * way, way, distance


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(3))
def test_a_bspline_is_the_surface_that_it_equals(name, seed):
    made, closed = shapes(seed)[name]
    rng = np.random.default_rng(seed)
    u, v = (rng.uniform(0, breaks[-1], 400) for breaks in made.breaks)
    points = made.jet(u, v).point
    assert np.abs(closed.height(points)).max() < 4e-16
    np.testing.assert_allclose(made.normal_at(u, v), closed.normal(points), atol=4e-15)
    off = points + 0.03 * rng.uniform(-1, 1, (400, 1)) * closed.normal(points)
    np.testing.assert_allclose(made.height(off), closed.height(off), atol=1e-15)
    np.testing.assert_allclose(made.nearest(off), closed.nearest(off), atol=4e-15)


@pytest.mark.parametrize("name", NAMES)
def test_reference_crossings_are_those_of_the_closed_form(name):
    made, closed = shapes(7)[name]
    rng = np.random.default_rng(3)
    for origin in rng.uniform(-0.6, 0.6, (25, 3)):
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        expected = closed.crossings(origin, way)
        if name == "tube":  # the B-spline ends
            along = (origin + expected[:, None] * way - closed.point) @ closed.axis
            expected = expected[(along > 0) & (along < 0.6)]
        np.testing.assert_allclose(made.crossings(origin, way), expected, atol=1e-12)


@profiled
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(3))
def test_kernel_meets_the_closed_form(name, seed, profiles):
    made, closed = shapes(seed)[name]
    corners = net(made, 24, 16)
    exact = tables(made, corners, profiles=profiles)
    rng = np.random.default_rng(seed)
    met = 0
    for triangle, origin, way, distance in aimed(corners, rng, 600):
        t = closed.crossings(origin, way)
        cosine = closed.normal(origin + t[:, None] * way) @ way
        near = np.argmin(np.abs(t - distance)) if len(t) else -1
        if near < 0 or abs(t[near] - distance) > 0.01 or abs(cosine[near]) < 0.1:
            continue
        met += 1
        found, *n = meet(exact, triangle, distance, np.sign(cosine[near]), False, origin, way)
        point = (origin + t[near] * way)[None]
        assert abs(found - t[near]) < 5e-15
        np.testing.assert_allclose(n, closed.normal(point)[0], atol=2e-14)
    assert met > 400


@profiled
@pytest.mark.parametrize("name", NAMES)
def test_lines_that_graze_find_both_ends_or_none(name, profiles):
    """Just under the surface a line goes in and out; just above it meets nothing."""
    made, closed = shapes(4)[name]
    corners = net(made, 24, 16)
    exact = tables(made, corners, profiles=profiles)
    rng = np.random.default_rng(8)
    checked = 0
    for triangle in rng.integers(len(corners), size=200):
        point = closed.nearest(corners[triangle].mean(axis=0)[None])
        n = closed.normal(point)[0]
        way = np.cross(n, rng.normal(size=3))
        way /= np.linalg.norm(way)
        for depth in (1e-3, 1e-5, 1e-7):
            origin = point[0] - depth * n - 0.5 * way
            t = closed.crossings(origin, way)
            t = t[np.abs(t - 0.5) < 0.1]
            ends = made.nearest(origin + t[:, None] * way) if len(t) == 2 else None
            if ends is None or np.abs(t - 0.5).max() > 0.1 or np.abs(closed.height(ends)).max() > 1e-12:
                continue
            if name == "tube" and np.ptp(np.abs((ends - closed.point) @ closed.axis - 0.3)) > 0.25:
                continue
            checked += 1
            for towards, expected in zip((-1, 1), t, strict=True):
                found = meet(exact, triangle, 0.5, towards, False, origin, way)[0]
                cosine = abs(closed.normal((origin + expected * way)[None])[0] @ way)
                assert abs(found - expected) * cosine < 1e-15
        if name == "ball":
            for towards in (-1, 1):
                assert math.isnan(meet(exact, triangle, 0.5, towards, False, point[0] + 1e-6 * n - 0.5 * way, way)[0])
    assert checked > 200


@profiled
@pytest.mark.parametrize("length", [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5])
@pytest.mark.parametrize("place", ["anywhere", "by a pole", "on a pole"])
def test_chords_of_a_ball(length, place, profiles):
    """A chord of length L of a sphere makes the angle asin(L / 2 R) with the tangent plane."""
    radius = 0.4
    made = spline(ball(radius))
    corners = net(made, 24, 16)
    exact = tables(made, corners, profiles=profiles)
    middles = corners.mean(axis=1)
    rng = np.random.default_rng(6)
    for _ in range(60):
        n = rng.normal(size=3)
        if place != "anywhere":
            n = np.array([0, 0, rng.choice([-1.0, 1.0])]) + (1e-3 * n if place == "by a pole" else 0)
        n /= np.linalg.norm(n)
        tangent = np.cross(n, rng.normal(size=3))
        tangent /= np.linalg.norm(tangent)
        sine = length / (2 * radius)
        way = math.sqrt(1 - sine * sine) * tangent - sine * n
        end = radius * n + length * way
        triangle = np.argmin(np.linalg.norm(middles - end, axis=1))
        t, *m = meet(exact, triangle, length, 1, True, radius * n, way)
        # where a chord leaves its patch, rounding counts by the angle at which it meets the surface
        assert abs(t - length) < 4e-14 + (3e-15 / length if length > 1e-5 else 0.0)
        np.testing.assert_allclose(m, end / radius, atol=1e-11)
        assert math.isnan(meet(exact, triangle, length, -1, True, radius * n, way)[0])


@profiled
def test_the_vertex_of_a_paraboloid(profiles):
    """Light along the axis of z = r² / 2R: it meets height r² / 2R, the normal's slope is r / R, down to r = 0."""
    radius, rim = 0.8, 0.5
    made = spline(paraboloid(radius, rim))
    corners = net(made, 24, 8)
    exact = tables(made, corners, profiles=profiles)
    fan = np.flatnonzero((np.linalg.norm(corners, axis=2) < 1e-12).any(axis=1))
    assert made.turns[0] == pytest.approx(2 * math.pi / 4, rel=1e-6)
    for r in (0.0, 1e-300, 1e-20, 1e-12, 1e-9, 1e-6, 1e-3, 0.02):
        for angle in np.linspace(0, 2 * math.pi, 17):
            x, y = r * math.cos(angle), r * math.sin(angle)
            for triangle in fan[::5]:  # whichever of the fan around the pole is met
                t, *n = meet(exact, triangle, 1.0, 1, False, (x, y, 1.0), (0, 0, -1))
                assert abs(t - (1 - r * r / (2 * radius))) < 3e-16
                expected = np.array([x / radius, y / radius, -1]) / math.hypot(r / radius, 1)
                np.testing.assert_allclose(n, expected, atol=1e-15)


@profiled
@pytest.mark.parametrize("name", NAMES)
def test_height_normal_and_nearest_point_of_the_kernel(name, profiles):
    made, closed = shapes(2)[name]
    corners = net(made, 24, 16)
    exact = tables(made, corners, profiles=profiles)
    rng = np.random.default_rng(2)
    for triangle in rng.integers(len(corners), size=200):
        point = closed.nearest(corners[triangle].mean(axis=0)[None])
        n = closed.normal(point)[0]
        above = rng.uniform(-0.01, 0.01)
        place = [float(x) for x in point[0] + above * n]
        for known in (triangle, -1):
            known = np.int32(known)
            assert kernels.height(exact, np.int32(0), *place, known) == pytest.approx(above, abs=1e-15)
            np.testing.assert_allclose(kernels.normal(exact, np.int32(0), *place, known), n, atol=1e-13)
            np.testing.assert_allclose(kernels.settle(exact, np.int32(0), known, *place), point[0], atol=2e-14)


def test_a_bspline_may_have_its_poles_along_u_or_at_the_upper_end():
    """However its parameters run, its own normal stays du x dv of the scene, and it knows its poles."""
    data = paraboloid(0.8, 0.5)
    swapped = {
        **data,
        **{key: data[key][::-1] for key in ("degrees", "knots", "multiplicities", "periodic")},
        "poles_mm": [list(row) for row in zip(*data["poles_mm"], strict=True)],
        "weights": [list(row) for row in zip(*data["weights"], strict=True)],
    }
    turned = {
        **data, "poles_mm": [row[::-1] for row in data["poles_mm"]], "weights": [row[::-1] for row in data["weights"]]
    }  # fmt: skip
    point = np.array([[0.1, 0.2, 0.05 / 1.6]])
    expected = np.array([0.1 / 0.8, 0.2 / 0.8, -1]) / math.sqrt(1 + 0.05 / 0.64)
    for form, sign in ((data, 1), (swapped, -1), (turned, -1)):
        made = spline(form)
        assert made.turns[0] > 0
        assert made.turns[1] == 0
        np.testing.assert_allclose(sign * made.normal(point)[0], expected, atol=1e-14)


def test_high_degrees_keep_their_digits():
    """A straight tube whose rim is raised to degree 20 is the same tube."""
    plain = tube(0.3, 0.6)
    n = 21
    data = {
        **plain, "degrees": [2, n - 1], "multiplicities": [plain["multiplicities"][0], [n, n]],
        "poles_mm": [
            [[low[0], low[1], low[2] + (high[2] - low[2]) * k / (n - 1)] for k in range(n)]
            for low, high in plain["poles_mm"]
        ],
        "weights": [[row[0]] * n for row in plain["weights"]],
    }  # fmt: skip
    made = bspline_of(ADAPTER.validate_python(data))
    rng = np.random.default_rng(0)
    u, v = (rng.uniform(0, breaks[-1], 300) for breaks in made.breaks)
    point = made.jet(u, v).point
    assert np.abs(np.hypot(point[:, 0], point[:, 1]) - 0.3).max() < 3e-16
    np.testing.assert_allclose(point[:, 2], 0.6 * v, atol=1e-15)
