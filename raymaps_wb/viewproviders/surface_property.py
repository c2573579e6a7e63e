# SPDX-License-Identifier: LGPL-2.1-or-later
"""ViewSurfaceProperty: a surface property in the tree."""

from raymaps_wb.viewproviders.base import ViewProxy


class ViewSurfaceProperty(ViewProxy):
    """An icon, and a task panel."""

    ICON = "surface_property"

    def panel(self, obj):
        from raymaps_wb.taskpanels.surface_property import SurfacePropertyPanel

        return SurfacePropertyPanel(obj)
