# SPDX-License-Identifier: LGPL-2.1-or-later
"""A process that answers questions about one map: JSON-RPC 2.0, one object a line."""

import json

from raymaps_wb.compat import QtCore
from raymaps_wb.tracer.interpreter import child_environment, find_interpreter, tracer_arguments
from raymaps_wb.tracer.process import LineProcess, last_sentence


class MapServer(QtCore.QObject):
    """Asks ``raymaps serve MAP``, which starts with the first question. Answers arrive later, in callbacks."""

    def __init__(self, map_folder, parent=None):
        super().__init__(parent)
        self.map_folder = map_folder
        self._process: LineProcess | None = None
        self._waiting: dict[int, tuple] = {}
        self._next_id = 1

    def ask(self, method, params, on_result, on_error):
        """Send a question.

        Parameters
        ----------
        method : str
        params : dict
        on_result : callable(dict)
        on_error : callable(str), gets one sentence

        Raises
        ------
        TracerError
            If there is no interpreter.
        """
        process = self._process = self._process or self._started()
        number, self._next_id = self._next_id, self._next_id + 1
        self._waiting[number] = (on_result, on_error)
        process.write_line(json.dumps({"jsonrpc": "2.0", "id": number, "method": method, "params": params}))

    def process_id(self):
        """The operating system's number of the process; 0 if there is none."""
        return self._process.process_id() if self._process is not None else 0

    def close(self):
        """End the process; open questions stay unanswered."""
        self._waiting = {}
        if self._process is not None:
            self._process.ended.disconnect(self._end)
            self._process.stop()
            self._process = None

    def _started(self):
        arguments = tracer_arguments(["serve", self.map_folder])
        process = LineProcess(find_interpreter().path, arguments, child_environment(), self)
        process.line.connect(self._line)
        process.ended.connect(self._end)
        process.start()
        return process

    def _line(self, text):
        try:
            answer = json.loads(text)
        except ValueError:
            return
        if not isinstance(answer, dict) or answer.get("id") not in self._waiting:
            return
        on_result, on_error = self._waiting.pop(answer["id"])
        if "error" in answer:
            on_error(str(answer["error"].get("message", "The tracer could not answer.")))
        else:
            on_result(answer.get("result") or {})

    def _end(self, code, crashed):
        said = last_sentence(self._process.errors) if self._process is not None else ""
        waiting, self._waiting, self._process = list(self._waiting.values()), {}, None
        how = "crashed or was killed" if crashed else f"ended with exit code {code}"
        text = (
            said
            if code == 3 and said
            else f"The process that reads the map {how}{': ' + said if said else ''}. Press Apply to start it again."
        )
        for _, on_error in waiting:
            on_error(text.replace("..", "."))
