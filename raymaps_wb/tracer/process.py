# SPDX-License-Identifier: LGPL-2.1-or-later
"""A child process whose lines arrive as signals, so that the window never waits."""

from raymaps_wb.compat import QtCore

KILL_AFTER_MS = 2000
KEPT_ERROR_CHARACTERS = 20_000


class LineProcess(QtCore.QObject):
    """Runs a program and reports each line of its standard output.

    Signals: ``line(str)``; ``ended(int, bool)`` with the exit code and whether it crashed or was killed.
    """

    line = QtCore.Signal(str)
    ended = QtCore.Signal(int, bool)

    def __init__(self, program, arguments, environment, parent=None):
        super().__init__(parent)
        self._output, self.errors, self._over = b"", "", False
        self._process = QtCore.QProcess(self)
        self._process.setProcessEnvironment(environment)
        self._process.readyReadStandardOutput.connect(self._read_output)
        self._process.readyReadStandardError.connect(self._read_errors)
        self._process.finished.connect(self._finished)
        self._process.errorOccurred.connect(self._failed)
        self._program, self._arguments = program, list(arguments)
        self._killer = QtCore.QTimer(self)
        self._killer.setSingleShot(True)
        self._killer.timeout.connect(self._process.kill)

    def start(self):
        """Start the program; returns at once."""
        self._process.start(self._program, self._arguments)

    def is_running(self):
        """Whether the program is starting or running."""
        return self._process.state() != QtCore.QProcess.NotRunning

    def process_id(self):
        """The operating system's number of the process; 0 before it runs."""
        return self._process.processId()

    def write_line(self, text):
        """Send a line to the program's standard input."""
        self._process.write(text.encode("utf-8") + b"\n")

    def stop(self):
        """Ask the program to end; kill it if it has not after two seconds."""
        if self.is_running():
            self._process.terminate()
            self._killer.start(KILL_AFTER_MS)

    def kill(self):
        """End the program at once."""
        self._process.kill()

    def _read_output(self):
        self._output += bytes(self._process.readAllStandardOutput())
        *lines, self._output = self._output.split(b"\n")
        for line in lines:
            if line.strip():
                self.line.emit(line.decode("utf-8", "replace"))

    def _read_errors(self):
        text = bytes(self._process.readAllStandardError()).decode("utf-8", "replace")
        self.errors = (self.errors + text)[-KEPT_ERROR_CHARACTERS:]

    def _finished(self, code, status):
        self._read_output()
        self._read_errors()
        self._end(code, status == QtCore.QProcess.CrashExit)

    def _failed(self, error):
        if error == QtCore.QProcess.FailedToStart:
            self.errors += self._process.errorString()
            self._end(-1, True)

    def _end(self, code, crashed):
        self._killer.stop()
        if not self._over:
            self._over = True
            self.ended.emit(code, crashed)


def last_sentence(text):
    """The last line of an error output that says something, without the name of the command before it."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1].removeprefix("raymaps: ")[:500] if lines else ""
