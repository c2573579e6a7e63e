#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Makes the examples' documents and scenes anew, inside FreeCAD.

    python3 examples/make.py [NAME ...]

Needs FreeCAD and, for colours and views in the documents, Xvfb. Plain Python without other packages.
"""

import os
import shutil
import subprocess
import sys
import tempfile

FOLDER = os.path.dirname(os.path.abspath(__file__))
NAMES = ("led_collimator", "singlet_barrel")

DRIVER = """
import os, runpy, sys, traceback
def make():
    done = 1
    try:
        sys.path.append({folder!r})
        runpy.run_path({script!r})
        done = 0
    except Exception:
        os.write(2, traceback.format_exc().encode())
    os._exit(done)
if os.environ["RAYMAPS_WINDOW"] == "1":
    from PySide import QtCore
    QtCore.QTimer.singleShot(0, make)
else:
    make()
"""


def make(name, home):
    """Run one example's script in FreeCAD; with a window where there is one or Xvfb."""
    script = os.path.join(FOLDER, name + ".py")
    driver = os.path.join(home, name + "_driver.py")
    with open(driver, "w", encoding="utf-8") as file:
        file.write(DRIVER.format(folder=FOLDER, script=script))
    window = bool(shutil.which("xvfb-run")) and bool(shutil.which("freecad"))
    command = (
        ["xvfb-run", "-a", "-s", "-screen 0 1400x900x24 -dpi 96", "freecad", driver]
        if window
        else ["freecadcmd", driver]
    )
    environment = {**os.environ, "HOME": home, "RAYMAPS_WINDOW": str(int(window)), "QTWEBENGINE_DISABLE_SANDBOX": "1"}
    return subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, timeout=300).returncode


def main():
    with tempfile.TemporaryDirectory() as home:
        for mod in (".local/share/FreeCAD/Mod", ".local/share/FreeCAD/v1-1/Mod"):
            os.makedirs(os.path.join(home, mod))
            os.symlink(os.path.dirname(FOLDER), os.path.join(home, mod, "RayMaps"))
        failed = [name for name in sys.argv[1:] or NAMES if make(name, home)]
    for name in failed:
        print(f"example '{name}' was not made; see the messages above", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
