# SPDX-License-Identifier: LGPL-2.1-or-later
"""Exact surfaces for tests: lowered alone, and B-splines that equal surfaces with a closed form."""

from __future__ import annotations

import math
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from raymaps.exact import ExactFaces, ExactTables, Surface, lower_exact, tables
from raymaps.frame import Frame
from raymaps.geometry import BodyMesh

Array = NDArray[np.float64]

#: Frame in which mm are frame units.
UNIT = Frame(np.zeros(3), 1.0, 2.0**-20)
_HALF = math.sqrt(0.5)
#: Poles (x, y) and weights of a full circle of radius 1, of degree 2; knots 0, 1, 2, 3, 4 twice each.
CIRCLE = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))
CIRCLE_WEIGHTS = (1, _HALF, 1, _HALF, 1, _HALF, 1, _HALF)


def lowered(surface: Surface, corners: Any, frame: Frame = UNIT, *, profiles: bool = True) -> ExactTables:
    """Tables of one surface with triangles on it, (n, 3, 3) in mm; without profiles every B-spline is its patches."""
    corners = np.asarray(corners, float)
    triangles = np.arange(3 * len(corners)).reshape(-1, 3)
    mesh = BodyMesh("Body", corners.reshape(-1, 3).copy(), triangles, ("Face1",), np.zeros(len(corners), np.int32))
    with patch.object(tables, "FAR_FROM_AXIS", tables.FAR_FROM_AXIS if profiles else 0.0):
        return lower_exact((mesh,), ExactFaces((surface,), ()), frame, corners)


def revolved(profile: list[tuple[float, float]], weights: tuple[float, ...], pose: Array | None = None) -> dict:
    """A Bezier curve of (radius, height) turned around z, as a record: u around the axis, v along the curve."""
    pose = np.eye(4) if pose is None else pose
    rows, row_weights = [], []
    for (x, y), w in zip(CIRCLE, CIRCLE_WEIGHTS, strict=True):
        rows.append([(pose @ [radius * x, radius * y, z, 1.0])[:3].tolist() for radius, z in profile])
        row_weights.append([w * other for other in weights])
    n = len(profile)
    return {
        "type": "bspline", "degrees": [2, n - 1], "knots": [[0, 1, 2, 3, 4], [0, 1]],
        "multiplicities": [[2, 2, 2, 2, 2], [n, n]], "periodic": [True, False], "poles_mm": rows,
        "weights": row_weights,
    }  # fmt: skip


def paraboloid(radius: float, rim: float, pose: Array | None = None) -> dict:
    """The bowl z = r² / (2 radius) up to r = rim; its pole is in the origin, its own normal points out of the bowl."""
    return revolved([(0, 0), (rim / 2, 0), (rim, rim * rim / (2 * radius))], (1, 1, 1), pose)


def ball(radius: float, pose: Array | None = None) -> dict:
    """A sphere from its lower pole to its upper one: two Bezier arcs."""
    arc = [(0, -radius), (radius, -radius), (radius, 0), (radius, radius), (0, radius)]
    data = revolved(arc, (1, _HALF, 1, _HALF, 1), pose)
    data["degrees"][1] = 2
    data["knots"][1], data["multiplicities"][1] = [0, 1, 2], [3, 2, 3]
    return data


def tube(radius: float, length: float, pose: Array | None = None) -> dict:
    """A circular cylinder along z from 0."""
    return revolved([(radius, 0), (radius, length)], (1, 1), pose)


def ring(major: float, minor: float, pose: Array | None = None) -> dict:
    """A torus around z, closed both ways."""
    data = revolved([(major + minor * x, minor * y) for x, y in CIRCLE], CIRCLE_WEIGHTS, pose)
    data["degrees"][1] = 2
    data["knots"][1], data["multiplicities"][1], data["periodic"][1] = [0, 1, 2, 3, 4], [2, 2, 2, 2, 2], True
    return data


def net(surface: Any, n_u: int, n_v: int) -> Array:
    """Triangles, (n, 3, 3), that span the parameters of a B-spline; those without an area are left out."""
    u = np.linspace(0, surface.breaks[0][-1], n_u + 1)
    v = np.linspace(0, surface.breaks[1][-1], n_v + 1)
    grid = surface.jet(*(x.ravel() for x in np.meshgrid(u, v, indexing="ij"))).point.reshape(n_u + 1, n_v + 1, 3)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    corners = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3, 3)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return np.ascontiguousarray(corners[area > 1e-9 * area.max()])
