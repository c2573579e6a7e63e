# SPDX-License-Identifier: LGPL-2.1-or-later
"""The lower part of the panel: histories of rays, light on detectors, and effects, one tab each."""

from raymaps_wb.compat import QtWidgets, translate
from raymaps_wb.errors import WorkbenchError
from raymaps_wb.gui import report
from raymaps_wb.gui.detector_view import DetectorView
from raymaps_wb.gui.effects_view import EffectsView

RAYS, DETECTORS, EFFECTS = range(3)


class ResultTabs(QtWidgets.QTabWidget):
    """Asks a session for what a tab shows once it is looked at.

    Attributes: ``report_page``, the report of the shown rays as a page of its own; ``known_effects``, a list of Effect.
    """

    def __init__(self):
        super().__init__()
        self._session, self._detectors_of, self._criterion = None, "", "true"
        self.report_page, self.known_effects = "", []
        self.report = QtWidgets.QTextBrowser()
        self.report.setOpenLinks(False)
        self.detectors = DetectorView(self.measure, self.save_detector)
        self.effects = EffectsView()
        area = QtWidgets.QScrollArea()
        area.setWidget(self.detectors)
        area.setWidgetResizable(True)
        area.setFrameShape(QtWidgets.QFrame.NoFrame)
        self.setDocumentMode(True)
        for widget, title in ((self.report, "Rays"), (area, "Detectors"), (self.effects, "Effects")):
            self.addTab(widget, translate(title))
        self.currentChanged.connect(lambda _: self.look())

    def show_session(self, session, criterion):
        """Show what belongs to a session, None for none; ``criterion`` was asked last."""
        self._session, self._criterion = session, criterion
        self.detectors.offer([])
        self.show_effects([])
        self.clear()

    def clear(self):
        """Show no answers."""
        self.report.clear()
        self.report_page, self._detectors_of = "", ""
        self.detectors.clear()

    def show_report(self, answer):
        """Show the answer to ``report``."""
        self.report.setHtml(report.html(answer))
        self.report_page = str(answer.get("html", ""))

    def show_effects(self, effects):
        """Show the effects of a run or of a map."""
        self.known_effects = effects
        self.effects.show_effects(effects)

    def asked(self, criterion):
        """Another criterion was asked: what detectors registered of its rays is another thing, too."""
        self._criterion = criterion
        if self.currentIndex() == DETECTORS:
            self.look()

    def run_ended(self):
        """There is a new map."""
        if self.currentIndex() == EFFECTS:
            self.look()

    def look(self):
        """Ask for what the present tab shows."""
        session = self._session
        if session is None or not session.has_map():
            return
        try:
            if self.currentIndex() == EFFECTS and not session.is_running():
                session.explain_map()
            elif self.currentIndex() == DETECTORS:
                if self._detectors_of != session.shown_map or not self.detectors.name():
                    session.info(self._offer_detectors)
                else:
                    self.measure()
        except WorkbenchError as error:
            self.detectors.clear(str(error))

    def measure(self):
        """Ask what the chosen detector registered of the rays that were asked for last."""
        name = self.detectors.name()
        if self._session is None or not name:
            return
        self.detectors.clear(translate("<i>asking ...</i>"))
        try:
            self._session.measure(name, self._criterion)
        except WorkbenchError as error:
            self.detectors.clear(str(error))

    def save_detector(self, path):
        """Write what the chosen detector registered to a file."""
        if self._session is not None:
            said = f"{self.detectors.name()} is written to {path}"
            told = self._session.noted.emit
            self._session.save_detector(self.detectors.name(), self._criterion, path, lambda _: told(said))

    def _offer_detectors(self, info):
        if self._session is None:
            return
        names = list(info.get("names", {}).get("detectors", ()))
        self._detectors_of = self._session.shown_map
        self.detectors.offer(names)
        self.detectors.clear("" if names else translate("This map has no detector."))
        self.measure()
