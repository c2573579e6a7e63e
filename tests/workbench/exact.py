# SPDX-License-Identifier: LGPL-2.1-or-later
"""Exact surfaces evaluated from their written parameters alone, by formulas of their own: nothing here asks FreeCAD."""

import math

STARTS = 2  # guesses for each span of a B-spline, along u and along v


def dot(a, b):
    return math.fsum(x * y for x, y in zip(a, b, strict=True))


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def plus(a, b, times):
    return [x + times * y for x, y in zip(a, b, strict=True)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    return [x / math.hypot(*a) for x in a]


def distance_and_outward(surface, point):
    """Distance of a point to a surface in mm, and the unit normal there that points out of the body.

    Parameters
    ----------
    surface : dict as in a scene
    point : (x, y, z) in mm, on the surface or almost
    """
    distance, normal = SHAPES[surface["type"]](surface, list(point))
    assert isinstance(surface["reversed"], bool)
    return distance, [-x for x in normal] if surface["reversed"] else normal


def plane(surface, point):
    assert set(surface) == {"type", "reversed", "point_mm", "normal"}
    normal = surface["normal"]
    return abs(dot(minus(point, surface["point_mm"]), normal)), normal


def sphere(surface, point):
    away = minus(point, surface["center_mm"])
    return abs(math.hypot(*away) - surface["radius_mm"]), unit(away)


def _about_axis(surface, origin, point):
    """How far along the axis, how far from it, and the unit vectors of both."""
    axis, away = surface["axis"], minus(point, surface[origin])
    assert abs(math.hypot(*axis) - 1) < 1e-14
    along = dot(away, axis)
    radial = plus(away, axis, -along)
    return along, math.hypot(*radial), axis, unit(radial)


def cylinder(surface, point):
    _, across, _, radial = _about_axis(surface, "point_mm", point)
    return abs(across - surface["radius_mm"]), radial


def cone(surface, point):
    along, across, axis, radial = _about_axis(surface, "apex_mm", point)
    assert along > 0, "the axis points from the apex into the cone"
    angle = math.radians(surface["half_angle_deg"])
    c, s = math.cos(angle), math.sin(angle)
    return abs(across * c - along * s), plus([c * x for x in radial], axis, -s)


def torus(surface, point):
    along, across, axis, radial = _about_axis(surface, "center_mm", point)
    beyond = across - surface["major_radius_mm"]
    return abs(math.hypot(beyond, along) - surface["minor_radius_mm"]), unit(
        plus([beyond * x for x in radial], axis, along)
    )


def bspline(surface, point):
    """By Newton's method from the nearest of many places."""
    candidates = []
    for u in _starts(surface, 0):
        for v in _starts(surface, 1):
            candidates.append((math.dist(_value(surface, u, v)[0], point), u, v))
    distance, normal = math.inf, None
    for _, u, v in sorted(candidates)[:3]:
        for _ in range(8):
            value, du, dv = _value(surface, u, v)
            off, a, b, c = minus(point, value), dot(du, du), dot(du, dv), dot(dv, dv)
            scale = a * c - b * b
            if scale <= 0:
                break
            p, q = dot(off, du), dot(off, dv)
            u = _inside(surface, 0, u + (c * p - b * q) / scale)
            v = _inside(surface, 1, v + (a * q - b * p) / scale)
        value, du, dv = _value(surface, u, v)
        if math.dist(value, point) < distance:
            distance, normal = math.dist(value, point), cross(du, dv)
    return distance, unit(normal)


def _starts(surface, i):
    knots = surface["knots"][i]
    steps = [(s + 0.5) / STARTS for s in range(STARTS)]
    return [a + s * (b - a) for a, b in zip(knots, knots[1:], strict=False) for s in steps]


def _inside(surface, i, parameter):
    knots = surface["knots"][i]
    if surface["periodic"][i]:
        return knots[0] + (parameter - knots[0]) % (knots[-1] - knots[0])
    return min(max(parameter, knots[0]), knots[-1])


def _value(surface, u, v):
    """Point and its two derivatives, by the rule for quotients."""
    across, along = _basis(surface, 0, u), _basis(surface, 1, v)
    poles, weights = surface["poles_mm"], surface["weights"]
    n_rows, n_columns = len(poles), len(poles[0])
    sums = [[0.0] * 4 for _ in range(3)]
    for i, f, df in across:
        for j, g, dg in along:
            pole = poles[i % n_rows][j % n_columns]
            weight = weights[i % n_rows][j % n_columns] if weights else 1.0
            for total, factor in zip(sums, (f * g, df * g, f * dg), strict=True):
                total[3] += factor * weight
                for k in range(3):
                    total[k] += factor * weight * pole[k]
    (*value, w), *rates = sums
    point = [x / w for x in value]
    return point, *([(x - rate[3] * y) / w for x, y in zip(rate[:3], point, strict=True)] for rate in rates)


def _basis(surface, i, parameter):
    """(index of the pole, basis function, its derivative) of all that are not 0, by the formula of Cox and de Boor."""
    degree, knots, times = surface["degrees"][i], surface["knots"][i], surface["multiplicities"][i]
    flat = [knot for knot, n in zip(knots, times, strict=True) for _ in range(n)]
    if surface["periodic"][i]:
        lacking, period, n = degree + 1 - times[0], knots[-1] - knots[0], sum(times[:-1])
        body = flat[: len(flat) - times[-1]]
        before = [body[(len(body) - lacking + k) % n] - period for k in range(lacking)]
        after = [body[(times[0] + k) % n] + period for k in range(lacking)]
        flat = before + flat + after
    span = next(k for k in range(len(flat) - degree - 2, -1, -1) if flat[k] <= parameter and flat[k] < flat[k + 1])

    def values(p):
        found = {span: 1.0}
        for d in range(1, p + 1):
            raised = {}
            for k in range(span - d, span + 1):
                left, right = flat[k + d] - flat[k], flat[k + d + 1] - flat[k + 1]
                raised[k] = (parameter - flat[k]) / left * found.get(k, 0.0) if left > 0 else 0.0
                raised[k] += (flat[k + d + 1] - parameter) / right * found.get(k + 1, 0.0) if right > 0 else 0.0
            found = raised
        return found

    whole, lower = values(degree), values(degree - 1)
    rows = []
    for k in range(span - degree, span + 1):
        left, right = flat[k + degree] - flat[k], flat[k + degree + 1] - flat[k + 1]
        rate = lower.get(k, 0.0) / left if left > 0 else 0.0
        rate -= lower.get(k + 1, 0.0) / right if right > 0 else 0.0
        rows.append((k, whole[k], degree * rate))
    return rows


SHAPES = {"plane": plane, "sphere": sphere, "cylinder": cylinder, "cone": cone, "torus": torus, "bspline": bspline}
