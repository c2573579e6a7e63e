# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the detectors of a map registered of the rays that match: figures, and a picture of those that have one."""

import math
from html import escape

from raymaps_wb.compat import QtWidgets, translate
from raymaps_wb.gui.false_colours import ERROR, LIGHT, picture, read_maps
from raymaps_wb.gui.figures import count, with_error
from raymaps_wb.taskpanels.rows import small_label

#: Figures in the order in which they are told: key without unit, words, unit of the key, unit for people.
FIGURES = (
    ("flux", "w", "light", "W"),
    ("flux", "lm", "", "lm"),
    ("mean", "w_per_mm2", "mean", "W/mm\u00b2"),
    ("min", "w_per_mm2", "least", "W/mm\u00b2"),
    ("max", "w_per_mm2", "most", "W/mm\u00b2"),
    ("mean", "lx", "mean", "lx"),
    ("min", "lx", "least", "lx"),
    ("max", "lx", "most", "lx"),
    ("mean", "w_per_sr", "mean", "W/sr"),
    ("min", "w_per_sr", "least", "W/sr"),
    ("max", "w_per_sr", "most", "W/sr"),
    ("mean", "cd", "mean", "cd"),
    ("min", "cd", "least", "cd"),
    ("max", "cd", "most", "cd"),
)
SAVED_AS = "Table (*.csv);;Arrays (*.npz);;Picture (*.png)"
SAVED_AS_FAR_FIELD = "Luminaire IES (*.ies);;Luminaire EULUMDAT (*.ldt);;" + SAVED_AS


class DetectorView(QtWidgets.QWidget):
    """One detector at a time. ``wanted()`` is called when another is chosen, ``save(path)`` to write it to a file."""

    def __init__(self, wanted, save):
        super().__init__()
        self._save = save
        layout = QtWidgets.QVBoxLayout(self)
        layout.setContentsMargins(4, 6, 4, 4)
        row = QtWidgets.QHBoxLayout()
        self.names = QtWidgets.QComboBox()
        self.names.activated.connect(lambda *_: wanted())
        self.save_button = QtWidgets.QPushButton(translate("Save ..."))
        self.save_button.setToolTip(translate("Writes a table, arrays or a picture; a far field as IES or LDT, too"))
        self.save_button.clicked.connect(self._ask_where)
        row.addWidget(self.names, 1)
        row.addWidget(self.save_button)
        layout.addLayout(row)
        self.text = QtWidgets.QLabel()
        self.text.setWordWrap(True)
        self.shown = QtWidgets.QComboBox()
        self.shown.addItem(translate("Light"), LIGHT)
        self.shown.addItem(translate("Standard error of each cell"), ERROR)
        self.shown.setToolTip(translate("What the colours tell: the light, or how unsure it is in each cell"))
        self.shown.currentIndexChanged.connect(lambda *_: self._draw())
        self.picture = QtWidgets.QLabel()
        self.spread = small_label()
        for widget in (self.text, self.shown, self.picture, self.spread):
            layout.addWidget(widget)
        layout.addStretch(1)
        self._is_far_field, self._maps = False, {}
        self.clear()

    def name(self):
        """The chosen detector; empty if there is none."""
        return self.names.currentText()

    def offer(self, names):
        """Offer the detectors of a map; the chosen one stays if it is among them."""
        if names == [self.names.itemText(i) for i in range(self.names.count())]:
            return
        chosen = self.name()
        self.names.clear()
        self.names.addItems(names)
        if chosen in names:
            self.names.setCurrentText(chosen)

    def clear(self, text=""):
        """Show nothing, or why there is nothing."""
        self.text.setText(text)
        self._maps = {}
        self._draw()
        self.save_button.setEnabled(False)

    def show_answer(self, answer, path):
        """Show the answer to ``detector`` and the picture of the table that came with it."""
        self._is_far_field = any(key.endswith("_w_per_sr") for key in answer)
        self.text.setText(html(answer))
        self._maps = read_maps(path)
        self.save_button.setEnabled(True)
        self._draw()

    def resizeEvent(self, event):
        super().resizeEvent(event)
        self._draw()

    def _draw(self):
        chosen = self.shown.currentData()
        drawn = self._maps.get(chosen)
        self.shown.setVisible(ERROR in self._maps)
        self.spread.setVisible(drawn is not None and chosen == ERROR)
        if drawn is None:
            self.picture.clear()
            return
        self.picture.setPixmap(picture(drawn, max(160, self.width() - 12)))
        if chosen == ERROR:
            self.spread.setText(spread(drawn.values))

    def _ask_where(self):
        kinds = SAVED_AS_FAR_FIELD if self._is_far_field else SAVED_AS
        path, kind = QtWidgets.QFileDialog.getSaveFileName(
            self, translate("Save detector"), self.name() + ".csv", kinds
        )
        if path:
            ending = kind.split("*")[-1].rstrip(")")
            self._save(path if "." in path.rsplit("/", 1)[-1] else path + ending)


def spread(errors_percent):
    """How unsure the cells of a map are, in a sentence."""
    known = sorted(error for row in errors_percent for error in row if math.isfinite(error))
    dark = sum(len(row) for row in errors_percent) - len(known)
    if not known:
        return translate("No cell got light.")
    told = f"Half of the cells that got light are known to {known[len(known) // 2]:.2g} % or better."
    more = f" Grey: {count(dark)} {'cell' if dark == 1 else 'cells'} without light." if dark else ""
    return told + more + " A coarser resolution, or more rays, makes cells surer."


def html(answer):
    """The figures of a detector as rich text, whatever kind of detector it is."""
    rows = []
    for name, key_unit, words, unit in FIGURES:
        value, error = answer.get(f"{name}_{key_unit}"), answer.get(f"{name}_stderr_{key_unit}")
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            rows.append((words, with_error(float(value), float(error or 0.0), unit)))
    for level in (50, 10):
        widths = [answer.get(f"beam_{level}_{plane}_deg") for plane in ("c0", "c90")]
        if any(width is not None for width in widths):
            told = " and ".join("none" if width is None else f"{width:.3g}\u00b0" for width in widths)
            rows.append((f"beam {level} %", f"{told} wide in C0 and C90"))
    if isinstance(answer.get("uniformity"), (int, float)):
        rows.append(("uniformity", f"{answer['uniformity']:.3g} \u00b1 {answer.get('uniformity_stderr') or 0:.2g}"))
    if answer.get("crossings") is not None and answer.get("rays") is not None:
        rows.append(("hits", f"{count(answer['crossings'])} by {count(answer['rays'])} rays"))
    if answer.get("without"):
        rows.append(("without", escape(", ".join(answer["without"]))))
    cells = "".join(f"<tr><td style='color:#7a7a7a;padding-right:10px'>{a}</td><td>{b}</td></tr>" for a, b in rows)
    return f"<table cellspacing='0' cellpadding='1'>{cells}</table>"
