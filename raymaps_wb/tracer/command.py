# SPDX-License-Identifier: LGPL-2.1-or-later
"""One command of the tracer in a process of its own, which answers in lines of JSON."""

import json

from raymaps_wb.compat import QtCore
from raymaps_wb.tracer.interpreter import child_environment, find_interpreter, tracer_arguments
from raymaps_wb.tracer.process import LineProcess, last_sentence


class TracerCommand(QtCore.QObject):
    """Base of what runs a command; it hears each answer in `_hear` and the end of the process in `_end`.

    Objects of Qt can't have an abstract base class, so a method that is missing is told when it is called.

    Signal: ``noted(str)`` with a sentence worth telling.
    """

    noted = QtCore.Signal(str)

    def __init__(self, arguments, parent=None):
        """Raises `TracerError` if there is no interpreter."""
        super().__init__(parent)
        self.process = LineProcess(find_interpreter().path, tracer_arguments(arguments), child_environment(), self)
        self.process.line.connect(self._line)
        self.process.ended.connect(self._end)

    def start(self):
        """Start the command; returns at once."""
        self.process.start()

    def is_running(self):
        """Whether the command runs."""
        return self.process.is_running()

    def forget(self):
        """End the command and tell nothing more."""
        self.process.line.disconnect(self._line)
        self.process.ended.disconnect(self._end)
        self.process.stop()

    def _hear(self, event, message):
        """An answer, a dict, and what it says under "event"; None if it does not."""
        raise NotImplementedError

    def _end(self, code, crashed):
        """The process has ended: its exit code, and whether it crashed or was killed."""
        raise NotImplementedError

    def _line(self, text):
        try:
            message = json.loads(text)
        except ValueError:
            return
        if not isinstance(message, dict):
            return
        if message.get("event") == "note":
            self.noted.emit(str(message.get("text", "")))
        else:
            self._hear(message.get("event"), message)

    def _why(self, code, crashed, undone, remedy=""):
        """One sentence, or the tracer's own; then what can be done."""
        said = last_sentence(self.process.errors)
        if code == 3 and not crashed and said:
            return said
        how = "crashed or was killed" if crashed else f"ended with exit code {code}"
        sentence = f"The tracer {how} before it {undone}{': ' + said.rstrip('.') if said else ''}."
        return f"{sentence} {remedy}".rstrip()
