# SPDX-License-Identifier: LGPL-2.1-or-later
"""DetectorPanel: edits a detector."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.references import set_references
from raymaps_wb.taskpanels.base import ObjectPanel


class DetectorPanel(ObjectPanel):
    """A rectangle with its cells, side and acceptance angle; faces of a body; or the far field."""

    ICON = "detector"
    TITLE = translate("Detector")

    def add_rows(self):
        self._place = self.add_placement_row(lambda: -1 if self.chosen("Kind") == "Far field" else 1)

    def show_relevant(self):
        super().show_relevant()
        self._place.setVisible(self.chosen("Kind") != "Faces")

    def write(self):
        super().write()
        if self.obj.Kind != "Faces":
            set_references(self.obj, [])
