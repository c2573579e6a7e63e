# SPDX-License-Identifier: LGPL-2.1-or-later
"""What accuracy costs: ``raymaps accuracy SCENE --progress json`` in a process of its own."""

import os

from raymaps_wb.compat import QtCore
from raymaps_wb.tracer.command import TracerCommand
from raymaps_wb.tracer.outlook import forecast_of


class AccuracyTrial(TracerCommand):
    """Tries the choices of a scene for some seconds.

    Signals: ``trying(number, of, words)`` before each choice; ``told(Forecast)``; ``failed(str)`` with one sentence;
    ``cancelled()``.
    """

    trying = QtCore.Signal(int, int, str)
    told = QtCore.Signal(object)
    failed = QtCore.Signal(str)
    cancelled = QtCore.Signal()

    def __init__(self, scene, detector="", seconds=8, parent=None):
        """Raises `TracerError` if there is no interpreter. Without a detector the least certain one is meant."""
        target = [f"--target={detector}"] if detector else []
        super().__init__(["accuracy", scene, *target, f"--seconds={seconds}", "--progress=json"], parent)
        self._answer, self._is_cancelled = None, False

    def cancel(self):
        """End the trial; nothing is told of it."""
        self._is_cancelled = True
        if os.name == "nt":  # there terminate() does not reach a program without a window; nothing is lost
            self.process.kill()
        self.process.stop()

    def _hear(self, event, message):
        if event == "choice":
            self.trying.emit(int(message.get("number", 0)), int(message.get("of", 0)), str(message.get("choice", "")))
        elif event == "done":
            self._answer = message

    def _end(self, code, crashed):
        if self._is_cancelled:
            self.cancelled.emit()
            return
        try:
            forecast = forecast_of(self._answer)
        except (KeyError, TypeError, ValueError):
            if "No such command" in self.process.errors or "No such option" in self.process.errors:
                why = "The installed tracer is too old to tell what accuracy costs; use the command 'Set up tracer'."
            else:
                why = self._why(code, crashed, "told what accuracy costs", "Try again.")
            self.failed.emit(why)
            return
        self.told.emit(forecast)
