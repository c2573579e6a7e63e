# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD reads this at every start, also without a window. There is nothing to register."""
