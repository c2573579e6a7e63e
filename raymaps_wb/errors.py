# SPDX-License-Identifier: LGPL-2.1-or-later
"""What can go wrong on the FreeCAD side. Each message is one sentence: where, what, what to do."""


class WorkbenchError(Exception):
    """Base of all errors that the workbench shows to its user."""


class ExportError(WorkbenchError):
    """The study can't be written as a scene."""


class TracerError(WorkbenchError):
    """The tracer can't be started, or ended without a result."""
