# SPDX-License-Identifier: LGPL-2.1-or-later
"""DetectorPanel: edits a detector."""

from raymaps_wb.compat import translate
from raymaps_wb.taskpanels.base import ObjectPanel


class DetectorPanel(ObjectPanel):
    """Size, cells, side and acceptance angle."""

    ICON = "detector"
    TITLE = translate("Detector")

    def add_rows(self):
        self.add_placement_row(facing=1)
