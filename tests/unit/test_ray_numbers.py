# SPDX-License-Identifier: LGPL-2.1-or-later
"""Ranks of rays among those of their source: counted without going through them, as if one went through them."""

from __future__ import annotations

import numpy as np
import pytest

from raymaps.errors import TraceError
from raymaps.ray_numbers import MOST_OF_SOBOL, REPLICATES, n_replicates, ranks, ranks_before, source_of_rays
from raymaps.run import simulate
from raymaps.scene import Scene

FLUXES_W = [[1.0], [1.0, 1.0], [3.0, 1.0, 0.5], [1e-9, 1.0], [1e6, 1e-3, 1.0], [0.1] * 37, [2.0**-60, 1.0, 2.0**-60]]


def scene_with(fluxes_w, **settings):
    sources = {f"S{i}": {"kind": "point", "flux_w": flux, "position_mm": [0, 0, 0]} for i, flux in enumerate(fluxes_w)}
    data = {"format": "raymaps-scene", "version": 1, "sources": sources, "settings": settings}
    return Scene.model_validate(data)


@pytest.mark.parametrize("fluxes_w", FLUXES_W)
def test_rays_before_are_those_that_one_counts(fluxes_w):
    scene = scene_with(fluxes_w)
    source = source_of_rays(scene, 0, 60_000)
    for ray in (0, 1, 2, 3, 10, 987, 4096, 59_999, 60_000):
        assert ranks_before(scene, ray).tolist() == np.bincount(source[:ray], minlength=len(fluxes_w)).tolist()


@pytest.mark.parametrize("fluxes_w", FLUXES_W)
@pytest.mark.parametrize("ray", [10**6 + 7, 2**32 - 5, 10**12 - 10_000, 2**53 + 1])
def test_far_rays_are_counted_on_from_those_before(fluxes_w, ray):
    scene = scene_with(fluxes_w)
    found = ranks_before(scene, ray + 9_999) - ranks_before(scene, ray)
    assert found.tolist() == np.bincount(source_of_rays(scene, ray, 9_999), minlength=len(fluxes_w)).tolist()
    shares = np.array(fluxes_w) / np.sum(fluxes_w)
    assert np.abs(ranks_before(scene, ray) - ray * shares).max() < 30 + ray * 2.0**-50
    assert ranks_before(scene, ray).sum() == ray


@pytest.mark.parametrize("steps", [0, 0.5, 1])
def test_a_border_at_the_place_of_a_ray_is_the_next_sources(steps):
    """The borders of both ways to count agree to the last bit; 2^-53 is the step of places."""
    golden, found = 0x9E3779B97F4A7C15, 0
    for ray in range(200):
        place = ((ray * golden + golden // 2) % 2**64) >> 11
        border = (place + steps) / 2**53
        scene = scene_with([border, 0.5 - border, 0.5]) if border < 0.49 else None
        if scene is None or border * 2**53 != place + steps:  # floats are too coarse
            continue
        found += 1
        assert int(source_of_rays(scene, ray, 1)[0]) == (0 if steps else 1)
        assert ranks_before(scene, ray + 1)[0] - ranks_before(scene, ray)[0] == (1 if steps else 0)
    assert found > 50


@pytest.mark.parametrize("fluxes_w", FLUXES_W)
def test_ranks_do_not_depend_on_portions(fluxes_w):
    scene, n = scene_with(fluxes_w), 5_000
    source = source_of_rays(scene, 0, n)
    expected, so_far = [], [0] * len(fluxes_w)
    for of in source.tolist():
        expected.append(so_far[of])
        so_far[of] += 1
    cuts = [0, 1, 2, 700, 701, 4096, n]
    pieces = [
        ranks(source_of_rays(scene, first, end - first), ranks_before(scene, first))
        for first, end in zip(cuts, cuts[1:], strict=False)
    ]
    assert np.concatenate(pieces).tolist() == expected


def test_rays_are_in_replicates_only_where_they_are_no_independent_samples():
    assert n_replicates(scene_with([1.0])) == 1
    assert n_replicates(scene_with([1.0], sampling="sobol")) == REPLICATES


def test_more_rays_than_there_are_points_are_refused(tmp_path):
    scene = scene_with([1.0], sampling="sobol")
    with pytest.raises(TraceError, match=f"points for {MOST_OF_SOBOL} rays at most: ask for fewer"):
        simulate(scene, tmp_path / "m.raymap", rays=MOST_OF_SOBOL + 1)
    assert not (tmp_path / "m.raymap").exists()
