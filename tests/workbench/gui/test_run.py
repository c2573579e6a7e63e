# SPDX-License-Identifier: LGPL-2.1-or-later
"""The main job in the window: open an example, run it for real, ask, see the rays."""

import os
import shutil
import signal
import time
import zipfile
from unittest import mock

import FreeCAD
import FreeCADGui

from gui.window import RUN_LIMIT_S, WindowTest, spin, wait_until, window_picture
from raymaps_wb.compat import QtCore, QtWidgets
from raymaps_wb.gui import dock
from raymaps_wb.gui.staleness import update_stale
from raymaps_wb.objects.medium import make_medium
from raymaps_wb.objects.references import set_references
from raymaps_wb.objects.result import map_folder, result_of
from raymaps_wb.objects.study import members, studies
from raymaps_wb.taskpanels.base import ObjectPanel
from raymaps_wb.tracer.interpreter import OVERRIDE, PREFERENCES
from raymaps_wb.tracer.trace import CANCELLED, DONE, FAILED

MANY_RAYS = 5_000_000


def is_alive(number):
    """Whether a child process runs; one that ended and was not waited for does not."""
    try:
        with open(f"/proc/{number}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


class RunTest(WindowTest):
    def start(self, study):
        """Start a run and wait for its first progress."""
        session, seen, outcomes = self.panel.show_study(study), [], []
        session.progressed.connect(lambda rays, of, left: seen.append(rays))
        session.run_ended.connect(outcomes.append)
        FreeCADGui.runCommand("RayMaps_Run")
        self.assertTrue(wait_until(lambda: outcomes or any(seen), RUN_LIMIT_S), self.panel.status.text())
        self.assertEqual(outcomes, [])
        return session, outcomes

    def test_example_1_run_filter_and_see(self):
        study = self.open_example("led_collimator", rays=3000)
        outcome = self.run_study(study)
        self.assertEqual(outcome.state, DONE, outcome.text)
        result = result_of(study)
        self.assertEqual((result.Rays, result.Stale), (3000, False))
        self.assertTrue(os.path.isdir(map_folder(result)))

        everything, drawn = self.ask("true", 3000)
        self.assertEqual((everything["rays"], everything["scanned"], drawn["rays"]), (3000, 3000, 3000))
        n_all, _ = self.ray_pixels()
        self.assertGreater(n_all, 5000)

        red, drawn = self.ask("from(LED_red) & detector(Target)", 3000)
        self.assertTrue(0 < red["rays"] <= 1000)
        self.assertGreater(red["flux_stderr_w"], 0)
        n_red, colour = self.ray_pixels()
        self.assertTrue(500 < n_red < n_all, (n_red, n_all))
        self.assertGreater(colour[0], 1.5 * max(colour[1:]), colour)

        few, drawn = self.ask("from(LED_red) & detector(Target, rect=(-5,-5,5,5))", 3000)
        self.assertTrue(0 < few["rays"] < red["rays"])
        n_few, _ = self.ray_pixels()
        self.assertTrue(0 < n_few < n_red, (n_few, n_red))

        none, drawn = self.ask("from(LED_red) & ~from(LED_red)")
        self.assertEqual((none["rays"], drawn["segments"], self.ray_pixels()[0]), (0, 0, 0))
        self.assertIn("No ray matches", self.panel.report.toPlainText())

        # The panel shows the figures, the document keeps them.
        self.ask("from(LED_red) & detector(Target)", 3000)
        self.assertIn("rays match", self.panel.counts.text())
        self.assertIn("emitted by LED_red", self.panel.report.toPlainText())
        self.assertEqual((result.MatchingRays, result.Criterion), (red["rays"], "from(LED_red) & detector(Target)"))
        self.assertEqual(result.History[0], "from(LED_red) & detector(Target)")

    def test_pictures(self):
        folder = os.environ.get("RAYMAPS_PICTURES") or self.folder
        study = self.open_example("led_collimator")
        self.run_to_the_end(study)
        FreeCAD.closeDocument(self.document.Name)
        self.ask("detector(Target) & ended(absorbed)", 150)
        window = FreeCADGui.getMainWindow()
        for name in ("Report view", "Python console"):
            window.findChild(QtWidgets.QDockWidget, name).hide()
        window.resizeDocks([self.panel], [430], QtCore.Qt.Horizontal)
        for tree in window.findChildren(QtWidgets.QTreeWidget):
            for item in tree.findItems("led_collimator", QtCore.Qt.MatchExactly | QtCore.Qt.MatchRecursive):
                item.setExpanded(True)
        view = FreeCADGui.activeDocument().activeView()
        view.setCameraOrientation(FreeCAD.Rotation(FreeCAD.Vector(0.91, 0.26, 0.31), 72).Q)
        spin(0.5)
        view.fitAll()
        self.panel.criterion.lineEdit().home(False)
        window_picture(os.path.join(folder, "workbench.png"))
        self.assertGreater(os.path.getsize(os.path.join(folder, "workbench.png")), 50_000)

    def test_a_wrong_criterion_is_told_in_words(self):
        study = self.open_example("led_collimator", rays=2000)
        self.run_to_the_end(study)
        self.ask("true")
        for text, word in (("from(LED_rde)", "LED_red"), ("detector(", ""), ("hit(Collimator, sideways)", "sideways")):
            self.panel.criterion.setEditText(text)
            self.panel.apply_button.click()
            self.assertTrue(wait_until(self.panel.error.text))
            self.assertIn(word, self.panel.error.text())
            self.assertNotIn("Traceback", self.panel.error.text())
            # Rays and histories of the question before are gone.
            self.assertEqual((self.ray_pixels()[0], self.panel.report.toPlainText()), (0, ""))
        self.ask("from(LED_red)")
        self.assertEqual(self.panel.error.text(), "")
        self.assertGreater(self.ray_pixels()[0], 0)

    def test_window_stays_responsive_during_a_run(self):
        study = self.open_example("singlet_barrel", rays=MANY_RAYS)
        ticks = []
        timer = QtCore.QTimer()
        timer.timeout.connect(lambda: ticks.append(time.monotonic()))
        timer.start(20)
        session, outcomes = self.start(study)
        first = len(ticks)
        spin(3)
        self.assertTrue(session.is_running())
        timer.stop()
        gaps = [b - a for a, b in zip(ticks[first:], ticks[first + 1 :], strict=False)]
        self.assertGreater(len(gaps), 30)
        self.assertLess(max(gaps), 1.0)
        session.cancel()
        self.assertTrue(wait_until(lambda: outcomes))

    def test_cancel_leaves_a_valid_map(self):
        study = self.open_example("singlet_barrel", rays=MANY_RAYS)
        _, outcomes = self.start(study)
        began = time.monotonic()
        self.panel.cancel_button.click()
        self.assertTrue(wait_until(lambda: outcomes, 10))
        self.assertLess(time.monotonic() - began, 5)
        self.assertEqual(outcomes[0].state, CANCELLED)
        answer, drawn = self.ask("true", 100)
        self.assertTrue(0 < answer["scanned"] < MANY_RAYS)
        self.assertGreater(drawn["segments"], 0)
        result = result_of(study)
        self.assertEqual((result.Rays, result.Stale), (answer["scanned"], False))
        self.assertTrue(self.panel.run_button.isEnabled())

    def test_a_tracer_that_dies_gives_one_clear_message(self):
        study = self.open_example("singlet_barrel", rays=2000)
        self.run_to_the_end(study)
        kept = result_of(study).MapPath
        study.Rays = MANY_RAYS
        session, outcomes = self.start(study)
        os.kill(session.run_process_id(), signal.SIGKILL)
        self.assertTrue(wait_until(lambda: outcomes, 10))
        self.assertEqual(outcomes[0].state, FAILED)
        self.assertIn("crashed or was killed", self.panel.status.text())
        # Nothing is lost: the former result answers, and the study runs again.
        self.assertEqual(result_of(study).MapPath, kept)
        self.assertEqual(self.ask("true")[0]["rays"], 2000)
        study.Rays = 1000
        self.run_to_the_end(study)

    def test_closing_a_document_ends_its_run(self):
        study = self.open_example("singlet_barrel", rays=MANY_RAYS)
        session, outcomes = self.start(study)
        number = session.run_process_id()
        FreeCAD.closeDocument(study.Document.Name)
        self.assertTrue(wait_until(lambda: not is_alive(number), 10))
        self.assertEqual(outcomes, [])
        self.assertIsNot(self.panel._session, session)

    def test_the_panel_follows_the_active_document(self):
        first, second = self.open_example("singlet_barrel"), self.open_example("led_collimator")
        self.assertIs(self.panel.study(), second)
        FreeCAD.setActiveDocument(first.Document.Name)
        self.assertTrue(wait_until(lambda: self.panel.study() is first, 3))
        self.assertIn("singlet_barrel", self.panel.title.text())
        self.assertIn("from(Stray)", [self.panel.criterion.itemText(i) for i in range(self.panel.criterion.count())])

    def test_a_reader_that_dies_is_started_again(self):
        study = self.open_example("singlet_barrel", rays=2000)
        self.run_to_the_end(study)
        self.ask("true")
        session = self.panel.show_study(study)
        os.kill(session.server_process_id(), signal.SIGKILL)
        spin(0.5)
        self.assertEqual(self.ask("true")[0]["rays"], 2000)

    def test_an_interpreter_that_is_no_tracer(self):
        study = self.open_example("singlet_barrel", rays=1000)
        before = os.environ.get(OVERRIDE)
        self.addCleanup(
            lambda: os.environ.pop(OVERRIDE, None) if before is None else os.environ.update({OVERRIDE: before})
        )
        os.environ[OVERRIDE] = "/bin/false"
        self.assertEqual(self.run_study(study).state, FAILED)
        self.assertIn("exit code 1", self.panel.status.text())
        os.environ[OVERRIDE] = "/nowhere/python"
        FreeCADGui.runCommand("RayMaps_Run")
        self.assertIn("'/nowhere/python'", self.panel.status.text())
        os.environ.pop(OVERRIDE)
        preferences = FreeCAD.ParamGet(PREFERENCES)
        preferences.SetString("Interpreter", "/nowhere/else/python")
        self.addCleanup(preferences.RemString, "Interpreter")
        FreeCADGui.runCommand("RayMaps_Run")
        self.assertIn("'/nowhere/else/python', named by the preference", self.panel.status.text())

    def test_a_faulty_study_does_not_start(self):
        study = self.open_example("singlet_barrel")
        source = next(obj for obj in study.Group if obj.Label == "Stray")
        source.FluxW = -3
        FreeCADGui.runCommand("RayMaps_Run")
        self.assertIn("Stray: the flux must be above 0 W, got -3 W.", self.panel.status.text())
        self.assertFalse(self.panel.show_study(study).is_running())
        source.FluxW = 3
        self.assertTrue(wait_until(lambda: not self.panel.status.text(), 3), self.panel.status.text())

    def test_touching_bodies_run_without_a_warning(self):
        study, _, _ = self.full_study()
        study.Rays = 2000
        cover = self.box("Cover")
        cover.Placement.Base = self.vector(0, 0, 30)
        glass = make_medium(self.document, study, "glass")
        set_references(glass, [(cover, "")])
        glass.RefractiveIndex = 1.9
        members(study, "RayMaps::Source")[0].Placement.Base = self.vector(5, 10, 15)
        self.document.recompute()
        outcome = self.run_study(study)
        self.assertEqual(outcome.state, DONE, outcome.text)
        self.assertEqual(self.panel.warning.text(), "")
        self.assertLess(outcome.summary["killed_w"], 1e-3 * outcome.summary["emitted_w"])
        self.assertIn(dock.GOOD, self.panel.status.styleSheet())
        self.assertFalse(self.panel.lost.isVisibleTo(self.panel))

    def test_killed_light_is_told(self):
        study, _, _ = self.full_study()
        study.Rays, study.MaxEvents = 1000, 2
        members(study, "RayMaps::Source")[0].Placement.Base = self.vector(5, 10, 15)
        outcome = self.run_study(study)
        self.assertEqual(outcome.state, DONE, outcome.text)
        self.assertGreater(outcome.summary["killed_w"], 0.01)
        self.assertTrue(wait_until(lambda: "Most of the killed light" in self.panel.status.text(), 20))
        self.assertIn("set 'Max events' of the study higher", self.panel.status.text())
        self.assertIn(dock.BAD, self.panel.status.styleSheet())

    def test_where_rays_got_lost_is_told_and_shown(self):
        study, _, _ = self.full_study()
        study.Rays = 1000
        session = self.panel.show_study(study)
        place = {"face": "Face3", "reason": "numerical", "rays": 2, "flux_w": 1e-3, "point_mm": [1.5, 2, -3]}
        places = [{**place, "body": body, "criterion": f"hit({body})"} for body in ("Lens", "Plate", "a<b", "Lens")]
        places[1] = {**place, "body": None, "face": None, "rays": 1}
        with mock.patch.object(session, "info", lambda on_result: on_result({"lost": places})):
            self.run_to_the_end(study)
            self.ask("from(Source)")
        label = self.panel.lost
        self.assertTrue(label.isVisibleTo(self.panel))
        for words in (
            "7 rays with 4 mW got lost",
            "<a href='1'>2 rays</a> at Lens.Face3, the first at (1.5, 2, -3) mm",
            "<a href='2'>1 ray</a> off all faces",
            "a&lt;b.Face3",
            "and at 1 more place",
        ):
            self.assertIn(words, label.text())
        folder = os.environ.get("RAYMAPS_PICTURES")
        if folder:
            window_picture(os.path.join(folder, "lost.png"))
        counted = []
        session.counted.connect(counted.append)
        for number, criterion in ((0, "event(killed_numerical)"), (1, "hit(Lens)"), (2, "event(killed_numerical)")):
            label.linkActivated.emit(str(number))
            self.assertEqual(self.panel.criterion.currentText(), criterion)
            self.assertTrue(wait_until(lambda n=number: len(counted) > n, 30))
            self.assertEqual(self.panel.error.text(), "")
        self.assertTrue(label.isVisibleTo(self.panel))
        self.panel.criterion.setEditText("hit(")
        self.panel.apply()
        self.assertTrue(wait_until(lambda: self.panel.error.text(), 30))
        self.assertTrue(label.isVisibleTo(self.panel))
        # Another map, which lost none, and one that an older tracer tells of.
        for info in ({"lost": []}, {}):
            with mock.patch.object(session, "info", lambda on_result, info=info: on_result(info)):
                self.run_to_the_end(study)
                self.ask("true")
            self.assertFalse(label.isVisibleTo(self.panel))

    def test_rays_belong_to_the_result_s_map_also_after_undo(self):
        study = self.open_example("singlet_barrel", rays=1000)
        document = study.Document
        document.UndoMode = 1
        self.run_to_the_end(study)
        self.ask("from(Stray)")
        first = map_folder(result_of(study))
        study.Rays = 2000
        self.run_to_the_end(study)
        self.assertEqual(self.ask("from(Stray)")[0]["scanned"], 2000)
        document.undo()
        self.assertEqual(map_folder(result_of(study)), first)
        self.assertTrue(
            wait_until(lambda: "of 1\u202f000 rays" in self.panel.counts.text(), 10), self.panel.counts.text()
        )
        shutil.rmtree(first)
        self.panel.refresh()
        self.assertIn("not there any more", self.panel.status.text())
        self.assertNotIn("up to date", self.panel.title.text())
        self.assertEqual((self.ray_pixels()[0], self.panel.counts.text()), (0, ""))
        document.redo()
        self.assertTrue(
            wait_until(lambda: "of 2\u202f000 rays" in self.panel.counts.text(), 10), self.panel.counts.text()
        )
        self.assertEqual(self.panel.status.text(), "")

    def test_undo_past_the_first_run(self):
        study = self.open_example("singlet_barrel", rays=1000)
        study.Document.UndoMode = 1
        self.run_to_the_end(study)
        self.ask("from(Stray)")
        study.Document.undo()
        self.assertIsNone(result_of(study))
        self.assertTrue(wait_until(lambda: "not simulated yet" in self.panel.title.text(), 5))
        self.assertEqual((self.panel.counts.text(), self.panel.report.toPlainText()), ("", ""))
        self.assertFalse(self.panel.apply_button.isEnabled())
        study.Document.redo()
        self.assertTrue(wait_until(lambda: "rays match" in self.panel.counts.text(), 10), self.panel.title.text())
        self.assertIn("up to date", self.panel.title.text())

    def test_a_run_that_ends_while_a_panel_is_open_outlives_its_cancel(self):
        study = self.open_example("singlet_barrel", rays=1000)
        before = len(study.Group)
        FreeCADGui.Selection.clearSelection()
        with mock.patch.object(ObjectPanel, "begin", autospec=True, side_effect=ObjectPanel.begin) as begin:
            FreeCADGui.runCommand("RayMaps_Detector")
        self.run_to_the_end(study)
        begin.call_args[0][0].reject()
        FreeCADGui.Control.closeDialog()
        self.assertEqual(len(study.Group), before + 1)
        self.assertTrue(os.path.isdir(map_folder(result_of(study))))
        self.ask("true")

    def test_a_count_without_flux(self):
        study = self.open_example("singlet_barrel", rays=1000)
        self.run_to_the_end(study)
        answer = {"criterion": "true", "rays": 3, "scanned": 7, "flux_w": None, "flux_stderr_w": None}
        self.panel.show_study(study)._count("true", 150, answer)
        self.assertIn("3</b> of 7 rays match", self.panel.counts.text())

    def test_save_reopen_ask_and_simulate_again(self):
        study = self.open_example("led_collimator", rays=3000)
        self.run_to_the_end(study)
        self.ask("detector(Beam)")
        first = map_folder(result_of(study))
        document = self.reopened(study.Document)
        study = studies(document)[0]
        self.panel.show_study(study)
        result = result_of(study)
        self.assertEqual((map_folder(result), result.Criterion), (first, "detector(Beam)"))
        self.assertFalse(update_stale(study))
        # The old map answers without a new simulation.
        self.assertGreater(self.ask("detector(Beam)")[1]["segments"], 0)
        self.run_to_the_end(study)
        self.assertNotEqual(map_folder(result_of(study)), first)
        self.assertTrue(os.path.isdir(first))
        self.assertEqual(self.ask("true")[0]["rays"], 3000)
        self.assertEqual(len([obj for obj in study.Group if obj.Proxy.TYPE == "RayMaps::Result"]), 1)

    def test_a_change_marks_the_result_stale(self):
        study = self.open_example("led_collimator", rays=1000)
        self.run_to_the_end(study)
        result = result_of(study)
        self.assertIn("up to date", self.panel.title.text())
        self.assertTrue(result.ViewObject.Proxy.getIcon().endswith("result.svg"))
        document = study.Document
        document.getObject("Collimator").Placement.Base.z += 0.5
        document.recompute()
        self.assertTrue(wait_until(lambda: result.Stale, 5))
        self.assertTrue(wait_until(lambda: "stale" in self.panel.title.text(), 5))
        self.assertTrue(result.ViewObject.Proxy.getIcon().endswith("result_stale.svg"))
        document.getObject("Collimator").Placement.Base.z -= 0.5
        document.recompute()
        self.assertTrue(wait_until(lambda: not result.Stale, 5))

    def test_an_unsaved_document_runs(self):
        study, _, _ = self.full_study()
        study.Rays = 500
        outcome = self.run_study(study)
        self.assertEqual(outcome.state, DONE, outcome.text)
        self.assertTrue(map_folder(result_of(study)).startswith(FreeCAD.getUserAppDataDir()))

    def test_a_document_made_without_a_window_gets_its_views(self):
        path = os.path.join(self.folder, "bare.FCStd")
        study = self.open_example("led_collimator")
        source = study.Document.FileName
        FreeCAD.closeDocument(study.Document.Name)
        with zipfile.ZipFile(source) as full, zipfile.ZipFile(path, "w") as bare:
            for name in full.namelist():
                if not name.startswith("Gui") and not name.endswith(".xml.bak"):
                    bare.writestr(name, full.read(name))
        study = studies(FreeCAD.openDocument(path))[0]
        spin(0.3)
        for obj in [study, *study.Group]:
            self.assertEqual(type(obj.ViewObject.Proxy).__name__, "View" + type(obj.Proxy).__name__)
