# SPDX-License-Identifier: LGPL-2.1-or-later
"""Exact surfaces as the flat arrays that `raymaps.kernels.exact` reads.

The numbers of a surface, lengths in frame units. V is a point of it near its faces; its local axes have x along its own
normal at V (cone: away from the axis) and z along its axis.

    0:3   V; of a torus its centre
    3:6   x axis, 6:9 y axis, 9:12 z axis
    12    sphere, cylinder: one over the radius; cone: one over the distance of V from the axis; torus: major radius
    13    cone: sine of the half angle; torus: minor radius
    14    cone: cosine of the half angle

Of a B-spline they are angles per unit of u around the poles at its lower and upper border of v (0: none), and the sign
of its own normal against du x dv. A B-spline that is a surface of revolution is lowered as its profile instead: one
patch along u, of degree 0, with (radius, 0, height) along v. Its numbers are

    0:12  point of the axis, and axes as above
    12:14 whether the profile begins, and ends, on the axis
    14    sign of its own normal against (slope of the height, - slope of the radius)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.exact.bspline import BSpline
from raymaps.exact.faces import ExactFaces
from raymaps.exact.revolution import Revolution, revolution_of
from raymaps.exact.surfaces import Cone, Cylinder, Plane, Sphere, Surface, Torus
from raymaps.frame import Frame
from raymaps.geometry import BodyMesh
from raymaps.kinds import ExactKind

__all__ = ["ExactTables", "lower_exact"]

Array = NDArray[np.float64]

#: Surfaces that differ by less, in units of the scene, are one.
SAME = 1e-9
N_NUMBERS, N_SHEET = 16, 11
#: Weights that differ by less from each other are equal.
ROUNDING = 1e-15
#: Surfaces of revolution that reach farther from their axis, in units of the scene, stay patches: their radii would
#: have fewer digits than places of the scene.
FAR_FROM_AXIS = 8.0
KINDS: dict[type, ExactKind] = {
    Plane: ExactKind.PLANE,
    Sphere: ExactKind.SPHERE,
    Cylinder: ExactKind.CYLINDER,
    Cone: ExactKind.CONE,
    Torus: ExactKind.TORUS,
    BSpline: ExactKind.PATCHES,
    Revolution: ExactKind.REVOLUTION,
}
Lowered = Surface | Revolution


class ExactTables(NamedTuple):
    """Exact surfaces for kernels; lengths in frame units."""

    face: NDArray[np.int32]  # (n_faces,) exact surface of each face, -1 facets; equal surfaces are one
    outward: NDArray[np.float64]  # (n_faces,) outward normal of the body = outward * own normal of the surface
    kind: NDArray[np.uint8]  # (n_exact,) ExactKind
    number: NDArray[np.float64]  # (n_exact, 16) see above
    sheet: NDArray[np.int32]  # (n_exact, 11) of B-splines: first patch, numbers of patches along u and v, degrees of u
    # and v, first breaks of u and v, first coefficient, whether it wraps along u and v, whether weights differ
    breaks: NDArray[np.float64]  # (n_breaks,) parameters at the borders of patches, from 0
    patch: NDArray[np.float64]  # (n_patches, 7) centre; reference and one over the width of its parameters u, v
    coefficient: NDArray[np.float64]  # (n_coefficients, 4) w (x, y, z) from the centre and w, u slowest
    guess_row: NDArray[np.int32]  # (n_triangles,) row of a B-spline's triangle, -1 none
    guess_uv: NDArray[np.float64]  # (n_rows, 3 corners, 2) parameters of the corners
    guess_sides: NDArray[np.float64]  # (n_rows, 3, 3) first corner, and vectors whose dot product with the way from it
    # to a point of the triangle is the point's share of the side to the second and to the third corner
    guess_longest: NDArray[np.float64]  # (n_rows,) longest side


def lower_exact(meshes: Sequence[BodyMesh], found: ExactFaces, frame: Frame, bounding_corners: Array) -> ExactTables:
    """Exact surfaces to arrays.

    Parameters
    ----------
    meshes : bodies
    found : see `raymaps.exact.faces.exact_faces`
    frame : Frame
    bounding_corners : (n_triangles, 3 corners, 3) float64
        Bounding mesh of all bodies, mm.
    """
    shared = _share(found.surfaces, frame)
    vertices = [mesh.corners_mm[mesh.triangle_face == face] for mesh in meshes for face in range(len(mesh.face_names))]
    first = {int(surface): face for face, surface in reversed(list(enumerate(shared))) if surface >= 0}
    chosen = [(found.surfaces[face], vertices[face].reshape(-1, 3)) for _, face in sorted(first.items())]
    surfaces = [(surface, points) for surface, points in chosen if surface is not None]
    outward = [
        1.0 if surface < 0 else _outward(surfaces[surface][0], corners)
        for surface, corners in zip(shared, vertices, strict=True)
    ]
    forms = [(_revolved(surface, frame), points) for surface, points in surfaces]
    sheets = _Sheets(frame)
    for form, _ in forms:
        sheets.add(form)
    return ExactTables(
        face=np.array(shared, np.int32),
        outward=np.array(outward, np.float64),
        kind=np.array([KINDS[type(form)] for form, _ in forms], np.uint8),
        number=np.array([_numbers(form, points, frame) for form, points in forms]).reshape(-1, N_NUMBERS),
        **sheets.arrays(),
        **_guesses(
            vertices, [None if s < 0 else (surfaces[s][0], forms[s][0]) for s in shared], frame, bounding_corners
        ),
    )


def _revolved(surface: Surface, frame: Frame) -> Lowered:
    """A B-spline as its profile if it is a surface of revolution near enough to its axis; else the surface."""
    revolution = revolution_of(surface) if isinstance(surface, BSpline) else None
    if revolution is None or revolution.farthest_mm > FAR_FROM_AXIS * frame.unit_mm:
        return surface
    return revolution


class _Sheets:
    """Patches of B-splines and profiles, gathered."""

    def __init__(self, frame: Frame):
        self._frame = frame
        self._sheet: list[list[int]] = []
        self._breaks, self._patch, self._coefficient = np.zeros(0), np.zeros((0, 7)), np.zeros((0, 4))

    def add(self, form: Lowered) -> None:
        """Add the patches of a surface; none of one that has a closed form."""
        if isinstance(form, Revolution):
            n = len(form.width)
            center = np.zeros((1, n, 3))
            center[0, :, [0, 2]] = form.center.T / self._frame.unit_mm
            terms = np.zeros((1, n, 1, form.coefficient.shape[1], 4))
            terms[0, :, 0][..., [0, 2, 3]] = form.coefficient
            ways = [(np.array([0.0, 1.0]), np.zeros(1), np.ones(1)), (form.breaks, form.reference, form.width)]
            self._add(center, terms, ways, (True, form.wraps))
        elif isinstance(form, BSpline):
            ways = list(zip(form.breaks, form.reference, form.width, strict=True))
            self._add(self._frame.to_units(form.center), form.coefficient.copy(), ways, form.wraps)
        else:
            self._sheet.append([0] * N_SHEET)

    def _add(self, center: Array, terms: Array, ways: Sequence[tuple[Array, ...]], wraps: tuple[bool, bool]) -> None:
        """Centres (n_u, n_v, 3) in frame units, coefficients in mm; breaks, references and widths along u and v."""
        (breaks_u, reference_u, width_u), (breaks_v, reference_v, width_v) = ways
        n_u, n_v, *orders = terms.shape[:4]
        constant = terms[:, :, :1, :1, 3:]
        is_rational = bool((np.abs(terms[..., 3:]).sum(axis=(2, 3)) > constant[:, :, 0, 0] * (1 + ROUNDING)).any())
        if not is_rational:
            terms /= constant
        first = len(self._breaks)
        starts = [first, first + n_u + 1, len(self._coefficient)]
        self._sheet.append(
            [len(self._patch), n_u, n_v, orders[0] - 1, orders[1] - 1, *starts, *map(int, (*wraps, is_rational))]
        )
        patch = np.zeros((n_u, n_v, 7))
        patch[..., :3] = center
        patch[..., 3], patch[..., 4] = reference_u[:, None], reference_v
        patch[..., 5], patch[..., 6] = 1 / width_u[:, None], 1 / width_v
        terms[..., :3] /= self._frame.unit_mm
        self._breaks = np.concatenate([self._breaks, breaks_u, breaks_v])
        self._patch = np.concatenate([self._patch, patch.reshape(-1, 7)])
        self._coefficient = np.concatenate([self._coefficient, terms.reshape(-1, 4)])

    def arrays(self) -> dict[str, NDArray[Any]]:
        """By the names of `ExactTables`."""
        return {
            "sheet": np.array(self._sheet, np.int32).reshape(-1, N_SHEET),
            "breaks": self._breaks,
            "patch": self._patch,
            "coefficient": self._coefficient,
        }


def _guesses(
    faces: Sequence[Array],
    surfaces: Sequence[tuple[Surface, Lowered] | None],
    frame: Frame,
    bounding_corners: Array,
) -> dict[str, NDArray[Any]]:
    """Parameters of the corners of all triangles on B-splines.

    ``faces`` are the corners, (n, 3, 3), of each face's triangles on the surface, in the order of all triangles.
    """
    row = np.full(sum(len(corners) for corners in faces), -1, np.int32)
    parameters, start = [np.zeros((0, 3, 2))], 0
    for corners, on_face in zip(faces, surfaces, strict=True):
        surface, form = on_face or (None, None)
        if isinstance(surface, BSpline):
            row[start : start + len(corners)] = 0
            uv = surface.corner_parameters(corners)
            is_swapped = isinstance(form, Revolution) and form.along == 0
            parameters.append(uv[..., ::-1] if is_swapped else uv)
        start += len(corners)
    on = row == 0
    row[on] = np.arange(on.sum())
    return {
        "guess_row": row,
        "guess_uv": np.concatenate(parameters),
        **_sides(frame.to_units(bounding_corners[on]).reshape(-1, 3, 3)),
    }


def _sides(corners: Array) -> dict[str, NDArray[Any]]:
    """Of triangles, (n, 3 corners, 3); those without an area have no shares."""
    first, side = corners[:, :1], corners[:, 1:] - corners[:, :1]
    square = np.einsum("nij,nkj->nik", side, side)
    determinant = square[:, 0, 0] * square[:, 1, 1] - square[:, 0, 1] ** 2
    other = np.stack([square[:, 1, 1], -square[:, 0, 1], -square[:, 0, 1], square[:, 0, 0]], axis=1).reshape(-1, 2, 2)
    inverse = other / np.where(determinant > 0, determinant, np.inf)[:, None, None]
    return {
        "guess_sides": np.concatenate([first, inverse @ side], axis=1),
        "guess_longest": np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0.0),
    }


def _share(surfaces: Sequence[Surface | None], frame: Frame) -> list[int]:
    """Index of each face's surface, -1 for none; surfaces that are the same to `SAME` have one."""
    # B-splines by what their poles say, the others by their heights at some points
    probes = frame.to_mm(np.random.default_rng(0).uniform(-1, 1, (16, 3)))
    known: dict[tuple[type, int], list[tuple[int, Array]]] = {}
    result, n = [], 0
    for surface in surfaces:
        if surface is None:
            result.append(-1)
            continue
        seen = (surface.told() if isinstance(surface, BSpline) else surface.height(probes)) / frame.unit_mm
        if isinstance(surface, Plane):
            seen = seen * np.copysign(1.0, seen[np.argmax(np.abs(seen))])  # either side may be in front
        cell = int(np.floor(seen[0] / (16 * SAME)))
        near = [other for c in (cell - 1, cell, cell + 1) for other in known.get((type(surface), c), ())]
        same = [index for index, other in near if len(other) == len(seen) and np.abs(other - seen).max() < SAME]
        if not same:
            same = [n]
            n += 1
            known.setdefault((type(surface), cell), []).append((same[0], seen))
        result.append(same[0])
    return result


def _outward(surface: Surface | None, corners: Array) -> float:
    """Whether triangles, (n, 3, 3), look along the surface's own normal (1) or against it (-1)."""
    if surface is None:
        return 1.0
    corners = corners[:: 1 + len(corners) // 500]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    own = np.nan_to_num(surface.normal(corners.reshape(-1, 3))).reshape(-1, 3, 3).sum(axis=1)
    return -1.0 if float(np.einsum("ij,ij->", area, own)) < 0 else 1.0


def _numbers(surface: Lowered, points: Array, frame: Frame) -> Array:
    """The row of a surface in ``ExactTables.number``; ``points`` (n, 3) are vertices of one of its faces.

    Points count from the frame's centre, so that a scene far from the origin has as many digits as one about it.
    """
    unit, middle = frame.unit_mm, frame.center_mm
    x, y, z = np.eye(3)
    shape: tuple[float, ...] = ()
    points = points - middle
    near = points.mean(axis=0)
    if isinstance(surface, Plane):
        x = surface.own_normal
        near, (y, z) = near - ((near - (surface.point - middle)) @ x) * x, _across(x)
    elif isinstance(surface, Sphere):
        center = surface.center - middle
        x = replace(surface, center=center).normal(near[None])[0]
        near, (y, z) = center + surface.radius * x, _across(x)
        shape = (unit / surface.radius,)
    elif isinstance(surface, Cylinder):
        surface = replace(surface, point=surface.point - middle)
        x, z = surface.normal(near[None])[0], surface.axis
        near, y = surface.nearest(near[None])[0], np.cross(z, x)
        shape = (unit / surface.radius,)
    elif isinstance(surface, Cone):
        surface = replace(surface, apex=surface.apex - middle)
        sine, cosine = np.sin(surface.half_angle_rad), np.cos(surface.half_angle_rad)
        along = (points - surface.apex) @ surface.axis
        far = points[[np.argmax(along)]]  # any but the apex
        z = surface.axis
        x = (surface.normal(far)[0] + sine * z) / cosine
        y = np.cross(z, x)
        across = along.max() * sine / cosine
        near = surface.apex + along.max() * z + across * x
        shape = (unit / across, sine, cosine)
    elif isinstance(surface, BSpline):
        return np.pad([*surface.turns, surface.sign], (0, N_NUMBERS - 3))
    elif isinstance(surface, Revolution):
        near, (x, y, z) = surface.origin - middle, surface.axes
        shape = (*surface.poles, surface.sign)
    else:
        near, z = surface.center - middle, surface.axis
        x, y = _across(z)
        shape = (surface.major / unit, surface.minor / unit)
    row = np.concatenate([near / unit, x, y, z, shape])
    return np.pad(row, (0, N_NUMBERS - len(row)))


def _across(axis: Array) -> tuple[Array, Array]:
    """Unit vectors that make a right-handed system with a unit vector: (axis, first, second)."""
    least = np.zeros(3)
    least[np.argmin(np.abs(axis))] = 1.0
    first = np.cross(axis, least)
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)
