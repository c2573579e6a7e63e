# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which study the commands and the dock panel work on."""

import FreeCAD
import FreeCADGui

from raymaps_wb.objects.study import studies, study_of


def active_study():
    """The study of what is selected, else the first of the active document; None if there is none."""
    document = FreeCAD.ActiveDocument
    if document is None:
        return None
    for obj in FreeCADGui.Selection.getSelection(document.Name):
        study = study_of(obj)
        if study is not None:
            return study
    found = studies(document)
    return found[0] if found else None


PREFIX = "Ray Maps: "


def is_own_step_open():
    """Whether the open step of undo is that of a task panel of ours."""
    step = FreeCAD.getActiveTransaction()
    return bool(step) and step[0].startswith(PREFIX)


class Transaction:
    """One step of undo; taken back as a whole if anything in it fails.

    Within a step that is open already, such as that of a sketch being edited, it is a part of that one.
    """

    def __init__(self, document, name):
        self._document, self._name = document, name
        self._is_part = bool(getattr(document, "HasPendingTransaction", False))

    def __enter__(self):
        if not self._is_part:
            self._document.openTransaction(self._name)
        return self._document

    def __exit__(self, kind, value, traceback):
        if self._is_part:
            return False
        if kind is None:
            self._document.commitTransaction()
        else:
            self._document.abortTransaction()
        return False
