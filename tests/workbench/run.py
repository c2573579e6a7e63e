#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs the workbench's tests inside a real FreeCAD, and its window under Xvfb.

    python3 tests/workbench/run.py [app] [gui] [NAME ...]

NAME is a part of a test's name. Plain Python without other packages. Ends with a line "N passed, N failed" and exits 1
if a test failed, was skipped, or FreeCAD or Xvfb is missing. The tracer's interpreter is the repository's .venv, or
the one that RAYMAPS_PYTHON names. RAYMAPS_PICTURES names a folder that pictures of the window are written to.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile

FOLDER = os.path.dirname(os.path.abspath(__file__))
ADDON = os.path.dirname(os.path.dirname(FOLDER))
LIMITS_S = {"app": 300, "gui": 1500}
#: How FreeCAD prints an exception that a view provider or a callback raised.
ERROR = re.compile(r"<class '\w*(Error|Exception)'>")
WINDOW = ["xvfb-run", "-a", "-s", "-screen 0 1600x1000x24 -dpi 96"]


def program(*names):
    """Path of the first of some programs that is there."""
    return next((path for path in map(shutil.which, names) if path), None)


def run_limited(command, environment, limit_s):
    """Output of a command and whether it ended in time; with all its children it is ended at the limit."""
    process = subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    try:
        output, _ = process.communicate(timeout=limit_s)
        return output.decode("utf-8", "replace"), True
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        output, _ = process.communicate()
        return output.decode("utf-8", "replace"), False


def fresh_home(freecadcmd, home):
    """Environment with an own home folder in which the addon is installed."""
    environment = {**os.environ, "HOME": home, "QTWEBENGINE_DISABLE_SANDBOX": "1"}
    for name in list(environment):
        if name.startswith("XDG_") or name in ("DISPLAY", "WAYLAND_DISPLAY", "PYTHONPATH", "PYTHONHOME"):
            del environment[name]
    runtime = os.path.join(home, "runtime")
    os.makedirs(runtime, mode=0o700)
    environment["XDG_RUNTIME_DIR"] = runtime
    answer, question = os.path.join(home, "data_folder"), os.path.join(home, "ask.py")
    with open(question, "w", encoding="utf-8") as file:
        file.write(f"import FreeCAD, os\nopen({answer!r}, 'w').write(FreeCAD.getUserAppDataDir())\nos._exit(0)\n")
    output, _ = run_limited([freecadcmd, question], environment, 120)
    if not os.path.isfile(answer):
        sys.exit(f"FreeCAD does not start:\n{output[-2000:]}\n0 passed, 1 failed")
    with open(answer, encoding="utf-8") as file:
        mod = os.path.join(file.read(), "Mod")
    os.makedirs(mod, exist_ok=True)
    os.symlink(ADDON, os.path.join(mod, "RayMaps"))
    return environment


def run_kind(kind, command, environment, home, patterns):
    """(name, text) of each test of a kind; the text tells what failed, empty if it passed."""
    report = os.path.join(home, kind + ".json")
    environment = {
        **environment,
        "RAYMAPS_TEST_KIND": kind,
        "RAYMAPS_TEST_REPORT": report,
        "RAYMAPS_TEST_PATTERNS": json.dumps(patterns),
    }
    output, in_time = run_limited([*command, os.path.join(FOLDER, "inside.py")], environment, LIMITS_S[kind])
    results, complete = [], False
    if os.path.isfile(report):
        with open(report, encoding="utf-8") as file:
            said = json.load(file)
        results, complete = [tuple(result) for result in said["results"]], said["complete"]
    if not in_time:
        results.append((f"{kind} tests", f"did not end within {LIMITS_S[kind]} s:\n{output[-3000:]}"))
    elif not complete:
        results.append((f"{kind} tests", f"FreeCAD ended before the tests were done:\n{output[-3000:]}"))
    elif not results and not patterns:
        results.append((f"{kind} tests", "there are none"))
    # FreeCAD prints what commands and callbacks raise, and goes on.
    raised = [line for line in output.splitlines() if "Traceback (most recent call last)" in line or ERROR.search(line)]
    if raised:
        at = output.index(raised[0])
        results.append((f"{kind} output", f"FreeCAD printed an exception:\n{output[at : at + 3000]}"))
    return results


def main():
    """Run what was asked for; returns the exit code."""
    kinds = [word for word in sys.argv[1:] if word in LIMITS_S] or list(LIMITS_S)
    patterns = [word for word in sys.argv[1:] if word not in LIMITS_S]
    freecadcmd, freecad = program("freecadcmd", "FreeCADCmd"), program("freecad", "FreeCAD")
    missing = [name for name, path in (("freecadcmd", freecadcmd), ("freecad", freecad)) if not path]
    if "gui" in kinds and not program("xvfb-run"):
        missing.append("xvfb-run")
    if missing:
        print(
            f"missing: {', '.join(missing)}; on Debian and Ubuntu: apt-get install freecad xvfb xauth libgl1-mesa-dri"
        )
        print("0 passed, 1 failed")
        return 1
    commands = {"app": [freecadcmd], "gui": [*WINDOW, freecad]}
    results = []
    with tempfile.TemporaryDirectory(prefix="raymaps-home-", ignore_cleanup_errors=True) as home:
        environment = fresh_home(freecadcmd, home)
        for kind in kinds:
            for name, text in run_kind(kind, commands[kind], environment, home, patterns):
                results.append((name, text))
                print(f"{'FAILED' if text else 'ok    '} {kind} {name}", flush=True)
                if text:
                    print("    " + text.replace("\n", "\n    "), flush=True)
    failed = sum(1 for _, text in results if text)
    print(f"{len(results) - failed} passed, {failed} failed")
    return 1 if failed or not results else 0


if __name__ == "__main__":
    sys.exit(main())
