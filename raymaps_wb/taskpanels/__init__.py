# SPDX-License-Identifier: LGPL-2.1-or-later
"""The panels in which the document objects are edited."""
