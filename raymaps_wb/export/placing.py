# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where sources and detectors are, in global coordinates, without the noise of computing it."""

import FreeCAD


def global_placement(obj):
    """Placement of a source or detector in global coordinates, also inside parts."""
    parent = obj.getParentGeoFeatureGroup()
    return obj.Placement if parent is None else parent.getGlobalPlacement().multiply(obj.Placement)


def position_mm(placement):
    """Where a placement is."""
    return [round(value, 9) + 0.0 for value in placement.Base]


def direction(placement, x, y, z):
    """Where a local direction points to; a rotation that a document kept differs in the last digits."""
    return [round(value, 12) + 0.0 for value in placement.Rotation.multVec(FreeCAD.Vector(x, y, z))]
