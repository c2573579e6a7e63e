# SPDX-License-Identifier: LGPL-2.1-or-later
"""A hundred thousand total reflections: light goes where unfolding says, keeps every bit, and the loop ends."""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from tests.physics.scenes import body
from tests.physics.scenes_exact import box, traced
from tests.stability.aiming import aimed, lost, rotation

#: The most that a scene may ask for.
MAX_EVENTS = 100_000
MIRROR = {"surfaces": {"tested": {"kind": "mirror", "reflectance": 1.0}}}
GLASS = {"surfaces": {"tested": {"kind": "fresnel"}}, "media": {"glass": {"refractive_index": 1.5}}}


def trapped(folder, shape, origins, directions, *, guide, events=MAX_EVENTS, rays=4):
    """Histories of rays in a mirror room or a light guide, none of which may have got out, or lost or won light."""
    h = traced(
        folder,
        {"Body": body(shape, "tested", "glass" if guide else None)},
        rays=rays,
        settings={"max_events": events},
        sources={"S": aimed(folder, "rays", origins, directions)},
        **(GLASS if guide else MIRROR),
    )
    assert lost(h).all == 0
    assert (h.kind[h.last] == EventKind.KILLED_DEPTH).all()
    reflections = EventKind.FRESNEL_REFLECTION if guide else EventKind.SPECULAR_REFLECTION
    assert h.count_kind(reflections) == (events - 2) * h.n_rays
    assert (h.light == h.light[0]).all()
    ledger = energy_ledger(h.raymap)
    assert ledger.killed_by_reason_w["depth"] == ledger.emitted_w == 1.0
    return h


def direction_at_start(h, directions):
    """Which of the given rays each ray is, by its first way."""
    way = h.way[h.first + 1]
    directions = np.asarray(directions, float) / np.linalg.norm(directions, axis=1, keepdims=True)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    return np.argmax(way @ directions.T, axis=1)


@pytest.mark.parametrize(
    ("guide", "turned", "events"),
    [(False, True, MAX_EVENTS), (True, True, MAX_EVENTS), (False, False, 10_000), (True, False, 10_000)],
    ids=["mirror", "light guide", "mirror along axes", "light guide along axes"],
)
def test_a_box(tmp_path, guide, turned, events):
    """In a box every reflection turns one component round: the last place is that of the unfolded straight line, folded
    back, to the grid of stored places after 600 m; and in a guide all cosines stay below the critical one.

    Guards: the length of the direction, brought to 1 at each reflection (`head`): its error would double each time it
    is fed back; `START_OFFSET`: a ray that starts on its facet would meet it again.
    """
    half = np.array([7.0, 5.0, 3.0])
    directions = np.array([[0.61, 0.57, 0.55], [-0.3, 0.7, 0.64], [0.7, -0.11, 0.7], [0.5, 0.62, -0.6]])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert np.abs(directions).max() < math.sqrt(1 - 1 / 1.5**2)  # all reflections are total
    turn = rotation() if turned else np.eye(3)
    start = np.array([0.1, 0.2, 0.3])
    shape = box(-half, half).placed(turn=turn)
    h = trapped(tmp_path, shape, np.tile(turn @ start, (4, 1)), directions @ turn.T, guide=guide, events=events)
    which = direction_at_start(h, directions @ turn.T)
    ways = np.abs(directions[which])
    # how often a component has turned round follows from the number of events; the length from any of them
    place = h.position.reshape(h.n_rays, -1, 3) @ turn
    for ray in range(h.n_rays):
        d = directions[which[ray]]
        # distances to all faces that the unfolded line passes, in order
        faces = []
        for axis in range(3):
            first = (half[axis] - start[axis] if d[axis] > 0 else half[axis] + start[axis]) / ways[ray, axis]
            faces.append(first + np.arange(events) * (2 * half[axis] / ways[ray, axis]))
        along = np.sort(np.concatenate(faces))[: events - 1]
        unfolded = start + along[:, None] * d
        folded = half - np.abs((unfolded + half) % (4 * half) - 2 * half)
        off = np.abs(place[ray, 1:] - folded).max(axis=1)
        assert off.max() <= h.raymap.manifest.grid_mm, (ray, int(off.argmax()), float(off.max()))
