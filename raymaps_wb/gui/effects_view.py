# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which effects a run simulates and why, and afterwards what share of the time each took."""

from html import escape

from raymaps_wb.compat import QtCore, QtWidgets, translate
from raymaps_wb.tracer.explain import simulated, switched_off, title_of

GREY, WARNING = "#7a7a7a", "#9a6700"
NAMED = 6


def sentence(effects):
    """What a run simulates, in one line of rich text."""
    on, off = simulated(effects), switched_off(effects)
    names = [escape(title_of(effect)) for effect in on]
    shown = ", ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")
    text = f"Simulates {len(on)} of {len(effects)} effects: {shown}."
    if off:
        told = "; ".join(f"{escape(title_of(effect))} ({escape(effect.off)})" for effect in off)
        text += f" <span style='color:{WARNING}'>Switched off: {told}.</span>"
    return text


def lines(effects):
    """The same for the report view, a line each."""
    found = [f"simulates {title_of(effect)} because of {_reasons(effect)}" for effect in simulated(effects)]
    return found + [f"leaves out {title_of(effect)}: {effect.off}" for effect in switched_off(effects)]


def _reasons(effect):
    more = f" and {len(effect.because) - 2} more" if len(effect.because) > 2 else ""
    return ", ".join(effect.because[:2]) + more


class EffectsView(QtWidgets.QTreeWidget):
    """A list of effects: those simulated with their reasons, those switched off, and those that nothing calls for."""

    def __init__(self):
        super().__init__()
        self.setHeaderLabels([translate("Effect"), translate("why"), translate("time")])
        self.setRootIsDecorated(True)
        self.setIndentation(14)
        self.setWordWrap(True)
        header = self.header()
        header.setStretchLastSection(False)
        header.setSectionResizeMode(0, QtWidgets.QHeaderView.ResizeToContents)
        header.setSectionResizeMode(1, QtWidgets.QHeaderView.Stretch)
        header.setSectionResizeMode(2, QtWidgets.QHeaderView.ResizeToContents)

    def show_effects(self, effects):
        """Show other effects."""
        self.clear()
        for effect in simulated(effects):
            share = "" if effect.share is None else f"{100 * effect.share:.0f} %"
            self._add(effect, effect.because[0] if effect.because else "", share)
        for effect in switched_off(effects):
            item = self._add(effect, f"switched off: {effect.off}", "")
            font = item.font(0)
            font.setStrikeOut(True)
            item.setFont(0, font)
        others = [effect for effect in effects if not (effect.needed or effect.because)]
        if others:
            branch = QtWidgets.QTreeWidgetItem(self, [translate("not needed"), f"{len(others)} effects", ""])
            for effect in others:
                item = QtWidgets.QTreeWidgetItem(branch, [title_of(effect), effect.summary, ""])
                item.setToolTip(1, effect.summary)
        self.setColumnHidden(2, all(effect.share is None for effect in effects))

    def _add(self, effect, why, share):
        more = f" (+{len(effect.because) - 1})" if len(effect.because) > 1 and effect.needed else ""
        item = QtWidgets.QTreeWidgetItem(self, [title_of(effect), why + more, share])
        item.setTextAlignment(2, QtCore.Qt.AlignRight)
        for i in (0, 1):
            item.setToolTip(i, "\n".join([effect.summary, *effect.because]))
        if len(effect.because) > 1:
            for reason in effect.because:
                QtWidgets.QTreeWidgetItem(item, ["", reason, ""]).setToolTip(1, reason)
        return item
