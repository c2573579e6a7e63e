# SPDX-License-Identifier: LGPL-2.1-or-later
import math

import numpy as np
import pytest

from raymaps.criterion import Ellipse, Rectangle, inside_area
from raymaps.results.regions import cell_areas_mm2, cell_centres_mm, cell_edges_mm


def test_edges_and_centres():
    edges = cell_edges_mm(4.0, 4)
    assert edges.tolist() == [-2, -1, 0, 1, 2]
    assert cell_centres_mm(edges).tolist() == [-1.5, -0.5, 0.5, 1.5]


def test_no_region_is_all_cells():
    areas = cell_areas_mm2(cell_edges_mm(4.0, 4), cell_edges_mm(3.0, 2), None)
    assert areas.tolist() == [[1.5] * 4] * 2


def test_rectangle_is_cut_exactly():
    areas = cell_areas_mm2(cell_edges_mm(4.0, 4), cell_edges_mm(2.0, 2), Rectangle(-0.5, -0.25, 1.0, 5.0))
    assert areas.tolist() == [[0, 0.125, 0.25, 0], [0, 0.5, 1.0, 0]]


def test_ellipse_has_its_area():
    for ellipse in (Ellipse(0, 0, 1, 1), Ellipse(0.3, -0.2, 1.2, 0.4), Ellipse(-0.5, 0.5, 0.01, 1.1)):
        areas = cell_areas_mm2(cell_edges_mm(6.0, 31), cell_edges_mm(6.0, 17), ellipse)
        # a sum of some hundred differences of areas near 1
        assert areas.sum() == pytest.approx(math.pi * ellipse.rx_mm * ellipse.ry_mm, rel=1e-11)


def test_quarter_and_half_discs():
    areas = cell_areas_mm2(np.array([-1.0, 0.0, 1.0]), np.array([-1.0, 0.0, 0.5, 1.0]), Ellipse(0, 0, 1, 1))
    quarter = math.pi / 4
    cap = (math.acos(0.5) - 0.5 * math.sqrt(0.75)) / 2  # half the segment above y = 1/2
    assert areas[0] == pytest.approx([quarter, quarter], rel=1e-14)
    assert areas[2] == pytest.approx([cap, cap], rel=1e-13)
    assert areas[1] == pytest.approx([quarter - cap] * 2, rel=1e-13)


def test_cells_inside_are_whole_and_cells_outside_are_nothing():
    edges = cell_edges_mm(4.0, 40)
    ellipse = Ellipse(0.1234, 0.2345, 1.3, 0.9)  # no corner of a cell lies on it
    areas = cell_areas_mm2(edges, edges, ellipse)
    x, y = np.meshgrid(edges, edges)
    corner_inside = inside_area(ellipse, np.column_stack([x.ravel(), y.ravel()])).reshape(41, 41)
    n_inside = (
        corner_inside[1:, 1:].astype(int) + corner_inside[:-1, 1:] + corner_inside[1:, :-1] + corner_inside[:-1, :-1]
    )
    assert np.allclose(areas[n_inside == 4], 0.01, rtol=1e-10, atol=0)
    assert (areas[n_inside == 0] < 0.01 * 0.5).all()
    assert (areas[(n_inside > 0) & (n_inside < 4)] > 0).all()
    assert np.count_nonzero(areas) < 1600


@pytest.mark.parametrize("seed", range(20))
def test_against_counted_points(seed):
    rng = np.random.default_rng(seed)
    ellipse = Ellipse(*rng.uniform(-1, 1, 2), *rng.uniform(0.2, 2, 2))
    x0, y0 = rng.uniform(-2, 1, 2)
    x1, y1 = x0 + rng.uniform(0.2, 2), y0 + rng.uniform(0.2, 2)
    found = cell_areas_mm2(np.array([x0, x1]), np.array([y0, y1]), ellipse)[0, 0]
    n = 200_000
    points = np.column_stack([rng.uniform(x0, x1, n), rng.uniform(y0, y1, n)])
    share = inside_area(ellipse, points).mean()
    size = (x1 - x0) * (y1 - y0)
    sigma = size * math.sqrt(max(share * (1 - share), 1 / n) / n)
    assert abs(found - share * size) < 5 * sigma
