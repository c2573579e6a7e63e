# SPDX-License-Identifier: LGPL-2.1-or-later
"""ViewStudy: a study in the tree."""

from raymaps_wb.viewproviders.base import ViewProxy


class ViewStudy(ViewProxy):
    """A folder with our icon; from here on its results are watched for changes of the document."""

    ICON = "study"

    def attach(self, view):
        from raymaps_wb.gui import observer

        super().attach(view)
        observer.install()

    def panel(self, obj):
        from raymaps_wb.taskpanels.study import StudyPanel

        return StudyPanel(obj)
