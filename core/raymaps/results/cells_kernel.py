# SPDX-License-Identifier: LGPL-2.1-or-later
"""The loop behind `raymaps.results.cells`: crossings of a detector added up ray by ray and cell by cell."""

from __future__ import annotations

import numpy as np

from raymaps.jit import kernel

__all__ = ["add_crossings"]


@kernel
def add_crossings(rows, ray, light_row, xy_mm, light, source_of_ray, size_mm, resolution, sums, in_cell):
    """Add the crossings of a portion that count.

    A ray's crossings stand next to each other. Its light in all is added up first and does not depend on the cells.

    Parameters
    ----------
    rows : (n,) int64
        Crossings that count, ascending.
    ray, light_row : (n_crossings,) int64
        Ray of each crossing, and the row of its light.
    xy_mm : (n_crossings, 2) float
    light : (n_lights, 5) float64
        Power, lumens, red, green, blue.
    source_of_ray : (n_rays,) int
    size_mm : (width, height)
    resolution : (n_x, n_y)
    sums : CellSums, added to
    in_cell : (n_cells,) float64
        Room for the light of one ray in each cell; zeros, and zeros again afterwards.

    Returns
    -------
    int: number of rays among the crossings
    """
    n_rays = 0
    n_x, n_y = resolution
    per_mm_x, per_mm_y = n_x / size_mm[0], n_y / size_mm[1]
    start = 0
    while start < len(rows):
        this_ray = ray[rows[start]]
        source = source_of_ray[this_ray]
        in_all = lumen_in_all = 0.0
        end = start
        while end < len(rows) and ray[rows[end]] == this_ray:
            at = light_row[rows[end]]
            in_all += light[at, 0]
            lumen_in_all += light[at, 1]
            end += 1
        sums.total[source] += in_all
        sums.squares[source] += in_all * in_all
        sums.lumen[source] += lumen_in_all
        sums.lumen_squares[source] += lumen_in_all * lumen_in_all
        n_rays += 1

        for k in range(start, end):
            row = rows[k]
            at = light_row[row]
            cell = _cell(xy_mm[row, 0], xy_mm[row, 1], size_mm, per_mm_x, per_mm_y, n_x, n_y)
            power = light[at, 0]
            for value in range(5):
                sums.cell_light[source, cell, value] += light[at, value]
            sums.cell_products[source, cell] += power * in_all
            in_cell[cell] += power
        # several crossings of a ray in one cell are one sample
        for k in range(start, end):
            row = rows[k]
            cell = _cell(xy_mm[row, 0], xy_mm[row, 1], size_mm, per_mm_x, per_mm_y, n_x, n_y)
            sums.cell_squares[source, cell] += in_cell[cell] * in_cell[cell]  # nothing the second time
            in_cell[cell] = 0.0
        start = end
    return n_rays


@kernel
def _cell(x_mm, y_mm, size_mm, per_mm_x, per_mm_y, n_x, n_y):
    """Cell of a point, counted row by row from the lower left; the outer borders belong to the outer cells."""
    column = int((np.float64(x_mm) + size_mm[0] / 2) * per_mm_x)
    line = int((np.float64(y_mm) + size_mm[1] / 2) * per_mm_y)
    return min(max(line, 0), n_y - 1) * n_x + min(max(column, 0), n_x - 1)
