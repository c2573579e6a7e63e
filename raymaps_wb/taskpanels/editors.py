# SPDX-License-Identifier: LGPL-2.1-or-later
"""A widget for each kind of property.

An editor has ``widget`` and ``write(obj)``, which raises ValueError in words; ``row`` if the widget is a part of more;
``about``, a label that stands below; IS_WIDE if its label stands above.
"""

import FreeCAD
import FreeCADGui

from raymaps_wb.compat import QtGui, QtWidgets, primary_selection, translate
from raymaps_wb.export.values import words
from raymaps_wb.objects.references import reference_list, set_references
from raymaps_wb.taskpanels.rows import say, small_label


class NumberEditor:
    """A number with all its digits."""

    def __init__(self, obj, prop):
        self.prop = prop
        self.widget = QtWidgets.QLineEdit(f"{getattr(obj, prop.name):.12g}")
        self.widget.setValidator(QtGui.QDoubleValidator(self.widget))

    def value(self):
        """What was typed; raises ValueError in words."""
        return _number(self.widget.text(), self.prop)

    def write(self, obj):
        setattr(obj, self.prop.name, self.value())


class IntegerEditor:
    """A whole number."""

    def __init__(self, obj, prop):
        self.prop = prop
        self.widget = QtWidgets.QSpinBox()
        low = min(0, prop.limits.low) if prop.limits else 0
        self.widget.setRange(int(low), 2**31 - 1)
        self.widget.setGroupSeparatorShown(True)
        self.widget.setValue(getattr(obj, prop.name))

    def write(self, obj):
        setattr(obj, self.prop.name, self.widget.value())


class QuantityEditor:
    """A length or an angle in the user's units."""

    def __init__(self, obj, prop):
        self.prop = prop
        self.widget = FreeCADGui.UiLoader().createWidget("Gui::QuantitySpinBox")
        self.widget.setMinimumWidth(70)
        self.widget.setProperty("value", getattr(obj, prop.name))
        self._shown = str(self.widget.property("value"))

    def write(self, obj):
        # The widget rounds to the digits that it shows: what nobody changed is left as it is.
        if str(self.widget.property("value")) != self._shown:
            setattr(obj, self.prop.name, self.widget.property("value"))


class ExactQuantityEditor:
    """A length or an angle with all its digits; a number without a unit is in mm or degrees."""

    def __init__(self, obj, prop):
        self.prop = prop
        self._unit = "mm" if prop.kind == "App::PropertyLength" else "deg"
        shown = "mm" if self._unit == "mm" else "\u00b0"
        self.widget = QtWidgets.QLineEdit(f"{float(getattr(obj, prop.name)):.12g} {shown}")

    def value(self):
        """What was typed, in mm or degrees; raises ValueError in words."""
        text = self.widget.text().replace("\u00b0", "deg").replace(",", ".")
        try:
            quantity = FreeCAD.Units.Quantity(text)
        except (ValueError, ArithmeticError, SyntaxError):
            raise ValueError(f"{label_of(self.prop)}: '{self.widget.text()}' is not a number with a unit.") from None
        if quantity.Unit == FreeCAD.Units.Unit():
            return float(quantity)
        if quantity.Unit != FreeCAD.Units.Quantity(f"1 {self._unit}").Unit:
            raise ValueError(f"{label_of(self.prop)}: '{self.widget.text()}' must be in {self._unit}.")
        return float(quantity)

    def write(self, obj):
        setattr(obj, self.prop.name, self.value())


class TextEditor:
    """A line of text."""

    def __init__(self, obj, prop):
        self.prop = prop
        self.widget = QtWidgets.QLineEdit(getattr(obj, prop.name))

    def write(self, obj):
        setattr(obj, self.prop.name, self.widget.text().strip())


class SuggestedEditor:
    """A line of text with a list of what it can be."""

    def __init__(self, obj, prop):
        self.prop = prop
        self.widget = QtWidgets.QComboBox()
        self.widget.setEditable(True)
        self.widget.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self.widget.setEditText(getattr(obj, prop.name))

    def offer(self, texts):
        """Offer other texts; what stands there stays, the first is taken where nothing does."""
        typed = self.widget.currentText()
        self.widget.clear()
        self.widget.addItems(texts)
        self.widget.setEditText(typed if typed or not texts else texts[0])

    def write(self, obj):
        setattr(obj, self.prop.name, self.widget.currentText().strip())


class ChoiceEditor:
    """One of several words, and a sentence about the chosen one; ``changed`` tells of another."""

    def __init__(self, obj, prop):
        self.prop = prop
        self.widget = QtWidgets.QComboBox()
        self.widget.addItems(list(obj.getEnumerationsOfProperty(prop.name) or prop.choices))
        self.widget.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self.widget.setCurrentText(getattr(obj, prop.name))
        self.changed = self.widget.currentTextChanged
        self.about = None
        if prop.choice_texts:
            self.about = small_label()
            self.changed.connect(self._tell)
            self._tell(self.widget.currentText())

    def _tell(self, choice):
        text = self.prop.choice_texts.get(choice, "")
        say(self.about, text if "=" in text else text[:1].upper() + text[1:])

    def choice(self):
        """The chosen word."""
        return self.widget.currentText()

    def write(self, obj):
        setattr(obj, self.prop.name, self.widget.currentText())


class NumbersEditor:
    """One number, or several with blanks between them."""

    def __init__(self, obj, prop):
        self.prop = prop
        self.widget = QtWidgets.QLineEdit(" ".join(f"{value:.12g}" for value in getattr(obj, prop.name)))
        self.widget.setCursorPosition(0)

    def value(self):
        """What was typed; raises ValueError in words."""
        return [_number(word, self.prop) for word in self.widget.text().replace(";", " ").split()]

    def write(self, obj):
        setattr(obj, self.prop.name, self.value())


class ReferencesEditor:
    """Bodies and faces picked in the 3D view."""

    IS_WIDE = True

    def __init__(self, obj, prop):
        self._own = obj
        self._pairs = reference_list(obj)
        self.widget = QtWidgets.QWidget()
        layout = QtWidgets.QVBoxLayout(self.widget)
        layout.setContentsMargins(0, 0, 0, 0)
        self._list = QtWidgets.QListWidget()
        self._list.setMinimumHeight(60)
        self._list.setMaximumHeight(100)
        self._list.setSelectionMode(QtWidgets.QAbstractItemView.ExtendedSelection)
        layout.addWidget(self._list)
        buttons = QtWidgets.QHBoxLayout()
        layout.addLayout(buttons)
        for text, action in ((translate("Add selection"), self._add), (translate("Remove"), self._remove)):
            button = QtWidgets.QPushButton(text)
            button.clicked.connect(action)
            button.setMinimumWidth(60)
            buttons.addWidget(button)
        self._show()

    def write(self, obj):
        set_references(obj, self._pairs)

    def _add(self):
        for pair in primary_selection():
            if pair not in self._pairs and pair[0] is not self._own and not pair[0].TypeId.startswith("App::Geometry"):
                self._pairs.append(pair)
        self._show()

    def _remove(self):
        gone = {self._list.row(item) for item in self._list.selectedItems()}
        self._pairs = [pair for i, pair in enumerate(self._pairs) if i not in gone]
        self._show()

    def _show(self):
        self._list.clear()
        self._list.addItems([reference_text(target, sub) for target, sub in self._pairs])


def reference_text(target, sub):
    """A reference as people read it: labels instead of internal names."""
    element = "" if sub.endswith(".") else sub.split(".")[-1]
    chain = target.getSubObjectList(sub) if sub else [target]
    labels = [obj.Label for obj in chain] or [target.Label]
    return " / ".join(labels + ([element] if element else []))


def _number(text, prop):
    try:
        return float(text.replace(",", "."))
    except ValueError:
        raise ValueError(f"{label_of(prop)}: '{text}' is not a number.") from None


def label_of(prop):
    """Name of a property as a label."""
    return translate(prop.label or words(prop.name))
