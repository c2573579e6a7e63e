# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which Python runs the tracer, and in which environment."""

import os
from collections import namedtuple

import FreeCAD

from raymaps_wb.compat import QtCore, user_data_folder
from raymaps_wb.errors import TracerError
from raymaps_wb.paths import ADDON_FOLDER, LAUNCHER

PREFERENCES = "User parameter:BaseApp/Preferences/Mod/RayMaps"
OVERRIDE = "RAYMAPS_PYTHON"

#: path: of the executable. origin: in words, where it was found.
Interpreter = namedtuple("Interpreter", "path origin")

#: Variables that would lead the child to the wrong libraries; AppImages set them.
REMOVED = ("LD_LIBRARY_PATH", "LD_PRELOAD", "DYLD_LIBRARY_PATH", "VIRTUAL_ENV", "QML2_IMPORT_PATH", "QTDIR")
REMOVED_PREFIXES = ("PYTHON", "QT_", "PYSIDE", "COIN_")


def environment_folder():
    """The private environment that *Set up tracer* makes."""
    return os.path.join(user_data_folder(), "environment")


def python_in(environment):
    """The interpreter of a virtual environment."""
    return os.path.join(environment, *(("Scripts", "python.exe") if os.name == "nt" else ("bin", "python")))


def find_interpreter():
    """The interpreter to use: a named one, else that of the repository, else the private one.

    Raises
    ------
    TracerError
        If a named one is not there, or there is none at all.
    """
    named = [
        (os.environ.get(OVERRIDE, ""), f"the environment variable {OVERRIDE}"),
        (FreeCAD.ParamGet(PREFERENCES).GetString("Interpreter", ""), "the preference Interpreter"),
    ]
    for path, origin in named:
        if path and not os.path.isfile(path):
            raise TracerError(f"The tracer's Python '{path}', named by {origin}, is not there; correct or remove it.")
        if path:
            return Interpreter(path, origin)
    made = [
        (python_in(os.path.join(ADDON_FOLDER, ".venv")), "the addon's own .venv"),
        (python_in(environment_folder()), "the private environment"),
    ]
    for path, origin in made:
        if os.path.isfile(path):
            return Interpreter(path, origin)
    raise TracerError("The tracer is not set up yet; use the command 'Set up tracer'.")


def tracer_arguments(arguments):
    """Arguments for the interpreter that run ``raymaps ARGUMENTS``."""
    return ["-I", "-u", LAUNCHER, *arguments]


def child_environment():
    """The environment of this process without what would mislead another Python."""
    environment = QtCore.QProcessEnvironment.systemEnvironment()
    for name in environment.keys():  # noqa: SIM118 (not a dict)
        if name in REMOVED or name.startswith(REMOVED_PREFIXES):
            environment.remove(name)
    environment.insert("PYTHONIOENCODING", "utf-8")
    return environment
