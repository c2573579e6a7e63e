# SPDX-License-Identifier: LGPL-2.1-or-later
"""The dialog of *Set up tracer*: what will happen, consent, progress, and the commands to do it by hand."""

import shutil

import FreeCAD

from raymaps_wb.compat import QtCore, QtWidgets, exec_dialog, translate
from raymaps_wb.errors import TracerError
from raymaps_wb.tracer.interpreter import PREFERENCES, environment_folder, find_interpreter
from raymaps_wb.tracer.setup import TracerSetup, commands_as_text, set_up_commands

TEXT = """
<p>The tracer runs in a Python environment of its own, so that nothing is installed into FreeCAD.</p>
<p><b>This uses the network.</b> About 150 MB of packages (Embree, NumPy, Numba, Arrow and what they need) are
downloaded from the Python package index that this machine is set up for. Versions are pinned, and each file is checked
against the hash that Ray Maps was released with. Nothing is sent.</p>
<p>They are kept in <code>{folder}</code> and nowhere else; delete that folder to be rid of them.</p>"""


class SetupDialog(QtWidgets.QDialog):
    """Asks first; then works in the background and can be cancelled at any time."""

    def __init__(self, parent=None):
        super().__init__(parent)
        self.setWindowTitle(translate("Set up tracer"))
        self.resize(680, 560)
        layout = QtWidgets.QVBoxLayout(self)
        text = QtWidgets.QLabel(TEXT.format(folder=environment_folder()))
        text.setWordWrap(True)
        layout.addWidget(text)
        self._present = QtWidgets.QLabel(self._present_text())
        self._present.setWordWrap(True)
        layout.addWidget(self._present)
        layout.addWidget(self._interpreter_row())
        layout.addWidget(QtWidgets.QLabel(translate("To do it by hand, type:")))
        commands = QtWidgets.QPlainTextEdit(commands_as_text(set_up_commands(uv=shutil.which("uv"))))
        commands.setReadOnly(True)
        commands.setMaximumHeight(110)
        layout.addWidget(commands)
        self._log = QtWidgets.QPlainTextEdit()
        self._log.setReadOnly(True)
        layout.addWidget(self._log, 1)
        self._agree = QtWidgets.QCheckBox(translate("Yes, download and install these packages"))
        layout.addWidget(self._agree)
        self._buttons = QtWidgets.QDialogButtonBox()
        self._install = self._buttons.addButton(translate("Install"), QtWidgets.QDialogButtonBox.ActionRole)
        self._close = self._buttons.addButton(QtWidgets.QDialogButtonBox.Close)
        self._install.setEnabled(False)
        self._agree.toggled.connect(self._install.setEnabled)
        self._install.clicked.connect(self._start)
        self._close.clicked.connect(self.reject)
        layout.addWidget(self._buttons)
        self._setup = None

    def _interpreter_row(self):
        row = QtWidgets.QWidget()
        layout = QtWidgets.QHBoxLayout(row)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(QtWidgets.QLabel(translate("Or use this Python:")))
        self._path = QtWidgets.QLineEdit(FreeCAD.ParamGet(PREFERENCES).GetString("Interpreter", ""))
        self._path.setPlaceholderText(
            translate("an interpreter that has these packages; empty: the private environment")
        )
        self._path.editingFinished.connect(self._name_interpreter)
        layout.addWidget(self._path, 1)
        return row

    def _name_interpreter(self):
        preferences = FreeCAD.ParamGet(PREFERENCES)
        if self._path.text().strip():
            preferences.SetString("Interpreter", self._path.text().strip())
        else:
            preferences.RemString("Interpreter")
        self._present.setText(self._present_text())

    @staticmethod
    def _present_text():
        try:
            found = find_interpreter()
        except TracerError as error:
            return str(error)
        return f"In use now: {found.path} ({found.origin})"

    def _start(self):
        self._install.setEnabled(False)
        self._agree.setEnabled(False)
        self._setup = TracerSetup(self)
        self._setup.said.connect(self._log.appendPlainText)
        self._setup.ended.connect(self._ended)
        try:
            self._setup.start()
        except (TracerError, OSError) as error:
            self._ended(False, str(error))

    def _ended(self, success, text):
        self._setup = None
        self._log.appendPlainText(text)
        self._agree.setEnabled(True)
        self._agree.setChecked(False)
        self._present.setText(self._present_text())
        FreeCAD.Console.PrintMessage(f"Ray Maps: {text}\n")

    def reject(self):
        if self._setup is not None:
            self._setup.cancel()
            return
        super().reject()


def show(parent=None):
    """Show the dialog; returns when it is closed."""
    dialog = SetupDialog(parent)
    dialog.setAttribute(QtCore.Qt.WA_DeleteOnClose)
    exec_dialog(dialog)
