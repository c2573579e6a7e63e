# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bodies hidden in one of higher priority."""

import numpy as np

from raymaps.kinds import EventKind
from tests.physics.scenes import body, disc_source
from tests.physics.scenes_exact import box, traced
from tests.stability.aiming import lost

SCATTERING = {"coefficient_per_mm": 0.1, "phase": {"kind": "henyey_greenstein", "g": 0.0}}


def test_scattering_among_hidden_boxes(tmp_path):
    """Six boxes, one in the other, hidden in a scattering one that rules: light passes their faces as if there were
    none, and is scattered before and behind them.

    Guards: silent passes are taken back where a ray is scattered before it gets there (`undo_passes`).
    """
    boxes = {
        f"Hidden{s}": body(box((-s, -s, -s), (s, s, s)), "polished", "glass") for s in (8.0, 7.0, 6.0, 5.0, 4.0, 3.0)
    }
    fog = body(box((-10, -10, -10), (10, 10, 10)), "polished", "fog")
    events = []
    for bodies in ({}, boxes):
        h = traced(
            tmp_path,
            {"Fog": {**fog, "priority": 5}, **bodies},
            rays=10_000,
            name=f"{len(bodies)}",
            settings={"max_events": 2000},
            surfaces={"polished": {"kind": "fresnel"}},
            media={"fog": {"refractive_index": 1.0, "scattering": [SCATTERING]}, "glass": {"refractive_index": 1.0}},
            sources={"S": disc_source((0, 0, -20), (0, 0, 1), 5)},
        )
        assert lost(h).all == 0
        assert (h.kind[h.last] == EventKind.LEFT).all()
        events.append(h.kind)
    assert np.array_equal(*events)
