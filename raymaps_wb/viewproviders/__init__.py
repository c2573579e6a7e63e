# SPDX-License-Identifier: LGPL-2.1-or-later
"""How the document objects look in the tree and in the 3D view."""
