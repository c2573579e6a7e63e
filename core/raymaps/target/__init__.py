# SPDX-License-Identifier: LGPL-2.1-or-later
"""A target in place of a number of rays: trace until a figure is known to so many percent, without bias."""

from raymaps.target.aim import Target
from raymaps.target.course import Course
from raymaps.target.law import Law, law_of_points
from raymaps.target.quantities import Quantity, check_target, quantities
from raymaps.target.reach import reach
from raymaps.target.rule import Tally, pilot_seed

__all__ = [
    "Course",
    "Law",
    "Quantity",
    "Tally",
    "Target",
    "check_target",
    "law_of_points",
    "pilot_seed",
    "quantities",
    "reach",
]
