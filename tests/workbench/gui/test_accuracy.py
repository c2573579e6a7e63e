# SPDX-License-Identifier: LGPL-2.1-or-later
"""What accuracy costs: a trial in another process, curves, the slider, and what OK sets."""

import math
import os
from unittest import mock

import FreeCADGui

from gui.window import WindowTest, spin, wait_until, window_picture
from raymaps_wb.compat import QtCore, QtWidgets
from raymaps_wb.objects.study import members
from raymaps_wb.taskpanels.accuracy import AccuracyPanel
from raymaps_wb.tracer.interpreter import OVERRIDE
from raymaps_wb.tracer.outlook import Outlook, forecast_of

TRIAL_LIMIT_S = 240


def choice(words, sampling="random", surfaces="exact", bands=32, **more):
    """A choice as the command tells it."""
    return {
        "choice": words,
        "settings": {"sampling": sampling, "surfaces": surfaces, "bands": bands},
        "error_at_one_ray": 2.0,
        "exponent": 0.5,
        "bias_percent": None,
        "bias_stderr_percent": None,
        "start_s": 3.0,
        "s_per_million_rays": 10.0,
        **more,
    }


ANSWER = {
    "quantity": "detector 'Detector'",
    "choices": [
        choice("exact, 32 bands, random"),
        choice("exact, 32 bands, Sobol'", "sobol", exponent=0.8, error_at_one_ray=6.0, s_per_million_rays=12.0),
        choice("faceted, 32 bands, random", surfaces="faceted", bias_percent=-0.4, bias_stderr_percent=0.1),
        choice("exact, RGB, random", bands=None, bias_percent=3, bias_stderr_percent=0.1, s_per_million_rays=4.0),
        choice("exact, 4 bands, random", bands=4, bias_percent=1.2, bias_stderr_percent=0.1, s_per_million_rays=5.0),
        choice("exact, 64 bands, random", bands=64, bias_percent=0.1, bias_stderr_percent=0.1, s_per_million_rays=15.0),
    ],
}


class OutlookTest(WindowTest):
    def test_errors_and_times(self):
        one = Outlook(ANSWER["choices"][2])
        for rays in (1000, 10**6, 10**12):
            self.assertAlmostEqual(one.error(rays), math.sqrt(4 / rays + 0.004**2), 12)
            self.assertAlmostEqual(one.time_s(rays), 3 + rays * 1e-5, 9)
        self.assertAlmostEqual(one.rays(13), 10**6)
        self.assertEqual(Outlook(ANSWER["choices"][5]).bias, 0)  # not seen

    def test_stops(self):
        stops = Outlook(ANSWER["choices"][0]).stops(123_456)
        self.assertEqual((stops[0], stops[-1]), (1000, 2 * 10**7))
        self.assertEqual(stops, sorted(set(stops)))
        self.assertIn(123_456, stops)
        stops = Outlook(ANSWER["choices"][1]).stops(100_000)
        self.assertTrue(all(n == 100_000 or n & (n - 1) == 0 for n in stops))


class AccuracyTest(WindowTest):
    def setUp(self):
        super().setUp()
        self.study_, _, _ = self.full_study()
        self.addCleanup(FreeCADGui.Control.closeDialog)

    def panel_of(self, study, answer=None):
        panel = AccuracyPanel(study)
        FreeCADGui.Control.showDialog(panel)
        self.addCleanup(panel.stop)
        if answer is not None:
            panel.show(forecast_of(answer))
        spin(0.1)
        return panel

    def picture_of(self, panel, name):
        folder = os.environ.get("RAYMAPS_PICTURES")
        if folder:
            spin(0.3)
            panel.form.grab().save(os.path.join(folder, f"accuracy_{name}.png"))

    def test_slider_and_choices(self):
        panel = self.panel_of(self.study_, ANSWER)
        self.assertEqual(panel.rays(), 100_000)
        self.assertIn("4 s", panel.told.text())
        self.assertIn("\u00b1 0.63 %", panel.told.text())
        self.assertEqual(panel.changes.text(), "OK changes nothing.")
        self.picture_of(panel, "now")
        panel.slider.setValue(panel.slider.maximum())
        self.assertEqual(panel.rays(), 2 * 10**7)
        self.assertIn("\u00b1 0.045 %", panel.told.text())
        panel.slider.setValue(0)
        self.assertIn("\u00b1 6.3 %", panel.told.text())
        panel.choice.setCurrentIndex(3)
        panel._pick(7.0)
        self.assertEqual(panel.rays(), 10**6)
        self.assertIn("light in red, green and blue", panel.changes.text())
        self.assertIn("Always off by about 3 %", panel.changes.text())
        self.picture_of(panel, "rgb")
        panel.choice.setCurrentIndex(1)
        self.assertEqual(panel.rays(), 2**20)
        self.assertIn("OK sets Rays 1\u202f048\u202f576, Sampling Sobol.", panel.changes.text())
        self.picture_of(panel, "sobol")

    def test_ok_is_one_step_of_undo(self):
        panel = self.panel_of(self.study_, ANSWER)
        panel.choice.setCurrentIndex(3)
        panel.slider.setValue(panel._stops.index(10**6))
        self.assertTrue(panel.accept())
        self.assertEqual((self.study_.Rays, list(self.study_.Without)), (10**6, ["spectral"]))
        self.assertFalse(FreeCADGui.Control.activeDialog())
        self.document.undo()
        self.assertEqual((self.study_.Rays, list(self.study_.Without)), (100_000, []))
        for i, name, value in ((1, "Sampling", "Sobol"), (2, "Surfaces", "Faceted"), (4, "Bands", 4)):
            panel = self.panel_of(self.study_, ANSWER)
            panel.choice.setCurrentIndex(i)
            panel.accept()
            self.assertEqual(getattr(self.study_, name), value)
            self.document.undo()
        panel = self.panel_of(self.study_, ANSWER)
        panel.slider.setValue(0)
        panel.reject()
        self.assertEqual(self.study_.Rays, 100_000)

    def test_a_trial(self):
        study = self.open_example("singlet_barrel")
        panel = self.panel_of(study)
        self.assertEqual(panel.detector.count(), 2)
        panel.seconds.setValue(4)
        steps = []
        panel.look()
        panel._trial.trying.connect(lambda *step: steps.append(step))
        self.assertTrue(panel.progress.isVisibleTo(panel.form))
        self.assertTrue(wait_until(lambda: not panel.is_trying(), TRIAL_LIMIT_S), panel.message.text())
        numbers, totals = [step[0] for step in steps], [step[1] for step in steps]
        self.assertEqual(numbers, list(range(1, totals[-1] + 1)))  # rays by need are found on the way
        self.assertEqual(panel.message.text(), "Error of detector 'SensorPlane'")
        self.assertEqual(panel.choice.count(), 4)
        panel.choice.setCurrentIndex(1)
        panel.slider.setValue(panel.slider.maximum() - 3)
        window = FreeCADGui.getMainWindow()
        docks = [dock for dock in window.findChildren(QtWidgets.QDockWidget) if dock.isAncestorOf(panel.form)]
        window.resizeDocks(docks, [400] * len(docks), QtCore.Qt.Horizontal)
        self.picture_of(panel, "trial")
        folder = os.environ.get("RAYMAPS_PICTURES")
        if folder:
            window_picture(os.path.join(folder, "accuracy_window.png"))
        rays = panel.rays()
        panel.accept()
        self.assertEqual((study.Rays, study.Sampling), (rays, "Sobol"))

    def test_the_command_tries_at_once(self):
        began = []
        with mock.patch.object(AccuracyPanel, "look", lambda panel: began.append(panel)):
            FreeCADGui.runCommand("RayMaps_Accuracy")
        spin(0.2)
        self.assertEqual([panel.study() for panel in began], [self.study_])
        self.assertTrue(FreeCADGui.Control.activeDialog())
        began[0].reject()
        self.assertFalse(FreeCADGui.Control.activeDialog())

    def test_cancel(self):
        panel = self.panel_of(self.study_)
        panel.seconds.setValue(600)
        panel.look()
        self.assertEqual(panel.button.text(), "Cancel")
        seen = []
        panel._trial.trying.connect(lambda *step: seen.append(step))
        self.assertTrue(wait_until(lambda: seen, 60))
        panel.button.click()
        self.assertTrue(wait_until(lambda: not panel.is_trying(), 10))
        self.assertIn("The trial was cancelled", panel.message.text())
        self.assertEqual((panel.button.text(), panel.rays(), panel.slider.isEnabled()), ("Try", 0, False))
        panel.accept()
        self.assertEqual(self.study_.Rays, 100_000)

    def test_what_can_not_be_is_told_in_a_sentence(self):
        panel = self.panel_of(self.study_)
        for source in members(self.study_, "RayMaps::Source"):
            self.document.removeObject(source.Name)
        panel.look()
        self.assertIn("no source; add one", panel.message.text())
        self.picture_of(panel, "no_source")
        self.assertFalse(panel.is_trying())
        nothing = {**ANSWER, "choices": [choice("random", error_at_one_ray=None, exponent=None)]}
        panel.show(forecast_of(nothing))
        self.assertIn("Detector 'Detector': no light arrived", panel.message.text())
        self.assertIn("error not known", panel.told.text())

    def test_a_tracer_that_is_missing_or_fails(self):
        before = os.environ.get(OVERRIDE)
        self.addCleanup(
            lambda: os.environ.pop(OVERRIDE, None) if before is None else os.environ.update({OVERRIDE: before})
        )
        panel = self.panel_of(self.study_)
        os.environ[OVERRIDE] = "/nowhere/python"
        panel.look()
        self.assertIn("'/nowhere/python'", panel.message.text())
        os.environ[OVERRIDE] = "/bin/false"
        panel.look()
        self.assertTrue(wait_until(lambda: not panel.is_trying(), 20))
        self.assertEqual(
            panel.message.text(), "The tracer ended with exit code 1 before it told what accuracy costs. Try again."
        )

    def test_a_click_on_the_curve(self):
        panel = self.panel_of(self.study_, ANSWER)
        place = panel.curve._axes().place
        self.assertIsInstance(place, QtCore.QRect)
        panel.curve.picked.emit(panel.curve._axes().time_s(place.right()))
        self.assertGreater(panel.rays(), 10**7)
