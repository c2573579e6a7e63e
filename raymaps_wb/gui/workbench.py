# SPDX-License-Identifier: LGPL-2.1-or-later
"""Toolbar, menu and dock panel."""

from raymaps_wb.compat import translate
from raymaps_wb.gui import commands, dock


def initialize(workbench):
    """Make toolbars and the menu, once."""
    names = commands.register()
    build, act = names[:5], names[5:10]
    workbench.appendToolbar(translate("Ray Maps study"), build)
    workbench.appendToolbar(translate("Ray Maps results"), act)
    workbench.appendMenu(translate("&Ray Maps"), [*build, "Separator", *act, "Separator", *names[10:]])


def activated():
    """Show the panel."""
    dock.show()
