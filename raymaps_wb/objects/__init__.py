# SPDX-License-Identifier: LGPL-2.1-or-later
"""The document objects of a study, one concept a file; each has a view provider and a task panel of the same name."""
