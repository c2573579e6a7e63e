# SPDX-License-Identifier: LGPL-2.1-or-later
"""What FreeCAD can tell of a shape by itself, and of two: faults, faces that cross, and space in common."""

import Part

NOT_FAULTS = "No error"  # FreeCAD lists it, too
MEET_MM = 1e-7
MAX_FACES = 300  # how many faces a shape may have to be looked at for crossings, which takes a while
SAME_VOLUME = 1e-9  # of the larger one; as the tracer has it


def faulty_faces(shape):
    """Faces of a shape that are faulty by themselves, as names, and FreeCAD's words for what it found."""
    faces = [f"Face{i}" for i, face in enumerate(shape.Faces, 1) if not face.isValid()]
    try:
        shape.check(False)
    except ValueError as error:
        found = dict.fromkeys(line.strip().lower() for line in str(error).splitlines())
        return faces, [line for line in found if line and line != NOT_FAULTS.lower()]
    return faces, []


def crosses_itself(shape):
    """Whether faces of a sound shape cross or meet where they should not; not looked for among very many faces."""
    if len(shape.Faces) > MAX_FACES:
        return False
    try:
        shape.check(True)
    except ValueError as error:
        return any("Face" in line and "SelfIntersect" in line for line in str(error).splitlines())
    except (RuntimeError, Part.OCCError):
        pass
    return False


def crossing_faces(shape):
    """Pairs of names of faces that meet though they share no corner."""
    faces, found = shape.Faces, []
    corners = [{(round(v.X, 6), round(v.Y, 6), round(v.Z, 6)) for v in face.Vertexes} for face in faces]
    for i, face in enumerate(faces):
        for k in range(i + 1, len(faces)):
            if corners[i] & corners[k] or not face.BoundBox.intersect(faces[k].BoundBox):
                continue
            if face.distToShape(faces[k])[0] < MEET_MM:
                found.append((f"Face{i + 1}", f"Face{k + 1}"))
    return found


def shared_volume_mm3(a, b):
    """Volume that two sound solids have in common; 0 if they only touch.

    Raises
    ------
    RuntimeError
        If FreeCAD can't tell.
    """
    if not a.BoundBox.intersect(b.BoundBox):
        return 0.0
    try:
        return sum(abs(solid.Volume) for solid in a.common(b).Solids)
    except Part.OCCError as error:
        raise RuntimeError(str(error)) from error


def is_smaller(volume_mm3, other_mm3):
    """Whether a volume is smaller than another by more than rounding."""
    return volume_mm3 < other_mm3 - SAME_VOLUME * max(volume_mm3, other_mm3)
