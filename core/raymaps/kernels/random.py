# SPDX-License-Identifier: LGPL-2.1-or-later
"""Random numbers as a function of (seed, ray, event, purpose): Philox4x32-10.

So a ray's history is the same whatever the threads, the portion, or what was traced before it.

References
----------
J. Salmon, M. Moraes, R. Dror, D. Shaw: Parallel Random Numbers: As Easy as 1, 2, 3, SC11 (2011), section 3.3.
"""

from __future__ import annotations

import numpy as np

from raymaps.jit import kernel

__all__ = [
    "COLLAPSE", "EMIT_PLACE", "IN_MEDIUM", "ON_SURFACE", "ON_SURFACE_MORE", "REJECTION", "SCATTER_DIRECTION",
    "SCATTER_PLACE", "philox4x32", "uniforms",
]  # fmt: skip

#: What four draws are for: those of one event and different purposes are independent.
ON_SURFACE, IN_MEDIUM, EMIT_PLACE, SCATTER_PLACE, SCATTER_DIRECTION, COLLAPSE, ON_SURFACE_MORE = range(7)
#: From here on to 255: draws that are thrown away until one fits.
REJECTION = 128

_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_LOW = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)


@kernel
def philox4x32(c0, c1, c2, c3, k0, k1):
    """Ten rounds of Philox; counter and key are 32-bit words held in uint64, and so are the four results."""
    for _ in range(10):
        p0 = _M0 * c0
        p1 = _M1 * c2
        c0, c1, c2, c3 = (p1 >> _32) ^ c1 ^ k0, p1 & _LOW, (p0 >> _32) ^ c3 ^ k1, p0 & _LOW
        k0 = (k0 + _W0) & _LOW
        k1 = (k1 + _W1) & _LOW
    return c0, c1, c2, c3


@kernel
def uniforms(seed, ray, event, purpose):
    """Four uniform numbers in the open interval (0, 1), each a multiple of 2^-33.

    Parameters
    ----------
    seed, ray : uint64
    event : int
        Which event of the ray, 0 to 2^24 - 1.
    purpose : int
    """
    word = np.uint64(event) | (np.uint64(purpose) << np.uint64(24))
    a, b, c, d = philox4x32(ray & _LOW, ray >> _32, word, np.uint64(0), seed & _LOW, seed >> _32)
    scale = 2.0**-32
    return (
        (np.float64(a) + 0.5) * scale,
        (np.float64(b) + 0.5) * scale,
        (np.float64(c) + 0.5) * scale,
        (np.float64(d) + 0.5) * scale,
    )
