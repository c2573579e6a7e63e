# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writing a study as a scene file with its geometry beside it."""

import json
import os
from collections import namedtuple

from raymaps_wb.errors import ExportError
from raymaps_wb.export.bodies import shape_of
from raymaps_wb.export.description import describe
from raymaps_wb.export.fingerprint import combined, shape_digest
from raymaps_wb.export.ply import ply_bytes
from raymaps_wb.export.surfaces import exact_surface
from raymaps_wb.export.triangles import open_edges, stand_in, triangulate

#: path: of the scene file. fingerprint: of what was written. triangles: number in all.
Exported = namedtuple("Exported", "path fingerprint triangles")


def export_study(study, folder, stem=None, progress=None):
    """Write ``STEM.scene.json`` and ``STEM.geometry/`` into a folder, and ``STEM.files/`` if it speaks of files.

    Parameters
    ----------
    study : document object
    folder : str, made if it is not there
    stem : str, optional
        Name of the files; the study's label by default.
    progress : callable(done, of), optional
        Called after each body.

    Returns
    -------
    Exported

    Raises
    ------
    ExportError
        If the study can't be written as a scene, or the files can't be written.
    """
    description = describe(study)
    stem = stem or file_stem(study.Label)
    scene, digests, n_triangles = description.scene, {}, 0
    try:
        os.makedirs(os.path.join(folder, stem + ".geometry"), exist_ok=True)
        taken: set[str] = set()
        for done, (name, place) in enumerate(description.places.items()):
            shape = shape_of(place)
            mesh = triangulate(shape, float(study.ChordTolerance), float(study.AngularDeflection), f"Body '{name}'")
            body = scene["bodies"][name]
            if body["medium"] is not None and open_edges(mesh):
                raise ExportError(
                    f"Body '{name}' is filled with '{body['medium']}' but its shell is open or its faces don't meet "
                    f"({open_edges(mesh)} edges without a partner); make it a solid, or remove the medium."
                )
            file_name = f"{stem}.geometry/{_unique(file_stem(name), taken)}.ply"
            _write(os.path.join(folder, file_name), ply_bytes(mesh))
            faces = shape.Faces
            body["geometry"] = {
                "file": file_name,
                "mm_per_unit": 1.0,
                "faces": [
                    {
                        "name": f"Face{index + 1}",
                        "triangles": count,
                        "surface": exact_surface(faces[index], mesh.is_turned),
                    }
                    for index, count in mesh.faces
                ],
            }
            digests[name] = shape_digest(shape)
            n_triangles += len(mesh.triangles)
            if progress is not None:
                progress(done + 1, len(description.places))
        digest = combined(description._replace(scene=_without_geometry(scene)), digests, study)
        description.files.copy(folder, stem)
        scene = description.files.placed(scene, folder, stem)
        document = os.path.basename(study.Document.FileName) or study.Document.Label
        scene["origin"] = {"document": document, "study": study.Label, "fingerprint": digest}
        path = os.path.join(folder, stem + ".scene.json")
        _write(path, scene_text(scene).encode("utf-8"))
    except ValueError as error:  # NaN or infinite numbers have no JSON
        raise ExportError(
            f"Study '{study.Label}' holds a number that is not finite (NaN or infinite): {error}."
        ) from error
    except OSError as error:
        raise ExportError(f"Folder '{folder}' can't be written: {error.strerror or error}.") from error
    return Exported(path, digest, n_triangles)


def write_with_stand_ins(study, folder):
    """Write a study's scene, all effects on, with stand-ins for its bodies: enough to tell which effects it calls for.

    Returns
    -------
    str, path of the scene file

    Raises
    ------
    ExportError
        If the study can't be written as a scene, or the file can't be written.
    """
    description = describe(study)
    scene = description.scene
    scene["settings"].pop("without", None)
    path = os.path.join(folder, "study.scene.json")
    try:
        for number, (name, place) in enumerate(description.places.items()):
            mesh = stand_in(len(shape_of(place).Faces))
            _write(os.path.join(folder, f"{number}.ply"), ply_bytes(mesh))
            faces = [{"name": f"Face{index + 1}", "triangles": count} for index, count in mesh.faces]
            scene["bodies"][name]["geometry"] = {"file": f"{number}.ply", "mm_per_unit": 1.0, "faces": faces}
        description.files.copy(folder, "study")
        _write(path, scene_text(description.files.placed(scene, folder, "study")).encode("utf-8"))
    except ValueError as error:
        raise ExportError(f"Study '{study.Label}' holds a number that is not finite: {error}.") from error
    except OSError as error:
        raise ExportError(f"Folder '{folder}' can't be written: {error.strerror or error}.") from error
    return path


def file_stem(label):
    """A label as a file name for any system."""
    text = "".join(c if c.isalnum() or c in "-_" else "_" for c in label.strip())
    return text[:80] or "study"


def scene_text(scene):
    """The scene as JSON that people can read: one line for each list of numbers."""
    return _indented(scene, "") + "\n"


def _indented(data, indent):
    if isinstance(data, dict) and data:
        flat = json.dumps(data, ensure_ascii=False, allow_nan=False)
        if len(flat) + len(indent) <= 180:
            return flat
        lines = [
            f"{indent}  {json.dumps(k, ensure_ascii=False)}: {_indented(v, indent + '  ')}" for k, v in data.items()
        ]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    if isinstance(data, list) and data and isinstance(data[0], (dict, list)):
        lines = [f"{indent}  {_indented(item, indent + '  ')}" for item in data]
        return "[\n" + ",\n".join(lines) + f"\n{indent}]"
    return json.dumps(data, ensure_ascii=False, allow_nan=False)


def _without_geometry(scene):
    bodies = {name: {k: v for k, v in body.items() if k != "geometry"} for name, body in scene["bodies"].items()}
    return {**scene, "bodies": bodies}


def _unique(stem, taken):
    name, n = stem, 1
    while name.lower() in taken:
        n += 1
        name = f"{stem}_{n}"
    taken.add(name.lower())
    return name


def _write(path, content):
    """Write a file so that it is either the whole new one or the old one."""
    with open(path + ".part", "wb") as file:
        file.write(content)
    os.replace(path + ".part", path)
