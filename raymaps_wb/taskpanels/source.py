# SPDX-License-Identifier: LGPL-2.1-or-later
"""SourcePanel: edits a source."""

from raymaps_wb.compat import translate
from raymaps_wb.taskpanels.base import ObjectPanel
from raymaps_wb.taskpanels.editors import SuggestedEditor
from raymaps_wb.taskpanels.findings import map_detectors


class SourcePanel(ObjectPanel):
    """Kind, flux, colour, and where the light comes from."""

    ICON = "source"
    TITLE = translate("Source")
    EDITORS = {"MapDetector": SuggestedEditor}
    SECTIONS = {"Spectrum": translate("Colour and rays")}

    def add_rows(self):
        self._place = self.add_placement_row(lambda: -1 if self.chosen("Kind") == "Luminaire" else 1)
        folder = self.editors["MapFolder"]
        folder.changed.connect(lambda *_: self.editors["MapDetector"].offer(map_detectors(folder.path())))
        if folder.path():
            self.editors["MapDetector"].offer(map_detectors(folder.path()))

    def show_relevant(self):
        super().show_relevant()
        self._place.setVisible(self.chosen("Kind") != "Faces")
