# SPDX-License-Identifier: LGPL-2.1-or-later
"""Watches documents with studies: after a change, results are compared with the document once it is quiet."""

import FreeCAD

from raymaps_wb.compat import QtCore, QtWidgets
from raymaps_wb.export.fingerprint import ShapeMeasures
from raymaps_wb.gui.staleness import update_document
from raymaps_wb.objects.properties import type_of
from raymaps_wb.objects.source import Source
from raymaps_wb.objects.study import members, studies

QUIET_MS = 400
NAME = "RayMapsObserver"


class DocumentObserver(QtCore.QObject):
    """Collects the documents that changed and looks at them a moment later.

    Signals: ``checked(document name)``; ``activated(document name)``; ``closed(document name)``.
    """

    checked = QtCore.Signal(str)
    activated = QtCore.Signal(str)
    closed = QtCore.Signal(str)

    def __init__(self, parent):
        super().__init__(parent)
        self.setObjectName(NAME)
        self._changed, self._measures = set(), {}
        self._timer = QtCore.QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._look)

    # FreeCAD calls the slots.
    def slotChangedObject(self, obj, name):
        if type_of(obj) != "RayMaps::Result" and name not in ("Visibility", "Label2"):
            self._note(obj.Document)

    def slotDeletedObject(self, obj):
        self._note(obj.Document)

    def slotCreatedObject(self, obj):
        self._note(obj.Document)

    def slotRecomputedDocument(self, document):
        self._note(document)

    def slotUndoDocument(self, document):
        self._note(document)

    def slotRedoDocument(self, document):
        self._note(document)

    def slotFinishRestoreDocument(self, document):
        self._note(document)

    def slotDeletedDocument(self, document):
        self._changed.discard(document.Name)
        self._measures.pop(document.Name, None)
        self.closed.emit(document.Name)

    def slotActivateDocument(self, document):
        self.activated.emit(document.Name)

    def _note(self, document):
        self._changed.add(document.Name)
        self._timer.start(QUIET_MS)

    def _look(self):
        names, self._changed = self._changed, set()
        for name in names & set(FreeCAD.listDocuments()):
            document = FreeCAD.getDocument(name)
            if getattr(document, "Restoring", False):
                self._note(document)
                continue
            update_document(document, self._measures.setdefault(name, ShapeMeasures()))
            redraw_sources(document)
            self.checked.emit(name)


def redraw_sources(document):
    """Draw the arrows of emitting faces where these are now; they may have moved, or just have been restored."""
    for study in studies(document):
        for source in members(study, Source.TYPE):
            if source.Kind == "Faces":
                source.ViewObject.Proxy.redraw(source)


def install():
    """Start watching, once; returns the observer. It lives as long as the main window."""
    import FreeCADGui

    window = FreeCADGui.getMainWindow()
    observer = window.findChild(QtCore.QObject, NAME) if isinstance(window, QtWidgets.QMainWindow) else None
    if observer is None:
        observer = DocumentObserver(window)
        FreeCAD.addDocumentObserver(observer)
    return observer
