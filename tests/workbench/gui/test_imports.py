# SPDX-License-Identifier: LGPL-2.1-or-later
"""The same as without a window, for the modules that need one."""

from app.test_imports import ImportsTest

__all__ = ["ImportsTest"]
