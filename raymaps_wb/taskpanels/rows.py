# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rows of a task panel: a label and a field beside or below each other, of which hidden ones leave no gap."""

from raymaps_wb.compat import QtCore, QtGui, QtWidgets

WIDEST_LABEL = 105
GREY = "color: #7f7f7f"
WRONG = "color: #b00020"


class Rows:
    """The rows of a panel, in a column. Labels beside their fields are as wide as the widest that is shown."""

    def __init__(self, form):
        self._column = QtWidgets.QVBoxLayout(form)
        self._column.setSpacing(6)
        self._labels = []

    def add(self, text, field, at=None, is_wide=False, about=None):
        """Add a row; returns its widget, to show and hide.

        Parameters
        ----------
        text : str, the label; none if empty
        field : QWidget
        at : int, optional
            Before which row; at the end by default.
        is_wide : bool
            The label stands above the field.
        about : QWidget, optional
            Stands below both.
        """
        row = QtWidgets.QWidget()
        outer = QtWidgets.QVBoxLayout(row)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(2)
        layout = outer if is_wide else QtWidgets.QHBoxLayout()
        if not is_wide:
            layout.setSpacing(6)
            outer.addLayout(layout)
        if text:
            label = QtWidgets.QLabel(text)
            layout.addWidget(label)
            if not is_wide:
                label.setWordWrap(True)
                layout.setAlignment(label, QtCore.Qt.AlignTop)
                self._labels.append((row, label))
        layout.addWidget(field, 1)
        if about is not None:
            outer.addWidget(about)
        if at is None:
            self._column.addWidget(row)
        else:
            self._column.insertWidget(at, row)
        return row

    def end(self):
        """What is left over of the panel's height stays empty."""
        self._column.addStretch(1)

    def align(self):
        """Give the labels that are shown one width."""
        shown = [label for row, label in self._labels if not row.isHidden()]
        needed = [label.fontMetrics().boundingRect(label.text()).width() + 4 for label in shown]
        width = min(WIDEST_LABEL, max(needed, default=0))
        for label in shown:
            label.setFixedWidth(width)
            line = label.fontMetrics().height()
            label.setContentsMargins(0, max(0, (24 - line) // 2), 0, 0)


def column(*widgets):
    """Widgets below each other, as one."""
    return _joined(QtWidgets.QVBoxLayout, widgets)


def beside(*widgets):
    """Widgets beside each other, as one."""
    return _joined(QtWidgets.QHBoxLayout, widgets)


def _joined(layout_class, widgets):
    joined = QtWidgets.QWidget()
    layout = layout_class(joined)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(2)
    for widget in widgets:
        layout.addWidget(widget)
    return joined


def small_label(text=""):
    """A grey label in small type that breaks lines."""
    label = QtWidgets.QLabel(text)
    label.setWordWrap(True)
    label.setStyleSheet(GREY)
    font = QtGui.QFont(label.font())
    font.setPointSizeF(0.9 * font.pointSizeF())
    label.setFont(font)
    return label


def say(label, text, is_wrong=False):
    """Set the text of a small label, which takes no room while it is empty."""
    label.setText(text)
    label.setStyleSheet(WRONG if is_wrong else GREY)
    label.setVisible(bool(text))


def section_label(text):
    """A heading above rows."""
    label = QtWidgets.QLabel(f"<b>{text}</b>")
    label.setContentsMargins(0, 8, 0, 0)
    return label
