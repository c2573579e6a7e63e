# SPDX-License-Identifier: LGPL-2.1-or-later
"""A sequential ray trace of centred lenses in float64, written from the textbook's formulas.

It shares nothing with the program: faces are given by their formula, and rays meet them in the order in which they are
listed. The axis is z, and light comes along +z.

References
----------
W. Welford: Aberrations of Optical Systems, 1986, chapter 4 (finite rays) and section 3.2 (paraxial rays).
G. Spencer, M. Murty: General ray-tracing procedure, J. Opt. Soc. Am. 52 (1962), pp. 672-678.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

#: Steps of Newton's iteration along a ray; it has converged to rounding after five or six.
NEWTON_STEPS = 12


class LensFace(NamedTuple):
    """z = vertex + c r² / (1 + sqrt(1 - (1 + k) c² r²)) + even[0] r⁴ + even[1] r⁶ + ...

    A plane has curvature 0; k is 0 for a sphere, -1 for a paraboloid, less for a hyperboloid.
    """

    vertex_mm: float
    curvature_per_mm: float = 0.0
    conic: float = 0.0
    even: tuple[float, ...] = ()

    def sag_mm(self, r2: Float) -> Float:
        """Height over the plane through the vertex at the squares of distances from the axis."""
        c, k = self.curvature_per_mm, self.conic
        return c * r2 / (1 + np.sqrt(1 - (1 + k) * c * c * r2)) + r2 * self._over_r2(r2)

    def slope(self, r2: Float) -> Float:
        """Derivative of the sag by r, divided by r."""
        c, k = self.curvature_per_mm, self.conic
        even = sum((2 * i + 4) * a * r2 ** (i + 1) for i, a in enumerate(self.even))
        return c / np.sqrt(1 - (1 + k) * c * c * r2) + even

    def _over_r2(self, r2: Float) -> Float | float:
        return sum(a * r2 ** (i + 1) for i, a in enumerate(self.even))


class RaysAt(NamedTuple):
    """Rays after a face; NaN where a ray misses it or is totally reflected."""

    points_mm: Float  # (n_rays, 3) where they met the face
    directions: Float  # (n_rays, 3) in which they go on


def trace(faces: Sequence[LensFace], indices: Sequence[float], points_mm: Float, directions: Float) -> list[RaysAt]:
    """Rays after each face.

    Parameters
    ----------
    faces : in the order in which light meets them
    indices : refractive indices before the first face and after each, so one more than faces
        As is the custom, an index of the other sign says that the face reflects.
    points_mm, directions : (n_rays, 3) float64
        Anywhere on the rays, and unit vectors.
    """
    found = []
    for face, before, after in zip(faces, indices, indices[1:], strict=False):
        with np.errstate(invalid="ignore"):
            points_mm = meet(face, points_mm, directions)
            normals = normals_at(face, points_mm)
            if before * after < 0:
                directions = reflect(directions, normals)
            else:
                directions = refract(directions, normals, abs(before), abs(after))
        found.append(RaysAt(points_mm, directions))
    return found


def meet(face: LensFace, points_mm: Float, directions: Float) -> Float:
    """Where rays meet a face, (n_rays, 3).

    Rays are carried to the plane through the vertex, from there to the conicoid in closed form [Welford, chapter 4],
    and to the surface by Newton's method along the ray [Spencer and Murty].
    """
    c, k = face.curvature_per_mm, face.conic
    along = directions[:, 2]
    # on the plane through the vertex, from which the rest of the way is short: nothing is lost by cancellation
    start = points_mm + ((face.vertex_mm - points_mm[:, 2]) / along)[:, None] * directions
    start[:, 2] = 0.0
    x, y = start[:, 0], start[:, 1]
    # c (x² + y² + (1 + k) z²) = 2 z, put in x + L t, y + M t, N t: the root that is 0 where F is
    f = c * (x * x + y * y)
    g = along - c * (directions[:, 0] * x + directions[:, 1] * y)
    root = np.sqrt(g * g - c * f * (1 + k * along * along))
    distance = f / (g + np.copysign(root, along))
    if face.even:
        for _ in range(NEWTON_STEPS):
            at = start + distance[:, None] * directions
            r2 = at[:, 0] ** 2 + at[:, 1] ** 2
            slope = face.slope(r2)
            rate = along - slope * (at[:, 0] * directions[:, 0] + at[:, 1] * directions[:, 1])
            distance = distance - (at[:, 2] - face.sag_mm(r2)) / rate
    return start + distance[:, None] * directions + (0.0, 0.0, face.vertex_mm)


def normals_at(face: LensFace, points_mm: Float) -> Float:
    """Unit normals with positive z, (n, 3): the gradient of z - sag."""
    slope = face.slope(points_mm[:, 0] ** 2 + points_mm[:, 1] ** 2)
    normals = np.stack([-slope * points_mm[:, 0], -slope * points_mm[:, 1], np.ones_like(slope)], axis=1)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def refract(directions: Float, normals: Float, n: float, n_after: float) -> Float:
    """Snell's law as vectors: n' d' = n d + (n' cos I' - n cos I) N [Welford, chapter 4]; NaN if totally reflected."""
    cos_i = np.einsum("ij,ij->i", directions, normals)
    cos_t = np.copysign(np.sqrt(1 - (n / n_after) ** 2 * (1 - cos_i**2)), cos_i)
    return (n * directions + (n_after * cos_t - n * cos_i)[:, None] * normals) / n_after


def reflect(directions: Float, normals: Float) -> Float:
    """d' = d - 2 cos I N."""
    return directions - 2 * np.einsum("ij,ij->i", directions, normals)[:, None] * normals


def at_plane(rays: RaysAt, z_mm: float) -> Float:
    """Where rays meet a plane across the axis, (n_rays, 2)."""
    distance = (z_mm - rays.points_mm[:, 2]) / rays.directions[:, 2]
    return rays.points_mm[:, :2] + distance[:, None] * rays.directions[:, :2]


def paraxial_focus(faces: Sequence[LensFace], indices: Sequence[float]) -> tuple[float, float]:
    """Focal length, and z of the focus, of light that comes along the axis; both in mm [Welford, section 3.2]."""
    height, slope, vertex = 1.0, 0.0, faces[0].vertex_mm
    for face, before, after in zip(faces, indices, indices[1:], strict=False):
        height += slope * (face.vertex_mm - vertex)
        vertex = face.vertex_mm
        slope = (before * slope - height * (after - before) * face.curvature_per_mm) / after
    return (-1.0 / slope, vertex - height / slope) if slope else (math.inf, math.inf)
