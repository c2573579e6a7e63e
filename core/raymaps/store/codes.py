# SPDX-License-Identifier: LGPL-2.1-or-later
"""What happened at an event or a crossing as one word, and numbers as bits."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["bits", "step_code"]


def step_code(kind: Any, index: Any, medium: Any, registered: Any) -> NDArray[np.int64]:
    """Kind, registered, medium + 1 and face (or detector) + 1 in words of 64 bits, (n_steps,)."""
    wide = [np.asarray(part).astype(np.int64) for part in (kind, index, medium, registered)]
    return wide[0] | (wide[3] << 8) | ((wide[2] + 1) << 16) | ((wide[1] + 1) << 32)


def bits(values: NDArray[np.floating]) -> NDArray[Any]:
    """Floating-point numbers as unsigned integers of their size."""
    values = np.ascontiguousarray(values)
    return values.view(f"u{values.itemsize}")
