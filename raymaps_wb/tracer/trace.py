# SPDX-License-Identifier: LGPL-2.1-or-later
"""One run of ``raymaps trace``."""

import os
from collections import namedtuple

from raymaps_wb.compat import QtCore
from raymaps_wb.tracer.command import TracerCommand

DONE, CANCELLED, FAILED = "done", "cancelled", "failed"
INTERRUPTED = 4  # exit code of a run that can be resumed

#: state: DONE, CANCELLED or FAILED. map_folder: empty if there is none. text: one sentence. summary: what it said last.
Outcome = namedtuple("Outcome", "state map_folder text summary")


class TraceRun(TracerCommand):
    """Traces a scene in a process of its own.

    Signals: ``progressed(rays, of, remaining_s)``; ``ended(Outcome)``.
    """

    progressed = QtCore.Signal(object, object, object)
    ended = QtCore.Signal(object)

    def __init__(self, scene, map_folder, parent=None):
        super().__init__(["trace", scene, "-o", map_folder, "--progress", "json"], parent)
        self.map_folder, self._cancelled, self._summary = map_folder, False, {}

    def cancel(self):
        """End the run; what was committed stays a valid map."""
        self._cancelled = True
        if os.name == "nt":  # there terminate() does not reach a program without a window
            self.process.write_line("cancel")
        self.process.stop()

    def _hear(self, event, message):
        if event in ("start", "progress"):
            rays = message.get("rays", 0) if event == "progress" else message.get("done_rays", 0)
            of = message.get("of") if event == "progress" else message.get("rays")
            self.progressed.emit(rays, of or 0, message.get("remaining_s"))
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
            remedy = ("The rays traced so far are kept. " if folder else "") + "Run again to repeat it."
            outcome = Outcome(FAILED, folder, self._why(code, crashed, "was done", remedy), {})
        self.ended.emit(outcome)
