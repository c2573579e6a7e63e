# SPDX-License-Identifier: LGPL-2.1-or-later
"""Figures are written as on the command line."""

import unittest

from raymaps_wb.gui.figures import watts, watts_with_error


class FiguresTest(unittest.TestCase):
    def test_prefixes(self):
        for value, text in ((1e-5, "10 µW"), (0.0255, "25.5 mW"), (3.0, "3 W"), (1500, "1.5 kW"), (0, "0 W")):
            self.assertEqual(watts(value), text)

    def test_errors(self):
        self.assertEqual(watts_with_error(0.2905, 0.0028), "290.5 ± 2.8 mW")
        self.assertEqual(watts_with_error(0.5, 0), "500 ± 0 mW")
        self.assertEqual(watts_with_error(0, 0), "0 ± 0 W")
