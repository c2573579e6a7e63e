# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whispering galleries: a hundred thousand total reflections along the wall of a rod and of a ball, however flat."""

import math

import numpy as np
import pytest

from tests.physics.scenes_exact import ball, rod
from tests.stability.aiming import rotation
from tests.stability.test_long_paths import trapped

EPS = np.finfo(float).eps
#: How far off its wall, relative to its radius, a place may be after a hundred thousand reflections.
OFF_THE_WALL = 256 * EPS


@pytest.mark.parametrize("guide", [False, True], ids=["mirror", "light guide"])
def test_round_a_rod(tmp_path, guide):
    """Light that goes round in a rod, also so flat that it rises a hundred-millionth of the radius off the wall
    (whispering gallery), and on its ends: after k reflections on the side it has gone on by 2 k asin(cos) around the
    axis, and lies at its radius exactly.

    Guards: the root of the quadratic at which the ray stands is divided out (`stands_on`); a step smaller than
    `START_OFFSET` off its wall is no missed surface.
    """
    radius, length = 5.0, 40.0
    # rays that meet the side at a cosine, in a plane across the axis, and two for each that climb along the axis
    # besides
    steepness, climb = (grid.reshape(-1) for grid in np.meshgrid([0.7, 0.1, 1e-2, 1e-3, 1e-4], [0.0, 0.3, -0.5]))
    starts = np.column_stack([radius * np.sqrt(1 - steepness**2), 0 * climb, 0.7 + steepness])  # the middle of a chord
    directions = np.column_stack([0 * climb, np.sqrt(1 - climb**2), climb])
    h = trapped(tmp_path, rod(radius, length, 24).moved(0, 0, -length / 2), starts, directions, guide=guide, rays=30)
    place, faces = h.position.reshape(h.n_rays, -1, 3), h.face.reshape(h.n_rays, -1)
    side, grid = h.face_index("Body", "Side"), h.raymap.manifest.grid_mm
    which = np.argmin(np.abs(place[:, 0, None, 2] - starts[:, 2]) + np.abs(place[:, :1, 0] - starts[:, 0]), axis=1)
    for ray in range(h.n_rays):
        climbs = place[ray, 1, 2] - place[ray, 0, 2]
        mine = np.flatnonzero(steepness == steepness[which[ray]])
        this = mine[np.argmin(np.abs(np.sign(climb[mine]) - np.sign(np.round(climbs / grid))))]
        rows = np.flatnonzero(faces[ray] == side)
        x, y = place[ray, rows, 0], place[ray, rows, 1]
        assert np.abs(np.hypot(x, y) - radius).max() <= 2 * grid
        k = np.arange(len(rows))
        off = np.angle(np.exp(1j * (np.arctan2(y, x) - math.asin(steepness[this]) * (2 * k + 1))))
        # a place that is off the wall by d turns the half chord by d / (radius cos), from there on
        slack = 2 * grid / radius + OFF_THE_WALL / steepness[this] * 2 * (k + 1)
        assert (np.abs(off) <= slack).all(), (steepness[this], climb[this], float(np.abs(off).max()))
        if climb[this] == 0:
            assert np.abs(place[ray, :, 2] - starts[this, 2]).max() <= grid
        elif steepness[this] > 1e-3:
            assert (faces[ray] != side).sum() > 2


@pytest.mark.parametrize(("steepness", "turned"), [(0.5, True), (1e-3, False), (1e-4, False)])
def test_round_a_ball(tmp_path, steepness, turned):
    """Light in a ball stays in its plane, and goes on by 2 asin(cos) at each reflection.

    Guards: as in a rod; the normal is that of the sphere, not of the facet, which would throw light out of its plane.
    """
    radius, turn = 5.0, rotation() if turned else np.eye(3)
    start = turn @ np.array([radius * math.sqrt(1 - steepness**2), 0, 0])
    h = trapped(tmp_path, ball(radius), [start], [turn @ np.array([0, 1.0, 0])], guide=True, events=20_000, rays=2)
    place = h.position.reshape(h.n_rays, -1, 3)[:, 1:] @ turn
    grid = h.raymap.manifest.grid_mm
    assert np.abs(place[..., 2]).max() <= 2 * grid
    assert np.abs(np.linalg.norm(place, axis=2) - radius).max() <= 2 * grid
    k = np.arange(place.shape[1])
    off = np.angle(np.exp(1j * (np.arctan2(place[..., 1], place[..., 0]) - math.asin(steepness) * (2 * k + 1))))
    assert (np.abs(off) <= 2 * grid / radius + OFF_THE_WALL / steepness * 2 * (k + 1)).all()
