# SPDX-License-Identifier: LGPL-2.1-or-later
"""SourcePanel: edits a source."""

from raymaps_wb.compat import translate
from raymaps_wb.taskpanels.base import ObjectPanel


class SourcePanel(ObjectPanel):
    """Kind, flux, colour, and where the light comes from."""

    ICON = "source"
    TITLE = translate("Source")

    def add_rows(self):
        self._place = self.add_placement_row(facing=1)

    def shown(self, prop, kind):
        return kind == "Faces" if prop.name == "References" else super().shown(prop, kind)

    def show_for_kind(self, kind):
        super().show_for_kind(kind)
        self._place.setEnabled(kind != "Faces")
