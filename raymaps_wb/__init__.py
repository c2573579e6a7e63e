# SPDX-License-Identifier: LGPL-2.1-or-later
"""The FreeCAD side of Ray Maps: tag a document, export it as a scene, run the tracer, ask, show.

Imports only the standard library, FreeCAD and Qt. Everything that computes runs in a second process.
"""

__version__ = "0.1.0"
