# SPDX-License-Identifier: LGPL-2.1-or-later
"""How compiled loops are compiled, in one place: those of the tracer, the store, criteria and results.

``cache`` keeps the machine code on disk, so only the first run of a machine compiles, and the first after loops have
changed: numba looks for changes in a function's own file, not in those of the functions that it calls, so the code is
kept in a folder named by what all loops say (or where NUMBA_CACHE_DIR says). ``nogil`` lets portions run on threads;
``error_model`` "numpy" divides without checks. No ``fastmath``: results must not depend on how the compiler reorders
sums.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

__all__ = ["allocating_kernel", "inlined_kernel", "kept_machine_code", "kernel"]

_PACKAGE = Path(__file__).parent
#: Machine code of loops that have changed since is deleted after so long.
_DAY_S = 24 * 3600

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


#: numba's types do not know of what is set here.
_config: Any = numba.config
_njit: Any = numba.njit


def _folder_of_loops() -> Path:
    """Where machine code is kept, named by the source of all loops."""
    sources = [path for path in sorted(_PACKAGE.rglob("*.py")) if b"raymaps.jit" in path.read_bytes()]
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in (*sources, _PACKAGE / "kinds.py")))
    return _PACKAGE / "__pycache__" / f"loops-{digest.hexdigest()[:16]}"


def _forget_old(folder: Path) -> None:
    with contextlib.suppress(OSError):  # another process may clear up too
        for other in folder.parent.glob("loops-*"):
            if other != folder and time.time() - other.stat().st_mtime > _DAY_S:
                shutil.rmtree(other, ignore_errors=True)


if "NUMBA_CACHE_DIR" not in os.environ:
    _folder = _folder_of_loops()
    _config.CACHE_DIR = str(_folder)
    _forget_old(_folder)


def kept_machine_code(module: str = "") -> list[Path]:
    """Files with the machine code of a module's loops, or of all, that an earlier run left."""
    return sorted(Path(_config.CACHE_DIR).rglob(f"{module}*.nbi"))


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a loop over rays, or a function that such loops call, that makes no arrays of its own.

    Its arguments live as long as it runs, so references to them are not counted: handing the arrays of a wave, one by
    one, to a function would otherwise take longer than what most functions do with them.
    """
    compiled: Callable[..., Any] = _njit(nogil=True, cache=True, error_model="numpy", _nrt=False)(function)
    return compiled


def inlined_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that loops call into these loops.

    What a wave and the tables are is copied at each call of a function that stays one: dozens of words for each array.
    """
    compiled: Callable[..., Any] = _njit(nogil=True, cache=True, error_model="numpy", _nrt=False, forceinline=True)(
        function
    )
    return compiled


def allocating_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a loop, or a function that such loops call, that makes arrays."""
    compiled: Callable[..., Any] = _njit(nogil=True, cache=True, error_model="numpy")(function)
    return compiled
