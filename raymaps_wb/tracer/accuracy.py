# SPDX-License-Identifier: LGPL-2.1-or-later
"""What accuracy costs: ``raymaps accuracy SCENE --progress json`` in a process of its own."""

import json
import os

from raymaps_wb.compat import QtCore
from raymaps_wb.tracer.interpreter import child_environment, find_interpreter, tracer_arguments
from raymaps_wb.tracer.outlook import forecast_of
from raymaps_wb.tracer.process import LineProcess, last_sentence


class AccuracyTrial(QtCore.QObject):
    """Tries the choices of a scene for some seconds.

    Signals: ``trying(number, of, words)`` before each choice; ``noted(str)``; ``told(Forecast)``; ``failed(str)`` with
    one sentence; ``cancelled()``.
    """

    trying = QtCore.Signal(int, int, str)
    noted = QtCore.Signal(str)
    told = QtCore.Signal(object)
    failed = QtCore.Signal(str)
    cancelled = QtCore.Signal()

    def __init__(self, scene, detector="", seconds=8, parent=None):
        """Raises `TracerError` if there is no interpreter. Without a detector the least certain one is meant."""
        super().__init__(parent)
        self._answer, self._is_cancelled = None, False
        target = [f"--target={detector}"] if detector else []
        arguments = ["accuracy", scene, *target, f"--seconds={seconds}", "--progress=json"]
        self.process = LineProcess(find_interpreter().path, tracer_arguments(arguments), child_environment(), self)
        self.process.line.connect(self._line)
        self.process.ended.connect(self._end)

    def start(self):
        """Start trying; returns at once."""
        self.process.start()

    def is_running(self):
        """Whether the tracer tries."""
        return self.process.is_running()

    def cancel(self):
        """End the trial; nothing is told of it."""
        self._is_cancelled = True
        if os.name == "nt":  # there terminate() does not reach a program without a window; nothing is lost
            self.process.kill()
        self.process.stop()

    def forget(self):
        """End the trial and tell nothing more."""
        self.process.line.disconnect(self._line)
        self.process.ended.disconnect(self._end)
        self.process.stop()

    def _line(self, text):
        try:
            message = json.loads(text)
        except ValueError:
            return
        event = message.get("event") if isinstance(message, dict) else None
        if event == "choice":
            self.trying.emit(int(message.get("number", 0)), int(message.get("of", 0)), str(message.get("choice", "")))
        elif event == "note":
            self.noted.emit(str(message.get("text", "")))
        elif event == "done":
            self._answer = message

    def _end(self, code, crashed):
        if self._is_cancelled:
            self.cancelled.emit()
            return
        try:
            forecast = forecast_of(self._answer)
        except (KeyError, TypeError, ValueError):
            self.failed.emit(self._why(code, crashed))
            return
        self.told.emit(forecast)

    def _why(self, code, crashed):
        said = last_sentence(self.process.errors)
        if code == 3 and not crashed and said:
            return said
        if "No such command" in self.process.errors or "No such option" in self.process.errors:
            return "The installed tracer is too old to tell what accuracy costs; use the command 'Set up tracer'."
        how = "crashed or was killed" if crashed else f"ended with exit code {code}"
        return f"The tracer {how} before it told what accuracy costs{': ' + said if said else ''}. Try again.".replace(
            "..", "."
        )
