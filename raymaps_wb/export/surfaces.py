# SPDX-License-Identifier: LGPL-2.1-or-later
"""The exact surface of a CAD face, as plain data in global coordinates and mm.

Every surface has ``type`` and ``reversed``: whether the normal that points out of the body is against the surface's
own. That is ``normal`` of a plane, the direction away from the axis, centre or core circle of a cylinder, cone, sphere
or torus, and du x dv of a B-spline. Parameters by type:

plane     point_mm, normal
cylinder  point_mm, axis, radius_mm
cone      apex_mm, axis (from the apex into the cone), half_angle_deg
sphere    center_mm, radius_mm
torus     center_mm, axis, major_radius_mm, minor_radius_mm
bspline   degrees, knots, multiplicities, periodic (each for u and v), poles_mm (rows along v), weights (null: all 1)
other     name that FreeCAD gives it, reason why it has no exact form; light sees the triangles of the face

Surfaces of revolution, of extrusion and Bezier surfaces are written as the B-spline that equals them, B-splines that
are flat as planes, and offsets of planes, cylinders, cones, spheres and tori as what they are.
"""

import math

import FreeCAD
import Part

MAX_POLES = 100_000
SAME = 1e-9  # of the size of a face: two surfaces that are closer are the same
FLAT = 1e-11  # of the size of a face: what all poles of a plane keep to; STEP files have 13 digits
PLACES = (0.47, 0.31, 0.68, 0.13, 0.89)  # shares of the range of u and v at which a face is looked at

_CENTRE = {"cylinder": "point_mm", "cone": "apex_mm", "sphere": "center_mm", "torus": "center_mm"}


class NotExactError(Exception):
    """A surface has no exact form; the text tells why."""


def exact_surface(face, is_inside_out=False):
    """Exact surface of a face.

    Parameters
    ----------
    face : Part.Face in global coordinates
    is_inside_out : bool
        The face is of a solid whose faces all look inwards.

    Returns
    -------
    dict
    """
    try:
        surface = face.Surface
    except (TypeError, RuntimeError, Part.OCCError) as error:  # FreeCAD knows fewer types than its kernel
        return _other("unknown", f"FreeCAD does not know its type ({error})", face, is_inside_out)
    name = type(surface).__name__
    try:
        data = _data(surface, face)
        return {**data, "reversed": _is_reversed(data, surface, face) != is_inside_out}
    except NotExactError as error:
        return _other(name, str(error), face, is_inside_out)
    except (RuntimeError, Part.OCCError) as error:
        return _other(name, f"FreeCAD can't evaluate it ({error})", face, is_inside_out)


def _other(name, reason, face, is_inside_out):
    is_reversed = (face.Orientation == "Reversed") != is_inside_out
    return {"type": "other", "name": name, "reason": reason, "reversed": is_reversed}


def own_normal(data, point):
    """Direction of a surface's own normal at a point on it, of any length; not for a B-spline."""
    if data["type"] == "plane":
        return FreeCAD.Vector(*data["normal"])
    away = point - FreeCAD.Vector(*data[_CENTRE[data["type"]]])
    if data["type"] == "sphere":
        return away
    axis = FreeCAD.Vector(*data["axis"])
    radial = away - axis * away.dot(axis)
    if data["type"] == "torus":
        return away - radial * (data["major_radius_mm"] / radial.Length)
    if data["type"] == "cone":
        return radial - axis * (radial.Length * math.tan(math.radians(data["half_angle_deg"])))
    return radial


def _data(surface, face):
    name = type(surface).__name__
    if name == "Toroid" and surface.MinorRadius >= surface.MajorRadius:  # parts of it lie beyond the axis
        return _as_bspline(surface, face)
    if name in SIMPLE:
        return SIMPLE[name](surface, face.valueAt(*_places(face)[0]))
    return FREE.get(name, _as_bspline)(surface, face)


def _is_reversed(data, surface, face):
    """Whether the outward normal inside the range of the face is against the surface's own normal there."""
    is_converted = data["type"] == "bspline" and type(surface).__name__ not in ("BSplineSurface", "BezierSurface")
    spline = _spline(data) if is_converted else surface
    for u, v in _places(face):
        point, outward = face.valueAt(u, v), face.normalAt(u, v)
        if data["type"] == "bspline":
            own = _normal(spline, *(_foot(spline, point) if is_converted else (u, v)))
        else:
            own = own_normal(data, point)
        side = outward.dot(own)
        if abs(side) > 0.5 * own.Length > 0:  # else the face is degenerate there, as at a pole
            return side < 0
    raise NotExactError("it has no normal")


def _places(face):
    """(u, v) of places in the range of a face, off its middle: seams and poles like to lie there."""
    u0, u1, v0, v1 = face.ParameterRange
    return [(u0 + s * (u1 - u0), v0 + t * (v1 - v0)) for t in PLACES for s in PLACES]


def _size(face):
    """Length that tells how far a face and its coordinates reach, in mm."""
    box = face.BoundBox
    return max(box.DiagonalLength, abs(box.XMin), abs(box.YMin), abs(box.ZMin), box.XMax, box.YMax, box.ZMax)


def _xyz(vector):
    return [vector.x, vector.y, vector.z]


def _plane(surface, place):
    return {"type": "plane", "point_mm": _xyz(surface.Position), "normal": _xyz(surface.Axis)}


def _cylinder(surface, place):
    return {
        "type": "cylinder",
        "point_mm": _xyz(surface.Center),
        "axis": _xyz(surface.Axis),
        "radius_mm": surface.Radius,
    }


def _cone(surface, place):
    # The half of the cone that the face is on, whichever way FreeCAD's axis and semi-angle turn.
    axis = surface.Axis if (place - surface.Apex).dot(surface.Axis) > 0 else surface.Axis * -1.0
    return {
        "type": "cone",
        "apex_mm": _xyz(surface.Apex),
        "axis": _xyz(axis),
        "half_angle_deg": math.degrees(abs(surface.SemiAngle)),
    }


def _sphere(surface, place):
    return {"type": "sphere", "center_mm": _xyz(surface.Center), "radius_mm": surface.Radius}


def _torus(surface, place):
    return {
        "type": "torus",
        "center_mm": _xyz(surface.Center),
        "axis": _xyz(surface.Axis),
        "major_radius_mm": surface.MajorRadius,
        "minor_radius_mm": surface.MinorRadius,
    }


def _offset(surface, face):
    """Offset of a surface that has such an offset of the same type."""
    basis = surface.BasisSurface
    name = type(basis).__name__
    if name not in SIMPLE:
        raise NotExactError("an offset of a free surface has no exact form")
    u, v = _places(face)[0]
    point = basis.value(u, v)
    data = SIMPLE[name](basis, point)
    own = own_normal(data, point)
    distance = math.copysign(abs(surface.OffsetValue), (face.valueAt(u, v) - point).dot(own))
    if name == "Plane":
        data["point_mm"] = _xyz(FreeCAD.Vector(*data["point_mm"]) + own.normalize() * distance)
    elif name == "Cone":
        along = distance / math.sin(math.radians(data["half_angle_deg"]))
        data["apex_mm"] = _xyz(FreeCAD.Vector(*data["apex_mm"]) - FreeCAD.Vector(*data["axis"]) * along)
    else:
        radius = "minor_radius_mm" if name == "Toroid" else "radius_mm"
        data[radius] += distance
        if not 0 < data[radius] < data.get("major_radius_mm", math.inf):
            raise NotExactError("its offset is larger than its radius")
    return data


def _bspline(surface, face):
    n_poles = surface.NbUPoles * surface.NbVPoles
    if n_poles > MAX_POLES:
        raise NotExactError(f"it has {n_poles} poles, more than {MAX_POLES}")
    poles = surface.getPoles()
    data = {
        "type": "bspline",
        "degrees": [surface.UDegree, surface.VDegree],
        "knots": [list(surface.getUKnots()), list(surface.getVKnots())],
        "multiplicities": [list(surface.getUMultiplicities()), list(surface.getVMultiplicities())],
        "periodic": [bool(surface.isUPeriodic()), bool(surface.isVPeriodic())],
    }
    return _flat(surface, poles, face) or {**data, **_poles(surface, poles)}


def _bezier(surface, face):
    poles, degrees = surface.getPoles(), [surface.UDegree, surface.VDegree]
    data = {
        "type": "bspline",
        "degrees": degrees,
        "knots": [[0.0, 1.0], [0.0, 1.0]],
        "multiplicities": [[degree + 1] * 2 for degree in degrees],
        "periodic": [False, False],
    }
    return _flat(surface, poles, face) or {**data, **_poles(surface, poles)}


def _poles(surface, poles):
    """Poles of a B-spline or Bezier surface, with their weights if they are not all one."""
    weights = surface.getWeights() if surface.isURational() or surface.isVRational() else None
    return {
        "poles_mm": [[_xyz(pole) for pole in row] for row in poles],
        "weights": None if weights is None else [list(row) for row in weights],
    }


def _flat(surface, poles, face):
    """The plane that holds all poles; None if there is none."""
    u, v = _places(face)[0]
    normal, point = _normal(surface, u, v), surface.value(u, v)
    if not normal.Length > 0:
        return None
    normal.normalize()
    off = max(abs((pole - point).dot(normal)) for row in poles for pole in row)
    # Poles that reach back over themselves make no plain plane, but the face on it is one.
    if off > FLAT * _size(face):
        return None
    return {"type": "plane", "point_mm": _xyz(point), "normal": _xyz(normal)}


def _as_bspline(surface, face):
    """The B-spline that equals a surface within the range of a face."""
    nurbs = face.toNurbs().Faces
    equal = nurbs[0].Surface if len(nurbs) == 1 else None
    if type(equal).__name__ != "BSplineSurface":
        raise NotExactError("it does not equal a B-spline")
    off = max(_distance(equal, face.valueAt(u, v)) for u, v in _places(face))
    if off > SAME * _size(face):
        raise NotExactError(f"it does not equal a B-spline, the nearest is {off:.1g} mm off")
    return _bspline(equal, face)


def _spline(data):
    """FreeCAD's surface from the data of one."""
    made = Part.BSplineSurface()
    weights = data["weights"] or [[1.0] * len(row) for row in data["poles_mm"]]
    made.buildFromPolesMultsKnots(
        [[FreeCAD.Vector(*pole) for pole in row] for row in data["poles_mm"]],
        *data["multiplicities"],
        *data["knots"],
        *data["periodic"],
        *data["degrees"],
        weights,
    )
    return made


def _normal(surface, u, v):
    return surface.getDN(u, v, 1, 0).cross(surface.getDN(u, v, 0, 1))


def _distance(surface, point):
    u, v = _foot(surface, point)
    return (surface.value(u, v) - point).Length


def _foot(surface, point):
    """(u, v) of the place of a surface that is nearest to a point, which is almost on it."""
    u, v = surface.parameter(point)
    for _ in range(3):  # FreeCAD's own stops at 1e-7 mm
        off, du, dv = point - surface.value(u, v), surface.getDN(u, v, 1, 0), surface.getDN(u, v, 0, 1)
        a, b, c = du.dot(du), du.dot(dv), dv.dot(dv)
        scale = a * c - b * b
        if not scale > 0:
            break
        p, q = off.dot(du), off.dot(dv)
        u, v = u + (c * p - b * q) / scale, v + (a * q - b * p) / scale
    return u, v


SIMPLE = {"Plane": _plane, "Cylinder": _cylinder, "Cone": _cone, "Sphere": _sphere, "Toroid": _torus}
FREE = {"OffsetSurface": _offset, "BSplineSurface": _bspline, "BezierSurface": _bezier}
