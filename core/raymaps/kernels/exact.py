# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a line crosses an exact surface, its normal there, and the nearest point of it.

Lengths are in frame units, directions of length one. Each surface is written around a point V of it near its faces, in
local axes with x along its own normal (cone: away from the axis) at V and z along its axis; see
`raymaps.exact.tables` for the numbers. A line q + t d crosses a quadric where

    A t² + 2 B t + C = 0,    B + A t = ± sqrt(B² - A C) is the cosine to the normal, but for a positive factor.

So the sign of the root is the orientation that is asked for. C has no cancellation near V, however large the radius,
and B² - A C is written as a difference of two squares, so a line that grazes loses nothing. From a point that stands on
the surface C is zero: the other root is -2 B / A.
"""

from __future__ import annotations

import math

from raymaps.jit import kernel
from raymaps.kernels.exact_axes import from_axes, to_axes
from raymaps.kernels.exact_patches import height_over_patches, meet_patches, normal_of_patches, settle_on_patches
from raymaps.kernels.exact_revolution import (
    height_over_revolution,
    meet_revolution,
    normal_of_revolution,
    settle_on_revolution,
)
from raymaps.kernels.exact_torus import torus_root
from raymaps.kinds import ExactKind

__all__ = ["height", "meet", "normal", "settle"]

_PLANE, _SPHERE, _CYLINDER = int(ExactKind.PLANE), int(ExactKind.SPHERE), int(ExactKind.CYLINDER)
_CONE, _PATCHES, _REVOLUTION = int(ExactKind.CONE), int(ExactKind.PATCHES), int(ExactKind.REVOLUTION)

#: So far beyond a cone's apex, in distances of V from it, the other nappe is not told from this one.
_AT_APEX = 2.0**-40
#: No crossing.
_NONE = (math.nan, 0.0, 0.0, 0.0)


@kernel
def meet(exact, surface, triangle, guess, towards, stands_on, px, py, pz, dx, dy, dz):
    """Crossing of the line p + t d with a surface, of those with an orientation the nearest to a guess.

    Parameters
    ----------
    exact : ExactTables
    surface : int
        Index of the exact surface.
    triangle : int
        Triangle of the bounding mesh that the line meets; where B-splines are searched first.
    guess : float
        About where the crossing is expected.
    towards : int
        +1: d goes along the surface's own normal; -1: against it.
    stands_on : bool
        Whether p lies on this surface: the crossing at t = 0 is none then.
    px, py, pz, dx, dy, dz : float

    Returns
    -------
    (t, nx, ny, nz): distance and own unit normal there; t is NaN if there is no such crossing.
    """
    number, kind = exact.number[surface], exact.kind[surface]
    if kind == _REVOLUTION:
        return meet_revolution(exact, surface, triangle, guess, towards, stands_on, px, py, pz, dx, dy, dz)
    if kind == _PATCHES:
        return meet_patches(exact, surface, triangle, guess, towards, stands_on, px, py, pz, dx, dy, dz)
    qx, qy, qz = to_axes(number, px - number[0], py - number[1], pz - number[2])
    ex, ey, ez = to_axes(number, dx, dy, dz)
    if kind == _PLANE:
        t, nx, ny, nz = _meet_plane(qx, ex, towards, stands_on)
    elif kind == _SPHERE:
        t, nx, ny, nz = _meet_sphere(number[12], qx, qy, qz, ex, ey, ez, towards, stands_on)
    elif kind == _CYLINDER:
        t, nx, ny, nz = _meet_cylinder(number[12], qx, qy, qz, ex, ey, ez, towards, stands_on)
    elif kind == _CONE:
        t, nx, ny, nz = _meet_cone(number[12], number[13], number[14], qx, qy, qz, ex, ey, ez, towards, stands_on)
    else:
        t = torus_root(number[12], number[13], qx, qy, qz, ex, ey, ez, guess, towards, stands_on)
        nx, ny, nz = _torus_normal(number[12], qx + t * ex, qy + t * ey, qz + t * ez)
    if not math.isfinite(t):
        return _NONE
    nx, ny, nz = from_axes(number, nx, ny, nz)
    return t, nx, ny, nz


@kernel
def height(exact, surface, x, y, z, triangle=-1):
    """Signed distance of a point along the surface's own normal; negative behind it.

    On a B-spline a triangle near the point tells where to search; without one all patches are looked at.
    """
    number, kind = exact.number[surface], exact.kind[surface]
    if kind == _REVOLUTION:
        return height_over_revolution(exact, surface, triangle, x, y, z)
    if kind == _PATCHES:
        return height_over_patches(exact, surface, triangle, x, y, z)
    qx, qy, qz = to_axes(number, x - number[0], y - number[1], z - number[2])
    if kind == _PLANE:
        return qx
    if kind == _SPHERE:
        return _round_height(number[12], qx, qy, qz)
    if kind == _CYLINDER:
        return _round_height(number[12], qx, qy, 0.0)
    if kind == _CONE:
        return _cone_height(number[12], number[13], number[14], qx, qy, qz)
    return math.hypot(math.hypot(qx, qy) - number[12], qz) - number[13]


@kernel
def normal(exact, surface, x, y, z, triangle=-1):
    """The surface's own unit normal at a point on it or next to it; the triangle is as for `height`."""
    number, kind = exact.number[surface], exact.kind[surface]
    if kind == _REVOLUTION:
        return normal_of_revolution(exact, surface, triangle, x, y, z)
    if kind == _PATCHES:
        return normal_of_patches(exact, surface, triangle, x, y, z)
    qx, qy, qz = to_axes(number, x - number[0], y - number[1], z - number[2])
    if kind == _PLANE:
        nx, ny, nz = 1.0, 0.0, 0.0
    elif kind == _SPHERE:
        nx, ny, nz = _unit(1.0 + number[12] * qx, number[12] * qy, number[12] * qz)
    elif kind == _CYLINDER:
        nx, ny, nz = _unit(1.0 + number[12] * qx, number[12] * qy, 0.0)
    elif kind == _CONE:
        ux, uy, _ = _unit(1.0 + number[12] * qx, number[12] * qy, 0.0)
        nx, ny, nz = number[14] * ux, number[14] * uy, -number[13]
    else:
        nx, ny, nz = _torus_normal(number[12], qx, qy, qz)
    return from_axes(number, nx, ny, nz)


@kernel
def settle(exact, surface, triangle, x, y, z):
    """Nearest point of the surface to a point next to it, three numbers."""
    if exact.kind[surface] == _REVOLUTION:
        return settle_on_revolution(exact, surface, triangle, x, y, z)
    if exact.kind[surface] == _PATCHES:
        return settle_on_patches(exact, surface, triangle, x, y, z)
    above = height(exact, surface, x, y, z)
    nx, ny, nz = normal(exact, surface, x, y, z)
    return x - above * nx, y - above * ny, z - above * nz


@kernel
def _unit(x, y, z):
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return 1.0, 0.0, 0.0
    return x / length, y / length, z / length


@kernel
def _root(a, b, c, root, towards, stands_on):
    """The t with a t² + 2 b t + c = 0 and b + a t = towards · root; inf or NaN if there is none.

    References
    ----------
    N. J. Higham: Accuracy and Stability of Numerical Algorithms, 2nd edition, section 1.8.
    """
    if stands_on:
        return -2.0 * b / a if towards * b < 0.0 else math.nan
    if towards * b > 0.0 and root > 0.0:
        return -c / (b + towards * root)
    return (towards * root - b) / a


@kernel
def _meet_plane(qx, ex, towards, stands_on):
    if stands_on or towards * ex <= 0.0:
        return _NONE
    return -qx / ex, 1.0, 0.0, 0.0


@kernel
def _meet_sphere(curvature, qx, qy, qz, ex, ey, ez, towards, stands_on):
    mx, my, mz = 1.0 + curvature * qx, curvature * qy, curvature * qz  # from the centre, in radii
    a = ex * ex + ey * ey + ez * ez
    b = ex * mx + ey * my + ez * mz
    kx, ky, kz = ey * mz - ez * my, ez * mx - ex * mz, ex * my - ey * mx
    miss, reach = math.sqrt(kx * kx + ky * ky + kz * kz), math.sqrt(a)
    if not miss <= reach and not stands_on:
        return _NONE
    c = 2.0 * qx + curvature * (qx * qx + qy * qy + qz * qz)
    root = math.sqrt(max((reach - miss) * (reach + miss), 0.0))
    t = _root(curvature * a, b, c, root, towards, stands_on)
    s = curvature * t
    nx, ny, nz = _unit(mx + s * ex, my + s * ey, mz + s * ez)
    return t, nx, ny, nz


@kernel
def _meet_cylinder(curvature, qx, qy, qz, ex, ey, ez, towards, stands_on):
    mx, my = 1.0 + curvature * qx, curvature * qy  # from the axis, in radii
    a = ex * ex + ey * ey
    b = ex * mx + ey * my
    miss, reach = abs(ex * my - ey * mx), math.sqrt(a)
    if not miss <= reach and not stands_on:
        return _NONE
    c = 2.0 * qx + curvature * (qx * qx + qy * qy)
    root = math.sqrt(max((reach - miss) * (reach + miss), 0.0))
    t = _root(curvature * a, b, c, root, towards, stands_on)
    s = curvature * t
    nx, ny, nz = _unit(mx + s * ex, my + s * ey, 0.0)
    return t, nx, ny, nz


@kernel
def _meet_cone(curvature, sine, cosine, qx, qy, qz, ex, ey, ez, towards, stands_on):
    """Curvature is one over the distance of V from the axis; sine and cosine are those of the half angle."""
    mx, my = 1.0 + curvature * qx, curvature * qy  # from the axis, in distances of V
    m = cosine + curvature * sine * qz  # along the axis from the apex, so scaled, times the sine
    a = curvature / cosine * (cosine * cosine * (ex * ex + ey * ey) - sine * sine * ez * ez)
    b = cosine * (ex * mx + ey * my) - m / cosine * sine * ez
    kx, ky = sine * mx * ez - m * ex, sine * my * ez - m * ey
    miss, reach = cosine * abs(mx * ey - my * ex), math.sqrt(kx * kx + ky * ky)
    if not miss <= reach and not stands_on and a >= 0.0:  # a line steeper than the cone crosses it for sure
        return _NONE
    c = 2.0 * (cosine * qx - sine * qz)
    c += curvature / cosine * (cosine * cosine * (qx * qx + qy * qy) - sine * sine * qz * qz)
    root = math.sqrt(max((reach - miss) * (reach + miss), 0.0))
    t = _root(a, b, c, root, towards, stands_on)
    s = curvature * t
    if not m + s * sine * ez >= -_AT_APEX:  # the other nappe
        return _NONE
    ux, uy, _ = _unit(mx + s * ex, my + s * ey, 0.0)
    return t, cosine * ux, cosine * uy, -sine


@kernel
def _round_height(curvature, qx, qy, qz):
    """Of a sphere; of a cylinder with qz = 0."""
    mx, my, mz = 1.0 + curvature * qx, curvature * qy, curvature * qz
    c = 2.0 * qx + curvature * (qx * qx + qy * qy + qz * qz)
    return c / (1.0 + math.sqrt(mx * mx + my * my + mz * mz))


@kernel
def _cone_height(curvature, sine, cosine, qx, qy, qz):
    across = math.hypot(1.0 + curvature * qx, curvature * qy)
    along = cosine + curvature * sine * qz
    if along <= 0.0:
        return (cosine * across - along) / curvature
    c = 2.0 * (cosine * qx - sine * qz)
    c += curvature / cosine * (cosine * cosine * (qx * qx + qy * qy) - sine * sine * qz * qz)
    return cosine * c / (cosine * across + along)


@kernel
def _torus_normal(major, qx, qy, qz):
    across = math.hypot(qx, qy)
    ux, uy = (qx / across, qy / across) if across > 0.0 else (1.0, 0.0)
    return _unit(qx - major * ux, qy - major * uy, qz)
