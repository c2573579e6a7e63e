# SPDX-License-Identifier: LGPL-2.1-or-later
"""How compiled loops are compiled, in one place: those of the tracer, the store, criteria and results.

``cache`` keeps the machine code on disk, so only the first run of a machine compiles; ``nogil`` lets portions run on
threads; ``error_model`` "numpy" divides without checks. No ``fastmath``: results must not depend on how the
compiler reorders sums.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

__all__ = ["allocating_kernel", "kernel"]

# numba takes linear algebra from scipy where there is one. Our loops have none, so a third of a second is saved by
# letting it find no scipy while it is imported.
_hides_scipy = "scipy" not in sys.modules
if _hides_scipy:
    sys.modules["scipy"] = None  # type: ignore[assignment]
try:
    import numba
    from numba.np import arraymath as _arraymath  # noqa: F401  what looks for scipy
finally:
    if _hides_scipy:
        del sys.modules["scipy"]


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a loop over rays, or a function that such loops call, that makes no arrays of its own.

    Its arguments live as long as it runs, so references to them are not counted: handing the arrays of a wave, one by
    one, to a function would otherwise take longer than what most functions do with them.
    """
    return numba.njit(nogil=True, cache=True, error_model="numpy", _nrt=False)(function)


def allocating_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a loop, or a function that such loops call, that makes arrays."""
    return numba.njit(nogil=True, cache=True, error_model="numpy")(function)
