# SPDX-License-Identifier: LGPL-2.1-or-later
"""Points of Sobol's sequence, scrambled by Owen's nested uniform scrambling as a hash does it.

References
----------
I. M. Sobol': On the distribution of points in a cube, USSR Comput. Math. Math. Phys. 7 (1967), p. 86.
S. Joe, F. Y. Kuo: Constructing Sobol sequences with better two-dimensional projections, SIAM J. Sci. Comput. 30 (2008),
p. 2635; `DIRECTIONS` are the first rows of their table new-joe-kuo-6.21201.
A. B. Owen: Randomly permuted (t,m,s)-nets and (t,s)-sequences, in: Monte Carlo and Quasi-Monte Carlo Methods (1995).
S. Laine, T. Karras: Stratified Sampling for Stochastic Transparency, Comput. Graph. Forum 30 (2011), section 3.1.
B. Burley: Practical Hash-based Owen Scrambling, JCGT 9 (4) (2020), p. 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.jit import kernel
from raymaps.kernels.random import philox4x32

__all__ = ["N_DIMENSIONS", "scrambles", "sobol_word"]

#: Degree s and coefficients a of the primitive polynomial, and initial numbers m, of the dimensions from the second on.
DIRECTIONS: tuple[tuple[int, int, tuple[int, ...]], ...] = (
    (1, 0, (1,)),
    (2, 1, (1, 3)),
    (3, 1, (1, 3, 1)),
    (3, 2, (1, 1, 1)),
    (4, 1, (1, 1, 3, 3)),
    (4, 4, (1, 3, 5, 13)),
    (5, 2, (1, 1, 5, 5, 17)),
    (5, 4, (1, 1, 5, 5, 5)),
    (5, 7, (1, 1, 7, 11, 19)),
    (5, 11, (1, 1, 5, 1, 1)),
    (5, 13, (1, 1, 1, 3, 11)),
    (5, 14, (1, 3, 5, 5, 31)),
    (6, 1, (1, 3, 3, 9, 7, 49)),
    (6, 13, (1, 1, 1, 15, 21, 21)),
    (6, 16, (1, 3, 1, 13, 27, 49)),
    (6, 19, (1, 1, 1, 15, 7, 5)),
    (6, 22, (1, 3, 1, 15, 13, 25)),
    (6, 25, (1, 1, 5, 5, 19, 61)),
    (7, 1, (1, 3, 7, 11, 23, 15, 103)),
    (7, 4, (1, 3, 7, 13, 13, 15, 69)),
    (7, 7, (1, 1, 3, 13, 7, 35, 63)),
    (7, 8, (1, 3, 5, 9, 1, 25, 53)),
    (7, 14, (1, 3, 1, 13, 9, 35, 107)),
    (7, 19, (1, 3, 1, 5, 27, 61, 31)),
    (7, 21, (1, 1, 5, 11, 19, 41, 61)),
    (7, 28, (1, 3, 5, 3, 3, 13, 69)),
    (7, 31, (1, 1, 7, 13, 1, 19, 1)),
    (7, 32, (1, 3, 7, 5, 13, 19, 59)),
    (7, 37, (1, 1, 3, 9, 25, 29, 41)),
    (7, 41, (1, 3, 5, 13, 23, 1, 55)),
    (7, 42, (1, 3, 7, 3, 13, 59, 17)),
)  # fmt: skip
N_DIMENSIONS = len(DIRECTIONS) + 1
_BITS = 32


def _mirrored_directions() -> NDArray[np.uint64]:
    """What each bit of an index turns round, (N_DIMENSIONS, _BITS); as words read from their lowest bit.

    By Joe and Kuo's equation (2): m_k = 2 a_1 m_(k-1) ^ ... ^ 2^(s-1) a_(s-1) m_(k-s+1) ^ 2^s m_(k-s) ^ m_(k-s).
    """
    rows = np.zeros((N_DIMENSIONS, _BITS), np.uint64)
    for dimension, (s, a, initial) in enumerate(((0, 0, (1,) * _BITS), *DIRECTIONS)):
        m = list(initial)
        for k in range(len(m), _BITS):
            number = m[k - s] ^ (m[k - s] << s)
            for j in range(1, s):
                number ^= ((a >> (s - 1 - j)) & 1) * (m[k - j] << j)
            m.append(number)
        # m_k / 2^k: its lowest bit is bit k of the fraction
        rows[dimension] = [int(f"{m[k]:b}".zfill(k + 1)[::-1], 2) for k in range(_BITS)]
    return rows


def _by_four_bits(directions: NDArray[np.uint64]) -> NDArray[np.uint32]:
    """What each four bits of an index turn round together, (N_DIMENSIONS, _BITS / 4, 16)."""
    found = np.zeros((N_DIMENSIONS, _BITS // 4, 16), np.uint32)
    for bit in range(4):
        is_set = np.arange(16) >> bit & 1
        found ^= (directions[:, bit::4, None] * is_set.astype(np.uint64)).astype(np.uint32)
    return found


_TURNS = _by_four_bits(_mirrored_directions())
_LOW = np.uint64(0xFFFFFFFF)
_ONE, _32, _FOUR_BITS = np.uint64(1), np.uint64(32), np.uint64(15)
#: Multipliers of the hash: those that N. Vegdahl found to mix best (Owen scrambling based on Laine-Karras, 2021).
_FIRST, _SECOND, _THIRD = np.uint64(0x3D20ADEA), np.uint64(0x05526C56), np.uint64(0x53A22864)


@kernel
def sobol_word(index, dimension, add, multiply):
    """A coordinate of a scrambled point, as a 32-bit word held in uint64.

    Each bit is turned round or not by a hash of the higher ones, which keeps the points a net. Over all ``add`` the
    word takes each value once, whatever else is given: it is exactly uniform.

    Parameters
    ----------
    index : uint64, below 2^32
    dimension : int, below `N_DIMENSIONS`
    add, multiply : uint32
        Scramble, see `scrambles`.
    """
    x = np.uint64(0)
    place = 0
    while index != 0:
        x ^= np.uint64(_TURNS[dimension, place, index & _FOUR_BITS])
        index >>= np.uint64(4)
        place += 1
    x ^= (x * _FIRST) & _LOW
    x = (x + np.uint64(add)) & _LOW
    x = (x * (np.uint64(multiply) | _ONE)) & _LOW
    x ^= (x * _SECOND) & _LOW
    x ^= (x * _THIRD) & _LOW
    return _turned(x)


@kernel
def _turned(x):
    """A 32-bit word read from its other end."""
    x = ((x >> np.uint64(1)) & np.uint64(0x55555555)) | ((x & np.uint64(0x55555555)) << np.uint64(1))
    x = ((x >> np.uint64(2)) & np.uint64(0x33333333)) | ((x & np.uint64(0x33333333)) << np.uint64(2))
    x = ((x >> np.uint64(4)) & np.uint64(0x0F0F0F0F)) | ((x & np.uint64(0x0F0F0F0F)) << np.uint64(4))
    x = ((x >> np.uint64(8)) & np.uint64(0x00FF00FF)) | ((x & np.uint64(0x00FF00FF)) << np.uint64(8))
    return (x >> np.uint64(16)) | ((x & np.uint64(0xFFFF)) << np.uint64(16))


@kernel
def scrambles(seed, words):
    """Fill the scrambles of all groups of a seed's rays.

    Philox with a counter that no ray has; see `raymaps.kernels.random.uniforms`.

    Parameters
    ----------
    seed : uint64
    words : (n_groups, N_DIMENSIONS, 2) uint32, filled
    """
    for group in range(words.shape[0]):
        for dimension in range(words.shape[1]):
            a, b, _, _ = philox4x32(
                np.uint64(group), np.uint64(dimension), np.uint64(0), _ONE, seed & _LOW, seed >> _32
            )
            words[group, dimension, 0] = a
            words[group, dimension, 1] = b
