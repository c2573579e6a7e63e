# SPDX-License-Identifier: LGPL-2.1-or-later
"""Makes the private environment of the tracer: a list of commands, run one after the other in the background.

Nothing here runs unless the user agrees in the dialog of *Set up tracer*.
"""

import os
import platform
import shutil
import sys

from raymaps_wb.compat import QtCore, python_candidates
from raymaps_wb.errors import TracerError
from raymaps_wb.paths import LOCK_FILE
from raymaps_wb.tracer.interpreter import child_environment, environment_folder, python_in
from raymaps_wb.tracer.process import LineProcess, last_sentence

OLDEST, NEWEST = (3, 10), (3, 14)

#: Tells the version, and whether the interpreter can make environments with pip in them.
PROBE = (
    "import sys, importlib.util as u; print(*sys.version_info[:2], int(all(map(u.find_spec, ('venv', 'ensurepip')))))"
)


def set_up_commands(folder=None, uv=None, python=None):
    """The commands that make the environment, as lists of words.

    Parameters
    ----------
    folder : str, optional
        Of the environment.
    uv : str, optional
        Path of the program uv, preferred where it is installed: it needs no Python that can make environments.
    python : str, optional
        Interpreter to build on, where there is no uv.

    Returns
    -------
    list of (str, list of str): what the command does, in words, and its words
    """
    folder = folder or environment_folder()
    inside = python_in(folder)
    check = [inside, "-I", "-c", "import numpy, numba, embreex, trimesh, pyarrow, pydantic"]
    if uv:
        return [
            ("Making the environment", [uv, "venv", "--quiet", "--clear", "--python", python or "3.12", folder]),
            (
                "Installing the packages",
                [
                    uv,
                    "pip",
                    "install",
                    "--python",
                    inside,
                    "--require-hashes",
                    "--only-binary",
                    ":all:",
                    "-r",
                    LOCK_FILE,
                ],
            ),
            ("Trying the packages", check),
        ]
    pip = [inside, "-I", "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--progress-bar", "off"]
    return [
        ("Making the environment", [python or "python3", "-I", "-m", "venv", "--clear", folder]),
        ("Installing the packages", [*pip, "--require-hashes", "--only-binary", ":all:", "-r", LOCK_FILE]),
        ("Trying the packages", check),
    ]


def commands_as_text(commands):
    """The commands as one types them."""

    def quoted(word):
        return word if all(c.isalnum() or c in "-_./:=\\" for c in word) else f'"{word}"'

    return "\n".join(" ".join(quoted(word) for word in words) for _, words in commands)


def unsupported_machine():
    """One sentence if the tracer can't run on this machine, else an empty text."""
    if sys.platform.startswith("linux") and platform.machine().lower() not in ("x86_64", "amd64"):
        return (
            f"The tracer needs Embree's Python package, which does not exist for Linux on {platform.machine()}; "
            "use an x86-64 machine."
        )
    return ""


class TracerSetup(QtCore.QObject):
    """Finds an interpreter, then runs the commands.

    Signals: ``said(str)``; ``ended(bool, str)`` with success and a sentence.
    """

    said = QtCore.Signal(str)
    ended = QtCore.Signal(bool, str)

    def __init__(self, parent=None):
        super().__init__(parent)
        self._process: LineProcess | None = None
        self._commands: list[tuple[str, list[str]]] = []
        self._candidates: list[str] = []
        self._cancelled = False

    def start(self):
        """Begin; returns at once."""
        sentence = unsupported_machine()
        if sentence:
            self.ended.emit(False, sentence)
            return
        if not os.path.isfile(LOCK_FILE):
            raise TracerError(f"The list of packages '{LOCK_FILE}' is missing; install the addon again.")
        os.makedirs(os.path.dirname(environment_folder()), exist_ok=True)
        uv = shutil.which("uv")
        if uv:
            self._commands = set_up_commands(uv=uv)
            self._next()
            return
        self._candidates = python_candidates()
        self._probe()

    def cancel(self):
        """Stop; the half-made environment is removed."""
        self._cancelled = True
        if self._process is not None:
            self._process.stop()

    def _probe(self):
        if not self._candidates:
            self._finish(
                False,
                "No Python 3.10 to 3.14 that can make environments was found; install one (on Debian and Ubuntu: "
                "apt-get install python3-venv) or the program uv, and try again.",
            )
            return
        python = self._candidates.pop(0)
        words: list[str] = []
        self._start([python, "-I", "-c", PROBE], words.append, lambda code, crashed: self._probed(python, words))

    def _probed(self, python, words):
        numbers = (
            [int(word) for word in words[0].split()] if words and words[0].replace(" ", "").isdigit() else [0, 0, 0]
        )
        if OLDEST <= tuple(numbers[:2]) <= NEWEST and numbers[2]:
            self._commands = set_up_commands(python=python)
            self._next()
        elif self._cancelled:
            self._finish(False, "Setting up was cancelled.")
        else:
            self._probe()

    def _next(self):
        if not self._commands:
            self._finish(True, "The tracer is ready.")
            return
        what, words = self._commands.pop(0)
        self.said.emit(f"{what} ...")
        self.said.emit("> " + commands_as_text([("", words)]))
        self._start(words, self.said.emit, lambda code, crashed: self._done(what, code, crashed))

    def _done(self, what, code, crashed):
        if self._cancelled:
            self._finish(False, "Setting up was cancelled.")
        elif code != 0 or crashed:
            said = last_sentence(self._process.errors) if self._process is not None else ""
            self._finish(
                False, f"{what} failed{': ' + said if said else f' with exit code {code}'}.".replace("..", ".")
            )
        else:
            self._next()

    def _start(self, words, on_line, on_end):
        self._process = LineProcess(words[0], words[1:], child_environment(), self)
        self._process.line.connect(on_line)
        self._process.ended.connect(on_end)
        self._process.start()

    def _finish(self, success, text):
        if not success:
            shutil.rmtree(environment_folder(), ignore_errors=True)
        self.ended.emit(success, text)
