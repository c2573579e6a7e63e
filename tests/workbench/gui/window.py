# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the window's tests share: waiting without blocking, the panel, pictures and what is on them."""

import os
import shutil
import time

import FreeCAD
import FreeCADGui
from support import EXAMPLES, DocumentTest

from raymaps_wb.compat import QtCore, QtGui, QtWidgets
from raymaps_wb.gui import dock
from raymaps_wb.objects.result import result_of
from raymaps_wb.objects.study import studies
from raymaps_wb.tracer.trace import DONE

RUN_LIMIT_S = 300


def spin(seconds):
    """Let the window work for a while."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        QtCore.QCoreApplication.processEvents(QtCore.QEventLoop.AllEvents, 50)


def wait_until(condition, limit_s=60):
    """Let the window work until a condition holds; whether it did in time."""
    end = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > end:
            return False
        QtCore.QCoreApplication.processEvents(QtCore.QEventLoop.AllEvents, 20)
        time.sleep(0.005)  # the processor is the tracer's
    return True


class WindowTest(DocumentTest):
    """The window with the workbench active; every process that a test started is ended after it."""

    def setUp(self):
        super().setUp()
        FreeCADGui.activateWorkbench("RayMapsWorkbench")
        FreeCADGui.getMainWindow().setGeometry(0, 0, 1600, 1000)
        self.panel = dock.show()
        self.addCleanup(self.panel.close_sessions)

    def open_example(self, name, rays=None):
        """A copy of an example, its study shown in the panel."""
        path = os.path.join(self.folder, name + ".FCStd")
        shutil.copy(os.path.join(EXAMPLES, name + ".FCStd"), path)
        document = FreeCAD.openDocument(path)
        study = studies(document)[0]
        if rays:
            study.Rays = rays
        view = FreeCADGui.getDocument(document.Name).activeView()
        view.setAnimationEnabled(False)
        view.viewIsometric()
        view.fitAll()
        self.panel.show_study(study)
        return study

    def run_study(self, study):
        """Run to the end; the outcome."""
        session, outcomes = self.panel.show_study(study), []
        session.run_ended.connect(outcomes.append)
        FreeCADGui.runCommand("RayMaps_Run")
        self.assertTrue(wait_until(lambda: outcomes, RUN_LIMIT_S), self.panel.status.text())
        return outcomes[0]

    def run_to_the_end(self, study):
        """Run; the test fails with the tracer's words if it is not done."""
        outcome = self.run_study(study)
        self.assertEqual(outcome.state, DONE, outcome.text)

    def ask(self, criterion, max_rays=1000):
        """Apply a criterion; the answers to query and overlay."""
        session = self.panel.show_study(self.panel.study())
        counted, drawn, reported, refused = [], [], [], []
        connections = (
            (session.counted, counted),
            (session.drawn, drawn),
            (session.reported, reported),
            (session.refused, refused),
        )
        for signal, answers in connections:
            signal.connect(answers.append)
        self.panel.max_rays.setValue(max_rays)
        self.panel.criterion.setEditText(criterion)
        self.panel.apply_button.click()
        done = wait_until(lambda: refused or (counted and drawn and reported))
        for signal, answers in connections:
            signal.disconnect(answers.append)
        self.assertTrue(done and not refused, refused or "no answer")
        spin(0.3)
        return counted[0], drawn[0]

    def picture(self, name="view.png"):
        """The 3D view as an image."""
        path = os.path.join(self.folder, name)
        view = FreeCADGui.activeDocument().activeView()
        view.saveImage(path, 900, 700, "Current")
        image = QtGui.QImage(path)
        self.assertFalse(image.isNull())
        return image

    def ray_pixels(self):
        """(number of pixels that the rays cover in the 3D view, their mean colour)."""
        view = result_of(self.panel.study()).ViewObject
        view.Visibility = True
        shown = self.picture("shown.png")
        view.Visibility = False
        hidden = self.picture("hidden.png")
        view.Visibility = True
        n, total = 0, [0, 0, 0]
        for y in range(shown.height()):
            for x in range(shown.width()):
                a, b = shown.pixel(x, y), hidden.pixel(x, y)
                if a != b and sum(abs(((a >> s) & 255) - ((b >> s) & 255)) for s in (0, 8, 16)) > 60:
                    n += 1
                    for i, s in enumerate((16, 8, 0)):
                        total[i] += (a >> s) & 255
        return n, [value / n for value in total] if n else total


def window_picture(path):
    """The whole window as it is on the screen."""
    spin(0.5)
    QtWidgets.QApplication.primaryScreen().grabWindow(0).save(path)
