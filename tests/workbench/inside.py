# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs inside FreeCAD, started by run.py: the tests of one folder, with all compiled packages made unavailable."""

import json
import os
import sys
import traceback
import unittest

#: The workbench must not need any of these; the last is the tracer, which is another process's business.
BLOCKED = ("numpy", "numba", "embreex", "trimesh", "pyarrow", "pydantic", "scipy", "pandas", "raymaps")


class Result(unittest.TestResult):
    """Writes the report after each test, so that a crash loses none. A skipped test is not a passed one."""

    def __init__(self, path):
        super().__init__()
        self.path, self.results, self.complete = path, [], False

    def write(self):
        with open(self.path + ".part", "w", encoding="utf-8") as file:
            json.dump({"complete": self.complete, "results": self.results}, file)
        os.replace(self.path + ".part", self.path)

    def _note(self, test, text):
        self.results.append((test.id(), text))
        self.write()

    def addSuccess(self, test):
        self._note(test, "")

    def addSkip(self, test, reason):
        self._note(test, f"skipped: {reason}")

    def addFailure(self, test, error):
        self._note(test, self._exc_info_to_string(error, test))

    addError = addFailure

    def addSubTest(self, test, subtest, error):
        if error is not None:
            self._note(subtest, self._exc_info_to_string(error, test))


def flat(suite):
    for item in suite:
        if isinstance(item, unittest.TestSuite):
            yield from flat(item)
        else:
            yield item


def run():
    result = Result(os.environ["RAYMAPS_TEST_REPORT"])
    try:
        for name in BLOCKED:
            sys.modules[name] = None
        folder = os.path.dirname(os.path.abspath(__file__))
        patterns = json.loads(os.environ["RAYMAPS_TEST_PATTERNS"])
        found = unittest.TestLoader().discover(
            os.path.join(folder, os.environ["RAYMAPS_TEST_KIND"]), top_level_dir=folder
        )
        wanted = [test for test in flat(found) if not patterns or any(pattern in test.id() for pattern in patterns)]
        unittest.TestSuite(wanted).run(result)
        result.complete = True
    except Exception:  # noqa: BLE001 (a report must be written in any case)
        result.results.append(("start", traceback.format_exc()))
    result.write()
    sys.stdout.flush()
    os._exit(0)


if os.environ["RAYMAPS_TEST_KIND"] == "gui":
    from PySide import QtCore

    QtCore.QTimer.singleShot(0, run)
else:
    run()
