# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bodies of odd triangles, of the index around them: light aimed at every seam goes straight through."""

import numpy as np
import pytest

from raymaps.kinds import EventKind
from tests.physics.scenes import Shape, body, box, traced
from tests.stability.aiming import aimed, clear, lost, seams, some_directions, towards
from tests.stability.test_odd_geometry import with_slivers


def passes_clear_glass(folder, shape, *, rays=20_000):
    """Light aimed at every seam of a body of the index around it goes straight through."""
    targets = seams(shape)
    targets = targets[np.random.default_rng(0).choice(len(targets), min(len(targets), 200), replace=False)]
    origins, ways = towards(targets, some_directions(50), 3 * float(np.ptp(shape.vertices, axis=0).max()))
    h = traced(
        folder,
        {"Body": body(shape, "polished", "glass")},
        rays=rays,
        sources={"S": aimed(folder, "rays", origins, ways)},
        **clear(1.0),
    )
    assert lost(h).all == 0
    assert ((np.diff(h.offsets) - 2) % 2 == 0).all()
    assert (h.kind[h.last] == EventKind.LEFT).all()
    return h


@pytest.mark.parametrize("aspect", [1e4, 1e6, 1e8])
def test_slivers_in_glass(tmp_path, aspect):
    """Guards: as in a room; and what a ray meets there agrees with the solids that it is in."""
    passes_clear_glass(tmp_path, with_slivers(box((-10, -7, -4), (10, 7, 4)).turned(0.7, (1, 2, 3)), aspect))


def test_an_edge_of_four_faces(tmp_path):
    """Two boxes that share an edge only, as one body of a medium: non-manifold, but closed.

    Guards: at such an edge there is no one neighbour to trim by.
    """
    low, high = box((-4, -4, -3), (0, 0, 3)), box((0, 0, -3), (4, 4, 3))
    both = Shape(
        np.concatenate([low.vertices, high.vertices]),
        np.concatenate([low.triangles, high.triangles + len(low.vertices)]),
        tuple((f"{name}{k}", n) for k, s in enumerate((low, high)) for name, n in s.faces),
    )
    passes_clear_glass(tmp_path, both.turned(0.3, (1, 1, 1)))


def test_boxes_that_share_a_corner_and_a_face_within_one_body(tmp_path):
    """Two halves of a box as one shell with the wall between them twice, once each way round: light goes through it.

    Guards: crossings in one place of one solid cancel, in and out.
    """
    low, high = box((-4, -4, -3), (0, 4, 3)), box((0, -4, -3), (4, 4, 3))
    both = Shape(
        np.concatenate([low.vertices, high.vertices]),
        np.concatenate([low.triangles, high.triangles + len(low.vertices)]),
        tuple((f"{name}{k}", n) for k, s in enumerate((low, high)) for name, n in s.faces),
    )
    passes_clear_glass(tmp_path, both.turned(0.3, (1, 1, 1)))
