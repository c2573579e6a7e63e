# SPDX-License-Identifier: LGPL-2.1-or-later
"""The loops behind `raymaps.results.cells`: samples of a detector added up ray by ray, cell by cell and band by band.

A ray's samples stand next to each other.
"""

from __future__ import annotations

import numpy as np

from raymaps.jit import kernel

__all__ = ["add_rays", "add_spectra", "add_to_cells", "add_to_replicates", "rectangle_cells"]


@kernel
def add_rays(ray, light_row, less_row, light, group_of_ray, sums, rounded):
    """Add the samples of a portion, whatever their cells.

    Parameters
    ----------
    ray, light_row : (n,) int64
        Ray of each sample, ascending, and the row of its light.
    less_row : (n,) int64, or empty
        Row of the light that is taken off.
    light : (n_lights, 5) float64
        Power, lumens, red, green, blue.
    group_of_ray : (n_rays,) int
        What the sums are told apart by: source, or source and replicate.
    sums : RaySums, added to
    rounded : (4, n_groups) float64
        What rounding added to each sum so far; zeros at first.

    Returns
    -------
    int: number of rays among the samples
    """
    n_rays = 0
    start = 0
    while start < len(ray):
        group = group_of_ray[ray[start]]
        power = lumen = 0.0
        end = start
        while end < len(ray) and ray[end] == ray[start]:
            power += _value(light, light_row, less_row, end, 0)
            lumen += _value(light, light_row, less_row, end, 1)
            end += 1
        _add(sums.total, rounded[0], group, power)
        _add(sums.squares, rounded[1], group, power * power)
        _add(sums.lumen, rounded[2], group, lumen)
        _add(sums.lumen_squares, rounded[3], group, lumen * lumen)
        sums.most[group] = max(sums.most[group], power)
        sums.most_lumen[group] = max(sums.most_lumen[group], lumen)
        n_rays += 1
        start = end
    return n_rays


@kernel
def add_to_cells(ray, light_row, less_row, cell, light, source_of_ray, sums, in_cell):
    """Add the samples of a portion to their cells.

    Parameters
    ----------
    ray, light_row, less_row, light, source_of_ray
        As of `add_rays`.
    cell : (n,) int64, -1 for none
    sums : CellSums, added to
    in_cell : (2, n_cells) float64
        Room for the power and lumens of one ray in each cell; zeros, and zeros again afterwards.
    """
    with_lumens = sums.cell_lumen_squares.shape[1] > 0
    start = 0
    while start < len(ray):
        source = source_of_ray[ray[start]]
        in_all = 0.0
        end = start
        while end < len(ray) and ray[end] == ray[start]:
            in_all += _value(light, light_row, less_row, end, 0)
            end += 1
        for k in range(start, end):
            c = cell[k]
            if c < 0:
                continue
            for value in range(5):
                sums.cell_light[source, c, value] += _value(light, light_row, less_row, k, value)
            power = _value(light, light_row, less_row, k, 0)
            sums.cell_products[source, c] += power * in_all
            in_cell[0, c] += power
            if with_lumens:
                in_cell[1, c] += _value(light, light_row, less_row, k, 1)
        # several samples of a ray in one cell are one sample
        for k in range(start, end):
            c = cell[k]
            if c < 0:
                continue
            sums.cell_squares[source, c] += in_cell[0, c] * in_cell[0, c]  # nothing the second time
            in_cell[0, c] = 0.0
            if with_lumens:
                sums.cell_lumen_squares[source, c] += in_cell[1, c] * in_cell[1, c]
                in_cell[1, c] = 0.0
        start = end


@kernel
def add_to_replicates(ray, light_row, less_row, cell, light, group_of_ray, sums):
    """Add the samples of a portion to their cells by source and replicate.

    Parameters
    ----------
    ray, light_row, less_row, cell, light
        As of `add_to_cells`.
    group_of_ray : (n_rays,) int
    sums : (1 or 2, n_groups, n_cells) float64, added to
        Power, and lumens if there are any.
    """
    for k in range(len(ray)):
        if cell[k] >= 0:
            for value in range(len(sums)):
                sums[value, group_of_ray[ray[k]], cell[k]] += _value(light, light_row, less_row, k, value)


@kernel
def add_spectra(ray, light_row, less_row, light, group_of_ray, sums, rounded, of_ray):
    """Add the samples of a portion band by band.

    Parameters
    ----------
    ray, light_row, less_row, group_of_ray
        As of `add_rays`.
    light : (n_lights, n_bands) float
    sums : SpectrumSums, added to
    rounded : (2, n_groups, n_bands) float64
        What rounding added to each sum so far; zeros at first.
    of_ray : (n_bands,) float64
        Room for the light of one ray.
    """
    start = 0
    while start < len(ray):
        group = group_of_ray[ray[start]]
        of_ray[:] = 0.0
        end = start
        while end < len(ray) and ray[end] == ray[start]:
            for band in range(len(of_ray)):
                of_ray[band] += _value(light, light_row, less_row, end, band)
            end += 1
        for band in range(len(of_ray)):
            _add(sums.total[group], rounded[0, group], band, of_ray[band])
            _add(sums.squares[group], rounded[1, group], band, of_ray[band] * of_ray[band])
        start = end


@kernel
def _add(sums, rounded, at, value):
    """Add a value to one of the sums without the rounding of many additions (W. Kahan, Comm. ACM 8 (1965), p. 40).

    Where all rays bring the same light, rounding alone would else look like a spread.
    """
    corrected = value - rounded[at]
    total = sums[at] + corrected
    rounded[at] = (total - sums[at]) - corrected
    sums[at] = total


@kernel
def _value(light, light_row, less_row, k, value):
    """One of the values of a sample's light."""
    if len(less_row) > 0:
        return np.float64(light[light_row[k], value]) - np.float64(light[less_row[k], value])
    return np.float64(light[light_row[k], value])


@kernel
def rectangle_cells(rows, xy_mm, size_mm, resolution, cell):
    """Cells of points of a rectangle, counted row by row from the lower left.

    The outer borders belong to the outer cells.

    Parameters
    ----------
    rows : (n,) int64
    xy_mm : (n_points, 2) float
    size_mm : (width, height)
    resolution : (n_x, n_y)
    cell : (n,) int64, filled
    """
    n_x, n_y = resolution
    per_mm_x, per_mm_y = n_x / size_mm[0], n_y / size_mm[1]
    for k in range(len(rows)):
        row = rows[k]
        column = int((np.float64(xy_mm[row, 0]) + size_mm[0] / 2) * per_mm_x)
        line = int((np.float64(xy_mm[row, 1]) + size_mm[1] / 2) * per_mm_y)
        cell[k] = min(max(line, 0), n_y - 1) * n_x + min(max(column, 0), n_x - 1)
