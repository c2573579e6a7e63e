# SPDX-License-Identifier: LGPL-2.1-or-later
"""A widget for each kind of property.

An editor has ``widget`` and ``write(obj)``, which raises ValueError in words; ``row`` if the widget is a part of more.
"""

import os

import FreeCADGui

from raymaps_wb.compat import QtGui, QtWidgets, primary_selection, translate
from raymaps_wb.export.values import words
from raymaps_wb.objects.files import absolute_path, kept_path
from raymaps_wb.objects.references import reference_list, set_references
from raymaps_wb.taskpanels.findings import finding

WRONG = "#b00020"


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
        self.widget.setRange(0, 2**31 - 1)
        self.widget.setGroupSeparatorShown(True)
        self.widget.setValue(getattr(obj, prop.name))

    def write(self, obj):
        setattr(obj, self.prop.name, self.widget.value())


class QuantityEditor:
    """A length or an angle in the user's units."""

    def __init__(self, obj, prop):
        self.prop = prop
        self.widget = FreeCADGui.UiLoader().createWidget("Gui::QuantitySpinBox")
        self.widget.setProperty("value", getattr(obj, prop.name))
        self._shown = str(self.widget.property("value"))

    def write(self, obj):
        # The widget rounds to the digits that it shows: what nobody changed is left as it is.
        if str(self.widget.property("value")) != self._shown:
            setattr(obj, self.prop.name, self.widget.property("value"))


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
        self.row = self.widget
        if prop.choice_texts:
            self._about = small_label()
            self.row = column(self.widget, self._about)
            self.changed.connect(self._tell)
            self._tell(self.widget.currentText())

    def _tell(self, choice):
        text = self.prop.choice_texts.get(choice, "")
        self._about.setText(text[:1].upper() + text[1:])

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

    def value(self):
        """What was typed; raises ValueError in words."""
        return [_number(word, self.prop) for word in self.widget.text().replace(";", " ").split()]

    def write(self, obj):
        setattr(obj, self.prop.name, self.value())


class FileEditor:
    """A file or folder with a button that looks for it, and a few words about what it holds."""

    def __init__(self, obj, prop):
        self.prop, self._document = prop, obj.Document
        self._is_folder = prop.kind == "App::PropertyPath"
        self.widget = QtWidgets.QLineEdit(getattr(obj, prop.name))
        self.widget.setPlaceholderText(translate("choose a folder") if self._is_folder else translate("choose a file"))
        button = QtWidgets.QToolButton()
        button.setText("...")
        button.setToolTip(translate("Looks for it"))
        button.clicked.connect(self._look_for)
        self._about = small_label()
        self.row = column(beside(self.widget, button), self._about)
        self.changed = self.widget.textChanged
        self.changed.connect(self._tell)
        self._tell()

    def path(self):
        """Absolute path of what is named; empty if nothing is."""
        return absolute_path(self._document, self.widget.text().strip())

    def write(self, obj):
        setattr(obj, self.prop.name, kept_path(self._document, self.path()))

    def _look_for(self):
        here = os.path.dirname(self.path()) or os.path.dirname(self._document.FileName)
        if self._is_folder:
            found = QtWidgets.QFileDialog.getExistingDirectory(self.row, label_of(self.prop), here)
        else:
            found, _ = QtWidgets.QFileDialog.getOpenFileName(self.row, label_of(self.prop), here, self.prop.filter)
        if found:
            self.widget.setText(kept_path(self._document, found))

    def _tell(self, *_):
        text, is_right = finding(self.path(), self.prop.form)
        self._about.setText(text)
        self._about.setStyleSheet("" if is_right else f"color: {WRONG}")


class SpectralEditor:
    """A value as one number, as red, green and blue, or as a file: a list of these forms, and a field for each."""

    NUMBER, COLOUR, FILE = range(3)

    def __init__(self, obj, prop):
        self.prop = prop
        self._numbers = NumbersEditor(obj, prop)
        self._file = FileEditor(obj, next(other for other in obj.Proxy.PROPERTIES if other.name == prop.file))
        self.widget = self._numbers.widget
        self.forms = QtWidgets.QComboBox()
        file = translate("Table file") if self._file.prop.form == "share" else translate("Spectrum file")
        self.forms.addItems([translate("Number"), translate("R G B"), file])
        self.forms.setToolTip(translate("One number, one for each of red, green and blue, or a table in a file"))
        self.forms.setSizePolicy(QtWidgets.QSizePolicy.Maximum, QtWidgets.QSizePolicy.Fixed)
        is_colour = len(getattr(obj, prop.name)) == 3
        self.forms.setCurrentIndex(self.FILE if self._file.path() else self.COLOUR if is_colour else self.NUMBER)
        self.forms.currentIndexChanged.connect(self._form_chosen)
        self.row = column(beside(self.forms, self.widget), self._file.row)
        self._show()

    def value(self):
        """What was typed; raises ValueError in words."""
        if self.forms.currentIndex() == self.FILE:
            if not self._file.path():
                raise ValueError(f"{label_of(self.prop)}: choose a file.")
            return None
        values = self._numbers.value()
        if len(values) not in (1, 3):
            raise ValueError(f"{label_of(self.prop)}: one number is needed, or three, got {len(values)}.")
        return values

    def write(self, obj):
        if self.value() is None:
            self._file.write(obj)
            return
        self._numbers.write(obj)
        setattr(obj, self.prop.file, "")

    def _form_chosen(self, form):
        """Carry what was typed over to the new form."""
        try:
            values = self._numbers.value()
        except ValueError:
            values = []
        if form == self.COLOUR and len(values) == 1:
            self.widget.setText(" ".join([f"{values[0]:.12g}"] * 3))
        elif form == self.NUMBER and len(values) == 3:
            self.widget.setText(f"{sum(values) / 3:.6g}")
        self._show()

    def _show(self):
        is_file = self.forms.currentIndex() == self.FILE
        self.widget.setVisible(not is_file)
        self._file.row.setVisible(is_file)


class ReferencesEditor:
    """Bodies and faces picked in the 3D view."""

    def __init__(self, obj, prop):
        self._own = obj
        self._pairs = reference_list(obj)
        self.widget = QtWidgets.QWidget()
        layout = QtWidgets.QVBoxLayout(self.widget)
        layout.setContentsMargins(0, 0, 0, 0)
        self._list = QtWidgets.QListWidget()
        self._list.setMaximumHeight(120)
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
    label.setEnabled(False)
    font = label.font()
    font.setPointSizeF(0.9 * font.pointSizeF())
    label.setFont(font)
    return label


EDITORS = {
    "App::PropertyFloat": NumberEditor,
    "App::PropertyInteger": IntegerEditor,
    "App::PropertyLength": QuantityEditor,
    "App::PropertyAngle": QuantityEditor,
    "App::PropertyEnumeration": ChoiceEditor,
    "App::PropertyFloatList": NumbersEditor,
    "App::PropertyString": TextEditor,
    "App::PropertyFile": FileEditor,
    "App::PropertyPath": FileEditor,
    "App::PropertyXLinkSubList": ReferencesEditor,
}


def editor_of(obj, prop):
    """The editor of a property; None if it has none, or if that of another edits it too."""
    if any(other.file == prop.name for other in obj.Proxy.PROPERTIES):
        return None
    editor = SpectralEditor if prop.file else EDITORS.get(prop.kind)
    return editor(obj, prop) if editor is not None else None
