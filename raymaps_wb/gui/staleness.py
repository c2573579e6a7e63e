# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whether results still belong to their documents."""

from raymaps_wb.errors import WorkbenchError
from raymaps_wb.export.fingerprint import fingerprint
from raymaps_wb.objects.result import Result
from raymaps_wb.objects.study import members, studies


def update_stale(study, measures=None):
    """Compare the study with what its results were simulated from; returns whether any is stale."""
    results = [obj for obj in members(study, Result.TYPE) if obj.Fingerprint]
    if not results:
        return False
    try:
        now = fingerprint(study, measures)
    except WorkbenchError:
        now = ""  # a study that can't be exported is not the one that was simulated
    for obj in results:
        stale = obj.Fingerprint != now
        if obj.Stale != stale:
            obj.Stale = stale
    return any(obj.Stale for obj in results)


def update_document(document, measures=None):
    """The same for all studies of a document."""
    return [study for study in studies(document) if update_stale(study, measures)]
