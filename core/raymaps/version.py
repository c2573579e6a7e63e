# SPDX-License-Identifier: LGPL-2.1-or-later
"""The version of Ray Maps."""

__all__ = ["__version__"]

__version__ = "0.1.0"
