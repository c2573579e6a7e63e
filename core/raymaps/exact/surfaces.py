# SPDX-License-Identifier: LGPL-2.1-or-later
"""Exact surfaces in plain numpy: what the kernels of `raymaps.kernels.exact` compute fast, slow and readable, in mm.

Each surface has

``nearest(points)``   the closest points of the surface without its borders, (n, 3)
``normal(points)``    its own unit normal at points on it, (n, 3); see `raymaps.scene.exact_surfaces`
``height(points)``    signed distance along its own normal, (n,), of points near it
``crossings(o, d)``   distances, rising, of all crossings of the line o + t d with it, d of length one
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.exact.bspline import BSpline, bspline_of
from raymaps.scene.exact_surfaces import (
    BSplineSurface,
    ConeSurface,
    CylinderSurface,
    ExactSurface,
    PlaneSurface,
    SphereSurface,
    TorusSurface,
)

__all__ = ["Cone", "Cylinder", "Plane", "Sphere", "Surface", "Torus", "exact_surface"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Plane:
    """Plane through ``point`` with a unit ``own_normal``, both (3,)."""

    point: Array
    own_normal: Array

    def nearest(self, points: Array) -> Array:
        """Feet of the perpendiculars."""
        return points - self.height(points)[:, None] * self.own_normal

    def normal(self, points: Array) -> Array:
        """The same everywhere."""
        return np.broadcast_to(self.own_normal, points.shape).copy()

    def height(self, points: Array) -> Array:
        """Distance in front of the plane."""
        return (points - self.point) @ self.own_normal

    def crossings(self, origin: Array, direction: Array) -> Array:
        """One, or none of a line along the plane."""
        cosine = float(direction @ self.own_normal)
        return np.zeros(0) if cosine == 0.0 else np.array([(self.point - origin) @ self.own_normal / cosine])


@dataclass(frozen=True, eq=False)
class Sphere:
    """Sphere around ``center``, (3,)."""

    center: Array
    radius: float

    def nearest(self, points: Array) -> Array:
        """Along the radius; of the centre some point."""
        return self.center + self.radius * self.normal(points)

    def normal(self, points: Array) -> Array:
        """Away from the centre."""
        return _unit(points - self.center, np.array([0.0, 0.0, 1.0]))

    def height(self, points: Array) -> Array:
        """Distance from the centre less the radius."""
        return np.linalg.norm(points - self.center, axis=1) - self.radius

    def crossings(self, origin: Array, direction: Array) -> Array:
        """Two or none; one where the line touches."""
        o, d = _long(origin) - _long(self.center), _long(direction)
        return _two_roots(d @ d, d @ o, o @ o - _long(self.radius) ** 2)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """Circular cylinder around the line through ``point`` along the unit vector ``axis``, both (3,)."""

    point: Array
    axis: Array
    radius: float

    def nearest(self, points: Array) -> Array:
        """Along the radius; of the axis some point."""
        along = (points - self.point) @ self.axis
        return self.point + along[:, None] * self.axis + self.radius * self.normal(points)

    def normal(self, points: Array) -> Array:
        """Away from the axis."""
        return _radial(points - self.point, self.axis)[0]

    def height(self, points: Array) -> Array:
        """Distance from the axis less the radius."""
        return _radial(points - self.point, self.axis)[1] - self.radius

    def crossings(self, origin: Array, direction: Array) -> Array:
        """Two or none; none of a line along the axis."""
        o, d, axis = _long(origin) - _long(self.point), _long(direction), _long(self.axis)
        o, d = o - (o @ axis) * axis, d - (d @ axis) * axis
        return _two_roots(d @ d, d @ o, o @ o - _long(self.radius) ** 2)


@dataclass(frozen=True, eq=False)
class Cone:
    """Circular cone from its ``apex`` along the unit vector ``axis``, both (3,); one nappe."""

    apex: Array
    axis: Array
    half_angle_rad: float

    def nearest(self, points: Array) -> Array:
        """Foot of the perpendicular, or the apex."""
        relative = points - self.apex
        outward, across = _radial(relative, self.axis)
        sine, cosine = math.sin(self.half_angle_rad), math.cos(self.half_angle_rad)
        along_edge = np.maximum(across * sine + (relative @ self.axis) * cosine, 0.0)
        return self.apex + along_edge[:, None] * (cosine * self.axis + sine * outward)

    def normal(self, points: Array) -> Array:
        """Away from the axis, leaning against its direction."""
        outward, _ = _radial(points - self.apex, self.axis)
        return math.cos(self.half_angle_rad) * outward - math.sin(self.half_angle_rad) * self.axis

    def height(self, points: Array) -> Array:
        """Distance from the edge through the point's own half plane."""
        relative = points - self.apex
        _, across = _radial(relative, self.axis)
        return across * math.cos(self.half_angle_rad) - (relative @ self.axis) * math.sin(self.half_angle_rad)

    def crossings(self, origin: Array, direction: Array) -> Array:
        """Two, one or none; the other nappe does not count."""
        o, d, axis = _long(origin) - _long(self.apex), _long(direction), _long(self.axis)
        cosine2 = np.cos(_long(self.half_angle_rad)) ** 2
        oa, da = o @ axis, d @ axis
        t = _two_roots(da * da - cosine2 * (d @ d), da * oa - cosine2 * (o @ d), oa * oa - cosine2 * (o @ o))
        return t[float(oa) + t * float(da) >= 0.0]


@dataclass(frozen=True, eq=False)
class Torus:
    """Points at ``minor`` from the circle of radius ``major`` around ``center`` across the unit vector ``axis``.

    Of a torus that crosses itself, minor above major, only the outer part counts.
    """

    center: Array
    axis: Array
    major: float
    minor: float

    def nearest(self, points: Array) -> Array:
        """From the nearest point of the core circle."""
        core = self.center + self.major * _radial(points - self.center, self.axis)[0]
        return core + self.minor * _unit(points - core, self.axis)

    def normal(self, points: Array) -> Array:
        """Away from the core circle."""
        core = self.center + self.major * _radial(points - self.center, self.axis)[0]
        return _unit(points - core, self.axis)

    def height(self, points: Array) -> Array:
        """Distance from the core circle less the minor radius."""
        relative = points - self.center
        _, across = _radial(relative, self.axis)
        return np.hypot(across - self.major, relative @ self.axis) - self.minor

    def crossings(self, origin: Array, direction: Array) -> Array:
        """Four, two or none."""
        o, d, axis = _long(origin) - _long(self.center), _long(direction), _long(self.axis)
        start = -(o @ d)
        o = o + start * d
        major2, minor2 = _long(self.major) ** 2, _long(self.minor) ** 2
        oa, da, rest = o @ axis, d @ axis, o @ o - major2 - minor2
        coefficients = np.array(
            [
                np.longdouble(1),
                np.longdouble(0),
                2 * rest + 4 * major2 * da * da,
                8 * major2 * oa * da,
                rest * rest + 4 * major2 * (oa * oa - minor2),
            ]
        )
        t = np.array([_polished(coefficients, root) for root in _real_roots(coefficients)], np.longdouble)
        points = np.asarray(o + t[:, None] * d, np.float64)
        _, across = _radial(points, self.axis)
        outer = np.abs(np.hypot(across - self.major, points @ self.axis) - self.minor) < 1e-6 * self.minor
        return np.sort((t + start)[outer].astype(np.float64))


Surface = Plane | Sphere | Cylinder | Cone | Torus | BSpline


def exact_surface(record: ExactSurface) -> Surface:
    """The surface that a record of a scene describes.

    Parameters
    ----------
    record : ExactSurface
        Of any type but ``other``.

    Raises
    ------
    ValueError
        If the record only names its surface.
    """
    if isinstance(record, PlaneSurface):
        return Plane(np.array(record.point_mm), _unit_axis(record.normal))
    if isinstance(record, SphereSurface):
        return Sphere(np.array(record.center_mm), record.radius_mm)
    if isinstance(record, CylinderSurface):
        return Cylinder(np.array(record.point_mm), _unit_axis(record.axis), record.radius_mm)
    if isinstance(record, ConeSurface):
        return Cone(np.array(record.apex_mm), _unit_axis(record.axis), math.radians(record.half_angle_deg))
    if isinstance(record, TorusSurface):
        axis = _unit_axis(record.axis)
        return Torus(np.array(record.center_mm), axis, record.major_radius_mm, record.minor_radius_mm)
    if isinstance(record, BSplineSurface):
        return bspline_of(record)
    raise ValueError(f"a surface of type '{record.type}' has no exact form")


def _long(value: Any) -> Any:
    return np.asarray(value, np.longdouble)


def _unit_axis(vector: tuple[float, float, float]) -> Array:
    axis = np.array(vector) / math.hypot(*vector)
    return axis / math.hypot(*axis)


def _unit(vectors: Array, instead: Array) -> Array:
    """Vectors brought to length one; those without a length replaced."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1.0), instead)


def _radial(relative: Array, axis: Array) -> tuple[Array, Array]:
    """Unit vectors away from an axis through the origin, (n, 3), and distances from it, (n,)."""
    across = relative - (relative @ axis)[:, None] * axis
    across -= (across @ axis)[:, None] * axis
    least = np.zeros(3)
    least[np.argmin(np.abs(axis))] = 1.0
    some = np.cross(axis, least)
    return _unit(across, some / np.linalg.norm(some)), np.linalg.norm(across, axis=1)


def _two_roots(a: Any, b: Any, c: Any) -> Array:
    """Real roots, rising, of a t² + 2 b t + c."""
    if a == 0:
        return np.zeros(0) if b == 0 else np.array([float(-c / (2 * b))])
    square = b * b - a * c
    if square < 0:
        return np.zeros(0)
    q = -(b + np.copysign(np.sqrt(square), b))
    return np.sort(np.array([q / a, c / q if q != 0 else q / a], np.float64))


def _real_roots(coefficients: NDArray[np.longdouble]) -> Array:
    roots = np.roots(coefficients.astype(np.float64))
    scale = float(np.abs(roots).max())
    return np.sort(roots.real[np.abs(roots.imag) < 1e-7 * scale])


def _polished(coefficients: NDArray[np.longdouble], root: float) -> Any:
    """A root after steps of Newton in extended precision."""
    t, slope = _long(root), np.polyder(coefficients)
    for _ in range(8):
        steepness = np.polyval(slope, t)
        if steepness == 0:
            break
        t = t - np.polyval(coefficients, t) / steepness
    return t
