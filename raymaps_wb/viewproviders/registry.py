# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which view provider belongs to which object."""


def ensure_view(obj):
    """Give an object of ours its view provider if it has none, for instance when it was made without a window."""
