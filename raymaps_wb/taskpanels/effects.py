# SPDX-License-Identifier: LGPL-2.1-or-later
"""The effects that a study calls for, with the reasons, each with a tick that switches it off."""

import tempfile

from raymaps_wb.compat import QtCore, QtWidgets, translate
from raymaps_wb.errors import WorkbenchError
from raymaps_wb.export.writer import write_with_stand_ins
from raymaps_wb.taskpanels.rows import beside, column, small_label
from raymaps_wb.tracer.explain import Explanation, title_of

NEVER_OFF = ("absorber",)  # what ends rays on surfaces


class EffectsEditor:
    """Asks the tracer about the study as it is in the document, and keeps the names of effects without a tick."""

    IS_WIDE = True

    def __init__(self, obj, prop):
        self.prop, self._study = prop, obj
        self._without = [name.strip() for name in getattr(obj, prop.name) if name.strip()]
        self.widget = QtWidgets.QTreeWidget()
        self.widget.setHeaderLabels([translate("Effect"), translate("because of")])
        self.widget.setMinimumHeight(140)
        self.widget.setMaximumHeight(180)
        self.widget.setRootIsDecorated(True)
        self.widget.itemChanged.connect(self._ticked)
        self._about = small_label(translate("Asking the tracer ..."))
        again = QtWidgets.QPushButton(translate("Look again"))
        again.setToolTip(translate("Asks the tracer which effects the study as it is now calls for"))
        again.clicked.connect(self.look)
        again.setSizePolicy(QtWidgets.QSizePolicy.Maximum, QtWidgets.QSizePolicy.Fixed)
        self.row = column(self.widget, beside(self._about, again))
        self._explanation, self._folder, self._unknown = None, None, []
        self.look()

    def write(self, obj):
        setattr(obj, self.prop.name, list(self._without))

    def look(self):
        """Ask which effects the study calls for."""
        self._forget()
        self._folder = tempfile.TemporaryDirectory(prefix="raymaps-")
        try:
            scene = write_with_stand_ins(self._study, self._folder.name)
            self._explanation = Explanation(scene, self.row)
        except WorkbenchError as error:
            self._tell(str(error))
            return
        self._explanation.explained.connect(self.show)
        self._explanation.failed.connect(self._tell)
        self._explanation.start()

    def show(self, effects):
        """Show effects: those that are needed with their reasons, the others in a branch of their own."""
        names = [effect.name for effect in effects if effect.name not in NEVER_OFF]
        self._unknown = [name for name in self._without if name not in names]
        self._without = [name for name in self._without if name in names]
        self.widget.blockSignals(True)
        self.widget.clear()
        others = [effect for effect in effects if not (effect.needed or effect.because)]
        for effect in effects:
            if effect not in others:
                self._branch(effect)
        if others:
            branch = QtWidgets.QTreeWidgetItem(self.widget, [translate("not needed"), str(len(others))])
            branch.setFirstColumnSpanned(False)
            for effect in others:
                item = QtWidgets.QTreeWidgetItem(branch, [title_of(effect), effect.summary])
                item.setToolTip(0, effect.summary)
                item.setDisabled(True)
        self.widget.resizeColumnToContents(0)
        self.widget.blockSignals(False)
        self._count()

    def _branch(self, effect):
        more = f" (+{len(effect.because) - 1})" if len(effect.because) > 1 else ""
        reason = effect.because[0] + more if effect.because else ""
        item = QtWidgets.QTreeWidgetItem(self.widget, [title_of(effect), reason])
        item.setData(0, QtCore.Qt.UserRole, effect.name)
        if effect.name in NEVER_OFF:
            item.setFlags(item.flags() & ~QtCore.Qt.ItemIsUserCheckable)
        is_off = effect.name in self._without
        item.setCheckState(0, QtCore.Qt.Unchecked if is_off else QtCore.Qt.Checked)
        for column_index in (0, 1):
            item.setToolTip(column_index, "\n".join([effect.summary, *effect.because]))
        for reason in effect.because if len(effect.because) > 1 else ():
            child = QtWidgets.QTreeWidgetItem(item, ["", reason])
            child.setToolTip(1, reason)

    def _ticked(self, item, _column):
        name = item.data(0, QtCore.Qt.UserRole)
        if not name:
            return
        self._without = [other for other in self._without if other != name]
        if item.checkState(0) == QtCore.Qt.Unchecked:
            self._without.append(name)
        self._count()

    def _count(self):
        items = [self.widget.topLevelItem(i) for i in range(self.widget.topLevelItemCount())]
        n = sum(1 for item in items if item.checkState(0) == QtCore.Qt.Checked and item.data(0, QtCore.Qt.UserRole))
        off = f"; switched off: {', '.join(self._without)}" if self._without else ""
        gone = f" There is no effect {', '.join(map(repr, self._unknown))} to switch off." if self._unknown else ""
        self._tell(f"A run simulates {n} effect{'s' * (n != 1)}{off}.{gone}")

    def _tell(self, text):
        self._about.setText(text)

    def _forget(self):
        if self._explanation is not None and self._explanation.is_running():
            self._explanation.forget()
        self._explanation = None
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def close(self):
        """Ask no more."""
        self._forget()
