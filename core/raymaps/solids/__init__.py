# SPDX-License-Identifier: LGPL-2.1-or-later
"""Solids, bodies filled with a medium: which one rules where several are, where bodies touch, nest and overlap.

A *rank* is given to each solid: 0 to that of the highest priority. The medium at a point is that of the solid of lowest
rank that contains it, else the ambient one.
"""

from raymaps.solids.contacts import SolidTables, lower_solids
from raymaps.solids.ranks import medium_at, medium_of, rank_solids, solids_at

__all__ = ["SolidTables", "lower_solids", "medium_at", "medium_of", "rank_solids", "solids_at"]
