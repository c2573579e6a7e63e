# SPDX-License-Identifier: LGPL-2.1-or-later
"""MediumPanel: edits a medium."""

from raymaps_wb.compat import QtWidgets, translate
from raymaps_wb.objects.medium import PRESETS
from raymaps_wb.taskpanels.base import ObjectPanel


class MediumPanel(ObjectPanel):
    """Index, absorption, bodies, and a list of common media to start from."""

    ICON = "medium"
    TITLE = translate("Medium")

    def add_rows(self):
        presets = QtWidgets.QComboBox()
        presets.addItems([translate("choose ..."), *PRESETS])
        presets.currentTextChanged.connect(self._take)
        self.layout.insertRow(1, translate("Start from"), presets)

    def _take(self, name):
        if name in PRESETS:
            self.editors["RefractiveIndex"].widget.setText(f"{PRESETS[name]:g}")
            self._name.setText(name)
