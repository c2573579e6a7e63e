# SPDX-License-Identifier: LGPL-2.1-or-later
"""Binary PLY with vertices in float64."""

import struct
import sys
from array import array

HEADER = """ply
format binary_little_endian 1.0
comment millimetres
element vertex {vertices}
property double x
property double y
property double z
element face {triangles}
property list uchar int vertex_indices
end_header
"""


def ply_bytes(mesh):
    """A mesh as the content of a PLY file; the triangles keep their order."""
    coordinates = array("d", [value for vertex in mesh.vertices_mm for value in vertex])
    if sys.byteorder == "big":
        coordinates.byteswap()
    header = HEADER.format(vertices=len(mesh.vertices_mm), triangles=len(mesh.triangles)).encode("ascii")
    pack = struct.Struct("<Biii").pack
    return header + coordinates.tobytes() + b"".join(pack(3, *corners) for corners in mesh.triangles)
