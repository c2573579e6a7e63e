# SPDX-License-Identifier: LGPL-2.1-or-later
"""B-spline surfaces, rational or not, as polynomial patches between their knots.

A patch holds the powers of its own parameters: of w (x - c), w (y - c), w (z - c) and w, with the weight w and a centre
c that is near, so rounding is small against the patch, not against the scene. Where a border shrinks to a point, a
*pole* like the vertex of a lens, its patches count powers from that border and c is the pole: points, derivatives and
normals lose nothing next to it. Steps near a pole are polar: u is an angle around it, v the distance.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import comb
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.scene.exact_surfaces import BSplineSurface

__all__ = ["EXTENSION", "BSpline", "Jet", "bspline_of"]

Array = NDArray[np.float64]

#: How far patches at a border go on past it, in widths of the patch.
EXTENSION = 0.25
#: A border whose poles are this near, in sizes of the surface, is a point.
POLE = 1e-9
#: By how much of its range v is kept off a pole, where u is not defined.
NUDGE = 1e-100
_MAX_STEPS = 60
_STARTS = 4


class Jet(NamedTuple):
    """Points, first and second derivatives by u and v, (n, 3) each."""

    point: Array
    u: Array
    v: Array
    uu: Array
    uv: Array
    vv: Array


@dataclass(frozen=True, eq=False)
class BSpline:
    """A B-spline surface.

    Attributes
    ----------
    breaks : (n_u + 1,) and (n_v + 1,) float64
        Parameters at the borders of patches, from 0.
    wraps : (bool, bool)
        Whether it closes on itself along u, v.
    center : (n_u, n_v, 3) float64
    reference, width : (n_u, 2) and (n_v, 2) float64
        A patch's own parameter is (parameter - reference) / width.
    coefficient : (n_u, n_v, degree_u + 1, degree_v + 1, 4) float64
    turns : (float, float)
        Angle per unit of u around the pole at the lower and the upper border of v; 0: no pole. One is the lower.
    sign : float
        Own normal = sign * du x dv; -1 where u and v are exchanged, or v is turned about, against the scene.
    """

    breaks: tuple[Array, Array]
    wraps: tuple[bool, bool]
    center: Array
    reference: tuple[Array, Array]
    width: tuple[Array, Array]
    coefficient: Array
    turns: tuple[float, float]
    sign: float

    def jet(self, u: Array, v: Array) -> Jet:
        """Points and derivatives at parameters, (n,) each."""
        i, j = self._patch(0, u), self._patch(1, v)
        terms = self.coefficient[i, j]
        powers = [
            self._powers((x - self.reference[axis][k]) / self.width[axis][k], self.width[axis][k], axis)
            for axis, x, k in ((0, u, i), (1, v, j))
        ]

        rows = [np.einsum("nijc,nj->nic", terms, x) for x in powers[1]]

        def derivative(of_u: int, of_v: int) -> tuple[Array, Array]:
            value = np.einsum("nic,ni->nc", rows[of_v], powers[0][of_u])
            return value[:, :3], value[:, 3:]

        x, w = derivative(0, 0)
        point = x / w
        (xu, wu), (xv, wv) = derivative(1, 0), derivative(0, 1)
        su, sv = (xu - wu * point) / w, (xv - wv * point) / w
        (xuu, wuu), (xuv, wuv), (xvv, wvv) = derivative(2, 0), derivative(1, 1), derivative(0, 2)
        suu = (xuu - 2 * wu * su - wuu * point) / w
        suv = (xuv - wu * sv - wv * su - wuv * point) / w
        svv = (xvv - 2 * wv * sv - wvv * point) / w
        return Jet(self.center[i, j] + point, su, sv, suu, suv, svv)

    def parameters(self, points: Array) -> tuple[Array, Array]:
        """Parameters of the nearest points, (n,) each."""
        points, back = np.unique(points, axis=0, return_inverse=True)
        u, v = self._parameters(points)
        return u[back.reshape(-1)], v[back.reshape(-1)]

    def _parameters(self, points: Array) -> tuple[Array, Array]:
        from scipy.spatial import cKDTree

        u0, v0, samples = self._samples
        _, rows = cKDTree(samples).query(points, k=min(_STARTS, len(samples)))
        best_u, best_v, best = np.zeros(len(points)), np.zeros(len(points)), np.full(len(points), np.inf)
        todo, close = np.arange(len(points)), 1e-12 * np.ptp(samples)
        for column in np.reshape(rows, (len(points), -1)).T:
            u, v = self._approach(points[todo], u0[column[todo]], v0[column[todo]])
            distance = np.linalg.norm(self.jet(u, v).point - points[todo], axis=1)
            nearer = distance < best[todo]
            which = todo[nearer]
            best_u[which], best_v[which], best[which] = u[nearer], v[nearer], distance[nearer]
            todo = todo[best[todo] > close]  # those that stand on the surface are found
            if not len(todo):
                break
        return best_u, best_v

    def nearest(self, points: Array) -> Array:
        """Closest points of the surface."""
        return self.jet(*self.parameters(points)).point

    def normal(self, points: Array) -> Array:
        """Own unit normal at the nearest points."""
        return self.normal_at(*self.parameters(points))

    def normal_at(self, u: Array, v: Array) -> Array:
        """Own unit normal at parameters, (n,) each."""
        high = self.breaks[1][-1]
        if self.turns[0]:
            v = np.where(np.abs(v) < NUDGE * high, NUDGE * high, v)
        if self.turns[1]:
            v = np.where(np.abs(v - high) < 1e-14 * high, (1 - 1e-14) * high, v)
        jet = self.jet(u, v)
        normal = self.sign * np.cross(jet.u, jet.v)
        return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))

    def height(self, points: Array) -> Array:
        """Signed distance along the own normal of points next to the surface."""
        u, v = self.parameters(points)
        return np.einsum("ij,ij->i", points - self.jet(u, v).point, self.normal_at(u, v))

    def told(self) -> Array:
        """Numbers, in mm, that are the same for equal surfaces: points spread over it, and its own normals there."""
        u, v, points = self._samples
        return np.concatenate([points.ravel(), self.sign * np.ptp(points) * self.normal_at(u, v).ravel()])

    def corner_parameters(self, corners: Array) -> Array:
        """Parameters of the corners of triangles on the surface, (n, 3, 3) to (n, 3, 2), near each other in each.

        A corner on a pole has the u of the others.
        """
        u, v = (x.reshape(-1, 3) for x in self.parameters(corners.reshape(-1, 3)))
        ends = self.breaks[1][0], self.breaks[1][-1]
        on_pole = np.zeros(v.shape, bool)
        for end, turn in zip(ends, self.turns, strict=True):
            if turn:
                on_pole |= np.abs(v - end) < 1e-6 * ends[1]
        uv = np.stack([u, v], axis=2)
        for axis in (0, 1):
            if self.wraps[axis]:
                x, period = uv[..., axis], self.breaks[axis][-1]
                first = np.argmin(on_pole, axis=1) if axis == 0 else np.zeros(len(x), np.int64)
                anchor = x[np.arange(len(x)), first][:, None]
                uv[..., axis] = x + period * np.round((anchor - x) / period)
        sound = np.maximum((~on_pole).sum(axis=1), 1)
        mean = np.where(on_pole, 0.0, uv[..., 0]).sum(axis=1) / sound
        uv[..., 0] = np.where(on_pole, mean[:, None], uv[..., 0])
        return uv

    def crossings(self, origin: Array, direction: Array) -> Array:
        """All crossings of a line, by halving patches until each part has one or none."""
        least = np.zeros(3)
        least[np.argmin(np.abs(direction))] = 1.0
        first = np.cross(direction, least)
        first /= np.linalg.norm(first)
        across = np.stack([first, np.cross(direction, first)])
        found = [
            distance
            for u0, u1, v0, v1 in self._parts_on_line(origin, across)
            for distance in self._newton(origin, direction, across, (u0, u1), (v0, v1))
        ]
        t = np.sort(np.array(found))
        size = np.ptp(self._samples[2], axis=0).max()
        return t[np.diff(t, prepend=-np.inf) > 1e-9 * size]

    def _parts_on_line(self, origin: Array, across: Array, depth: int = 5) -> Iterator[tuple[float, ...]]:
        """Parts of patches that a line may cross: no side of all their Bezier points lies off it."""
        for i in range(len(self.width[0])):
            for j in range(len(self.width[1])):
                start = (*self.breaks[0][i : i + 2], *self.breaks[1][j : j + 2])
                parts = [start]
                for _ in range(depth):
                    parts = [quarter for part in parts for quarter in _quarters(part)]
                    parts = [part for part in parts if self._may_hold(i, j, part, origin, across)]
                yield from parts

    def _may_hold(self, i: int, j: int, part: tuple[float, ...], origin: Array, across: Array) -> bool:
        terms = self.coefficient[i, j]
        moved = terms[..., :3] + (self.center[i, j] - origin) * terms[..., 3:]
        plane = np.einsum("ijc,kc->kij", moved, across)
        bounds = [
            [(x - self.reference[axis][k]) / self.width[axis][k] for x in part[2 * axis : 2 * axis + 2]]
            for axis, k in ((0, i), (1, j))
        ]
        to_bezier = [_power_to_bezier(n - 1, *ends) for n, ends in zip(plane.shape[1:], bounds, strict=True)]
        bezier = np.einsum("kij,ai,bj->kab", plane, *to_bezier)
        slack = 1e-13 * np.abs(plane).sum(axis=(1, 2))
        low, high = bezier.min(axis=(1, 2)), bezier.max(axis=(1, 2))
        return bool(((low <= slack) & (high >= -slack)).all())

    def _newton(
        self, origin: Array, direction: Array, across: Array, u: tuple[float, float], v: tuple[float, float]
    ) -> Iterator[float]:
        x = np.array([np.mean(u), np.mean(v)])
        low, high = np.array([u[0], v[0]]), np.array([u[1], v[1]])
        for _ in range(50):
            jet = self.jet(x[:1], x[1:])
            residual = across @ (jet.point[0] - origin)
            slopes = across @ np.stack([jet.u[0], jet.v[0]], axis=1)
            step = np.linalg.lstsq(slopes, residual, rcond=None)[0]
            x = np.clip(x - step, low - 0.3 * (high - low), high + 0.3 * (high - low))
            if (np.abs(step) <= 1e-15 * (high - low)).all():
                break
        jet = self.jet(x[:1], x[1:])
        size = 1e-12 * (np.abs(jet.point).max() + np.linalg.norm(origin))
        inside = (x >= low - 1e-9 * (high - low)).all() and (x <= high + 1e-9 * (high - low)).all()
        if inside and np.linalg.norm(across @ (jet.point[0] - origin)) < size:
            yield float(direction @ (jet.point[0] - origin))

    @cached_property
    def _samples(self) -> tuple[Array, Array, Array]:
        """Parameters and points to begin at, spread over all patches."""
        n_u, n_v = (2 * n for n in self.coefficient.shape[2:4])
        shares = [(np.arange(max(n, 5)) + 0.5) / max(n, 5) for n in (n_u, n_v)]
        axes = [
            (b[:-1, None] + np.diff(b)[:, None] * share).ravel() for b, share in zip(self.breaks, shares, strict=True)
        ]
        u, v = (x.ravel() for x in np.meshgrid(*axes, indexing="ij"))
        return u, v, self.jet(u, v).point

    def _approach(self, points: Array, u: Array, v: Array) -> tuple[Array, Array]:
        """Newton to the nearest points."""
        u, v, moving = u.copy(), v.copy(), np.arange(len(points))
        spans = [float(x[-1] - x[0]) for x in self.breaks]
        for _ in range(_MAX_STEPS):
            before = u[moving], v[moving]
            u[moving], v[moving] = self._nearer(points[moving], *before)
            change = np.maximum(np.abs(u[moving] - before[0]) / spans[0], np.abs(v[moving] - before[1]) / spans[1])
            moving = moving[change > 4e-15]
            if not len(moving):
                break
        return u, v

    def _nearer(self, points: Array, u: Array, v: Array) -> tuple[Array, Array]:
        """One step towards the nearest points."""
        jet = self.jet(u, v)
        q = points - jet.point
        (a, b, c), rest = _squares(jet), [np.einsum("ij,ij->i", q, x) for x in jet[1:]]
        full = (a - rest[2], b - rest[3], c - rest[4])
        good = (full[0] > 0) & (full[0] * full[2] - full[1] ** 2 > 1e-3 * np.abs(a * c - b * b))
        a, b, c = (np.where(good, x, y) for x, y in zip(full, (a, b, c), strict=True))
        determinant = a * c - b * b
        determinant = np.where(determinant > 0, determinant, np.inf)
        du, dv = (c * rest[0] - b * rest[1]) / determinant, (a * rest[1] - b * rest[0]) / determinant
        return self.moved(u, v, du, dv)

    def moved(self, u: Array, v: Array, du: Array, dv: Array) -> tuple[Array, Array]:
        """Parameters after a step: polar near a pole, at most a patch wide, wrapped, and kept by the borders."""
        for end, turn in zip((0, -1), self.turns, strict=True):
            if turn:
                away = v - self.breaks[1][end]
                is_near = np.abs(away) < 0.5 * np.ptp(self.breaks[1])
                along, aside = away + dv, np.abs(away) * turn * du
                radius = np.copysign(np.hypot(along, aside), away)
                angle = np.arctan2(aside, along * np.sign(away))
                du = np.where(is_near, angle / turn, du)
                dv = np.where(is_near, radius - away, dv)
        moved = []
        for axis, x, dx in ((0, u, du), (1, v, dv)):
            breaks = self.breaks[axis]
            most = np.diff(breaks)[self._patch(axis, x)]
            has_pole = any(self.turns)
            step = dx if has_pole and axis == 0 else np.clip(dx, -most, most)
            x = x + step
            if self.wraps[axis]:
                x = breaks[0] + np.mod(x - breaks[0], breaks[-1] - breaks[0])
            else:
                low = 0.0 if axis == 1 and self.turns[0] else EXTENSION * (breaks[1] - breaks[0])
                high = 0.0 if axis == 1 and self.turns[1] else EXTENSION * (breaks[-1] - breaks[-2])
                x = np.clip(x, breaks[0] - low, breaks[-1] + high)
            moved.append(x)
        return moved[0], moved[1]

    def _patch(self, axis: int, x: Array) -> NDArray[np.int64]:
        return np.clip(np.searchsorted(self.breaks[axis], x, side="right") - 1, 0, len(self.width[axis]) - 1)

    def _powers(self, local: Array, width: Array, axis: int) -> list[Array]:
        """Powers of local parameters and their first and second derivatives, (n, degree + 1) each."""
        n = self.coefficient.shape[2 + axis]
        powers = local[:, None] ** np.arange(n)
        rows = [powers]
        for _ in range(2):
            slope = np.zeros_like(powers)
            slope[:, 1:] = rows[-1][:, :-1] * np.arange(1, n)
            rows.append(slope / width[:, None])
        return [rows[0], rows[1], _second(powers) / width[:, None] ** 2]


def bspline_of(record: BSplineSurface) -> BSpline:
    """The surface that a record of a scene describes."""
    poles = np.array(record.poles_mm, float)
    weights = np.ones(poles.shape[:2]) if record.weights is None else np.array(record.weights, float)
    ways = list(zip(record.degrees, record.knots, record.multiplicities, record.periodic, strict=True))
    size = float(np.ptp(poles.reshape(-1, 3), axis=0).max())
    sign = 1.0
    if not any(_poles_at_ends(poles, ways[1], size)) and any(_poles_at_ends(poles.swapaxes(0, 1), ways[0], size)):
        poles, weights, ways, sign = poles.swapaxes(0, 1), weights.T, ways[::-1], -1.0
    ends = _poles_at_ends(poles, ways[1], size)
    if ends == (False, True):
        degree, rising, times, periodic = ways[1]
        ways[1] = (degree, tuple(-x for x in rising[::-1]), times[::-1], periodic)
        poles, weights, sign, ends = poles[:, ::-1], weights[:, ::-1], -sign, (True, False)
    ways = [(way[0], tuple(x - way[1][0] for x in way[1]), *way[2:]) for way in ways]
    for end, is_pole in zip((0, -1), ends, strict=True):
        if is_pole:
            poles[:, end] = poles[:, end].mean(axis=0)

    knots = [_flat_knots(*way[:3], periodic=way[3]) for way in ways]
    breaks = [_breaks(way[0], way[1]) for way in ways]
    if len(breaks[1]) == 2 and all(ends):
        breaks[1] = np.insert(breaks[1], 1, breaks[1].mean())  # a patch has one pole at most
    degrees = [way[0] for way in ways]
    spans = [
        [int(np.searchsorted(flat, x, side="right")) - 1 for x in b[:-1]] for flat, b in zip(knots, breaks, strict=True)
    ]
    reference = [(b[:-1] + b[1:]) / 2 for b in breaks]
    width = [np.diff(b) / 2 for b in breaks]
    for end, is_pole in zip((0, -1), ends, strict=True):
        if is_pole:
            reference[1][end], width[1][end] = breaks[1][end], np.diff(breaks[1])[end]
    bases = [
        [_basis(flat, degree, k, r, h) for k, r, h in zip(span, ref, wid, strict=True)]
        for flat, degree, span, ref, wid in zip(knots, degrees, spans, reference, width, strict=True)
    ]
    shape = (len(spans[0]), len(spans[1]))
    center = np.zeros((*shape, 3))
    coefficient = np.zeros((*shape, degrees[0] + 1, degrees[1] + 1, 4))
    for i, k in enumerate(spans[0]):
        rows = np.arange(k - degrees[0], k + 1) % poles.shape[0]
        for j, m in enumerate(spans[1]):
            columns = np.arange(m - degrees[1], m + 1) % poles.shape[1]
            block, w = poles[np.ix_(rows, columns)], weights[np.ix_(rows, columns)]
            middle = block.reshape(-1, 3).mean(axis=0)
            if ends[0] and j == 0:
                middle = poles[0, 0]
            elif ends[1] and j == shape[1] - 1:
                middle = poles[0, -1]
            center[i, j] = middle
            w = np.asarray(w / w.mean(), np.longdouble)[..., None]
            homogeneous = np.concatenate([w * (block - middle), w], axis=2)
            terms = np.einsum("abc,ai,bj->ijc", homogeneous, bases[0][i], bases[1][j])
            if (ends[0] and j == 0) or (ends[1] and j == shape[1] - 1):
                terms[:, 0, :3] = 0  # the pole itself
            coefficient[i, j] = terms
    made = BSpline(
        breaks=(breaks[0], breaks[1]),
        wraps=(bool(ways[0][3]), bool(ways[1][3])),
        center=center,
        reference=(reference[0], reference[1]),
        width=(width[0], width[1]),
        coefficient=coefficient,
        turns=(0.0, 0.0),
        sign=sign,
    )
    low, high = (_turn(made, end) if is_pole else 0.0 for end, is_pole in zip((0, -1), ends, strict=True))
    return replace(made, turns=(low, high), wraps=(_is_closed(made, 0, size), _is_closed(made, 1, size)))


def _is_closed(surface: BSpline, axis: int, size: float) -> bool:
    """Whether the surface ends where it begins."""
    if surface.wraps[axis]:
        return True
    other = np.linspace(surface.breaks[1 - axis][0], surface.breaks[1 - axis][-1], 33)
    ends = [np.full_like(other, surface.breaks[axis][k]) for k in (0, -1)]
    first, last = (surface.jet(*((end, other) if axis == 0 else (other, end))).point for end in ends)
    return bool(np.abs(first - last).max() <= POLE * size)


def _breaks(degree: int, knots: tuple[float, ...]) -> Array:
    """Borders of patches: the knots, and for high degrees more, so that no power outweighs the sum of all."""
    pieces = 1 + degree // 6
    inner = [np.linspace(a, b, pieces, endpoint=False) for a, b in itertools.pairwise(knots)]
    return np.append(np.concatenate(inner), knots[-1])


def _poles_at_ends(poles: Array, way: Any, size: float) -> tuple[bool, bool]:
    """Whether the lower and the upper border of the second parameter are points."""
    degree, _, times, periodic = way
    if periodic:
        return False, False

    def is_point(end: int) -> bool:
        return times[end] == degree + 1 and bool(np.ptp(poles[:, end], axis=0).max() <= POLE * size)

    return is_point(0), is_point(-1)


def _flat_knots(
    degree: int, knots: tuple[float, ...], times: tuple[int, ...], periodic: bool
) -> NDArray[np.longdouble]:
    """Knots, each as often as it counts; of a periodic surface as many before and behind as a span needs."""
    flat = np.repeat(np.asarray(knots, np.longdouble), times)
    if not periodic:
        return flat
    period, more = flat[-1] - flat[0], degree + 1 - times[0]
    inner = flat[: -times[-1]]  # one period
    before = [inner[-1 - (k % len(inner))] - period * (1 + k // len(inner)) for k in range(more)][::-1]
    behind = [inner[(times[0] + k) % len(inner)] + period * (1 + (times[0] + k) // len(inner)) for k in range(more)]
    return np.concatenate([np.array(before, np.longdouble), flat, np.array(behind, np.longdouble)])


def _basis(
    knots: NDArray[np.longdouble], degree: int, span: int, reference: float, width: float
) -> NDArray[np.longdouble]:
    """Powers of (x - reference) / width in each basis function of a span, (degree + 1 functions, degree + 1).

    References
    ----------
    L. Piegl, W. Tiller: The NURBS Book, 2nd edition, eq. 2.5.
    """
    rows = np.zeros((degree + 1, degree + 1), np.longdouble)
    rows[degree, 0] = 1
    for k in range(1, degree + 1):
        made = np.zeros_like(rows)
        for a in range(degree - k, degree + 1):
            i = span - degree + a
            if a > degree - k:
                made[a] += _times_line(rows[a], -(knots[i] - reference), width, knots[i + k] - knots[i])
            if a < degree:
                gap = knots[i + k + 1] - knots[i + 1]
                made[a] -= _times_line(rows[a + 1], -(knots[i + k + 1] - reference), width, gap)
        rows = made
    return rows


def _times_line(powers: Any, constant: Any, slope: Any, divisor: Any) -> Any:
    result = powers * (constant / divisor)
    result[1:] += powers[:-1] * (slope / divisor)
    return result


def _turn(surface: BSpline, end: int) -> float:
    """Angle by which the direction away from a pole turns, per unit of u."""
    u = np.linspace(surface.breaks[0][0], surface.breaks[0][-1], 16 * len(surface.width[0]) + 1)
    away = surface.jet(u, np.full_like(u, surface.breaks[1][end])).v
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    turned = np.arccos(np.clip(np.einsum("ij,ij->i", away[1:], away[:-1]), -1, 1)).sum()
    return float(turned / (u[-1] - u[0]))


def _second(powers: Array) -> Array:
    n = powers.shape[1]
    result = np.zeros_like(powers)
    for k in range(2, n):
        result[:, k] = k * (k - 1) * powers[:, k - 2]
    return result


def _squares(jet: Jet) -> tuple[Array, Array, Array]:
    return (
        np.einsum("ij,ij->i", jet.u, jet.u),
        np.einsum("ij,ij->i", jet.u, jet.v),
        np.einsum("ij,ij->i", jet.v, jet.v),
    )


def _quarters(part: tuple[float, ...]) -> list[tuple[float, ...]]:
    u0, u1, v0, v1 = part
    u, v = (u0 + u1) / 2, (v0 + v1) / 2
    return [(a, b, c, d) for a, b in ((u0, u), (u, u1)) for c, d in ((v0, v), (v, v1))]


def _power_to_bezier(degree: int, low: float, high: float) -> Array:
    """Bezier points, (degree + 1, degree + 1 powers), over an interval of polynomials given by their powers."""
    # p(low + (high - low) s) in powers of s, then to Bernstein
    n = degree + 1
    shift = np.zeros((n, n))
    for k in range(n):
        for m in range(k + 1):
            shift[m, k] = comb(k, m) * low ** (k - m) * (high - low) ** m
    bernstein = np.array([[comb(i, k) / comb(degree, k) if k <= i else 0.0 for k in range(n)] for i in range(n)])
    return np.asarray(bernstein @ shift)
