# SPDX-License-Identifier: LGPL-2.1-or-later
"""Commands, the dock panel, and the rays in the 3D view."""
