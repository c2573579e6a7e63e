# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays aimed at vertices, and at edges to the last bit."""

import numpy as np
import pytest

from tests.physics.scenes import body
from tests.physics.scenes_exact import traced
from tests.stability.aiming import aimed, clear, lost, rotation, some_directions, towards
from tests.stability.test_aimed import SHAPES, goes_straight_through, placed, targets_of


@pytest.mark.parametrize("turned", [False, True], ids=["straight", "turned"])
@pytest.mark.parametrize("exact", [True, False], ids=["exact", "faceted"])
@pytest.mark.parametrize("name", SHAPES)
def test_rays_at_vertices_edges_and_seams_go_through(tmp_path, name, exact, turned):
    """Guards: the search in float64 over all faces where Embree's hits do not agree with the solids that a ray is in
    (`SlowSearch`), its last resort (`kernels.membership`); trimming at borders between faces (`Borders`).
    """
    shape = placed(name, exact, rotation() if turned else np.eye(3))
    goes_straight_through(tmp_path, shape, targets_of(shape))


@pytest.mark.parametrize("exact", [True, False], ids=["exact", "faceted"])
@pytest.mark.parametrize("name", SHAPES)
def test_nothing_is_lost_at_them_in_glass(tmp_path, name, exact):
    """The same with an index of 1.7: light goes round inside, and at each edge float32 may err.

    Guards: as above, and that a reflected ray stays on its side of the facet that it stands on (`START_OFFSET`).
    """
    shape = placed(name, exact, rotation())
    origins, directions = towards(targets_of(shape), some_directions(60), 20.0)
    h = traced(
        tmp_path,
        {"Body": body(shape, "polished", "glass")},
        rays=30_000,
        settings={"max_events": 200},
        sources={"S": aimed(tmp_path, "rays", origins, directions)},
        **clear(1.7),
    )
    assert lost(h).all == 0
