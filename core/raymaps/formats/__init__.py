# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of others: one module a format, each with `read` functions that return plain data or raise `FormatError`."""
