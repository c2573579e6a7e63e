# SPDX-License-Identifier: LGPL-2.1-or-later
"""MediumPanel: edits a medium."""

from raymaps_wb.compat import translate
from raymaps_wb.objects.medium import CATALOGUE
from raymaps_wb.taskpanels.base import TablesPanel
from raymaps_wb.taskpanels.catalogue import CatalogueEditor
from raymaps_wb.taskpanels.editors import SuggestedEditor
from raymaps_wb.taskpanels.findings import glasses
from raymaps_wb.taskpanels.scattering import OTHERS, ScatteringEditor


class MediumPanel(TablesPanel):
    """A medium of the catalogue, own figures, or a file; and the bodies."""

    ICON = "medium"
    TITLE = translate("Medium")
    EDITORS = {"Catalogue": CatalogueEditor, "Glass": SuggestedEditor, "ScatteringKinds": ScatteringEditor}
    LEFT_OUT = OTHERS

    def add_rows(self):
        self._given = self._name.text()
        self.editors["Catalogue"].chosen.connect(lambda *_: self._take_name())
        self.editors["Kind"].changed.connect(lambda *_: self._take_name())
        file = self.editors["MaterialFile"]
        file.changed.connect(lambda *_: self.editors["Glass"].offer(glasses(file.path())))
        if file.path():
            self.editors["Glass"].offer(glasses(file.path()))

    def begin(self, is_new):
        super().begin(is_new)
        self._take_name()

    def _take_name(self):
        """A new medium is called like that of the catalogue, as long as nobody has typed a name."""
        if self._is_new and self.chosen("Kind") == CATALOGUE and self._name.text() == self._given:
            self._given = self.editors["Catalogue"].name()
            self._name.setText(self._given)
