# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is measured side by side: `make bench`, or ``python -m benchmarks --quick`` to try."""
