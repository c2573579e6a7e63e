# SPDX-License-Identifier: LGPL-2.1-or-later
"""What kernels are given, of the types that they are given while tracing.

Compiled kernels are kept on disk with the types of their arguments. A type of a test among them would break every later
run without the tests.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from raymaps.compile import Tables

#: Shapes without entries, and types, of the arrays of `Tables`.
_EMPTY = {
    "plane": ((0, 4), np.float64), "triangle_face": ((0,), np.int32), "face_body": ((0,), np.int32),
    "face_surface": ((0,), np.int16),
    "surface_kind": ((0,), np.uint8), "medium_index": ((0,), np.float64), "ambient": ((1,), np.int16),
    "box": ((2, 3), np.float64),
}  # fmt: skip


def tables(**given: Any) -> Tables:
    """Tables with the given arrays; the others are empty."""
    arrays = {}
    for name, (shape, dtype) in _EMPTY.items():
        array = np.ascontiguousarray(given[name], dtype) if name in given else np.zeros(shape, dtype)
        arrays[name] = array.copy()
        arrays[name].setflags(write=False)
    return Tables(**arrays)
