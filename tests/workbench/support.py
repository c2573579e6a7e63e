# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the tests share: documents that are closed again, scenes as they were written, meshes and their measures."""

import json
import os
import shutil
import struct
import subprocess
import tempfile
import unittest

import FreeCAD

from raymaps_wb.export.writer import export_study
from raymaps_wb.objects.detector import make_detector
from raymaps_wb.objects.medium import make_medium
from raymaps_wb.objects.references import set_references
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import make_study
from raymaps_wb.objects.surface_property import make_surface_property
from raymaps_wb.paths import CORE_FOLDER
from raymaps_wb.tracer.interpreter import find_interpreter, tracer_arguments

ADDON = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
EXAMPLES = os.path.join(ADDON, "examples")


class DocumentTest(unittest.TestCase):
    """A new document and a temporary folder for each test."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="raymaps-test-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.document = FreeCAD.newDocument("test")
        self.document.UndoMode = 1
        self.addCleanup(close_all)

    def vector(self, x, y, z):
        return FreeCAD.Vector(x, y, z)

    def placement(self, x=0, y=0, z=0, axis=(0, 0, 1), angle_deg=0):
        return FreeCAD.Placement(self.vector(x, y, z), FreeCAD.Rotation(self.vector(*axis), angle_deg))

    def box(self, label="Box", size=(10, 20, 30), parent=None):
        box = self.document.addObject("Part::Box", label)
        box.Length, box.Width, box.Height = size
        if parent is not None:
            parent.addObject(box)
        return box

    def study(self, *references, source=True):
        """A study with PMMA in what the references name."""
        self.document.recompute()
        study = make_study(self.document)
        medium = make_medium(self.document, study, preset="PMMA")
        set_references(medium, references)
        if source:
            make_source(self.document, study)
        self.document.recompute()
        return study

    def full_study(self):
        """A box of plastic above a black plate, a beam and a detector."""
        lens, plate = self.box("Lens"), self.box("Plate", (50, 50, 1))
        plate.Placement.Base = self.vector(-20, -20, -10)
        study = self.study((lens, ""))
        black = make_surface_property(self.document, study, "black")
        set_references(black, [(plate, ""), (lens, "Face5")])
        make_detector(self.document, study)
        self.document.recompute()
        return study, lens, plate

    def export(self, study):
        """The written scene, and a dict of body name to (vertices, triangles)."""
        exported = export_study(study, self.folder)
        with open(exported.path, encoding="utf-8") as file:
            scene = json.load(file)
        meshes = {
            name: read_ply(os.path.join(self.folder, body["geometry"]["file"]))
            for name, body in scene["bodies"].items()
        }
        return scene, meshes

    def reopened(self, document):
        """Save, close and open a document."""
        path = document.FileName or os.path.join(self.folder, "test.FCStd")
        document.saveAs(path)
        FreeCAD.closeDocument(document.Name)
        return FreeCAD.openDocument(path)


def check_scene(path):
    """What the core has against a scene: sentences, none if it is sound."""
    command = [find_interpreter().path, *tracer_arguments(["check", path, "--json"])]
    run = subprocess.run(command, capture_output=True, text=True, env=clean_environment(), timeout=120)
    if not run.stdout:
        return [run.stderr.strip() or f"exit code {run.returncode}"]
    return [finding["text"] for finding in json.loads(run.stdout)["findings"] if finding["severity"] == "fault"]


def ask_core(code):
    """What Python code that imports the core prints."""
    command = [find_interpreter().path, "-c", code]
    environment = {**clean_environment(), "PYTHONPATH": CORE_FOLDER}
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120, check=True).stdout


def clean_environment():
    """The environment without what would mislead another Python than FreeCAD's."""
    return {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "QT_", "LD_"))}


def close_all():
    for name in list(FreeCAD.listDocuments()):
        FreeCAD.closeDocument(name)


def read_ply(path):
    """Vertices and triangles of a binary PLY file, read by its own header and nothing else."""
    with open(path, "rb") as file:
        data = file.read()
    header, body = data.split(b"end_header\n", 1)
    lines = header.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"], lines
    counts = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    n = counts["vertex"]
    vertices = list(struct.iter_unpack("<3d", body[: 24 * n]))
    triangles = []
    for count, a, b, c in struct.iter_unpack("<Biii", body[24 * n :]):
        assert count == 3
        triangles.append((a, b, c))
    assert len(triangles) == counts["face"]
    return vertices, triangles


def volume_mm3(mesh):
    vertices, triangles = mesh
    total = 0.0
    for a, b, c in triangles:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = vertices[a], vertices[b], vertices[c]
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6


def bounds(mesh):
    vertices, _ = mesh
    return [round(f(v[i] for v in vertices), 6) + 0.0 for f in (min, max) for i in range(3)]


def unpaired_edges(mesh):
    """Directed edges without exactly one opposite partner; none for a closed, consistently turned mesh."""
    uses = {}
    for a, b, c in mesh[1]:
        for edge in ((a, b), (b, c), (c, a)):
            uses[edge] = uses.get(edge, 0) + 1
    return [edge for edge, n in uses.items() if n != 1 or uses.get(edge[::-1]) != 1]
