# SPDX-License-Identifier: LGPL-2.1-or-later
"""The dock panel: run, ask, read."""

import os

import FreeCAD
import FreeCADGui

from raymaps_wb.compat import QtCore, QtGui, QtWidgets, translate
from raymaps_wb.errors import WorkbenchError
from raymaps_wb.gui import examples, observer
from raymaps_wb.gui.active import active_study
from raymaps_wb.gui.effects_view import lines, sentence
from raymaps_wb.gui.figures import count, duration, watts_with_error
from raymaps_wb.gui.lost import LostRays
from raymaps_wb.gui.result_tabs import ResultTabs
from raymaps_wb.gui.session import GONE, StudySession
from raymaps_wb.objects.result import map_folder, result_of
from raymaps_wb.objects.study import studies, study_of
from raymaps_wb.paths import icon
from raymaps_wb.taskpanels.rows import small_label
from raymaps_wb.tracer.trace import CANCELLED, DONE

NAME = "RayMapsDock"
MISSING, OBSTACLE = "map is missing", "run can't start"  # what the status line tells of, where it can pass by itself
KILLED_SHARE = 0.01
KILLED = {
    "depth": "the rays reached the largest number of events; set 'Max events' of the study higher, or look for "
    "light that is trapped (ask ended(killed))",
    "numerical": "the rays got lost; below stands where, and Check study names geometry that is faulty",
    "medium_mismatch": "bodies touch or overlap, which was not supported when this map was made; run again",
}
BAD, WARNING, GOOD = "#b3261e", "#9a6700", "#1a7f37"


class RayMapsDock(QtWidgets.QDockWidget):
    """Shows one study at a time; keeps a session for each study that was run or asked."""

    def __init__(self, parent):
        super().__init__(translate("Ray Maps"), parent)
        self.setObjectName(NAME)
        self.sessions, self._session, self._said = {}, None, ""
        body = QtWidgets.QWidget()
        layout = QtWidgets.QVBoxLayout(body)
        layout.setContentsMargins(8, 6, 8, 6)
        self.title = QtWidgets.QLabel()
        self.title.setTextFormat(QtCore.Qt.RichText)
        self.title.setWordWrap(True)
        layout.addWidget(self.title)
        layout.addLayout(self._run_row())
        self.status = _wrapped_label()
        layout.addWidget(self.status)
        self.warning = _wrapped_label(WARNING)
        layout.addWidget(self.warning)
        self.lost, self._lost_of = LostRays(WARNING), ""
        self.lost.asked.connect(self._ask_for)
        layout.addWidget(self.lost)
        self.effects_line = small_label()
        self.effects_line.setTextFormat(QtCore.Qt.RichText)
        layout.addWidget(self.effects_line)
        layout.addWidget(_separator())
        layout.addWidget(QtWidgets.QLabel(translate("Show the rays for which")))
        layout.addLayout(self._criterion_row())
        self.error = _wrapped_label(BAD)
        layout.addWidget(self.error)
        self.counts = _wrapped_label()
        self.counts.setTextFormat(QtCore.Qt.RichText)
        layout.addWidget(self.counts)
        self.tabs = ResultTabs()
        self.report, self.detectors, self.effects = self.tabs.report, self.tabs.detectors, self.tabs.effects
        layout.addWidget(self.tabs, 1)
        self.setWidget(body)
        self.setMinimumWidth(330)
        watched = observer.install()
        watched.checked.connect(self._document_checked)
        watched.activated.connect(self._document_activated)
        watched.closed.connect(self._document_closed)
        self.refresh()

    def _run_row(self):
        row = QtWidgets.QHBoxLayout()
        self.run_button = QtWidgets.QPushButton(QtGui.QIcon(icon("run")), translate("Run"))
        self.run_button.clicked.connect(self.run)
        self.cancel_button = QtWidgets.QPushButton(translate("Cancel"))
        self.cancel_button.clicked.connect(self.cancel)
        self.progress = QtWidgets.QProgressBar()
        self.progress.setRange(0, 1000)
        for widget in (self.run_button, self.cancel_button):
            row.addWidget(widget)
        row.addWidget(self.progress, 1)
        return row

    def _criterion_row(self):
        column = QtWidgets.QVBoxLayout()
        self.criterion = QtWidgets.QComboBox()
        self.criterion.setEditable(True)
        self.criterion.setInsertPolicy(QtWidgets.QComboBox.NoInsert)
        self.criterion.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self.criterion.lineEdit().returnPressed.connect(self.apply)
        self.criterion.lineEdit().setPlaceholderText("from(LED) & hit(Lens) & ~detector(Sensor)")
        self.criterion.setToolTip(
            translate(
                "from(SOURCE)  hit(BODY)  hit(BODY.Face3, KIND)  surface(PROPERTY)  event(KIND)\n"
                "medium(NAME, absorption)  detector(NAME)  detector(NAME, rect=(X0,Y0,X1,Y1))\n"
                "ended(absorbed|left|killed)\n"
                "joined with  & and,  | or,  ~ not,  and brackets; names with other signs in double quotes"
            )
        )
        column.addWidget(self.criterion)
        row = QtWidgets.QHBoxLayout()
        row.addWidget(QtWidgets.QLabel(translate("draw at most")))
        self.max_rays = QtWidgets.QSpinBox()
        self.max_rays.setRange(1, 1_000_000)
        self.max_rays.setValue(150)
        self.max_rays.setSuffix(translate(" rays"))
        row.addWidget(self.max_rays, 1)
        self.apply_button = QtWidgets.QPushButton(QtGui.QIcon(icon("ask")), translate("Apply"))
        self.apply_button.clicked.connect(self.apply)
        row.addWidget(self.apply_button)
        column.addLayout(row)
        return column

    # -- which study --------------------------------------------------------------------------------------------------

    def show_study(self, study):
        """Show a study; its last criterion and what can be asked of it."""
        key = (study.Document.Name, study.Name)
        session = self.sessions.get(key)
        if session is None or session.study() is None:
            session = self.sessions[key] = self._connected(StudySession(study, self))
        if session is not self._session:
            self._session = session
            result = result_of(study)
            self._fill_criteria(study, result)
            if result is not None:
                self.max_rays.setValue(result.MaxRays)
            self._clear()
        self.refresh()
        return session

    def _connected(self, session):
        slots = {
            session.warned: self._warned,
            session.run_started: self._run_started,
            session.progressed: self._progressed,
            session.noted: self.status.setText,
            session.run_ended: self._run_ended,
            session.counted: self._counted,
            session.reported: self.tabs.show_report,
            session.refused: self._refused,
            session.explained: self._explained,
            session.measured: self.detectors.show_answer,
            session.unmeasured: self.detectors.clear,
        }
        for signal, slot in slots.items():
            signal.connect(lambda *args, slot=slot: slot(*args) if session is self._session else None)
        return session

    def _fill_criteria(self, study, result):
        past = list(result.History) if result is not None else []
        texts = list(dict.fromkeys(past + examples.criteria(study)))
        self.criterion.clear()
        self.criterion.addItems(texts)
        self.criterion.setEditText(result.Criterion if result is not None else "true")

    def study(self):
        """The study that is shown; None if there is none."""
        return self._session.study() if self._session is not None else None

    def refresh(self):
        """Bring title and buttons up to date."""
        if self.study() is None:
            self._session = None
        study = self.study()
        running = self._session is not None and self._session.is_running()
        result = result_of(study) if study is not None else None
        folder = map_folder(result) if result is not None else ""
        has_map = bool(folder) and os.path.isdir(folder)
        self.title.setText(_title(study, result))
        self.run_button.setEnabled(study is not None and not running)
        self.cancel_button.setEnabled(running)
        for widget in (self.apply_button, self.criterion):
            widget.setEnabled(has_map)
        if not running and not has_map:
            self.progress.setValue(0)
        if not running:
            if folder and not has_map:
                self._say(f"The map '{folder}' is not there any more; run the study again.", WARNING, MISSING)
            elif self._said == MISSING:
                self._say("")
        if self._session is not None:
            self._show_only(self._session, folder if has_map else "")

    def _show_only(self, session, folder):
        """Rays and figures of another map than the result's go: after an undo, or when the map is gone."""
        if session.shown_map in ("", folder) or (session.shown_map == GONE and not folder):
            return
        session.shown_map = GONE
        session.forget()
        self._clear_answers()
        self._show_lost("", [])
        if folder:
            self.criterion.setEditText(result_of(session.study()).Criterion)
            self.apply()

    def _document_checked(self, name):
        """A document changed: its study may be new, stale, or gone."""
        for key, session in list(self.sessions.items()):
            if key[0] == name and session.study() is None:
                self._drop(key)
        if self.study() is None and active_study() is not None:
            self.show_study(active_study())
        self.refresh()
        self.clear_obstacle()

    def clear_obstacle(self):
        """Take away what was said about a run that could not start, once it can."""
        if self._said == OBSTACLE and self._session is not None and not self._session.obstacle():
            self._say("")

    def _document_activated(self, name):
        found = studies(FreeCAD.getDocument(name)) if name in FreeCAD.listDocuments() else []
        shown = self.study()
        if found and (shown is None or shown.Document.Name != name):
            self.show_study(found[0])

    def _document_closed(self, name):
        for key in [key for key in self.sessions if key[0] == name]:
            self._drop(key)
        self.refresh()

    def _drop(self, key):
        """End what goes on with a study that is gone."""
        session = self.sessions.pop(key)
        session.close()
        if session is self._session:
            self._session = None
            self._clear()

    def _clear(self):
        self._say("")
        self.warning.setText("")
        self._show_effects([])
        self.tabs.show_session(self._session, self.criterion.currentText())
        self._clear_answers()
        self._show_lost("", [])

    def _clear_answers(self):
        for label in (self.error, self.counts):
            label.setText("")
        self.tabs.clear()

    # -- run ----------------------------------------------------------------------------------------------------------

    def run(self):
        """Start a run of the shown study."""
        if self._session is None and active_study() is not None:
            self.show_study(active_study())
        if self._session is None:
            self._fault(translate("There is no study; make one first."))
            return
        try:
            self._session.run()
        except WorkbenchError as error:
            self._fault(str(error), OBSTACLE if self._session.obstacle() else "")

    def cancel(self):
        """End the run."""
        if self._session is not None:
            self._session.cancel()

    def _warned(self, texts):
        for text in texts:
            FreeCAD.Console.PrintWarning(f"Ray Maps: {text}\n")
        more = f" ({len(texts) - 1} more; use Check study)" if len(texts) > 1 else ""
        self.warning.setText(f"\u26a0 {texts[0]}{more}" if texts else "")

    def _run_started(self):
        self.progress.setValue(0)
        self._say(translate("Starting the tracer ..."))
        self.refresh()

    def _explained(self, effects):
        for line in lines(effects) if self._session is not None and self._session.is_running() else ():
            FreeCAD.Console.PrintMessage(f"Ray Maps: {line}\n")
        self._show_effects(effects)

    def _show_effects(self, effects):
        self.effects_line.setText(sentence(effects) if effects else "")
        self.effects_line.setVisible(bool(effects))
        self.tabs.show_effects(effects)

    def _progressed(self, rays, of, remaining_s):
        self.progress.setValue(int(1000 * rays / of) if of else 0)
        if not rays and self.status.text():
            return  # what the tracer says while it gets ready is worth more than a zero
        left = f", about {duration(remaining_s)} left" if remaining_s else ""
        self._say(f"{count(rays)} of {count(of)} rays{left}")

    def _run_ended(self, outcome):
        if outcome.state == DONE:
            self.progress.setValue(1000)
            self._tell_summary(outcome.summary)
        elif outcome.state == CANCELLED:
            self._say(outcome.text, WARNING)
        else:
            self._fault(outcome.text)
        self.refresh()
        study = self.study()
        if study is not None and outcome.map_folder and outcome.state in (DONE, CANCELLED):
            self._fill_criteria(study, result_of(study))
            self.apply()
            self.tabs.run_ended()

    def _tell_summary(self, done):
        text = _summary(done)
        if not (done.get("killed_w") or 0) > KILLED_SHARE * (done.get("emitted_w") or 0):
            self._say(text, GOOD)
            return
        self._say(text, BAD)
        session = self._session
        if session is None:
            return
        try:
            session.info(lambda info: self._fault(f"{text} {_why_killed(info)}") if self._at(text) else None)
        except WorkbenchError as error:
            self._fault(f"{text} {error}")

    def _at(self, text):
        return self.status.text() == text

    def _say(self, text, colour="", said=""):
        self._said = said
        self.status.setStyleSheet(f"color: {colour}" if colour else "")
        self.status.setText(text)

    def _fault(self, text, said=""):
        FreeCAD.Console.PrintError(f"Ray Maps: {text}\n")
        self._say(text, BAD, said)

    # -- ask ----------------------------------------------------------------------------------------------------------

    def apply(self):
        """Ask for the rays that match the criterion."""
        if self._session is None:
            return
        self.error.setText("")
        try:
            self._session.ask(self.criterion.currentText(), self.max_rays.value())
            self.counts.setText(translate("<i>asking ...</i>"))
            self._tell_lost(self._session)
        except WorkbenchError as error:
            self._session.forget()
            self._refused(str(error))

    def _tell_lost(self, session):
        """Tell where rays of a map got lost, once for each map that is asked."""
        folder = session.shown_map
        if folder == self._lost_of:
            return
        self._show_lost(folder, [])

        def show(info):
            if session is self._session and folder == self._lost_of:
                self._show_lost(folder, info.get("lost") or [])

        session.info(show)

    def _show_lost(self, folder, places):
        self._lost_of = folder
        self.lost.show_places(places)

    def _ask_for(self, criterion):
        self.criterion.setEditText(criterion)
        self.apply()

    def _counted(self, answer):
        self.tabs.asked(answer["criterion"])
        share = 100.0 * answer["rays"] / answer["scanned"] if answer["scanned"] else 0.0
        text = f"<b>{count(answer['rays'])}</b> of {count(answer['scanned'])} rays match ({share:.3g} %)"
        if answer["flux_w"] is not None and answer["flux_stderr_w"] is not None:  # else not all rays were looked at
            text += f", emitted with <b>{watts_with_error(answer['flux_w'], answer['flux_stderr_w'])}</b>"
        self.counts.setText(text)
        if self.criterion.findText(answer["criterion"]) < 0:
            text = self.criterion.currentText()
            self.criterion.insertItem(0, answer["criterion"])
            self.criterion.setEditText(text)

    def _refused(self, text):
        self._clear_answers()
        self.error.setText(text)

    def close_sessions(self):
        """End all processes; the main window calls this when it closes."""
        for session in self.sessions.values():
            session.close()
        self.sessions, self._session = {}, None


def find():
    """The dock panel; None if it was not made yet."""
    return FreeCADGui.getMainWindow().findChild(QtWidgets.QDockWidget, NAME)


def show(obj=None):
    """Show the dock panel with the study of an object, else with the active study; returns the panel."""
    window = FreeCADGui.getMainWindow()
    dock = find()
    if dock is None:
        dock = RayMapsDock(window)
        window.addDockWidget(QtCore.Qt.RightDockWidgetArea, dock)
        QtCore.QCoreApplication.instance().aboutToQuit.connect(dock.close_sessions)
    study = (study_of(obj) if obj is not None else None) or active_study()
    if study is not None:
        dock.show_study(study)
    dock.refresh()
    dock.show()
    dock.raise_()
    return dock


def _title(study, result):
    if study is None:
        return translate("No study. Make one with <i>New study</i>, tag bodies and faces, and run it.")
    name = f"<b>{study.Label}</b>"
    if result is None or not result.MapPath:
        return f"{name} &nbsp; " + translate("not simulated yet")
    rays = f"{count(result.Rays)} rays" if result.Rays else translate("simulated")
    if not os.path.isdir(map_folder(result)):
        note = translate("its map is not there any more; run again")
        return f"{name} &nbsp; <span style='color:{WARNING}'>&#9888; {note}</span>"
    if result.Stale:
        note = translate("stale: the document has changed since; run again")
        return f"{name} &nbsp; {rays} &nbsp; <span style='color:{WARNING}'>&#9888; {note}</span>"
    return f"{name} &nbsp; {rays} &nbsp; <span style='color:{GOOD}'>{translate('up to date')}</span>"


def _why_killed(info):
    """Why most of the killed light was killed, and what to do."""
    by_reason = info.get("ledger", {}).get("killed_by_reason_w", {})
    reason = max(by_reason, key=by_reason.get, default="")
    return f"Most of the killed light: {KILLED.get(reason, reason)}." if reason else ""


def _summary(done):
    rays, events = count(done.get("rays", 0)), count(done.get("events", 0))
    parts = [f"{rays} rays, {events} events in {duration(done.get('elapsed_s', 0))}."]
    emitted = done.get("emitted_w") or 0
    if emitted:
        shares = [(word, done.get(f"{word}_w", 0) / emitted) for word in ("absorbed", "escaped", "killed")]
        parts.append(", ".join(f"{100 * share:.3g} % {word}" for word, share in shares) + ".")
    return " ".join(parts)


class _Label(QtWidgets.QLabel):
    """Takes no room while it is empty."""

    def setText(self, text):
        super().setText(text)
        self.setVisible(bool(text))


def _wrapped_label(colour=""):
    label = _Label()
    label.hide()
    label.setWordWrap(True)
    label.setTextInteractionFlags(QtCore.Qt.TextSelectableByMouse)
    if colour:
        label.setStyleSheet(f"color: {colour}")
    return label


def _separator():
    line = QtWidgets.QFrame()
    line.setFrameShape(QtWidgets.QFrame.HLine)
    line.setFrameShadow(QtWidgets.QFrame.Sunken)
    return line
