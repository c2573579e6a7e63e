# SPDX-License-Identifier: LGPL-2.1-or-later
"""B-splines that are surfaces of revolution: which are recognised, and their kernel against the slow B-spline."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.spatial.transform import Rotation

from raymaps.exact import exact_surface
from raymaps.exact.revolution import revolution_of
from raymaps.frame import Frame
from raymaps.kernels import exact as kernels
from raymaps.kinds import ExactKind
from raymaps.scene import BSplineSurface
from tests.exact_surfaces import ball, lowered, net, paraboloid, revolved, ring, tube

ADAPTER = TypeAdapter(BSplineSurface)
HALF = math.sqrt(0.5)
Z = np.array([0.0, 0.0, 1.0])


def spline(data):
    return exact_surface(ADAPTER.validate_python(data))


def pose(seed, scale=1.0):
    made = np.eye(4)
    made[:3, :3] = scale * Rotation.random(random_state=seed).as_matrix()
    made[:3, 3] = np.random.default_rng(seed).uniform(-0.2, 0.2, 3)
    return made


def ellipsoid(across, along, place=None):
    """From its lower pole to its upper one."""
    arc = [(0, -along), (across, -along), (across, 0), (across, along), (0, along)]
    data = revolved(arc, (1, HALF, 1, HALF, 1), place)
    data["degrees"][1], data["knots"][1], data["multiplicities"][1] = 2, [0, 1, 2], [3, 2, 3]
    return data


def quarter(data):
    """The first quarter of a turn."""
    cut = {key: list(value) for key, value in data.items() if key != "type"}
    cut["knots"][0], cut["multiplicities"][0], cut["periodic"] = [0, 1], [3, 3], [False, data["periodic"][1]]
    return {**cut, "type": "bspline", "poles_mm": data["poles_mm"][:3], "weights": data["weights"][:3]}


def swapped(data):
    """u along the profile, v around the axis."""
    ways = ("degrees", "knots", "multiplicities", "periodic")
    turned = {key: [list(row) for row in zip(*data[key], strict=True)] for key in ("poles_mm", "weights")}
    return {**data, **{key: data[key][::-1] for key in ways}, **turned}


def wavy(place=None):
    """A mirror whose profile rises and falls, of degree 5 in one piece."""
    return revolved(
        [(0.1, 0), (0.2, 0.3), (0.3, -0.3), (0.35, 0.4), (0.4, -0.2), (0.5, 0.1)], (1, 1, 1, 1, 1, 1), place
    )


def spun_cone(place=None):
    """A cone of 45 degrees, its apex in the origin."""
    return revolved([(0, 0), (0.5, 0.5)], (1, 1), place)


SHAPES = {
    "ball": lambda p: ball(0.4, p),
    "tube": lambda p: tube(0.3, 0.6, p),
    "ring": lambda p: ring(0.4, 0.15, p),
    "paraboloid": lambda p: paraboloid(0.8, 0.5, p),
    "ellipsoid": lambda p: ellipsoid(0.5, 0.2, p),
    "wavy": wavy,
    "cone": spun_cone,
    "quarter of a ring": lambda p: quarter(ring(0.4, 0.15, p)),
    "quarter of a paraboloid": lambda p: quarter(paraboloid(0.8, 0.5, p)),
    "swapped tube": lambda p: swapped(tube(0.3, 0.6, p)),
    "swapped ring": lambda p: swapped(ring(0.4, 0.15, p)),
    "swapped wave": lambda p: swapped(wavy(p)),
}
every = pytest.mark.parametrize("name", SHAPES)


def meet(exact, triangle, guess, towards, stands_on, origin, way):
    numbers = (float(x) for x in (*origin, *way))
    return kernels.meet(exact, np.int32(0), np.int32(triangle), float(guess), float(towards), bool(stands_on), *numbers)


# ------------------------------------------------------------------------------------------------------- recognition


@every
@pytest.mark.parametrize("seed", range(3))
def test_a_turned_profile_is_recognised(name, seed):
    """The profile's points, turned back to the surface, are as far off as rounding; so are its own normals."""
    place = pose(seed)
    surface = spline(SHAPES[name](place))
    made = revolution_of(surface)
    assert abs(made.axes[2] @ place[:3, 2]) == pytest.approx(1, abs=1e-14)
    np.testing.assert_allclose(np.cross(place[:3, 2], made.origin - place[:3, 3]), 0, atol=1e-14)
    rng = np.random.default_rng(seed)
    u, v = (rng.uniform(0.01 * breaks[-1], breaks[-1], 200) for breaks in surface.breaks)
    points = surface.jet(u, v).point - made.origin
    radius, height = made.profile((u, v)[made.along]).T
    np.testing.assert_allclose(points @ made.axes[2], height, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(np.cross(points, made.axes[2]), axis=1), radius, atol=1e-15)


def test_what_is_no_revolution_is_none():
    """Extrusions, ellipses turned like circles, profiles that are no plane curves, bumps of a billionth."""
    extrusion = tube(0.3, 0.6)
    extrusion["poles_mm"] = [[[2 * x, y, z] for x, y, z in row] for row in extrusion["poles_mm"]]
    plate = {
        "type": "bspline", "degrees": [1, 1], "knots": [[0, 1], [0, 1]], "multiplicities": [[2, 2], [2, 2]],
        "periodic": [False, False], "poles_mm": [[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0]]],
    }  # fmt: skip
    twisted = tube(0.3, 0.6)
    turn = Rotation.from_euler("z", 40, degrees=True).as_matrix()
    twisted["poles_mm"] = [[low, (turn @ high).tolist()] for low, high in twisted["poles_mm"]]
    sheared = tube(0.3, 0.6)
    sheared["poles_mm"] = [[low, [high[0] + 0.1, *high[1:]]] for low, high in sheared["poles_mm"]]
    for data in (extrusion, plate, twisted, sheared):
        surface = spline(data)
        assert revolution_of(surface) is None
        assert lowered(surface, net(surface, 4, 4)).kind.tolist() == [ExactKind.PATCHES]


@every
@pytest.mark.parametrize("what", ["poles_mm", "weights"])
def test_a_billionth_off_is_no_revolution(name, what):
    data = SHAPES[name](pose(1))
    changed = spline(data)
    assert revolution_of(changed) is not None
    row, column = len(data["poles_mm"]) // 2, len(data["poles_mm"][0]) // 2
    if what == "weights":
        data["weights"][row][column] *= 1 + 1e-8
    else:
        data["poles_mm"][row][column][0] += 1e-9
        data["poles_mm"][row][column][1] += 1e-9
    assert revolution_of(spline(data)) is None


def test_far_from_its_axis_a_surface_stays_patches():
    """A part of a ring whose axis is a hundred scenes away."""
    surface = spline(quarter(ring(0.4, 0.15)))
    corners = net(surface, 6, 6)
    for unit_mm, kind in ((1.0, ExactKind.REVOLUTION), (0.01, ExactKind.PATCHES)):
        frame = Frame(np.zeros(3), unit_mm, unit_mm * 2.0**-20)
        assert lowered(surface, corners, frame).kind.tolist() == [kind]


def test_far_from_the_origin_a_revolution_is_recognised():
    """Poles of a scene 100 m away are rounded, and the surface is one of revolution to that rounding."""
    place = np.eye(4)
    place[:3, 3] = [1e5, -3e4, 7e4]
    place[:3, :3] *= 10
    surface = spline(paraboloid(0.8, 0.5, place))
    made = revolution_of(surface)
    np.testing.assert_allclose(np.abs(made.axes[2]), Z, atol=1e-10)
    frame = Frame(place[:3, 3], 8.0, 1e-6)
    exact = lowered(surface, net(surface, 24, 8), frame)
    assert exact.kind.tolist() == [ExactKind.REVOLUTION]
    # 10 mm up the axis from the vertex of r² / 1.6, ten times as large
    t = meet(exact, 0, 1.0, 1, False, (0.125, 0, 1.25), (0, 0, -1))[0]
    assert t == pytest.approx(1.25 - 0.125**2 * 8 / 16, abs=1e-11)


# ------------------------------------------------------------------------------------------------------------ kernel


def kernel_of(name, seed, *, profiles=True):
    surface = spline(SHAPES[name](pose(seed)))
    corners = net(surface, 24, 16)
    exact = lowered(surface, corners, profiles=profiles)
    assert exact.kind.tolist() == [ExactKind.REVOLUTION if profiles else ExactKind.PATCHES]
    return surface, corners, exact


def inner(surface, points):
    """Which points of the surface are well within its borders."""
    u, v = surface.parameters(points)
    within = np.ones(len(points), bool)
    for axis, x in ((0, u), (1, v)):
        share = x / surface.breaks[axis][-1]
        is_end = 0.0 if axis == 1 and surface.turns[0] else 0.02
        within &= surface.wraps[axis] | ((share > is_end) & (share < 0.98))
    return within


def lines(corners, rng, n):
    """Lines through points of triangles: triangle, origin, way, distance."""
    for triangle in rng.integers(len(corners), size=n):
        point = rng.dirichlet([1, 1, 1]) @ corners[triangle]
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        distance = rng.uniform(0.1, 1.0)
        yield int(triangle), point - distance * way, way, distance


@every
@pytest.mark.parametrize("seed", range(2))
def test_lines_through_triangles_meet_what_the_slow_reference_meets(name, seed):
    """Of all crossings near a triangle the nearest with the orientation that is asked for, however it grazes."""
    surface, corners, exact = kernel_of(name, seed)
    rng = np.random.default_rng(50 + seed)
    met = 0
    for triangle, origin, way, distance in lines(corners, rng, 30):
        t = surface.crossings(origin, way)
        points = origin + t[:, None] * way
        t = t[inner(surface, points)] if len(t) else t
        cosine = surface.normal(origin + t[:, None] * way) @ way if len(t) else t
        for towards in (-1, 1):
            right = t[np.sign(cosine) == towards]
            right = right[np.abs(right - distance) < 0.01]
            if len(right) != 1:
                continue
            found, *n = meet(exact, triangle, distance, towards, False, origin, way)
            met += 1
            point = (origin + found * way)[None]
            n_true = surface.normal(point)[0]
            assert abs(found - right[0]) < 1e-14 / abs(n_true @ way)
            assert np.linalg.norm(surface.nearest(point) - point) < 2e-15
            np.testing.assert_allclose(n, n_true, atol=1e-12)
    assert met > 10


@pytest.mark.parametrize("name", [name for name in SHAPES if "quarter" not in name])
def test_without_a_triangle_all_of_the_profile_is_searched(name):
    """Lines at random: what is found is a crossing, and nothing is found only where there is none. Of whole turns: the
    kernel's surface goes all the way round.
    """
    surface, _, exact = kernel_of(name, 3)
    rng = np.random.default_rng(9)
    n_met, n_none = 0, 0
    for _ in range(30):
        origin = rng.uniform(-0.6, 0.6, 3)
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        t = surface.crossings(origin, way)
        cosine = surface.normal(origin + t[:, None] * way) @ way if len(t) else t
        for towards in (-1, 1):
            found, *n = meet(exact, -1, 0.0, towards, False, origin, way)
            right = t[(np.sign(cosine) == towards)]
            if math.isnan(found):
                assert not len(right)
                n_none += 1
                continue
            point = origin + found * way
            n_met += 1
            if len(right) and np.abs(right - found).min() < 1e-6:
                assert np.abs(right - found).min() < 1e-12
                assert towards * (np.array(n) @ way) > 0
            else:  # a little past an end
                assert not inner(surface, surface.nearest(point[None]))[0]
    assert n_met > 10
    assert n_none > 3


@every
def test_where_a_ray_stands_is_never_met(name):
    """From a point of the surface: another crossing, with the orientation, or none."""
    surface, corners, exact = kernel_of(name, 2)
    rng = np.random.default_rng(4)
    found = 0
    for triangle in rng.integers(len(corners), size=40):
        point = surface.nearest(corners[triangle].mean(axis=0)[None])
        n = surface.normal(point)[0]
        way = np.cross(n, rng.normal(size=3))
        way /= np.linalg.norm(way)
        for angle in (1e-7, 1e-5, 1e-3, 0.1):
            for towards in (-1, 1):
                d = math.cos(angle) * way - towards * math.sin(angle) * n
                for guess in (0.0, 1e-3, 0.1):
                    t, *m = meet(exact, triangle, guess, towards, True, point[0], d)
                    assert not abs(t) < 1e-10
                    if math.isnan(t):
                        continue
                    found += 1
                    end = (point[0] + t * d)[None]
                    assert towards * (np.array(m) @ d) > 0
                    if inner(surface, surface.nearest(end))[0] and "quarter" not in name:
                        assert np.linalg.norm(surface.nearest(end) - end) < 3e-15
    assert found > 20


@every
def test_height_normal_and_nearest_point_are_those_of_the_reference(name):
    surface, corners, exact = kernel_of(name, 5)
    rng = np.random.default_rng(6)
    for triangle in rng.integers(len(corners), size=80):
        point = surface.nearest((rng.dirichlet([3, 3, 3]) @ corners[triangle])[None])
        n = surface.normal(point)[0]
        above = rng.uniform(-0.005, 0.005)
        place = [float(x) for x in point[0] + above * n]
        for known in (triangle, -1):
            known = np.int32(known)
            assert kernels.height(exact, np.int32(0), *place, known) == pytest.approx(above, abs=2e-15)
            np.testing.assert_allclose(kernels.normal(exact, np.int32(0), *place, known), n, atol=1e-12)
            np.testing.assert_allclose(kernels.settle(exact, np.int32(0), known, *place), point[0], atol=1e-14)


def test_a_whispering_gallery_stays_on_the_profile():
    """Ten thousand reflections inside of an ellipsoid, over its poles: the point does not drift off, nor get lost."""
    across, along = 0.5, 0.2
    surface = spline(ellipsoid(across, along))
    exact = lowered(surface, net(surface, 24, 16))
    position, way = np.array([across, 0.0, 0.0]), np.array([-1e-2, 0.3, 1.0])
    way /= np.linalg.norm(way)
    for _ in range(10_000):
        t, *n = meet(exact, -1, 1e-3, 1, True, position, way)
        assert 0 < t < 1.0
        position, n = position + t * way, np.array(n)
        np.testing.assert_allclose(
            np.cross(n, position / [across**2, across**2, along**2]), 0, atol=1e-9
        )  # the gradient of x² / a² + y² / a² + z² / b²
        way = way - 2 * (way @ n) * n
        way /= np.linalg.norm(way)
    assert abs(np.linalg.norm(position / [across, across, along]) - 1) < 1e-11


def test_the_apex_of_a_cone():
    """Of 45 degrees: a line beside the axis meets it at its distance from the axis, the normal leans 45 degrees."""
    surface = spline(spun_cone())
    corners = net(surface, 24, 8)
    exact = lowered(surface, corners)
    fan = np.flatnonzero((np.linalg.norm(corners, axis=2) < 1e-12).any(axis=1))
    for r in (1e-12, 1e-9, 1e-6, 1e-3, 0.02):
        for angle in np.linspace(0, 2 * math.pi, 9):
            x, y = r * math.cos(angle), r * math.sin(angle)
            for triangle in fan[::7]:
                t, *n = meet(exact, triangle, 1.0, 1, False, (x, y, 1.0), (0, 0, -1))
                assert t == pytest.approx(1 - r, abs=3e-16)
                np.testing.assert_allclose(n, [HALF * x / r, HALF * y / r, -HALF], atol=1e-12 + 1e-16 / r)


def test_a_silhouette_within_a_piece_is_found_on_both_sides():
    """The wave's profile has crests: a line just under one goes in and out, just above it neither."""
    surface = spline(wavy())
    corners = net(surface, 48, 64)
    exact = lowered(surface, corners)
    # on the half line away from the axis the wave is a curve: x and z are its Bezier polynomials
    bernstein = [
        math.comb(5, k) * np.polynomial.Polynomial([0, 1]) ** k * np.polynomial.Polynomial([1, -1]) ** (5 - k)
        for k in range(6)
    ]
    x = sum(b * value for b, value in zip(bernstein, (0.1, 0.2, 0.3, 0.35, 0.4, 0.5), strict=True))
    z = sum(b * value for b, value in zip(bernstein, (0, 0.3, -0.3, 0.4, -0.2, 0.1), strict=True))
    turns = [float(v.real) for v in z.deriv().roots() if abs(v.imag) < 1e-9 and 0 < v.real < 1]
    top = next(v for v in turns if z.deriv(2)(v) < 0)
    crest = np.array([x(top), 0.0, z(top)])
    triangle = np.argmin(np.linalg.norm(corners.mean(axis=1) - crest, axis=1))
    for depth in (1e-3, 1e-5, 1e-7):
        origin = np.array([crest[0] - 0.3, 0.0, crest[2] - depth])
        roots = sorted((z - origin[2]).roots().real, key=lambda v: abs(v - top))[:2]
        near = sorted(float(x(v)) - origin[0] for v in roots)
        slopes = [float(z.deriv()(v) / x.deriv()(v)) for v in sorted(roots)]
        for expected, slope in zip(near, slopes, strict=True):
            # du x dv looks along (slope of z, - slope of x): the line goes along it where the profile rises
            found = meet(exact, triangle, 0.3, math.copysign(1, slope), False, origin, (1, 0, 0))[0]
            assert abs(found - expected) * abs(slope) < 1e-14
    above = np.array([crest[0] - 0.3, 0.0, crest[2] + 1e-5])
    for towards in (-1, 1):
        found = meet(exact, triangle, 0.3, towards, False, above, (1, 0, 0))[0]
        assert math.isnan(found) or abs(found - 0.3) > 0.05
