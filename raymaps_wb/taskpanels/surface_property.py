# SPDX-License-Identifier: LGPL-2.1-or-later
"""SurfacePropertyPanel: edits a surface property."""

from raymaps_wb.compat import QtWidgets, translate
from raymaps_wb.objects.study import members, study_of
from raymaps_wb.objects.surface_property import SurfaceProperty
from raymaps_wb.taskpanels.base import TablesPanel
from raymaps_wb.taskpanels.layers import LayersEditor


class SurfacePropertyPanel(TablesPanel):
    """Kind, its figures, faces; for a mixture the weight of each of the study's other properties."""

    ICON = "surface_property"
    TITLE = translate("Surface property")
    EDITORS = {"LayerMedia": LayersEditor}
    LEFT_OUT = ("Parts", "Weights", "LayerThicknessNm")

    def add_rows(self):
        study = study_of(self.obj)
        others = members(study, SurfaceProperty.TYPE) if study is not None else []
        self._others = [other for other in others if other is not self.obj and other.Kind != "Mixture"]
        weights = dict(zip([part.Name for part in self.obj.Parts], self.obj.Weights, strict=False))
        self._table = QtWidgets.QTableWidget(len(self._others), 2)
        self._table.setHorizontalHeaderLabels([translate("Property"), translate("Weight")])
        self._table.setToolTip(translate("The share of the light that meets each property; the weights add up to 1"))
        self._table.verticalHeader().hide()
        self._table.horizontalHeader().setSectionResizeMode(0, QtWidgets.QHeaderView.Stretch)
        self._table.horizontalHeader().setSectionResizeMode(1, QtWidgets.QHeaderView.ResizeToContents)
        self._table.setMinimumWidth(150)
        self._table.setMinimumHeight(80)
        self._table.setMaximumHeight(150)
        for row, other in enumerate(self._others):
            self._table.setItem(row, 0, QtWidgets.QTableWidgetItem(other.Label))
            self._table.setItem(row, 1, QtWidgets.QTableWidgetItem(f"{weights.get(other.Name, 0.0):.6g}"))
        self._parts = self.rows.add(translate("Mixture of"), self._table, at=2, is_wide=True)

    def show_relevant(self):
        super().show_relevant()
        self._parts.setVisible(self.chosen("Kind") == "Mixture")

    def check(self):
        super().check()
        if self.chosen("Kind") == "Mixture":
            self._mixture()

    def write(self):
        super().write()
        if self.obj.Kind == "Mixture":
            self.obj.Parts, self.obj.Weights = self._mixture()

    def _mixture(self):
        """(parts, weights) as typed; raises ValueError in words."""
        parts, weights = [], []
        for row, other in enumerate(self._others):
            text = self._table.item(row, 1).text().replace(",", ".")
            try:
                weight = float(text or 0)
            except ValueError:
                raise ValueError(f"Weight of '{other.Label}': '{text}' is not a number.") from None
            if weight:
                parts.append(other)
                weights.append(weight)
        return parts, weights
