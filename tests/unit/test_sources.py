# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which source a ray comes from, and the light that it starts with; how sources emit is for the tests of physics."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from pydantic import ValidationError

from raymaps import scene as scene_module
from raymaps.compile import compile_scene
from raymaps.ray_numbers import source_of_rays
from raymaps.scene import Scene, load_scene
from raymaps.sources import SOURCES, emitters, quantised
from tests.store.small_scenes import workshop, write_scene


def rays_per_source(scene, first_ray, n_rays):
    return np.bincount(source_of_rays(scene, first_ray, n_rays), minlength=len(scene.sources))


def scene_with(fluxes_w: list[float], rgb: list | None = None) -> Scene:
    sources = {
        f"S{i}": {"kind": "point", "flux_w": flux, "position_mm": [0, 0, 0], "rgb": (rgb or [[1, 1, 1]] * 99)[i]}
        for i, flux in enumerate(fluxes_w)
    }
    return Scene.model_validate({"format": "raymaps-scene", "version": 1, "sources": sources})


def test_every_kind_of_source_can_emit():
    union = get_args(get_args(scene_module.Source)[0])
    assert set(SOURCES) == {kind.model_fields["kind"].default for kind in union}


@pytest.mark.parametrize("fluxes_w", [[1.0], [1.0, 1.0], [3.0, 1.0, 0.5], [1e-9, 1.0], [1e6, 1e-3, 1.0], [0.1] * 37])
@pytest.mark.parametrize("first_ray", [0, 12345, 10**11])
def test_any_run_of_rays_shares_by_flux(fluxes_w, first_ray):
    """To within a few rays, wherever the run starts."""
    expected = np.array(fluxes_w) / np.sum(fluxes_w)
    for n in (100, 4096, 65536):
        counts = rays_per_source(scene_with(fluxes_w), first_ray, n)
        assert counts.sum() == n
        assert np.abs(counts - n * expected).max() < 8


def test_source_is_a_function_of_the_rays_number():
    scene = scene_with([3.0, 1.0, 0.5])
    whole = source_of_rays(scene, 0, 1000)
    assert np.concatenate([source_of_rays(scene, at, 100) for at in range(0, 1000, 100)]).tolist() == whole.tolist()
    assert set(whole) == {0, 1, 2}


def test_flux_scales_without_changing_whose_a_ray_is():
    a, b = scene_with([3.0, 1.0, 0.5]), scene_with([6.0, 2.0, 1.0])
    assert source_of_rays(a, 0, 5000).tolist() == source_of_rays(b, 0, 5000).tolist()


def test_fluxes_whose_sum_overflows_are_refused_or_shared():
    try:
        scene = scene_with([1e308, 1e308])
    except ValidationError:
        return
    assert rays_per_source(scene, 0, 1000) == pytest.approx([500, 500], abs=8)


def test_shares_of_rays_as_set_stand_beside_fluxes():
    """A source without a share of its own counts with its flux in W."""
    scene = scene_with([1.0, 5.0, 2.0])
    sources = scene.sources | {"S1": scene.sources["S1"].model_copy(update={"ray_share": 1.0})}
    counts = rays_per_source(scene.model_copy(update={"sources": sources}), 777, 40_000)
    assert np.abs(counts - [10_000, 10_000, 20_000]).max() < 8


@pytest.mark.parametrize(
    "rgb", [[1, 1, 1], [1, 0, 0], [0, 0, 3], [0.3, 0.2, 0.1], [1e-6, 1, 1], [1e-12, 1, 0], [1e6, 1, 1e-6], [7, 11, 13]]
)
def test_light_at_emission_adds_up_to_exactly_one(rgb):
    shares = np.array([rgb], float) / np.sum(rgb)
    light = quantised(shares)
    assert light.dtype == np.float32
    assert light.astype(np.float64).sum() == 1.0
    assert (light >= 0).all()
    assert light[0] == pytest.approx(shares[0], abs=1e-7)
    assert ((light == 0) >= (shares == 0)).all()


def test_light_of_rgb_is_what_it_has_always_been():
    """Rounded where the bands meet: (1, 1, 1) / 3 in steps of 2^-24."""
    light = quantised(np.array([[1 / 3, 1 / 3, 1 / 3], [0.25, 0.5, 0.25], [0.1, 0.2, 0.7]]))
    assert (light * 2.0**24).tolist() == [
        [5592405, 5592406, 5592405], [4194304, 8388608, 4194304], [1677722, 3355443, 11744051],
    ]  # fmt: skip


@pytest.mark.parametrize("n_bands", [2, 31, 320, 1000])
def test_light_of_many_bands_adds_up_and_loses_none(n_bands):
    rng = np.random.default_rng(n_bands)
    shares = 10.0 ** rng.uniform(-9, 0, (200, n_bands)) * (rng.random((200, n_bands)) < 0.8)
    shares[:, 0] += 1e-9
    shares[0] = 0
    shares[0, n_bands // 2] = 1
    shares /= shares.sum(axis=1, keepdims=True)
    light = quantised(shares).astype(np.float64)
    assert (light.sum(axis=1) == 1).all()
    assert (light >= 0).all()
    assert np.abs(light - shares).max() < n_bands * 2.0**-24
    assert (light[shares >= 2.0**-25] > 0).all()
    assert (light[shares == 0] == 0).all()
    assert np.array_equal(light * 2.0**24, np.round(light * 2.0**24))


def test_emitters_stand_in_the_scenes_order_and_frame(tmp_path):
    compiled = compile_scene(load_scene(write_scene(tmp_path, workshop(tmp_path))))
    made = emitters(compiled)
    assert [emitter.kernel for emitter in made] == ["faces", "point", "point", "disc"]
    position, axis, cosine = made[2].arguments
    assert compiled.frame.to_mm(position) == pytest.approx([0, 1, 0.3])
    assert np.linalg.norm(axis) == pytest.approx(1)
    assert cosine == pytest.approx(1 - np.cos(np.radians(20)))
    assert made[3].arguments[2] * compiled.frame.unit_mm == pytest.approx(2)


def test_faces_emit_by_area_and_never_from_degenerate_triangles(tmp_path):
    compiled = compile_scene(load_scene(write_scene(tmp_path, workshop(tmp_path))))
    _, _, triangles, cumulated, corners = emitters(compiled)[0].arguments
    top = [i for i, (b, f) in enumerate(compiled.names.faces) if (compiled.names.bodies[b], f) == ("Chip", "top")]
    assert set(compiled.tables.triangle_face[triangles]) == set(top)
    assert cumulated.tolist() == [0.5, 1.0]
    assert corners.shape == (2, 3, 3)
