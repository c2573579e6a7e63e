# SPDX-License-Identifier: LGPL-2.1-or-later
"""What accuracy costs in time: short runs of a scene's choices, and what they foretell of long ones."""

from raymaps.accuracy.choices import Choice, choices
from raymaps.accuracy.outlook import ERRORS_PERCENT, Outlook, Outlooks, Present
from raymaps.accuracy.pilot import forecast
from raymaps.accuracy.plot import check_plot, plot

__all__ = [
    "ERRORS_PERCENT",
    "Choice",
    "Outlook",
    "Outlooks",
    "Present",
    "check_plot",
    "choices",
    "forecast",
    "plot",
]
