# SPDX-License-Identifier: LGPL-2.1-or-later
"""Directions sorted as on a goniometer of type C (CIE 121): half planes C at equal steps from 0, and in each the angles
gamma from 0 to 180 degrees.

An intensity is the flux in a cell around its direction over the cell's solid angle

    dC (cos(gamma - d/2) - cos(gamma + d/2)).

Near the axis, where half planes come close to each other, several share a cell: an odd number of them, around one in
their middle, so that no cell is much narrower than it is high. Around the axis all share one cap of half a step. So
intensities there are not drowned in the noise of slivers, and times their solid angles they add up to the flux.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Goniometer"]

Float = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Goniometer:
    """Cells of directions, counted from gamma = 0 on, step by step in gamma.

    Attributes
    ----------
    n_c, n_gamma : int
        Half planes, and steps in gamma from 0 to 180 degrees.
    largest_rad : float
        Gamma beyond which nothing counts.
    """

    n_c: int
    n_gamma: int
    largest_rad: float = math.pi

    @property
    def together(self) -> Indices:
        """How many half planes share a cell at each gamma, (n_gamma + 1,): all of them at the axis."""
        gamma = np.arange(1, self.n_gamma) * (math.pi / self.n_gamma)
        most = (math.pi / self.n_gamma) / (2 * math.pi / self.n_c * np.sin(gamma))
        odd = np.array([n for n in range(1, self.n_c + 1, 2) if self.n_c % n == 0])
        inner = odd[np.maximum(np.searchsorted(odd, most * (1 + 1e-9), side="right") - 1, 0)]
        return np.concatenate([[self.n_c], inner, [self.n_c]]).astype(np.int64)

    @property
    def first(self) -> Indices:
        """First cell at each gamma, and how many cells there are, (n_gamma + 2,)."""
        return np.concatenate([[0], np.cumsum(self.n_c // self.together)])

    def cell_of(self, gamma: Float, c: Float) -> Indices:
        """Cell of directions, (n,); gamma in radians from 0 to pi, C in radians."""
        step = np.floor(np.minimum(gamma, self.largest_rad) * (self.n_gamma / math.pi) + 0.5).astype(np.int64)
        step = np.clip(step, 0, math.ceil(self.largest_rad * self.n_gamma / math.pi - 0.5 - 1e-9))  # the limit as well
        half_plane = np.floor(c * (self.n_c / (2 * math.pi)) + 0.5).astype(np.int64)
        return self._cell(step, half_plane)

    def _cell(self, step: Indices, half_plane: Indices) -> Indices:
        together = self.together[step]
        around = (half_plane + (together - 1) // 2) // together % (self.n_c // together)
        return np.asarray(self.first[step] + around)

    @property
    def solid_angle_sr(self) -> Float:
        """Solid angle of each cell, or of its part up to the largest gamma, (n_cells,)."""
        step = math.pi / self.n_gamma
        edges = np.clip((np.arange(self.n_gamma + 2) - 0.5) * step, 0.0, self.largest_rad)
        edges[-1] = min(math.pi, self.largest_rad)
        low, high = edges[:-1], edges[1:]
        high = np.where(high - low < 1e-9 * step, low, high)  # rounding at the limit
        # cos(a) - cos(b) = 2 sin((a + b) / 2) sin((b - a) / 2), exact also for narrow rings
        ring = 2 * np.sin((low + high) / 2) * np.sin((high - low) / 2) * 2 * math.pi
        count = self.n_c // self.together
        return np.repeat(ring / count, count)

    def on_grid(self, values: Float, *, shared: bool) -> Float:
        """Values of cells by half plane and gamma, (n_c, n_gamma + 1).

        Half planes that share a cell have its value, or, if that is to be shared, the same part of it.
        """
        step, half_plane = np.meshgrid(np.arange(self.n_gamma + 1), np.arange(self.n_c))
        grid = np.asarray(values[self._cell(step, half_plane)], np.float64)
        if shared:
            grid = grid / self.together
        grid.setflags(write=False)
        return grid
