# SPDX-License-Identifier: LGPL-2.1-or-later
"""StudyPanel: the settings of a study."""

from raymaps_wb.compat import QtWidgets, translate
from raymaps_wb.objects.medium import Medium
from raymaps_wb.objects.study import members
from raymaps_wb.taskpanels.base import ObjectPanel
from raymaps_wb.taskpanels.effects import EffectsEditor


class StudyPanel(ObjectPanel):
    """Rays, limits, the medium around everything, surfaces and their triangles, spectral light, and effects."""

    ICON = "study"
    TITLE = translate("Study")
    EDITORS = {"Without": EffectsEditor}
    SECTIONS = {
        "Rays": translate("Rays"),
        "Surfaces": translate("Geometry"),
        "SpectrumFromNm": translate("Spectral light"),
    }

    def add_rows(self):
        self._media = members(self.obj, Medium.TYPE)
        self._ambient = QtWidgets.QComboBox()
        self._ambient.addItems([translate("vacuum"), *(medium.Label for medium in self._media)])
        if self.obj.AmbientMedium in self._media:
            self._ambient.setCurrentIndex(1 + self._media.index(self.obj.AmbientMedium))
        self._ambient.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self._ambient.setToolTip(translate("Medium outside all bodies"))
        self.rows.add(translate("Outside"), self._ambient, at=1)

    def write(self):
        super().write()
        index = self._ambient.currentIndex()
        self.obj.AmbientMedium = self._media[index - 1] if index > 0 else None

    def _close(self):
        self.editors["Without"].close()
        super()._close()
