# SPDX-License-Identifier: LGPL-2.1-or-later
"""ViewMedium: a medium in the tree."""

from raymaps_wb.viewproviders.base import ViewProxy


class ViewMedium(ViewProxy):
    """An icon, and a task panel."""

    ICON = "medium"

    def panel(self, obj):
        from raymaps_wb.taskpanels.medium import MediumPanel

        return MediumPanel(obj)
