# SPDX-License-Identifier: LGPL-2.1-or-later
"""How all kernels are compiled, in one place.

``cache`` keeps the machine code on disk, so only the first run of a machine compiles; ``nogil`` lets portions run on
threads; ``error_model`` "numpy" divides without checks. No ``fastmath``: results must not depend on how the
compiler reorders sums.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

__all__ = ["inlined", "kernel"]


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a loop that is called from Python."""
    return numba.njit(nogil=True, cache=True, error_model="numpy")(function)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a small function that kernels call."""
    return numba.njit(nogil=True, cache=True, error_model="numpy", inline="never")(function)
