# SPDX-License-Identifier: LGPL-2.1-or-later
"""Triangles of a shape, grouped by CAD face, closed where the shape is closed, outward."""

import math
from collections import namedtuple

import MeshPart

from raymaps_wb.errors import ExportError

#: vertices_mm: list of (x, y, z). triangles: list of (i, j, k). faces: list of (index of a CAD face, its triangles).
#: is_turned: whether the faces of the shape look inwards, so that the triangles were turned round.
Mesh = namedtuple("Mesh", "vertices_mm triangles faces is_turned", defaults=(False,))

KEEP_TRIANGLES = 1e6  # mm, a tolerance so wide that a face keeps the triangles that it has


def triangulate(shape, chord_mm, angle_deg, where="shape"):
    """Triangles of all faces of a shape.

    The whole shape is triangulated at once, so neighbouring faces share the points of their common edge exactly; then
    each face gives its own triangles.

    Parameters
    ----------
    shape : Part.Shape in global coordinates
    chord_mm : float, largest distance between triangle and surface
    angle_deg : float, largest angle between neighbouring triangles
    where : str, the body's name for errors

    Returns
    -------
    Mesh; faces without a triangle are left out of ``faces``.

    Raises
    ------
    ExportError
        If the settings are not positive or the shape gives no triangles.
    """
    if not chord_mm > 0 or not 0 < angle_deg <= 90:
        raise ExportError(
            f"{where}: chord tolerance must be > 0 mm and angular deflection in (0, 90] degrees, got {chord_mm:g} mm "
            f"and {angle_deg:g} degrees; correct them in the study."
        )
    shape = shape.copy()  # else the document's own display would be triangulated anew
    MeshPart.meshFromShape(
        Shape=shape, LinearDeflection=chord_mm, AngularDeflection=math.radians(angle_deg), Relative=False, Segments=True
    )
    mesh = _gather(shape.Faces)
    if not mesh.triangles:
        raise ExportError(f"{where}: it gives no triangles; check its geometry with Part's 'Check geometry'.")
    if open_edges(mesh) and _is_solid(shape):
        mesh = _weld(mesh, 1e-6 * shape.BoundBox.DiagonalLength)
    if _is_solid(shape) and signed_volume_mm3(mesh) < 0:
        mesh = mesh._replace(triangles=[(a, c, b) for a, b, c in mesh.triangles], is_turned=True)
    return mesh


def stand_in(n_faces):
    """A closed mesh with a number of faces and no likeness to anything: two pyramids on a polygon."""
    n = max(3, (n_faces + 1) // 2)
    corners = [(math.cos(2 * math.pi * i / n), math.sin(2 * math.pi * i / n), 0.0) for i in range(n)]
    sides = [(i, (i + 1) % n) for i in range(n)]
    triangles = [triangle for a, b in sides for triangle in ((a, b, n), (b, a, n + 1))]
    counts = [(index, 1) for index in range(n_faces - 1)] + [(n_faces - 1, 2 * n - n_faces + 1)]
    return Mesh([*corners, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)], triangles, counts)


def open_edges(mesh):
    """Number of directed edges without exactly one partner in the opposite direction; 0 for a closed mesh."""
    uses: dict[tuple[int, int], int] = {}
    for a, b, c in mesh.triangles:
        for edge in ((a, b), (b, c), (c, a)):
            uses[edge] = uses.get(edge, 0) + 1
    return sum(1 for (a, b), n in uses.items() if n != 1 or uses.get((b, a)) != 1)


def signed_volume_mm3(mesh):
    """Volume inside the triangles in mm^3; negative if they face inwards."""
    ox, oy, oz = mesh.vertices_mm[0]
    total = []
    for a, b, c in mesh.triangles:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = mesh.vertices_mm[a], mesh.vertices_mm[b], mesh.vertices_mm[c]
        ax, ay, az, bx, by, bz, cx, cy, cz = (
            ax - ox,
            ay - oy,
            az - oz,
            bx - ox,
            by - oy,
            bz - oz,
            cx - ox,
            cy - oy,
            cz - oz,
        )
        total.append(ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx))
    return math.fsum(total) / 6


def _is_solid(shape):
    return bool(shape.Solids)


def _gather(faces):
    index: dict[tuple[float, float, float], int] = {}
    vertices: list[tuple[float, float, float]] = []
    triangles: list[tuple[int, int, int]] = []
    counts = []
    for face_index, face in enumerate(faces):
        points, corners = face.tessellate(KEEP_TRIANGLES)
        local = []
        for point in points:
            key = (point.x + 0.0, point.y + 0.0, point.z + 0.0)  # -0.0 becomes 0.0
            local.append(index.setdefault(key, len(vertices)))
            if local[-1] == len(vertices):
                vertices.append(key)
        new = [(local[a], local[b], local[c]) for a, b, c in corners]
        new = [t for t in new if t[0] != t[1] and t[1] != t[2] and t[2] != t[0]]
        triangles += new
        if new:
            counts.append((face_index, len(new)))
    return Mesh(vertices, triangles, counts)


def _weld(mesh, tolerance_mm):
    """Join vertices that are closer than the tolerance, for shapes whose edges are only nearly common."""
    cells: dict[tuple[int, int, int], list[int]] = {}
    vertices: list[tuple[float, float, float]] = []
    new_index = []
    for x, y, z in mesh.vertices_mm:
        cell = (math.floor(x / tolerance_mm), math.floor(y / tolerance_mm), math.floor(z / tolerance_mm))
        near = _near(cells, cell, vertices, (x, y, z), tolerance_mm)
        if near is None:
            near = len(vertices)
            vertices.append((x, y, z))
            cells.setdefault(cell, []).append(near)
        new_index.append(near)
    triangles, faces, start = [], [], 0
    for face_index, count in mesh.faces:
        joined = [tuple(new_index[i] for i in t) for t in mesh.triangles[start : start + count]]
        joined = [t for t in joined if len(set(t)) == 3]
        start += count
        triangles += joined
        if joined:
            faces.append((face_index, len(joined)))
    return Mesh(vertices, triangles, faces)


def _near(cells, cell, vertices, point, tolerance_mm):
    for dx in (-1, 0, 1):
        for dy in (-1, 0, 1):
            for dz in (-1, 0, 1):
                for i in cells.get((cell[0] + dx, cell[1] + dy, cell[2] + dz), ()):
                    if math.dist(vertices[i], point) <= tolerance_mm:
                        return i
    return None
