# SPDX-License-Identifier: LGPL-2.1-or-later
"""One run of ``raymaps trace``."""

import json
import os
from collections import namedtuple

from raymaps_wb.compat import QtCore
from raymaps_wb.tracer.interpreter import child_environment, find_interpreter, tracer_arguments
from raymaps_wb.tracer.process import LineProcess, last_sentence

DONE, CANCELLED, FAILED = "done", "cancelled", "failed"
INTERRUPTED = 4  # exit code of a run that can be resumed

#: state: DONE, CANCELLED or FAILED. map_folder: empty if there is none. text: one sentence. summary: what it said last.
Outcome = namedtuple("Outcome", "state map_folder text summary")


class TraceRun(QtCore.QObject):
    """Traces a scene in a process of its own.

    Signals: ``progressed(rays, of, remaining_s)``; ``noted(str)``; ``ended(Outcome)``.
    """

    progressed = QtCore.Signal(object, object, object)
    noted = QtCore.Signal(str)
    ended = QtCore.Signal(object)

    def __init__(self, scene, map_folder, parent=None):
        super().__init__(parent)
        self.map_folder, self._cancelled, self._summary = map_folder, False, {}
        arguments = ["trace", scene, "-o", map_folder, "--progress", "json"]
        self.process = LineProcess(find_interpreter().path, tracer_arguments(arguments), child_environment(), self)
        self.process.line.connect(self._line)
        self.process.ended.connect(self._end)

    def start(self):
        """Start tracing; returns at once."""
        self.process.start()

    def is_running(self):
        """Whether the tracer runs."""
        return self.process.is_running()

    def cancel(self):
        """End the run; what was committed stays a valid map."""
        self._cancelled = True
        if os.name == "nt":  # there terminate() does not reach a program without a window
            self.process.write_line("cancel")
        self.process.stop()

    def _line(self, text):
        try:
            message = json.loads(text)
        except ValueError:
            return
        event = message.get("event") if isinstance(message, dict) else None
        if event in ("start", "progress"):
            rays = message.get("rays", 0) if event == "progress" else message.get("done_rays", 0)
            of = message.get("of") if event == "progress" else message.get("rays")
            self.progressed.emit(rays, of or 0, message.get("remaining_s"))
        elif event == "note":
            self.noted.emit(str(message.get("text", "")))
        elif event == "done":
            self._summary = message

    def _end(self, code, crashed):
        folder = self.map_folder if os.path.isfile(os.path.join(self.map_folder, "manifest.json")) else ""
        if code == 0 and not crashed and self._summary:
            outcome = Outcome(DONE, self.map_folder, "", self._summary)
        elif self._cancelled:
            kept = "The rays traced so far are kept." if folder else "No rays were traced yet."
            outcome = Outcome(CANCELLED, folder, f"The run was cancelled. {kept}", {})
        else:
            outcome = Outcome(FAILED, folder, self._why(code, crashed, folder), {})
        self.ended.emit(outcome)

    def _why(self, code, crashed, folder):
        said = last_sentence(self.process.errors)
        if code == 3 and not crashed and said:
            return said
        how = "crashed or was killed" if crashed else f"ended with exit code {code}"
        kept = " The rays traced so far are kept." if folder else ""
        return (
            f"The tracer {how} before it was done{': ' + said if said else ''}.{kept} Run again to repeat it.".replace(
                "..", "."
            )
        )
