# SPDX-License-Identifier: LGPL-2.1-or-later
"""A task panel that shows an object's properties, and only those that matter for its kind."""

import math
from html import escape
from typing import Any

import FreeCAD
import FreeCADGui
import Part

from raymaps_wb.compat import QtGui, QtWidgets, flags_as_int, primary_selection, translate
from raymaps_wb.gui.active import PREFIX, is_own_step_open
from raymaps_wb.paths import icon
from raymaps_wb.taskpanels.editor_table import editor_of
from raymaps_wb.taskpanels.editors import label_of
from raymaps_wb.taskpanels.file_editors import FileEditor, SpectralEditor
from raymaps_wb.taskpanels.rows import WRONG, Rows, section_label

GAP_MM = 0.05  # between a face and what is put on it


class ObjectPanel:
    """Edits a document object as one step of undo: OK commits, Cancel takes everything back."""

    ICON = "raymaps"
    TITLE = ""
    LEFT_OUT: tuple[str, ...] = ()
    EDITORS: dict[str, Any] = {}
    SECTIONS: dict[str, str] = {}

    def __init__(self, obj):
        self.obj, self._is_new = obj, False
        self._document, self._object = obj.Document.Name, obj.Name
        self.form = QtWidgets.QWidget()
        self.form.setWindowTitle(self.TITLE or obj.Label)
        self.form.setWindowIcon(QtGui.QIcon(icon(self.ICON)))
        self.rows = Rows(self.form)
        self._name = QtWidgets.QLineEdit(obj.Label)
        self.rows.add(translate("Name"), self._name)
        self.editors: dict[str, Any] = {}
        self._rows: dict[str, Any] = {}
        for prop in obj.Proxy.PROPERTIES:
            if prop.hidden or prop.read_only or prop.name in self.LEFT_OUT:
                continue
            editor = self.EDITORS[prop.name](obj, prop) if prop.name in self.EDITORS else editor_of(obj, prop)
            if editor is not None:
                self.add(prop, editor)
        self.add_rows()
        self._message = QtWidgets.QLabel()
        self._message.setWordWrap(True)
        self._message.setStyleSheet(WRONG)
        self.rows.add("", self._message)
        self.rows.end()
        for name in {name for prop in obj.Proxy.PROPERTIES for name in prop.conditions}:
            self.editors[name].changed.connect(lambda *_: self.show_relevant())
        self.show_relevant()

    def add(self, prop, editor):
        """A row for a property."""
        if prop.name in self.SECTIONS:
            self.rows.add("", section_label(self.SECTIONS[prop.name]))
        field = getattr(editor, "row", editor.widget)
        is_wide, about = getattr(editor, "IS_WIDE", False), getattr(editor, "about", None)
        row = self.rows.add(label_of(prop), field, is_wide=is_wide, about=about)
        for widget in (row, field, editor.widget):
            widget.setToolTip(tooltip(prop.text))
        self.editors[prop.name], self._rows[prop.name] = editor, row

    def add_rows(self):
        """For rows of a panel's own."""

    def chosen(self, name):
        """The present choice of an enumeration, chosen but perhaps not written yet."""
        return self.editors[name].choice()

    def show_relevant(self):
        """Show only what matters for what is chosen."""
        self._message.setText("")
        for prop in self.obj.Proxy.PROPERTIES:
            if prop.conditions and prop.name in self._rows:
                self._rows[prop.name].setVisible(prop.matters(self.chosen) and self.is_wanted(prop.name))
        self.rows.align()

    def is_wanted(self, name):
        """Whether a property that matters is worth a row as things are."""
        return True

    def relevant(self):
        """Editors of what matters for what is chosen."""
        props = {prop.name: prop for prop in self.obj.Proxy.PROPERTIES}
        return [editor for name, editor in self.editors.items() if props[name].matters(self.chosen)]

    def begin(self, is_new):
        """Open the step of undo that OK or Cancel ends; for a new object it is open since the object was made."""
        self._is_new = is_new
        if not is_new:
            self.obj.Document.openTransaction(f"{PREFIX}edit {self.obj.Label}")

    def check(self):
        """Raise ValueError in words if something that was typed can't be written."""
        for editor in self.relevant():
            if hasattr(editor, "value"):
                editor.value()

    def write(self):
        """Write what matters to the object; raises ValueError in words."""
        self.obj.Label = self._name.text().strip() or self.obj.Label
        for editor in self.relevant():
            editor.write(self.obj)

    def accept(self):
        document = self._document_with_object()
        if document is None:  # undone meanwhile
            self._close()
            return True
        try:
            self.check()
        except ValueError as error:
            self._message.setText(str(error))
            return False
        if not is_own_step_open():  # something else ended it, such as an undo or a save
            document.openTransaction(f"{PREFIX}edit {self.obj.Label}")
        self.write()
        document.commitTransaction()
        document.recompute()
        self._close()
        return True

    def reject(self):
        document = self._document_with_object()
        if document is not None and is_own_step_open():
            document.abortTransaction()
        self._close()
        document = self._document_with_object()
        if document is not None and self._is_new:  # its step was ended meanwhile, by a run that was done for instance
            document.openTransaction(f"{PREFIX}cancel")
            document.removeObject(self._object)
            document.commitTransaction()
        return True

    def _document_with_object(self):
        """The document; None if the object is not in it any more."""
        document = FreeCAD.listDocuments().get(self._document)
        return document if document is not None and document.getObject(self._object) is not None else None

    def _close(self):
        if self._document in FreeCAD.listDocuments():
            FreeCADGui.getDocument(self._document).resetEdit()

    def getStandardButtons(self):
        return flags_as_int(QtWidgets.QDialogButtonBox.Ok | QtWidgets.QDialogButtonBox.Cancel)

    def add_placement_row(self, facing):
        """A row that tells how to place the object, and a button that puts it on the selected face.

        ``facing`` 1: the object's z axis points out of the face; -1: into it; or a function that tells which.
        """
        button = QtWidgets.QPushButton(translate("Put on selected face"))
        button.setToolTip(translate("Moves it to the middle of the face selected in the 3D view, along its normal"))
        button.clicked.connect(lambda: self._put_on_face(facing() if callable(facing) else facing))
        return self.rows.add(translate("Placement"), button)

    def _put_on_face(self, facing):
        placement = placement_on_selected_face(facing)
        if placement is None:
            self._message.setText(translate("Select a face in the 3D view first."))
            return
        self._message.setText("")
        self.obj.Placement = placement


class TablesPanel(ObjectPanel):
    """Panel of an object with spectra: what holds outside of tables is asked for only where there are some."""

    def __init__(self, obj):
        super().__init__(obj)
        for editor in self.editors.values():
            if isinstance(editor, SpectralEditor):
                editor.changed.connect(lambda *_: self.show_relevant())

    def is_wanted(self, name):
        if name != "OutsideTables":
            return True
        return any(
            isinstance(editor, FileEditor) or (isinstance(editor, SpectralEditor) and editor.is_file())
            for editor in self.relevant()
        )


def tooltip(text):
    """A tooltip that breaks lines where it is long; Qt does so for rich text only."""
    return "<p>" + "<br>".join(escape(line) for line in text.split("\n")) + "</p>"


def placement_on_selected_face(facing=1, gap_mm=GAP_MM):
    """Placement in the middle of the selected face, its z axis along the outward normal; None without a face."""
    face = selected_face()
    if face is None:
        return None
    middle = face.CenterOfMass
    normal = face.normalAt(*face.Surface.parameter(middle))
    rotation = FreeCAD.Rotation(FreeCAD.Vector(0, 0, 1), normal * facing)
    return FreeCAD.Placement(middle + normal * gap_mm, rotation)


def rectangle_on_selected_face(gap_mm=GAP_MM):
    """The rectangle around the selected face, just above it, along its own straight edges.

    Returns
    -------
    (placement, width in mm, height in mm); None without a face, or if it is not plane
    """
    face = selected_face()
    if face is None or not isinstance(face.Surface, Part.Plane):
        return None
    normal = face.normalAt(*face.Surface.parameter(face.CenterOfMass))
    upright = FreeCAD.Rotation(FreeCAD.Vector(0, 0, 1), normal)
    placement = FreeCAD.Placement(face.CenterOfMass, upright * _turn_along_edges(face, upright))
    flat = face.copy()
    flat.Placement = placement.inverse().multiply(flat.Placement)
    box = flat.BoundBox
    placement.Base = placement.multVec(FreeCAD.Vector(box.Center.x, box.Center.y, 0)) + normal * gap_mm
    return placement, round(box.XLength, 6), round(box.YLength, 6)


def _turn_along_edges(face, upright):
    """Rotation about z, by at most 45 degrees, that puts the x or y axis along the longest straight edge."""
    straight = [edge for edge in face.Edges if isinstance(edge.Curve, Part.Line)]
    if not straight:
        return FreeCAD.Rotation()
    longest = max(straight, key=lambda edge: round(edge.Length, 6))
    along = upright.inverted().multVec(longest.tangentAt(longest.FirstParameter))
    angle_deg = math.degrees(math.atan2(along.y, along.x))
    return FreeCAD.Rotation(FreeCAD.Vector(0, 0, 1), angle_deg - 90 * round(angle_deg / 90))


def selected_face():
    """The first selected face in global coordinates; None without one."""
    from raymaps_wb.errors import ExportError
    from raymaps_wb.export.bodies import resolve, shape_of

    for target, sub in primary_selection():
        try:
            picked = resolve(target, sub)
        except ExportError:
            continue
        place, name = picked[0]
        if name is None:
            continue
        return shape_of(place).Faces[int(name[4:]) - 1]
    return None
