# SPDX-License-Identifier: LGPL-2.1-or-later
"""How compiled loops are compiled, in one place: those of the tracer, the store, criteria and results.

``cache`` keeps the machine code on disk, so only the first run of a machine compiles; ``nogil`` lets portions run on
threads; ``error_model`` "numpy" divides without checks. No ``fastmath``: results must not depend on how the
compiler reorders sums.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

__all__ = ["kernel"]


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a loop over rays, or a function that such loops call."""
    return numba.njit(nogil=True, cache=True, error_model="numpy")(function)
