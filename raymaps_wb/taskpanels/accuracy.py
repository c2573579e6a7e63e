# SPDX-License-Identifier: LGPL-2.1-or-later
"""AccuracyPanel: what accuracy costs in time, and a slider from draft to final that sets the number of rays."""

import tempfile

import FreeCAD
import FreeCADGui

from raymaps_wb.compat import QtCore, QtGui, QtWidgets, flags_as_int, translate
from raymaps_wb.errors import WorkbenchError
from raymaps_wb.export.check import check_study
from raymaps_wb.export.description import unique_names
from raymaps_wb.export.writer import export_study
from raymaps_wb.gui.active import PREFIX, Transaction
from raymaps_wb.gui.cost_curve import CostCurve
from raymaps_wb.gui.figures import count, rough_duration
from raymaps_wb.objects.detector import Detector
from raymaps_wb.objects.study import members
from raymaps_wb.paths import icon
from raymaps_wb.taskpanels.rows import Rows, beside, say, small_label
from raymaps_wb.tracer.accuracy import AccuracyTrial

SECONDS = 8
NO_SPECTRA = "spectral"  # the effect without which light is red, green and blue


class AccuracyPanel:
    """Tries the study for some seconds, shows time against error, and sets rays and choice when it is accepted."""

    def __init__(self, study):
        self._document, self._study = study.Document.Name, study.Name
        self._trial, self._folder, self._outlooks, self._stops = None, None, [], []
        self.form = QtWidgets.QWidget()
        self.form.setWindowTitle(translate("Accuracy"))
        self.form.setWindowIcon(QtGui.QIcon(icon("accuracy")))
        self.rows = Rows(self.form)
        self._add_trial(study)
        self.curve = CostCurve()
        self.curve.picked.connect(self._pick)
        self.curve.setToolTip(translate("Click to choose how long a run may take"))
        self.rows.add("", self.curve)
        self._add_choice()
        self.rows.end()
        self.rows.align()
        self._show_state(False)

    def _add_trial(self, study):
        self.detector = QtWidgets.QComboBox()
        self.detector.addItem(translate("the least certain one"), "")
        for name in unique_names(members(study, Detector.TYPE)).values():
            self.detector.addItem(name, name)
        self.detector.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self.detector.setToolTip(translate("Of which detector the error of its light is meant"))
        self.detector.activated.connect(lambda *_: self.look())
        self.rows.add(translate("Detector"), self.detector)
        self.seconds = QtWidgets.QSpinBox()
        self.seconds.setRange(1, 3600)
        self.seconds.setValue(SECONDS)
        self.seconds.setSuffix(" s")
        self.seconds.setToolTip(translate("How long short runs try the choices, about; longer foretells better"))
        self.button = QtWidgets.QPushButton()
        self.button.clicked.connect(self._press)
        self.rows.add(translate("Try for"), beside(self.seconds, self.button))
        self.progress = QtWidgets.QProgressBar()
        self.rows.add("", self.progress)
        self.message = small_label()
        self.rows.add("", self.message)
        say(self.message, "")

    def _add_choice(self):
        self.choice = QtWidgets.QComboBox()
        self.choice.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self.choice.setToolTip(translate("How the study is simulated; another choice than now is set with OK"))
        self.choice.currentIndexChanged.connect(lambda *_: self._choose())
        self.rows.add(translate("Choice"), self.choice)
        self.slider = QtWidgets.QSlider(QtCore.Qt.Horizontal)
        self.slider.setPageStep(2)
        self.slider.valueChanged.connect(lambda *_: self._tell())
        self.rows.add("", beside(QtWidgets.QLabel(translate("Draft")), self.slider, _right(translate("Final"))))
        self.told = QtWidgets.QLabel()
        self.told.setTextFormat(QtCore.Qt.RichText)
        self.told.setWordWrap(True)
        self.rows.add("", self.told)
        self.changes = small_label()
        self.rows.add("", self.changes)

    def study(self):
        """The study; None if it or its document is gone."""
        document = FreeCAD.listDocuments().get(self._document)
        return document.getObject(self._study) if document is not None else None

    # -- try ----------------------------------------------------------------------------------------------------------

    def look(self):
        """Export the study and try its choices; everything arrives later."""
        self._forget()
        study = self.study()
        if study is None:
            say(self.message, translate("The study is not there any more; close this panel."), is_wrong=True)
            return
        try:
            blocking = [problem.text for problem in check_study(study, distances=False) if problem.blocks]
            if blocking:
                raise WorkbenchError(blocking[0])
            self._folder = tempfile.TemporaryDirectory(prefix="raymaps-")
            scene = export_study(study, self._folder.name, "study").path
            trial = AccuracyTrial(scene, self.detector.currentData(), self.seconds.value(), self.form)
        except WorkbenchError as error:
            self._fail(str(error))
            return
        self._trial = trial
        trial.trying.connect(self._trying)
        trial.noted.connect(lambda text: say(self.message, text))
        trial.told.connect(self.show)
        trial.failed.connect(self._fail)
        trial.cancelled.connect(
            lambda: self._fail(translate("The trial was cancelled before it told anything; press Try to repeat it."))
        )
        self.progress.setRange(0, 0)
        say(self.message, translate("Starting the tracer ..."))
        self._show_state(True)
        trial.start()

    def is_trying(self):
        """Whether a trial goes on."""
        return self._trial is not None

    def _press(self):
        if self._trial is not None:
            self._trial.cancel()
        else:
            self.look()

    def _trying(self, number, of, words):
        self.progress.setRange(0, of)
        self.progress.setValue(number - 1)
        say(self.message, f"{translate('Trying')} {number} / {of}: {words}")

    def _fail(self, text):
        FreeCAD.Console.PrintWarning(f"Ray Maps: {text}\n")
        self._forget()
        say(self.message, text, is_wrong=True)

    def _forget(self):
        self.stop()
        self._show_state(False)

    def stop(self):
        """End a trial that goes on, and tell nothing of it."""
        if self._trial is not None:
            if self._trial.is_running():
                self._trial.forget()
            self._trial = None
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def _show_state(self, is_trying):
        self.button.setText(translate("Cancel") if is_trying else translate("Try"))
        self.progress.setVisible(is_trying)
        self.detector.setEnabled(not is_trying)
        self.seconds.setEnabled(not is_trying)
        for widget in (self.choice, self.slider):
            widget.setEnabled(bool(self._outlooks))

    # -- choose -------------------------------------------------------------------------------------------------------

    def show(self, forecast):
        """Show what a trial foretells."""
        self._outlooks = forecast.outlooks
        self._forget()
        study = self.study()
        if study is None:
            return
        of = translate("Error of")
        if any(outlook.is_known for outlook in self._outlooks):
            say(self.message, f"{of} {forecast.quantity}")
        else:
            say(
                self.message,
                f"{forecast.quantity[:1].upper()}{forecast.quantity[1:]}: no light arrived in the trial; try for "
                "longer, choose another detector, or let a source aim at it.",
                is_wrong=True,
            )
        self.choice.blockSignals(True)
        self.choice.clear()
        for i, outlook in enumerate(self._outlooks):
            self.choice.addItem(f"{outlook.words} ({translate('as now')})" if i == 0 else outlook.words)
        self.choice.blockSignals(False)
        self.curve.show_outlooks(self._outlooks, study.Rays)
        self._stops = []
        self._choose()

    def rays(self):
        """Rays that the slider is at; 0 before a trial."""
        return self._stops[self.slider.value()] if self._stops else 0

    def _choose(self):
        """Offer the numbers of rays of the choice; the slider stays as near as can be."""
        study, i = self.study(), self.choice.currentIndex()
        if study is None or i < 0:
            return
        wanted = self.rays() or study.Rays
        self._stops = self._outlooks[i].stops(study.Rays)
        self.slider.blockSignals(True)
        self.slider.setRange(0, len(self._stops) - 1)
        self.slider.setValue(min(range(len(self._stops)), key=lambda k: _apart(self._stops[k], wanted)))
        self.slider.blockSignals(False)
        self._tell()

    def _pick(self, time_s):
        i = self.choice.currentIndex()
        if self._stops and i >= 0:
            wanted = self._outlooks[i].rays(time_s)
            self.slider.setValue(min(range(len(self._stops)), key=lambda k: _apart(self._stops[k], wanted)))

    def _tell(self):
        """What a run with these rays is likely to take and to be sure to, and what OK changes."""
        outlook, rays = self._outlooks[self.choice.currentIndex()], self.rays()
        self.curve.show_point(self.choice.currentIndex(), rays)
        error = f"\u00b1 {_percent(outlook.error(rays))}" if outlook.is_known else translate("error not known")
        self.told.setText(
            f"<b>{count(rays)}</b> {translate('rays')} &nbsp; <b>{rough_duration(outlook.time_s(rays))}</b> "
            f"&nbsp; <b>{error}</b>"
        )
        bias = f" {translate('Always off by about')} {_percent(outlook.bias)}." if outlook.bias else ""
        say(self.changes, self._words_of_changes() + bias)

    def _words_of_changes(self):
        changes = self._changes()
        if not changes:
            return translate("OK changes nothing.")
        words = {
            "Rays": lambda rays: f"{translate('Rays')} {count(rays)}",
            "Without": lambda names: (
                translate("light in red, green and blue") if NO_SPECTRA in names else translate("light in spectra")
            ),
        }
        told = [words.get(name, lambda value, name=name: f"{name} {value}")(value) for name, value in changes.items()]
        return f"{translate('OK sets')} {', '.join(told)}."

    def _changes(self):
        """Properties of the study that OK sets: its rays, and what differs in the choice."""
        study, i = self.study(), self.choice.currentIndex()
        if study is None or not self._stops or i < 0:
            return {}
        wanted = {"Rays": self.rays()}
        if i > 0:
            wanted.update(self._outlooks[i].settings)
            others = [name for name in study.Without if name != NO_SPECTRA]
            if "Bands" in wanted and wanted["Bands"] is None:
                del wanted["Bands"]
                wanted["Without"] = [*others, NO_SPECTRA]
            elif "Bands" in wanted and len(others) != len(study.Without):
                wanted["Without"] = others
            if NO_SPECTRA in study.Without and NO_SPECTRA in wanted.get("Without", ()):
                del wanted["Without"]
        return {
            name: value
            for name, value in wanted.items()
            if (list(study.Without) if name == "Without" else getattr(study, name)) != value
        }

    # -- end ----------------------------------------------------------------------------------------------------------

    def accept(self):
        changes, study = self._changes(), self.study()
        if changes and study is not None:
            with Transaction(study.Document, f"{PREFIX}accuracy of {study.Label}") as document:
                for name, value in changes.items():
                    setattr(study, name, value)
                document.recompute()
        return self.reject()

    def reject(self):
        self.stop()
        FreeCADGui.Control.closeDialog()
        return True

    def getStandardButtons(self):
        return flags_as_int(QtWidgets.QDialogButtonBox.Ok | QtWidgets.QDialogButtonBox.Cancel)


def _percent(share):
    return f"{float(f'{100 * share:.2g}'):g} %"


def _apart(a, b):
    """How far apart two numbers are, as a ratio."""
    return max(a, b, 1) / max(min(a, b), 1)


def _right(text):
    label = QtWidgets.QLabel(text)
    label.setAlignment(QtCore.Qt.AlignRight | QtCore.Qt.AlignVCenter)
    return label
