# SPDX-License-Identifier: LGPL-2.1-or-later
"""What goes on with one study: its run, and the process that answers questions about its map."""

import os
import tempfile

import FreeCAD

from raymaps_wb.compat import QtCore, user_data_folder
from raymaps_wb.errors import TracerError, WorkbenchError
from raymaps_wb.export.check import check_study
from raymaps_wb.export.writer import export_study, file_stem
from raymaps_wb.gui.active import Transaction, is_own_step_open
from raymaps_wb.gui.staleness import update_stale
from raymaps_wb.objects.result import make_result, map_folder, result_of, set_map_folder
from raymaps_wb.tracer.explain import Explanation
from raymaps_wb.tracer.interpreter import find_interpreter
from raymaps_wb.tracer.server import MapServer
from raymaps_wb.tracer.trace import DONE, FAILED, TraceRun

REPORTED_RAYS = 50
MAX_SEGMENTS = 100_000
CHECK_LIMIT_S = 3.0
GONE = "gone"


class StudySession(QtCore.QObject):
    """Run and questions of a study. Everything arrives as signals; nothing waits.

    Signals: ``warned(list of str)`` before a run, with what will most likely spoil its figures; ``run_started()``;
    ``progressed(rays, of, remaining_s)``; ``noted(str)``; ``run_ended(Outcome)``; ``asked()``; ``counted(dict)`` with
    the answer to query; ``drawn(dict)`` with that to overlay; ``reported(dict)`` with that to report; ``refused(str)``
    when a question failed, with one sentence; ``explained(list of Effect)`` with what a run simulates, or a map held;
    ``measured(dict, path)`` with the answer to detector and the table of it; ``unmeasured(str)`` when that failed.
    """

    run_started = QtCore.Signal()
    progressed = QtCore.Signal(object, object, object)
    noted = QtCore.Signal(str)
    run_ended = QtCore.Signal(object)
    warned = QtCore.Signal(object)
    asked = QtCore.Signal()
    counted = QtCore.Signal(object)
    drawn = QtCore.Signal(object)
    reported = QtCore.Signal(object)
    refused = QtCore.Signal(str)
    explained = QtCore.Signal(object)
    measured = QtCore.Signal(object, object)
    unmeasured = QtCore.Signal(str)

    def __init__(self, study, parent=None):
        super().__init__(parent)
        self._document, self._study = study.Document.Name, study.Name
        self._run: TraceRun | None = None
        self._server: MapServer | None = None
        self._explanation: Explanation | None = None
        self._fingerprint, self._question, self._measuring = "", 0, 0
        #: The map whose rays and figures are shown; empty before the first question, GONE while its result is undone.
        self.shown_map = ""
        self._scratch = tempfile.TemporaryDirectory(prefix="raymaps-")

    def study(self):
        """The study; None if it or its document is gone."""
        if self._document not in FreeCAD.listDocuments():
            return None
        return FreeCAD.getDocument(self._document).getObject(self._study)

    def is_running(self):
        """Whether a run goes on."""
        return self._run is not None and self._run.is_running()

    def run_process_id(self):
        """The operating system's number of the tracing process; 0 if there is none."""
        return self._run.process.process_id() if self._run is not None else 0

    def server_process_id(self):
        """The operating system's number of the answering process; 0 if there is none."""
        return self._server.process_id() if self._server is not None else 0

    # -- run ----------------------------------------------------------------------------------------------------------

    def run(self):
        """Export and start the tracer; returns when it is started.

        Raises
        ------
        WorkbenchError
            If the study has a fault, can't be exported, or the tracer is not set up.
        """
        if self.is_running():
            raise TracerError("A run of this study goes on; cancel it first or wait.")
        study = self.study()
        problems = check_study(study, limit_s=CHECK_LIMIT_S)
        obstacle = _obstacle(problems)
        if obstacle:
            raise WorkbenchError(obstacle)
        find_interpreter()
        self.warned.emit([problem.text for problem in problems if problem.spoils])
        folder = run_folder(study)
        exported = export_study(study, folder, progress=self._breathe)
        self._fingerprint = exported.fingerprint
        self._run = TraceRun(exported.path, free_map_folder(folder, file_stem(study.Label)), self)
        self._run.progressed.connect(self.progressed)
        self._run.noted.connect(self.noted)
        self._run.ended.connect(self._ended)
        self._run.start()
        self.run_started.emit()
        self._explain(exported.path)

    def obstacle(self):
        """Why the study can't run now, in one sentence; empty if it can."""
        study = self.study()
        try:
            find_interpreter()
        except TracerError as error:
            return str(error)
        return _obstacle(check_study(study, distances=False)) if study is not None else ""

    def has_map(self):
        """Whether the result's map is there."""
        return os.path.isdir(self._map_folder())

    def _map_folder(self):
        study = self.study()
        result = result_of(study) if study is not None else None
        return map_folder(result) if result is not None else ""

    def explain_map(self):
        """Ask which effects the result's map holds, and what share of the time each took."""
        if self.has_map():
            self._explain(self._map_folder())

    def _explain(self, what):
        """Ask about a scene or a map; what can't be told, the run itself tells better."""
        self._stop_explaining()
        self._explanation = Explanation(what, self)
        self._explanation.explained.connect(self.explained)
        self._explanation.start()

    def _stop_explaining(self):
        if self._explanation is not None and self._explanation.is_running():
            self._explanation.forget()
        self._explanation = None

    def cancel(self):
        """End the run; what it traced so far becomes the result."""
        if self._run is not None:
            self._run.cancel()

    def _breathe(self, done, of):
        self.noted.emit(f"Exporting body {done} of {of}")
        QtCore.QCoreApplication.processEvents(QtCore.QEventLoop.ExcludeUserInputEvents)

    def _ended(self, outcome):
        self._run = None
        study = self.study()
        if study is not None and outcome.map_folder and outcome.state != FAILED:
            self._keep(study, outcome)
        self.run_ended.emit(outcome)

    def _keep(self, study, outcome):
        """Make the new map the study's result."""
        if is_own_step_open():  # of a task panel: its Cancel must not take the result away
            study.Document.commitTransaction()
        with Transaction(study.Document, "Ray Maps: result of a run"):
            result = result_of(study) or make_result(study.Document, study)
            set_map_folder(result, outcome.map_folder)
            result.Fingerprint = self._fingerprint
            result.Rays = int(outcome.summary.get("rays", 0))
            result.Events = int(outcome.summary.get("events", 0))
            result.MatchingRays, result.FluxW, result.FluxStderrW = 0, 0.0, 0.0
        for obj in (result, study):  # a result asks for no recompute
            obj.purgeTouched()
        update_stale(study)
        if outcome.state != DONE:
            FreeCAD.Console.PrintWarning(f"Ray Maps: {outcome.text}\n")
        self._close_server()

    # -- questions ----------------------------------------------------------------------------------------------------

    def ask(self, criterion, max_rays):
        """Count, draw and report the matching rays; the answers arrive as signals.

        Raises
        ------
        WorkbenchError
            If there is no map, or the tracer is not set up.
        """
        server = self._server_of_result()
        self.shown_map = server.map_folder
        self._question += 1
        criterion = criterion.strip() or "true"
        overlay_file = os.path.join(self._scratch.name, f"overlay-{self._question % 2}.bin")
        overlay = {"criterion": criterion, "max_rays": max_rays, "max_segments": MAX_SEGMENTS, "file": overlay_file}
        report = {"criterion": criterion, "limit": min(max_rays, REPORTED_RAYS)}
        current = self._only_latest(self._question)
        self.asked.emit()
        server.ask("overlay", overlay, current(self._draw), current(self._refuse))
        server.ask(
            "query", {"criterion": criterion}, current(lambda a: self._count(criterion, max_rays, a)), lambda text: None
        )
        server.ask("report", report, current(self.reported.emit), lambda text: None)

    def info(self, on_result):
        """Ask what the map holds; the answer goes to a callback."""
        self._server_of_result().ask("info", {}, on_result, self.refused.emit)

    def measure(self, name, criterion):
        """Ask what a detector registered of the matching rays; the answer arrives as a signal.

        Raises
        ------
        WorkbenchError
            If there is no map, or the tracer is not set up.
        """
        self._measuring += 1
        number, path = self._measuring, os.path.join(self._scratch.name, f"detector-{self._measuring % 2}.csv")

        def current(tell):
            return lambda answer: tell(answer) if number == self._measuring else None

        params = {"name": name, "criterion": criterion.strip() or "true", "file": path}
        told, failed = current(lambda answer: self.measured.emit(answer, path)), current(self.unmeasured.emit)
        self._server_of_result().ask("detector", params, told, failed)

    def save_detector(self, name, criterion, path, on_saved):
        """Write what a detector registered to a file of the kind that its name ends in."""
        params = {"name": name, "criterion": criterion.strip() or "true", "file": path}
        self._server_of_result().ask("detector", params, on_saved, self.unmeasured.emit)

    def forget(self):
        """Draw no rays, and show no answer that is still to come."""
        self._question += 1
        self._measuring += 1
        study = self.study()
        result = result_of(study) if study is not None else None
        proxy = getattr(getattr(result, "ViewObject", None), "Proxy", None)
        if proxy is not None:
            proxy.clear_overlay()

    def close(self):
        """End all processes; nothing of a run that goes on becomes a result."""
        if self._run is not None:
            self._run.ended.disconnect(self._ended)
            self._run.cancel()
        self._stop_explaining()
        self._close_server()
        self._scratch.cleanup()

    def _server_of_result(self):
        folder = self._map_folder()
        if not folder:
            raise TracerError("There is no map yet; run the study first.")
        if not os.path.isdir(folder):
            raise TracerError(f"The map '{folder}' is not there any more; run the study again.")
        if self._server is None or self._server.map_folder != folder:
            self._close_server()
            self._server = MapServer(folder, self)
        return self._server

    def _close_server(self):
        if self._server is not None:
            self._server.close()
            self._server = None

    def _only_latest(self, question):
        """Callbacks that do nothing once a newer question was asked."""

        def current(callback):
            return lambda answer: callback(answer) if question == self._question else None

        return current

    def _refuse(self, text):
        self.forget()
        self.refused.emit(text)

    def _draw(self, answer):
        study = self.study()
        result = result_of(study) if study is not None else None
        if result is None:
            return
        try:
            result.ViewObject.Proxy.show_overlay(result.ViewObject, answer["file"], int(answer["segments"]))
        except TracerError as error:
            self.refused.emit(str(error))
            return
        self.drawn.emit(answer)

    def _count(self, criterion, max_rays, answer):
        study = self.study()
        result = result_of(study) if study is not None else None
        if result is not None:
            result.Criterion, result.MaxRays = criterion, max_rays
            result.History = [criterion, *(text for text in result.History if text != criterion)][:20]
            result.MatchingRays = int(answer["rays"])
            # Without a value where not all rays were looked at.
            result.FluxW, result.FluxStderrW = float(answer["flux_w"] or 0), float(answer["flux_stderr_w"] or 0)
            result.Rays = int(answer["scanned"])
        self.counted.emit(answer)


def _obstacle(problems):
    """The first problem that blocks a run, with how many more there are; empty if there is none."""
    blocking = [problem for problem in problems if problem.blocks]
    more = f" ({len(blocking) - 1} more; use Check study)" if len(blocking) > 1 else ""
    return blocking[0].text + more if blocking else ""


def run_folder(study):
    """Where scenes and maps of a study are kept: beside the saved document, else in the user's data folder."""
    path = study.Document.FileName
    if path and os.access(os.path.dirname(path), os.W_OK):
        stem = os.path.splitext(os.path.basename(path))[0]
        return os.path.join(os.path.dirname(path), stem + ".raymaps")
    return os.path.join(user_data_folder(), "runs", file_stem(study.Document.Label))


def free_map_folder(folder, stem):
    """A map folder that does not exist yet: runs never overwrite each other."""
    n = 1
    while os.path.exists(os.path.join(folder, f"{stem}-{n:03d}.raymap")):
        n += 1
    return os.path.join(folder, f"{stem}-{n:03d}.raymap")
