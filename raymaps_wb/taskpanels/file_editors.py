# SPDX-License-Identifier: LGPL-2.1-or-later
"""Editors of files, and of values that are numbers or a file; see `raymaps_wb.taskpanels.editors`."""

import os

from raymaps_wb.compat import QtWidgets, translate
from raymaps_wb.objects.files import absolute_path, kept_path
from raymaps_wb.taskpanels.editors import NumbersEditor, label_of
from raymaps_wb.taskpanels.findings import finding
from raymaps_wb.taskpanels.rows import beside, column, say, small_label


class FileEditor:
    """A file or folder with a button that looks for it, and a few words about what it holds."""

    def __init__(self, obj, prop):
        self.prop, self._document = prop, obj.Document
        self._is_folder = prop.kind == "App::PropertyPath"
        self.widget = QtWidgets.QLineEdit(getattr(obj, prop.name))
        self.widget.setPlaceholderText(translate("choose a folder") if self._is_folder else translate("choose a file"))
        button = QtWidgets.QToolButton()
        button.setText("...")
        button.setToolTip(translate("Looks for it"))
        button.clicked.connect(self._look_for)
        self.about = small_label()
        self.row = beside(self.widget, button)
        self.changed = self.widget.textChanged
        self.changed.connect(self._tell)
        self._tell()

    def path(self):
        """Absolute path of what is named; empty if nothing is."""
        return absolute_path(self._document, self.widget.text().strip())

    def write(self, obj):
        setattr(obj, self.prop.name, kept_path(self._document, self.path()))

    def _look_for(self):
        here = os.path.dirname(self.path()) or os.path.dirname(self._document.FileName)
        if self._is_folder:
            found = QtWidgets.QFileDialog.getExistingDirectory(self.row, label_of(self.prop), here)
        else:
            found, _ = QtWidgets.QFileDialog.getOpenFileName(self.row, label_of(self.prop), here, self.prop.filter)
        if found:
            self.widget.setText(kept_path(self._document, found))

    def _tell(self, *_):
        text, is_right = finding(self.path(), self.prop.form)
        say(self.about, text, not is_right)


class SpectralEditor:
    """A value as one number, as red, green and blue, or as a file: a list of these forms, and a field for each."""

    IS_WIDE = True
    NUMBER, COLOUR, FILE = range(3)

    def __init__(self, obj, prop):
        self.prop = prop
        self._numbers = NumbersEditor(obj, prop)
        self._file = FileEditor(obj, next(other for other in obj.Proxy.PROPERTIES if other.name == prop.file))
        self.widget = self._numbers.widget
        self.forms = QtWidgets.QComboBox()
        file = translate("Table file") if self._file.prop.form == "share" else translate("Spectrum file")
        self.forms.addItems([translate("Number"), translate("R G B"), file])
        self.forms.setToolTip(translate("One number, one for each of red, green and blue, or a table in a file"))
        self.changed = self.forms.currentIndexChanged
        is_colour = len(getattr(obj, prop.name)) == 3
        self.forms.setCurrentIndex(self.FILE if self._file.path() else self.COLOUR if is_colour else self.NUMBER)
        self.forms.currentIndexChanged.connect(self._form_chosen)
        self._file_row = column(self._file.row, self._file.about)
        self.row = column(beside(self.forms, self.widget), self._file_row)
        self._show()

    def is_file(self):
        """Whether the value stands in a file."""
        return self.forms.currentIndex() == self.FILE

    def value(self):
        """What was typed; raises ValueError in words."""
        if self.is_file():
            if not self._file.path():
                raise ValueError(f"{label_of(self.prop)}: choose a file.")
            return None
        values = self._numbers.value()
        if len(values) not in (1, 3):
            raise ValueError(f"{label_of(self.prop)}: one number is needed, or three, got {len(values)}.")
        return values

    def write(self, obj):
        if self.value() is None:
            self._file.write(obj)
            return
        self._numbers.write(obj)
        setattr(obj, self.prop.file, "")

    def _form_chosen(self, form):
        """Carry what was typed over to the new form."""
        try:
            values = self._numbers.value()
        except ValueError:
            values = []
        if form == self.COLOUR and len(values) == 1:
            self.widget.setText(" ".join([f"{values[0]:.12g}"] * 3))
        elif form == self.NUMBER and len(values) == 3:
            self.widget.setText(f"{sum(values) / 3:.6g}")
        self._show()

    def _show(self):
        self.widget.setVisible(not self.is_file())
        self._file_row.setVisible(self.is_file())
