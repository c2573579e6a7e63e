# SPDX-License-Identifier: LGPL-2.1-or-later
"""Choosing a medium of the catalogue: a list by groups that a search narrows, and what is known of the chosen one."""

from html import escape

from raymaps_wb.compat import QtCore, QtWidgets, translate
from raymaps_wb.objects.catalogue import catalogue, catalogue_medium, told
from raymaps_wb.taskpanels.rows import column, say, small_label


class CatalogueEditor:
    """One medium of the catalogue; ``chosen`` tells its name."""

    IS_WIDE = True

    def __init__(self, obj, prop):
        self.prop = prop
        self.widget = QtWidgets.QLineEdit()
        self.widget.setPlaceholderText(translate("search, such as BK7 or metal"))
        self.widget.setClearButtonEnabled(True)
        self._tree = QtWidgets.QTreeWidget()
        self._tree.setHeaderHidden(True)
        self._tree.setIndentation(12)
        self._tree.setMinimumHeight(150)
        self._tree.setMaximumHeight(200)
        self._about = small_label()
        self._items = {}
        for group, media in catalogue().items():
            branch = QtWidgets.QTreeWidgetItem(self._tree, [group])
            branch.setFlags(QtCore.Qt.ItemIsEnabled)
            for name, data in media.items():
                item = self._items[name] = QtWidgets.QTreeWidgetItem(branch, [name])
                item.setToolTip(0, told(data))
        self.row = column(self.widget, self._tree, self._about)
        self._name = getattr(obj, prop.name)
        if self._name in self._items:
            self._tree.setCurrentItem(self._items[self._name])
            self._tree.scrollToItem(self._items[self._name])
        self._tree.currentItemChanged.connect(self._select)
        self.chosen = self._tree.currentItemChanged
        self.widget.textChanged.connect(self._search)
        self._tell()

    def name(self):
        """The chosen medium."""
        return self._name

    def write(self, obj):
        setattr(obj, self.prop.name, self._name)

    def choose(self, name):
        """Choose a medium by its name."""
        self._tree.setCurrentItem(self._items[name])

    def _select(self, item, _=None):
        if item is not None and item.text(0) in self._items and item.parent() is not None:
            self._name = item.text(0)
            self._tell()

    def _tell(self):
        data = catalogue_medium(self._name)
        if data is None:
            say(self._about, f"The catalogue has no medium '{self._name}'.", is_wrong=True)
            return
        say(self._about, f"<b>{escape(self._name)}</b>: {escape(told(data))}")

    def _search(self, text):
        """Show what holds all words that were typed, in its name, its group or its reference."""
        wanted = text.lower().split()
        for i in range(self._tree.topLevelItemCount()):
            branch = self._tree.topLevelItem(i)
            shown = 0
            for j in range(branch.childCount()):
                item = branch.child(j)
                about = f"{branch.text(0)} {item.text(0)} {item.toolTip(0)}".lower()
                item.setHidden(not all(word in about for word in wanted))
                shown += not item.isHidden()
            branch.setHidden(not shown)
            branch.setExpanded(bool(wanted))
        if not wanted and self._name in self._items:
            self._tree.scrollToItem(self._items[self._name])
