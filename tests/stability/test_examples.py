# SPDX-License-Identifier: LGPL-2.1-or-later
"""A million rays into each of the shipped assemblies: none is lost."""

from pathlib import Path

import pytest

from raymaps.compile import compile_scene
from raymaps.scene import load_scene
from raymaps.trace import Tracer
from tests.stability.long_run import EXAMPLES, losses, trace_and_count

RAYS = 1_000_000
SCENES = sorted(EXAMPLES.glob("*.scene.json"))


def test_there_are_examples(example_scenes):
    assert set(SCENES) == {scene for scene in example_scenes if scene.parent == EXAMPLES}
    assert len(SCENES) >= 2


@pytest.mark.parametrize("scene", SCENES, ids=[scene.name.split(".")[0] for scene in SCENES])
def test_no_ray_of_a_million_is_lost(scene: Path):
    """Not one is killed for a numerical reason, none leaves from within a body.

    Guards: all of what is tested one by one in this folder, with edges, contacts and exact surfaces as a CAD program
    makes them. `python -m tests.stability.long_run --rays 1e8` does the same by hand, with a hundred times as many.
    """
    *_, (done, events, counts, told) = trace_and_count(scene, RAYS, threads=2, seed=1)
    print(f"  {done} rays, {events} events: {dict(counts)}")
    assert done == RAYS
    assert sum(counts.values()) == 0, told


@pytest.mark.parametrize(("seed", "ray"), [(7, 4_247_136), (11, 11_643_323)])
def test_rays_that_were_lost_find_their_way(seed, ray):
    """Two of a hundred million: out of the collimator 2e-6 of the scene behind the rim of its hollow; along the wall of
    that hollow, with more strips of it around than were looked at.

    Guards: a search does not go past an edge behind what it has rejected (`_is_at_edge`); `MAX_PROPOSED`.
    """
    compiled = compile_scene(load_scene(EXAMPLES / "led_collimator.scene.json"))
    found = losses(compiled, Tracer(compiled, seed).trace_portion(ray, 1))
    assert not any(len(rays) for rays in found.values())
