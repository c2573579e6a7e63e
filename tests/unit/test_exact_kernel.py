# SPDX-License-Identifier: LGPL-2.1-or-later
"""Kernels of exact surfaces against the slow reference and against closed forms: any pose, scale, chord and grazing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from raymaps.exact import Cone, Cylinder, ExactFaces, Plane, Sphere, Torus, lower_exact
from raymaps.frame import Frame
from raymaps.geometry import BodyMesh
from raymaps.kernels.exact import height, meet, normal, settle

UNIT = Frame(np.zeros(3), 1.0, 2.0**-20)


def lowered(surface, points, frame=UNIT):
    """Tables of one surface; a triangle stands at three of its points."""
    points = surface.nearest(np.asarray(points, float))
    mesh = BodyMesh("Body", points.copy(), np.array([[0, 1, 2]]), ("Face1",), np.zeros(1, np.int32))
    return lower_exact((mesh,), ExactFaces((surface,), ()), frame, points[None].copy())


def posed(seed, scale=1.0):
    """A surface of each kind, turned and moved at random within the frame, and points near it."""
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed).as_matrix()
    center = scale * rng.uniform(-0.4, 0.4, 3)
    axis = np.ascontiguousarray(turn[2])
    made = {
        "plane": Plane(center, axis),
        "sphere": Sphere(center, scale * rng.uniform(0.05, 0.5)),
        "cylinder": Cylinder(center, axis, scale * rng.uniform(0.05, 0.5)),
        "cone": Cone(center, axis, math.radians(rng.uniform(3, 87))),
        "torus": Torus(center, axis, scale * rng.uniform(0.2, 0.4), scale * rng.uniform(0.02, 0.19)),
    }
    near = center + 0.3 * scale * axis + 0.1 * scale * rng.normal(size=(3, 3))
    return made, near


KINDS = ("plane", "sphere", "cylinder", "cone", "torus")


def directions(rng, n):
    d = rng.normal(size=(n, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def nearest_of(surface, origin, direction, guess, towards):
    """From the reference: the crossing with an orientation that is nearest to a guess, or NaN."""
    t = surface.crossings(origin, direction)
    cosine = surface.normal(origin + t[:, None] * direction) @ direction
    t = t[np.sign(cosine) == towards]
    return t[np.argmin(np.abs(t - guess))] if len(t) else math.nan


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(8))
def test_crossings_are_those_of_the_reference(kind, seed):
    made, near = posed(seed)
    surface = made[kind]
    exact = lowered(surface, near)
    rng = np.random.default_rng(100 + seed)
    origins, ways = rng.uniform(-1, 1, (400, 3)), directions(rng, 400)
    origins[200:] = surface.nearest(origins[200:]) + 0.05 * rng.normal(size=(200, 3)) - ways[200:]
    met = 0
    for origin, way in zip(origins, ways, strict=True):
        for towards in (-1, 1):
            guess = rng.uniform(-2, 2)
            expected = nearest_of(surface, origin, way, guess, towards)
            t, nx, ny, nz = meet(exact, 0, 0, guess, towards, False, *origin, *way)
            assert math.isnan(t) == math.isnan(expected), (kind, origin, way, t, expected)
            if math.isnan(t):
                continue
            met += 1
            point, n = origin + t * way, np.array([nx, ny, nz])
            cosine = abs(n @ way)
            assert abs(t - expected) * cosine < 2e-14 * max(1, abs(expected))
            assert abs(surface.height(point[None])[0]) < 2e-14 * max(1, abs(expected))
            assert n @ n == pytest.approx(1, abs=1e-14)
            assert np.sign(n @ way) == towards
    assert met > 100
