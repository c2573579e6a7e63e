# SPDX-License-Identifier: LGPL-2.1-or-later
"""The second process: which interpreter, how it is started, what it says."""
