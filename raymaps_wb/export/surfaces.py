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
other     only the name that FreeCAD gives it

Surfaces of revolution, of extrusion and Bezier surfaces are written as the B-spline that equals them.
"""

import math

import FreeCAD
import Part

MAX_POLES = 100_000


def exact_surface(face):
    """Exact surface of a face.

    Parameters
    ----------
    face : Part.Face in global coordinates

    Returns
    -------
    dict
    """
    surface = face.Surface
    kind = type(surface).__name__
    data = WRITERS.get(kind, _bspline_of_face)(surface, face)
    return {**data, "reversed": _is_reversed(data, face)}


def _is_reversed(data, face):
    """Whether the outward normal in the middle of the face is against the surface's own normal there."""
    u0, u1, v0, v1 = face.ParameterRange
    u, v = u0 + 0.47 * (u1 - u0), v0 + 0.47 * (v1 - v0)
    point, outward = face.valueAt(u, v), face.normalAt(u, v)
    kind = data["type"]
    if kind == "plane":
        return outward.dot(FreeCAD.Vector(*data["normal"])) < 0
    if kind == "sphere":
        return outward.dot(point - FreeCAD.Vector(*data["center_mm"])) < 0
    if kind in ("cylinder", "cone", "torus"):
        origin = FreeCAD.Vector(*data[{"cylinder": "point_mm", "cone": "apex_mm", "torus": "center_mm"}[kind]])
        axis = FreeCAD.Vector(*data["axis"])
        radial = (point - origin) - axis * (point - origin).dot(axis)
        if kind == "torus":
            radial = point - origin - radial * (data["major_radius_mm"] / radial.Length)
        return outward.dot(radial) < 0
    return face.Orientation == "Reversed"


def _xyz(vector):
    return [vector.x, vector.y, vector.z]


def _plane(surface, face):
    return {"type": "plane", "point_mm": _xyz(surface.Position), "normal": _xyz(surface.Axis)}


def _cylinder(surface, face):
    return {
        "type": "cylinder",
        "point_mm": _xyz(surface.Center),
        "axis": _xyz(surface.Axis),
        "radius_mm": surface.Radius,
    }


def _cone(surface, face):
    # FreeCAD's semi-angle is negative for a cone that narrows along its axis.
    axis = surface.Axis if surface.SemiAngle > 0 else surface.Axis * -1.0
    return {
        "type": "cone",
        "apex_mm": _xyz(surface.Apex),
        "axis": _xyz(axis),
        "half_angle_deg": math.degrees(abs(surface.SemiAngle)),
    }


def _sphere(surface, face):
    return {"type": "sphere", "center_mm": _xyz(surface.Center), "radius_mm": surface.Radius}


def _torus(surface, face):
    return {
        "type": "torus",
        "center_mm": _xyz(surface.Center),
        "axis": _xyz(surface.Axis),
        "major_radius_mm": surface.MajorRadius,
        "minor_radius_mm": surface.MinorRadius,
    }


def _bspline(surface, face):
    if surface.NbUPoles * surface.NbVPoles > MAX_POLES:
        return {"type": "other", "name": "BSplineSurface"}
    return {
        "type": "bspline",
        "degrees": [surface.UDegree, surface.VDegree],
        "knots": [list(surface.getUKnots()), list(surface.getVKnots())],
        "multiplicities": [list(surface.getUMultiplicities()), list(surface.getVMultiplicities())],
        "periodic": [bool(surface.isUPeriodic()), bool(surface.isVPeriodic())],
        "poles_mm": [[_xyz(pole) for pole in row] for row in surface.getPoles()],
        "weights": (
            [list(row) for row in surface.getWeights()] if surface.isURational() or surface.isVRational() else None
        ),
    }


def _bspline_of_face(surface, face):
    name = type(surface).__name__
    try:
        equal = face.toNurbs().Faces[0].Surface
    except (Part.OCCError, RuntimeError):
        return {"type": "other", "name": name}
    if type(equal).__name__ != "BSplineSurface":
        return {"type": "other", "name": name}
    return _bspline(equal, face)


WRITERS = {
    "Plane": _plane,
    "Cylinder": _cylinder,
    "Cone": _cone,
    "Sphere": _sphere,
    "Toroid": _torus,
    "BSplineSurface": _bspline,
}
