# SPDX-License-Identifier: LGPL-2.1-or-later
"""From a study to a scene file with its geometry."""
