# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scatterers of a medium, one row each."""

from raymaps_wb.compat import QtWidgets, translate
from raymaps_wb.objects.files import absolute_path, kept_path
from raymaps_wb.objects.medium import HENYEY_GREENSTEIN, PHASE_TABLE, PHASES, SCATTERING, scatterers, set_scatterers
from raymaps_wb.objects.spectral import TEXT_FILES
from raymaps_wb.taskpanels.lists import ListEditor
from raymaps_wb.taskpanels.rows import beside

TIP = (
    "Scattering coefficient in 1/mm: the mean free path is its inverse. One number such as 0.5, three for red, green "
    "and blue, or a spectrum file"
)


class ScatteringEditor(ListEditor):
    """Kind of scatterers, coefficient, and g or the phase function's file."""

    HEADINGS = ("Scatterers", "1/mm", "g or file")
    ADD = translate("Add scatterers")

    def __init__(self, obj, prop):
        super().__init__()
        self.prop, self._document = prop, obj.Document
        header = self.widget.horizontalHeader()
        for i in (1, 2):
            header.setSectionResizeMode(i, QtWidgets.QHeaderView.Fixed)
            header.resizeSection(i, 62)
        self.set_rows(scatterers(obj))

    def new_values(self):
        return (HENYEY_GREENSTEIN, "0.1", 0.8, "")

    def widgets(self, values):
        kind, coefficient, g, path = values
        kinds = QtWidgets.QComboBox()
        kinds.addItems(list(PHASES))
        kinds.setCurrentText(kind)
        kinds.setToolTip(translate("How they scatter"))
        kinds.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        detail = _Detail(self._document, g, path)
        kinds.currentTextChanged.connect(detail.show_for)
        detail.show_for(kinds.currentText())
        return kinds, _Coefficient(self._document, coefficient), detail.widget

    def values_of(self, widgets):
        kinds, coefficient, detail = widgets
        return (kinds.currentText(), coefficient.text().strip(), *detail.detail.values())

    def value(self):
        """Check what was typed; raises ValueError in words."""
        for kind, coefficient, g, path in self.rows():
            if not coefficient:
                raise ValueError("Scattering: each kind of scatterers needs a coefficient in 1/mm.")
            if kind == HENYEY_GREENSTEIN and not (g is not None and -1 < g < 1):
                raise ValueError("Scattering: g must be a number above -1 and below 1.")
            if kind == PHASE_TABLE and not path:
                raise ValueError("Scattering: choose the file of the phase function.")

    def write(self, obj):
        rows = [
            (kind, _kept(self._document, coefficient), g or 0.0, kept_path(self._document, path))
            for kind, coefficient, g, path in self.rows()
        ]
        set_scatterers(obj, rows)


class _Coefficient(QtWidgets.QLineEdit):
    """Numbers, or a file that the button at its end looks for."""

    def __init__(self, document, text):
        super().__init__(text)
        self._document = document
        self.setToolTip(TIP)
        self.setFrame(False)
        style = self.style().standardIcon(QtWidgets.QStyle.SP_DirOpenIcon)
        action = self.addAction(style, QtWidgets.QLineEdit.TrailingPosition)
        action.setToolTip(translate("Looks for a spectrum file"))
        action.triggered.connect(self._look_for)

    def _look_for(self):
        found = look_for(self, self._document, "", translate("Scattering coefficient"))
        if found:
            self.setText(found)


class _Detail:
    """g of Henyey and Greenstein, or the file of a phase function; nothing for isotropic scatterers."""

    def __init__(self, document, g, path):
        self._document = document
        self._g = QtWidgets.QLineEdit(f"{g or 0.0:.12g}")
        self._g.setToolTip(translate("Mean cosine g of the scattering angle, -1 to 1: 0.9 is strongly forward"))
        self._g.setFrame(False)
        self._file = QtWidgets.QLineEdit(path)
        self._file.setToolTip(translate("Phase function: two columns, angle from 0 to 180 degrees and value"))
        self._file.setFrame(False)
        self._button = QtWidgets.QToolButton()
        self._button.setText("...")
        self._button.clicked.connect(self._look_for)
        self.widget = beside(self._g, self._file, self._button)
        self.widget.detail = self  # a table keeps the widget alone

    def show_for(self, kind):
        """Show what a kind of scatterers needs."""
        self._g.setVisible(kind == HENYEY_GREENSTEIN)
        self._file.setVisible(kind == PHASE_TABLE)
        self._button.setVisible(kind == PHASE_TABLE)

    def values(self):
        """g, None if it is no number, and the absolute path of the file."""
        try:
            g = float(self._g.text().replace(",", "."))
        except ValueError:
            g = None
        return g, absolute_path(self._document, self._file.text().strip())

    def _look_for(self):
        found = look_for(self.widget, self._document, self._file.text(), translate("Phase function"))
        if found:
            self._file.setText(found)


def look_for(parent, document, path, title):
    """A table that the user chose, as the document keeps it; empty if none."""
    found, _ = QtWidgets.QFileDialog.getOpenFileName(parent, title, absolute_path(document, path), TEXT_FILES)
    return kept_path(document, found) if found else ""


def _kept(document, coefficient):
    """A coefficient as typed; if it is a file, as the document keeps it."""
    try:
        [float(number) for number in coefficient.replace(";", " ").split()]
    except ValueError:
        return kept_path(document, absolute_path(document, coefficient))
    return coefficient


#: Properties that this editor writes beside its own.
OTHERS = SCATTERING[1:]
