# SPDX-License-Identifier: LGPL-2.1-or-later
"""B-splines that are surfaces of revolution: their axis and their profile.

CAD programs hand over aspheres, reflectors and collimators as rational B-splines in which one parameter turns around an
axis and the other runs along a profile of (radius, height). The profile alone is a curve of piecewise polynomials, far
faster to meet than the surface. A B-spline counts as revolved if it is its profile turned, to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raymaps.exact.bspline import BSpline

__all__ = ["Revolution", "revolution_of"]

Array = NDArray[np.float64]

#: How far a surface may lie off its turned profile, over its size; rounding of its coordinates is added.
SAME = 1e-12
ROUNDINGS = 4
#: Patches whose points the axis is sought from, along each parameter.
MOST_FITTED = 16
#: A radius below this share of the size, other than at a pole, is none that a ray can be told to be outside of.
LEAST_RADIUS = 1e-9


@dataclass(frozen=True, eq=False)
class Revolution:
    """A profile of (radius, height) that turns around an axis.

    Attributes
    ----------
    along : int
        Parameter of the B-spline that runs along the profile: 0 is u, 1 is v. Pieces have its parameter.
    origin : (3,) float64, mm
        Point of the axis from which heights count.
    axes : (3, 3) float64
        Rows are unit vectors; the last is the axis, around which the other parameter turns right-handed.
    breaks : (n + 1,) float64
        Parameters at the ends of pieces.
    wraps : bool
        Whether the profile is closed.
    center : (n, 2) float64, mm
    reference, width : (n,) float64
        A piece's own parameter is (parameter - reference) / width.
    coefficient : (n, degree + 1, 3) float64
        Powers of w (radius - center), w (height - center), w.
    poles : (bool, bool)
        Whether the profile begins, and ends, on the axis.
    sign : float
        Own normal = sign * (slope of the height, - slope of the radius), brought to length one.
    """

    along: int
    origin: Array
    axes: Array
    breaks: Array
    wraps: bool
    center: Array
    reference: Array
    width: Array
    coefficient: Array
    poles: tuple[bool, bool]
    sign: float

    @property
    def farthest_mm(self) -> float:
        """About the largest distance from its axis, or height: that of any piece's middle or end."""
        v = np.unique(np.concatenate([self.breaks, 0.5 * (self.breaks[1:] + self.breaks[:-1])]))
        return float(np.abs(self.profile(v)).max())

    def profile(self, v: Array) -> Array:
        """Radius and height, (n, 2), at parameters, (n,)."""
        j = np.clip(np.searchsorted(self.breaks, v, side="right") - 1, 0, len(self.width) - 1)
        powers = ((v - self.reference[j]) / self.width[j])[:, None] ** np.arange(self.coefficient.shape[1])
        terms = np.einsum("njc,nj->nc", self.coefficient[j], powers)
        return np.asarray(self.center[j] + terms[:, :2] / terms[:, 2:])


def revolution_of(surface: BSpline) -> Revolution | None:
    """The axis and the profile of a B-spline that is a surface of revolution; None of one that is not."""
    return _turned(surface, along=1) or (None if any(surface.turns) else _turned(surface, along=0))


def _turned(surface: BSpline, along: int) -> Revolution | None:
    turning, running = (_samples(surface, axis) for axis in (1 - along, along))
    few = [x[:: 1 + len(x) // (MOST_FITTED * 8)] for x in (turning, running)]
    points = _grid(surface, along, *few)
    size, allowed = float(np.ptp(points.reshape(-1, 3), axis=0).max()), 0.0
    allowed = SAME * size + ROUNDINGS * np.finfo(float).eps * float(np.abs(points).max())
    found = _axis(points)
    if found is None or _off(points, *found) > allowed:
        return None
    made = _profile(surface, along, *found, points, allowed)
    radius, height = made.profile(running).T
    inner = radius[int(made.poles[0]) : len(radius) - int(made.poles[1])]
    if not inner.min() > 0 or (not any(made.poles) and inner.min() < LEAST_RADIUS * size):
        return None

    # all points are those of the profile, turned by an angle that rises with the other parameter
    local = (_grid(surface, along, turning, running) - made.origin) @ made.axes.T
    widest = int(np.argmax(radius))
    angle = np.unwrap(np.arctan2(local[:, widest, 1], local[:, widest, 0]))
    steps = np.diff(angle)
    turned = np.stack(
        [
            np.cos(angle)[:, None] * radius,
            np.sin(angle)[:, None] * radius,
            np.broadcast_to(height, (len(angle), len(height))),
        ],
        axis=2,
    )
    is_same = np.linalg.norm(local - turned, axis=2).max() <= allowed
    rises = steps.min() > 0 and angle[-1] - angle[0] <= 2 * np.pi * (1 + 1e-9)
    return made if is_same and rises else None


def _samples(surface: BSpline, axis: int) -> Array:
    """Parameters, rising, with the ends; in each patch more than two polynomials of its degree may agree at."""
    breaks, n = surface.breaks[axis], 2 * surface.coefficient.shape[2 + axis] + 1
    shares = np.arange(n) / n
    return np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * shares).ravel(), breaks[-1])


def _grid(surface: BSpline, along: int, turning: Array, running: Array) -> Array:
    """Points (n_turning, n_running, 3)."""
    a, b = (x.ravel() for x in np.meshgrid(turning, running, indexing="ij"))
    u, v = (a, b) if along == 1 else (b, a)
    return surface.jet(u, v).point.reshape(len(turning), len(running), 3)


def _axis(points: Array) -> tuple[Array, Array] | None:
    """A point and the direction of the axis around which each column of points, (n, m, 3), may turn."""
    middle = points.reshape(-1, 3).mean(axis=0)
    local = points - middle
    chords = local - local[:1]
    _, strength, rows = np.linalg.svd(chords.reshape(-1, 3), full_matrices=False)
    if not strength[1] > 1e-6 * strength[0]:
        return None  # the points do not turn
    axis = rows[2]
    axis = axis / np.linalg.norm(axis)
    # right-handed: what turns sweeps an area that looks along the axis
    swept = np.cross(chords[1:-1], chords[2:]).sum(axis=(0, 1)) @ axis
    axis = axis if swept > 0 else -axis
    # all points of a column are equally far from the axis: |p|² - 2 p c is the same
    across = rows[:2]
    plane = local @ across.T
    step = plane - plane[:1]
    squares = (plane**2).sum(axis=2)
    center = np.linalg.lstsq(2 * step.reshape(-1, 2), (squares - squares[:1]).reshape(-1), rcond=None)[0]
    return middle + center @ across, axis


def _off(points: Array, origin: Array, axis: Array) -> float:
    """How far radii and heights of points in a column, (n, m, 3), differ."""
    local = points - origin
    height = local @ axis
    radius = np.linalg.norm(local - height[..., None] * axis, axis=2)
    return float(max(np.ptp(height, axis=0).max(), np.ptp(radius, axis=0).max()))


def _profile(surface: BSpline, along: int, origin: Array, axis: Array, points: Array, allowed: float) -> Revolution:
    """The profile as the curve in the middle of the first patches along the turn."""
    height = (points - origin) @ axis
    origin = origin + 0.5 * (height.min() + height.max()) * axis
    first = np.array([surface.reference[1 - along][0]])
    curve = _grid(surface, along, first, _samples(surface, along))[0] - origin
    across = curve - (curve @ axis)[:, None] * axis
    outward = across[np.argmax(np.linalg.norm(across, axis=1))]
    outward = outward / np.linalg.norm(outward)
    outward = outward - (outward @ axis) * axis
    axes = np.stack([outward, np.cross(axis, outward), axis])

    centers = (surface.center[0] if along == 1 else surface.center[:, 0]) - origin
    terms = surface.coefficient[0, :, 0] if along == 1 else surface.coefficient[:, 0, :, 0]
    center = centers @ axes[[0, 2]].T
    coefficient = np.concatenate([terms[..., :3] @ axes[[0, 2]].T, terms[..., 3:]], axis=2)
    poles = bool(surface.turns[0]), bool(surface.turns[1])
    for end, is_pole in zip((0, -1), poles, strict=True):
        if is_pole:
            center[end, 0] = 0.0
            if abs(coefficient[end, 1, 1]) <= allowed:
                coefficient[end, 1, 1] = 0.0  # smooth there, so that its normal is the axis
    return Revolution(
        along=along,
        origin=origin,
        axes=axes,
        breaks=surface.breaks[along],
        wraps=surface.wraps[along],
        center=center,
        reference=surface.reference[along],
        width=surface.width[along],
        coefficient=np.ascontiguousarray(coefficient),
        poles=poles,
        sign=surface.sign if along == 1 else -surface.sign,
    )
