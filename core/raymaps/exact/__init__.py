# SPDX-License-Identifier: LGPL-2.1-or-later
"""Exact surfaces of CAD faces: what they are, and the arrays that kernels read.

Topology comes from the triangles, geometry from the exact surfaces: Embree names the facet that a ray meets, and the
crossing is computed with the exact surface of the facet's face.
"""

from raymaps.exact.faces import ExactFaces, Fallback, exact_faces
from raymaps.exact.finer import finer
from raymaps.exact.surfaces import Cone, Cylinder, Plane, Sphere, Surface, Torus, exact_surface
from raymaps.exact.tables import ExactTables, lower_exact

__all__ = [
    "Cone",
    "Cylinder",
    "ExactFaces",
    "ExactTables",
    "Fallback",
    "Plane",
    "Sphere",
    "Surface",
    "Torus",
    "exact_faces",
    "exact_surface",
    "finer",
    "lower_exact",
]
