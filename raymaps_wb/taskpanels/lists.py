# SPDX-License-Identifier: LGPL-2.1-or-later
"""A table whose rows people add, take away and move: scatterers of a medium, layers of a thin film."""

from raymaps_wb.compat import QtWidgets, translate
from raymaps_wb.taskpanels.rows import beside, column


class ListEditor:
    """Rows of widgets. A subclass says how a row looks and what is in it."""

    IS_WIDE = True
    HEADINGS: tuple[str, ...] = ()
    ORDERED = False
    ADD = translate("Add")

    def __init__(self):
        self.widget = QtWidgets.QTableWidget(0, len(self.HEADINGS))
        self.widget.setHorizontalHeaderLabels([translate(text) for text in self.HEADINGS])
        self.widget.verticalHeader().setVisible(self.ORDERED)
        self.widget.setSelectionBehavior(QtWidgets.QAbstractItemView.SelectRows)
        self.widget.setSelectionMode(QtWidgets.QAbstractItemView.SingleSelection)
        header = self.widget.horizontalHeader()
        header.setSectionResizeMode(QtWidgets.QHeaderView.Stretch)
        self.widget.setMinimumWidth(150)
        actions = [(self.ADD, self.add), (translate("Remove"), self._remove)]
        if self.ORDERED:
            actions += [("\u2191", lambda: self._move(-1)), ("\u2193", lambda: self._move(1))]
        buttons = []
        for text, action in actions:
            button = QtWidgets.QPushButton(text)
            button.clicked.connect(lambda _=False, action=action: action())
            button.setMinimumWidth(30 if len(text) == 1 else 60)
            buttons.append(button)
        self.row = column(self.widget, beside(*buttons))

    def widgets(self, values):
        """Widgets of a row that shows some values."""
        raise NotImplementedError

    def values_of(self, widgets):
        """What a row's widgets hold now."""
        raise NotImplementedError

    def new_values(self):
        """Values of a row that is added."""
        raise NotImplementedError

    def rows(self):
        """What all rows hold now."""
        columns = range(self.widget.columnCount())
        return [
            self.values_of([self.widget.cellWidget(row, i) for i in columns]) for row in range(self.widget.rowCount())
        ]

    def set_rows(self, rows):
        """Show other rows."""
        self.widget.setRowCount(len(rows))
        for row, values in enumerate(rows):
            for i, widget in enumerate(self.widgets(values)):
                self.widget.setCellWidget(row, i, widget)
        self.widget.resizeRowsToContents()
        self._fit()

    def _fit(self):
        """As high as the rows need, up to six."""
        n = max(1, min(6, self.widget.rowCount()))
        row = self.widget.rowHeight(0) if self.widget.rowCount() else self.widget.fontMetrics().height()
        self.widget.setFixedHeight(self.widget.horizontalHeader().sizeHint().height() + n * row + 8)

    def add(self):
        """Add a row."""
        self.set_rows([*self.rows(), self.new_values()])
        self.widget.selectRow(self.widget.rowCount() - 1)

    def _remove(self):
        rows, at = self.rows(), self._at()
        if rows:
            del rows[at]
            self.set_rows(rows)
            self.widget.selectRow(min(at, len(rows) - 1))

    def _move(self, by):
        rows, at = self.rows(), self._at()
        if 0 <= at + by < len(rows):
            rows[at], rows[at + by] = rows[at + by], rows[at]
            self.set_rows(rows)
            self.widget.selectRow(at + by)

    def _at(self):
        """The row that is meant: where something was last clicked or typed, else the last."""
        at = self.widget.currentRow()
        for row in range(self.widget.rowCount()):
            cells = [self.widget.cellWidget(row, i) for i in range(self.widget.columnCount())]
            if any(cell is not None and (cell.hasFocus() or cell.isAncestorOf(focused())) for cell in cells):
                at = row
        return at if at >= 0 else self.widget.rowCount() - 1


def focused():
    """The widget that has the keyboard."""
    return QtWidgets.QApplication.focusWidget()
