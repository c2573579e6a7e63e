# SPDX-License-Identifier: LGPL-2.1-or-later
"""Starts the command line of Ray Maps in an interpreter that has what it needs, but perhaps not Ray Maps itself.

    python -I -u launcher.py trace SCENE -o MAP

Run by the interpreter of the tracer, never imported in FreeCAD. An installed Ray Maps wins over the addon's own.
"""

import os
import runpy
import sys

if __name__ == "__main__":
    addon = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
    sys.path.append(os.path.join(addon, "core"))
    sys.argv[0] = "raymaps"
    runpy.run_module("raymaps", run_name="__main__", alter_sys=True)
