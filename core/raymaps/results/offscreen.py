# SPDX-License-Identifier: LGPL-2.1-or-later
"""Drawing with VTK where there may be no display."""

from __future__ import annotations

import ctypes
import os
import sys

from raymaps.errors import OutputError

__all__ = ["prepare_offscreen"]

#: Read by VTK when it makes its first window.
_WINDOW_VARIABLE = "VTK_DEFAULT_OPENGL_WINDOW"


def prepare_offscreen() -> None:
    """Make VTK draw without a display on Linux, through EGL; elsewhere it needs no help.

    VTK ends the whole process where it finds no OpenGL, so that is looked for before.

    Raises
    ------
    OutputError
        If there is neither EGL nor a display.
    """
    if sys.platform != "linux" or _WINDOW_VARIABLE in os.environ:
        return
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        if os.environ.get("DISPLAY"):
            return  # VTK's own choice draws through the display
        raise OutputError(
            "A PNG of the model can't be drawn: this machine has neither a display nor EGL. Install the system "
            "packages libegl1 and libgl1-mesa-dri (apt-get install), or name a .html file, which needs neither."
        ) from None
    os.environ[_WINDOW_VARIABLE] = "vtkEGLRenderWindow"
