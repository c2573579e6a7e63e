# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where the addon's own files stand."""

import os

ADDON_FOLDER = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
CORE_FOLDER = os.path.join(ADDON_FOLDER, "core")
ICON_FOLDER = os.path.join(ADDON_FOLDER, "resources", "icons")
MATERIAL_FOLDER = os.path.join(ADDON_FOLDER, "resources", "materials")
EXAMPLE_FOLDER = os.path.join(ADDON_FOLDER, "examples")
LOCK_FILE = os.path.join(ADDON_FOLDER, "requirements.lock")
LAUNCHER = os.path.join(ADDON_FOLDER, "raymaps_wb", "tracer", "launcher.py")


def icon(name):
    """Path of one of our icons by its name without the ending."""
    return os.path.join(ICON_FOLDER, name + ".svg")
