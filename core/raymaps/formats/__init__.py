# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of others: one module a format, whose `read_...` and `parse_...` return plain data or raise `FormatError`."""
