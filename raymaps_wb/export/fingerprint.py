# SPDX-License-Identifier: LGPL-2.1-or-later
"""A digest of everything that a map depends on, fast enough to be taken after every change, the same after reopening.

Shapes go in by measures that do not depend on how they are triangulated or stored: for each face its kind of surface,
area, centre and some points; rounded, because a document keeps 15 digits.
"""

import hashlib
import json
import math

from raymaps_wb.export.bodies import shape_of
from raymaps_wb.export.description import describe

GRID_MM = 1e-6


class ShapeMeasures:
    """Measures of shapes, kept for as long as a shape stays the same in memory; and digests of files in ``files``."""

    def __init__(self):
        self._known, self.files = {}, {}

    def of(self, place, shape):
        """Digest of a shape at a place."""
        known = self._known.get(place)
        if known is None or not known[0].isEqual(shape):
            self._known[place] = known = (shape, shape_digest(shape))
        return known[1]


def fingerprint(study, measures=None):
    """Digest of a study and of the geometry that it refers to, as 64 hexadecimal digits.

    Parameters
    ----------
    study : document object
    measures : ShapeMeasures, optional
        Remembers shapes between calls.

    Raises
    ------
    ExportError
        If the study can't be written as a scene.
    """
    measures = measures or ShapeMeasures()
    description = describe(study)
    shapes = {name: measures.of(place, shape_of(place)) for name, place in description.places.items()}
    return combined(description, shapes, study, measures.files)


def combined(description, shapes, study, known_files=None):
    """Digest of a description, of the digests of its shapes, of how they are triangulated, and of its files."""
    triangulation = [float(study.ChordTolerance), float(study.AngularDeflection)]
    data = _rounded([description.scene, shapes, triangulation])
    files = description.files.digests(known_files)
    if files:
        data.append(files)
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def shape_digest(shape):
    """Digest of a shape in global coordinates."""
    digest = hashlib.sha256()
    for face in shape.Faces:
        surface = face.Surface
        radii = [getattr(surface, name, None) for name in ("Radius", "MajorRadius", "MinorRadius", "SemiAngle")]
        values = [type(surface).__name__, face.Orientation, _grid(face.Area), _point(face.CenterOfMass)]
        values += [None if value is None else _grid(value) for value in radii]
        values += sorted(_point(vertex.Point) for vertex in face.Vertexes)
        u0, u1, v0, v1 = face.ParameterRange
        if max(abs(u0), abs(u1), abs(v0), abs(v1)) < 1e50:
            steps = (0.2, 0.5, 0.8)
            values += [_point(face.valueAt(u0 + s * (u1 - u0), v0 + t * (v1 - v0))) for s in steps for t in steps]
        digest.update(repr(values).encode())
    return digest.hexdigest()


def _grid(value):
    return round(value / GRID_MM)


def _point(vector):
    return (_grid(vector.x), _grid(vector.y), _grid(vector.z))


def _rounded(data):
    """Floats with 12 digits, so that what a file keeps and what memory holds compare equal.

    Numbers of one list, such as a direction, are rounded by the largest of them: what is noise beside it is zero.
    """
    if isinstance(data, float):
        return float(f"{data:.12g}") + 0.0
    if isinstance(data, (list, tuple)) and data and all(isinstance(value, float) for value in data):
        largest = max(abs(value) for value in data)
        if 0 < largest < math.inf:
            digits = 11 - math.floor(math.log10(largest))
            return [round(value, digits) + 0.0 for value in data]
    if isinstance(data, dict):
        return {key: _rounded(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [_rounded(value) for value in data]
    return data
