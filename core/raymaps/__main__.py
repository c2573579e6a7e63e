# SPDX-License-Identifier: LGPL-2.1-or-later
"""``python -m raymaps`` is the command ``raymaps``."""

from raymaps.cli import main

main()
