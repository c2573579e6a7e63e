# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays of files and of other maps: drawn by their flux, placed, with the light they have; maps keep them."""

import math

import numpy as np
import pytest

from raymaps.check import check_map
from raymaps.compile import compile_scene
from raymaps.errors import SceneError
from raymaps.formats.ray_file import write_rays
from raymaps.formats.ray_set import RaySet
from raymaps.kinds import EventKind
from raymaps.ray_sets import crossing_rays
from raymaps.run import simulate
from raymaps.scene import load_scene
from raymaps.store import RayMap
from tests.physics.emission import emitted
from tests.physics.scenes import (
    Histories,
    agrees,
    ball,
    body,
    box,
    chi_square_agrees,
    disc,
    disc_source,
    rectangle,
    share_agrees,
    traced,
    unit,
    write_scene,
)

N = 60_000


def some_rays(n=12, **more):
    rng = np.random.default_rng(5)
    power = rng.random(n)
    power[[0, n // 2, n - 1]] = 0
    return RaySet(rng.uniform(-2, 2, (n, 3)), unit(rng.normal(size=(n, 3))), power, **more)


def rays_source(tmp_path, rays, **more):
    write_rays(tmp_path / "rays.parquet", rays)
    return {"kind": "rays", "flux_w": 1, "file": "rays.parquet", **more}


def which(e, rays, source_axes=None, origin=(0, 0, 0)):
    """Which ray of the set each emitted one is; its place and direction must be that ray's."""
    axes = np.eye(3) if source_axes is None else source_axes
    place, way = np.array(origin) + rays.position_mm @ axes, rays.direction @ axes
    distance = ((e.position[:, None] - place) ** 2).sum(axis=2)
    index = distance.argmin(axis=1)
    assert np.abs(e.position - place[index]).max() < 1e-9
    assert np.abs(e.direction - way[index]).max() < 1e-9
    assert np.abs(np.linalg.norm(e.direction, axis=1) - 1).max() < 1e-14
    return index


def test_rays_are_drawn_by_their_flux(tmp_path):
    rays = some_rays()
    e = emitted(tmp_path, {}, N, sources={"S": rays_source(tmp_path, rays)})
    counts = np.bincount(which(e, rays), minlength=12)
    shining = rays.power > 0
    assert (counts[~shining] == 0).all()
    chi_square_agrees("rays", counts[shining], (rays.power / rays.power.sum() * N)[shining])
    assert (e.light.astype(float).sum(axis=1) == 1).all()


def test_rays_of_a_million_are_drawn_evenly(tmp_path):
    """More rays than 32 random bits tell apart well; the second half has thrice the flux."""
    n = 1_000_000
    z = np.linspace(0, 1, n, endpoint=False)
    power = np.where(z < 0.5, 1.0, 3.0).astype(np.float32)
    rays = RaySet(np.stack([0 * z, 0 * z, z], 1).astype(np.float32), np.tile([0, 0, np.float32(1)], (n, 1)), power)
    e = emitted(tmp_path, {}, N, sources={"S": rays_source(tmp_path, rays)})
    counts = np.histogram(e.position[:, 2], 40, (0, 1))[0]
    chi_square_agrees("place", counts, np.repeat([1, 3], 20) * N / 80)


def test_rays_are_placed(tmp_path):
    """The file's z axis along (0, 3, 4), its x axis as near to (0, 1, 0) as can be: along (0, 0.8, -0.6)."""
    rays = some_rays()
    source = rays_source(tmp_path, rays, position_mm=[7, 8, 9], z_axis=[0, 3, 4], x_axis=[0, 1, 0])
    e = emitted(tmp_path, {}, 2000, sources={"S": source})
    z, x = np.array([0, 0.6, 0.8]), np.array([0, 0.8, -0.6])
    which(e, rays, np.stack([x, np.cross(z, x), z]), (7, 8, 9))


def test_directions_are_made_unit_vectors(tmp_path):
    """Files keep them in few digits."""
    rays = RaySet(np.zeros((1, 3)), np.array([[0.6003, 0, 0.8004]]), np.ones(1))
    e = emitted(tmp_path, {}, 10, sources={"S": rays_source(tmp_path, rays)})
    assert np.abs(e.direction - [0.6, 0, 0.8]).max() < 1e-15


# --------------------------------------------------------------------------------------------------- colours


def coloured(n=12):
    rng = np.random.default_rng(6)
    light = rng.random((n, 3)).astype(np.float32)
    light[3] = [0, 2, 0]
    return some_rays(light=light)


def test_rays_have_colours_of_their_own(tmp_path):
    rays = coloured()
    e = emitted(tmp_path, {}, 5000, sources={"S": rays_source(tmp_path, rays)})
    expected = rays.light / rays.light.sum(axis=1, keepdims=True)
    assert np.abs(e.light - expected[which(e, rays)]).max() < 2e-7
    assert (e.light.astype(float).sum(axis=1) == 1).all()


def test_rgb_of_a_source_stands_in_place_of_its_rays_colours(tmp_path):
    e = emitted(tmp_path, {}, 500, sources={"S": rays_source(tmp_path, coloured(), rgb=[1, 3, 0])})
    assert (e.light == [0.25, 0.75, 0]).all()


def test_wavelengths_have_their_colour_without_spectra(tmp_path):
    """Deep red, green and blue light is red, green and blue; infrared is white."""
    nm = np.array([650, 535, 440, 1064.0])
    rays = RaySet(np.diag([1.0, 2, 3, 4])[:, :3], np.tile([0, 0, 1.0], (4, 1)), np.ones(4), wavelength_nm=nm)
    e = emitted(tmp_path, {}, 500, sources={"S": rays_source(tmp_path, rays)})
    index = which(e, rays)
    light = np.array([e.light[index == i][0] for i in range(4)])
    assert light[0, 0] > 0.99
    assert light[1].argmax() == 1
    assert light[2].argmax() == 2
    assert light[3] == pytest.approx([1 / 3] * 3, abs=1e-6)


SPECTRAL = {"kind": "table", "wavelength_nm": [400.0, 700.0], "value": [1.0, 1.0]}
BANDS = {"spectrum": {"from_nm": 400.0, "to_nm": 700.0, "bands": 6}}


def spectral_rays(tmp_path, rays, **more):
    """A scene with a spectral source beside the rays; their light as a map with spectra holds it."""
    other = {"kind": "point", "flux_w": 1, "position_mm": [50, 0, 0], "spectrum": SPECTRAL}
    sources = {"P": other, "S": rays_source(tmp_path, rays, **more)}
    scene = write_scene(tmp_path, {}, sources=sources, settings={**BANDS, "store": "spectral"})
    h = Histories(simulate(scene, tmp_path / "spectral.raymap", rays=4000, seed=1, threads=1))
    mine = h.first[h.ray_source == 1]
    assert h.raymap.bands.low_nm.tolist()[:6] == [400, 450, 500, 550, 600, 650]
    return h.position[mine], h.light[mine]


def at_places(n, **more):
    """Rays along z from places 1 mm apart."""
    return RaySet(np.arange(float(n))[:, None] * [1, 0, 0], np.tile([0, 0, 1.0], (n, 1)), np.ones(n), **more)


def test_rays_of_wavelengths_in_a_spectral_scene(tmp_path):
    """All their light is in a band of its own, and they are narrowed to their wavelength from the start."""
    nm = np.array([410.0, 449.9, 561, 900])
    position, light = spectral_rays(tmp_path, at_places(4, wavelength_nm=nm))
    expected = np.eye(10)[[6, 7, 8, 9]]
    index = np.round(position[:, 0]).astype(int)
    assert np.array_equal(light, expected[index])
    raymap = RayMap.open(tmp_path / "spectral.raymap")
    stored = np.concatenate([portion.ray_wavelength_nm for portion in raymap.portions])
    assert stored[stored > 0] == pytest.approx(nm[index])


def test_rays_of_many_wavelengths_in_a_spectral_scene(tmp_path):
    """They stand for a spectrum: each ray's light is in the band that holds its wavelength."""
    nm = np.linspace(401.0, 699.0, 150)
    position, light = spectral_rays(tmp_path, at_places(150, wavelength_nm=nm))
    assert light.shape[1] == 6
    index = np.round(position[:, 0]).astype(int)
    assert np.array_equal(light.argmax(axis=1), ((nm - 400) // 50).astype(int)[index])
    with pytest.raises(SceneError, match=r"^Source 'S'.*settings\.spectrum"):
        spectral_rays(tmp_path / "beyond", at_places(150, wavelength_nm=nm + 100))


def test_rays_of_wavelengths_break_by_them(tmp_path):
    """Snell's law with the index of each ray's own wavelength, not of its band (Cauchy: n = 1.5 + 0.05 µm² / λ²)."""
    nm = np.array([405.0, 445.0, 690.0])
    slanted = np.tile([0.6, 0, 0.8], (3, 1))
    rays = RaySet(np.array([[0, -2.0, 0], [0, 0, 0], [0, 2, 0]]), slanted, np.ones(3), wavelength_nm=nm)
    glass = {"refractive_index": {"formula": "cauchy", "coefficients": [1.5, 0.05]}}
    other = {"kind": "point", "flux_w": 1e-6, "position_mm": [0, 0, 40], "spectrum": SPECTRAL}
    h = traced(
        tmp_path, {"Block": body(box((-30, -30, 5), (30, 30, 30)), "clear", "glass")}, rays=3000,
        media={"glass": glass}, surfaces={"clear": {"kind": "fresnel"}}, settings=BANDS,
        sources={"S": rays_source(tmp_path, rays), "P": other},
    )  # fmt: skip
    entered = (h.kind == EventKind.FRESNEL_REFRACTION) & (h.number == 1) & (h.ray_source[h.ray] == 0)
    way = unit(h.way[np.flatnonzero(entered) + 1])
    which_ray = np.round(h.position[entered][:, 1] / 2).astype(int) + 1
    index = 1.5 + 0.05 / (nm / 1000) ** 2
    assert np.abs(way[:, 0] - (0.6 / index)[which_ray]).max() < 2e-5
    assert set(which_ray) == {0, 1, 2}


def test_rays_of_spectra_in_a_spectral_scene(tmp_path):
    """Light by band is the integral of the spectrum over it."""
    spectra = (((500.0, 550.0, 600.0), (0.0, 2.0, 0.0)), ((400.0, 450.0, 500.0), (0.0, 1.0, 0.0)))
    rays = at_places(3, spectrum=np.array([1, 0, 1], np.int32), spectra=spectra)
    position, light = spectral_rays(tmp_path, rays)
    expected = np.array([[0, 0, 0.5, 0.5, 0, 0], [0.5, 0.5, 0, 0, 0, 0]])[[1, 0, 1]]
    assert np.abs(light - expected[np.round(position[:, 0]).astype(int)]).max() < 1e-6


def test_rays_of_other_bands_in_a_spectral_scene(tmp_path):
    """A band spreads evenly over those that it covers; a line goes into the one that holds it."""
    bands = np.array([[400.0, 500.0], [532.0, 532.0], [625.0, 675.0]])
    light = np.array([[1, 0, 0], [0, 1, 0], [1, 1, 2]], np.float32)
    position, light = spectral_rays(tmp_path, at_places(3, light=light, bands_nm=bands))
    expected = np.array([[0.5, 0.5, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0.125, 0.125, 0.25, 0, 0.25, 0.25]])
    assert np.abs(light - expected[np.round(position[:, 0]).astype(int)]).max() < 1e-6


def test_rays_of_red_green_and_blue_in_a_spectral_scene(tmp_path):
    """As a source with that rgb: the spectra of the three add up to an even one (Mallett and Yuksel, 2019)."""
    position, light = spectral_rays(tmp_path, at_places(2, light=np.array([[1, 1, 1], [1, 0, 0]], np.float32)))
    white = light[np.round(position[:, 0]) == 0]
    red = light[np.round(position[:, 0]) == 1]
    assert np.abs(white - 1 / 6).max() < 1e-6
    assert (red[:, 4:].sum(axis=1) > 0.8).all()


@pytest.mark.parametrize(
    "colour",
    [
        {"light": np.ones((2, 1), np.float32), "bands_nm": np.array([[650.0, 750]])},
        {"spectrum": np.zeros(2, np.int32), "spectra": (((800.0, 900.0), (1.0, 1.0)),)},
    ],
)
def test_wavelengths_that_are_not_simulated_are_told(tmp_path, colour):
    with pytest.raises(SceneError, match=r"^Source 'S'.*settings\.spectrum"):
        spectral_rays(tmp_path, at_places(2, **colour))
    assert not (tmp_path / "spectral.raymap").exists()
    _, light = spectral_rays(tmp_path, at_places(2, **colour), spectrum=SPECTRAL)
    assert np.abs(light - 1 / 6).max() < 1e-6


# ------------------------------------------------------------------------------------------- maps stand alone


def test_a_map_keeps_the_rays(tmp_path):
    """Without the ray file it is sound, can be resumed, and another file of the same rays makes the same map."""
    rays = coloured()
    sources = {"S": rays_source(tmp_path, rays, position_mm=[1, 2, 3], x_axis=[0, 1, 0])}
    scene = write_scene(tmp_path, {}, sources=sources, settings={"rays": 3000})
    first = simulate(scene, tmp_path / "a.raymap", rays=1000)
    write_rays(tmp_path / "other" / "copy.parquet", rays)
    (tmp_path / "rays.parquet").unlink()
    raymap = RayMap.open(first.path)
    assert compile_scene(raymap.scene).scene_hash == first.manifest.scene_hash
    assert [f.text for f in check_map(first.path) if f.is_fault] == []
    resumed = simulate(raymap.scene, first.path, rays=3000, resume=True)

    again = write_scene(tmp_path / "other", {}, sources={"S": {**sources["S"], "file": "copy.parquet"}})
    whole = simulate(again, tmp_path / "b.raymap", rays=3000)
    assert whole.manifest.scene_hash == first.manifest.scene_hash
    assert whole.content_hash == resumed.content_hash

    moved = RaySet(rays.position_mm + 1e-6, rays.direction.copy(), rays.power.copy(), light=rays.light.copy())
    write_rays(tmp_path / "other" / "copy.parquet", moved)
    assert compile_scene(load_scene(again)).scene_hash != first.manifest.scene_hash


def test_rays_within_a_medium_start_in_it(tmp_path):
    rays = RaySet(np.array([[10, 0, 0.5], [10.5, 0, 0]]), np.tile([0, 0, 1.0], (2, 1)), np.ones(2))
    h = traced(
        tmp_path, {"Ball": body(ball(5).moved(10, 0, 0), "clear", "glass")}, rays=100,
        media={"glass": {"refractive_index": 1.5}}, surfaces={"clear": {"kind": "fresnel"}},
        sources={"S": rays_source(tmp_path, rays)},
    )  # fmt: skip
    assert (h.medium[h.first] == h.index("media", "glass")).all()
    assert h.position[h.first].min(axis=0) == pytest.approx([10, 0, 0], abs=1e-4)


def test_rays_that_all_start_inside_an_opaque_body_are_told(tmp_path):
    """Not those of which some start outside."""
    bodies = {"Housing": body(ball(5), "black")}
    inside = rays_source(tmp_path, at_places(4))
    black = {"black": {"kind": "absorber"}}
    with pytest.raises(SceneError, match=r"^Source 'S' lies inside body 'Housing', which absorbs all light"):
        compile_scene(load_scene(write_scene(tmp_path, bodies, surfaces=black, sources={"S": inside})))
    partly = rays_source(tmp_path, at_places(9))
    compile_scene(load_scene(write_scene(tmp_path, bodies, surfaces=black, sources={"S": partly})))


# --------------------------------------------------------------------------------------------------- crossings


def first_map(tmp_path, **more):
    """A red cone from the left and a blue one from the right through a detector that faces both."""
    cone = {"kind": "cone", "half_angle_deg": 30, "position_mm": [-5, 0, 0], "direction": [0, 0, 1]}
    sources = {
        "Red": {**cone, "flux_w": 3, "rgb": [1, 0, 0]},
        "Blue": {**cone, "flux_w": 1, "rgb": [0, 1, 3], "position_mm": [5, 0, 0]},
    }
    detectors = {"Gate": rectangle((0, 0, 10), 40, 40, normal=[0, 0, -1], x_axis=[0, 1, 0], **more)}
    return traced(tmp_path, {}, rays=N, name="first", sources=sources, detectors=detectors)


def crossings_source(**more):
    return {"kind": "crossings", "flux_w": 4, "map": "first.raymap", "detector": "Gate", **more}


def test_crossings_start_where_they_crossed_with_the_light_they_had(tmp_path):
    h = first_map(tmp_path)
    rays = crossing_rays(h.raymap, "Gate")
    assert len(rays) == N
    e = emitted(tmp_path, {}, N, sources={"S": crossings_source()})
    assert np.abs(e.position[:, 2] - 10).max() < 1e-4
    # back to where they came from: two points
    back = e.position - e.direction * (10 / e.direction[:, 2:])
    red = back[:, 0] < 0
    assert np.abs(np.abs(back[:, 0]) - 5).max() < 1e-3
    assert np.abs(back[:, 1]).max() < 1e-3
    share_agrees("red", red.sum(), N, 0.75)
    assert (e.light[red] == [1, 0, 0]).all()
    assert (e.light[~red] == [0, 0.25, 0.75]).all()


def test_crossings_light_what_lies_behind_as_their_source_would(tmp_path):
    """A detector behind sees flux of the cones by its solid angle (W. Gardner et al.: Solid angle of a rectangle,
    four times the arctangent of the product of half sides over height and the distance to a corner).
    """
    first_map(tmp_path)
    h = traced(
        tmp_path, {}, rays=N, sources={"S": crossings_source()},
        detectors={"Behind": rectangle((-5, 0, 25), 8, 6, normal=[0, 0, -1])},
    )  # fmt: skip
    solid_angle = 4 * math.atan(4 * 3 / (25 * math.sqrt(16 + 9 + 625)))
    mine = (h.light[h.crossing_row] == [1, 0, 0]).all(axis=1)
    cone = 2 * math.pi * (1 - math.cos(math.radians(30)))
    agrees("red", *h.flux_w(h.crossings_per_ray(mine)), 3 * solid_angle / cone, rounding=1e-3)


@pytest.mark.parametrize("store", ["rgb", "spectral"])
def test_crossings_of_a_spectral_map(tmp_path, store):
    """Two sources of two bands each: whole spectra go on as they were, colours as colours."""

    def half(low, high):
        return {"kind": "table", "wavelength_nm": [low, (low + high) / 2, high], "value": [0.0, 1.0, 0.0]}

    sources = {
        "Blue": disc_source((0, 0, 0), (0, 0, 1), 1) | {"spectrum": half(400.0, 500.0)},
        "Red": disc_source((10, 0, 0), (0, 0, 1), 1) | {"spectrum": half(600.0, 700.0)},
    }
    settings = {**BANDS, "store": store}
    gate = {"Gate": rectangle((5, 0, 5), 30, 30, normal=[0, 0, -1])}
    traced(tmp_path, {}, rays=2000, name="first", sources=sources, detectors=gate, settings=settings)
    other = {"kind": "point", "flux_w": 1, "position_mm": [50, 0, 0], "spectrum": SPECTRAL}
    h = traced(
        tmp_path, {}, rays=2000, name="second", sources={"S": crossings_source(), "P": other},
        settings={**BANDS, "store": "spectral"},
    )  # fmt: skip
    mine = h.first[h.ray_source == 0]
    red = h.position[mine, 0] > 5
    light = h.light[mine]
    share_agrees("red", red.sum(), len(mine), 0.5)
    if store == "spectral":
        assert np.abs(light[red] - [0, 0, 0, 0, 0.5, 0.5]).max() < 1e-6
        assert np.abs(light[~red] - [0.5, 0.5, 0, 0, 0, 0]).max() < 1e-6
    else:
        assert (light[red][:, 4:].sum(axis=1) > 0.7).all()
        assert (light[~red][:, :2].sum(axis=1) > 0.7).all()
    plain = emitted(tmp_path, {}, 500, sources={"S": crossings_source()})
    red = plain.position[:, 0] > 5
    if store == "spectral":  # rays that have spectra call for spectra
        middle = plain.light.shape[1] // 2
        assert middle > 2
        assert (plain.light[red][:, middle:].sum(axis=1) > 0.999).all()
        assert (plain.light[~red][:, :middle].sum(axis=1) > 0.999).all()
    else:
        assert (plain.light[red][:, 0] > 0.9).all()
        assert (plain.light[~red][:, 2] > 0.5).all()


def test_only_registered_crossings_are_emitted(tmp_path):
    """An acceptance angle of 10 degrees cuts the cones: by their solid angles."""
    h = first_map(tmp_path, max_angle_deg=10)
    rays = crossing_rays(h.raymap, "Gate")
    share_agrees("rays", len(rays), N, (1 - math.cos(math.radians(10))) / (1 - math.cos(math.radians(30))))
    assert rays.direction[:, 2].min() > math.cos(math.radians(10.001))


def test_crossings_carry_what_losses_left(tmp_path):
    """A mirror of reflectance 0.25 on the way leaves red light a quarter of its flux."""
    h = traced(
        tmp_path, {"Mirror": body(disc(8.0), "mirror")}, rays=20_000, name="first",
        surfaces={"mirror": {"kind": "mirror", "reflectance": 0.25}},
        sources={
            "Mirrored": disc_source((0, 0, 5), (0, 0, -1), 1, rgb=(1, 0, 0)),
            "Straight": disc_source((20, 0, -5), (0, 0, 1), 1, rgb=(0, 0, 1)),
        },
        detectors={"Gate": rectangle((0, 0, 8), 60, 10, normal=[0, 0, -1])},
        settings={"roulette_threshold": 0.0},
    )  # fmt: skip
    rays = crossing_rays(h.raymap, "Gate")
    by_colour = rays.power @ (rays.light / rays.light.sum(axis=1, keepdims=True))
    assert by_colour[1] == 0
    assert by_colour[0] / by_colour[2] == pytest.approx(0.25, rel=1e-3)
    assert np.abs(rays.direction - [0, 0, 1]).max() < 1e-4


def test_crossings_inside_a_tinted_medium_have_the_colour_that_light_has_there(tmp_path):
    """By Beer and Lambert exp(-a d) of each band is left 1 mm deep; the segment through the gate starts outside it."""
    per_mm = np.array([0.0, 1.0, 5.0])
    h = traced(
        tmp_path, {"Pool": body(box((-5, -5, -4), (5, 5, 0)), "open", "tinted")}, rays=N, name="first",
        sources={"S": disc_source((0, 0, 5), (0, 0, -1), 0.1)}, surfaces={"open": {"kind": "fresnel"}},
        media={"tinted": {"refractive_index": 1, "absorption_per_mm": per_mm.tolist()}},
        detectors={"Gate": rectangle((0, 0, -1), 4, 4)},
    )  # fmt: skip
    rays = crossing_rays(h.raymap, "Gate")
    assert rays.light is not None
    assert rays.light.dtype == np.float32
    left = np.exp(-per_mm) / 3
    assert rays.light / rays.light.sum(axis=1, keepdims=True) == pytest.approx(
        np.broadcast_to(left / left.sum(), rays.light.shape), rel=1e-5
    )


def test_map_of_crossings_stands_alone(tmp_path):
    h = first_map(tmp_path)
    scene = write_scene(tmp_path, {}, name="second", sources={"S": crossings_source()})
    second = simulate(scene, tmp_path / "second.raymap", rays=1000)
    h.raymap.path.rename(tmp_path / "gone.raymap")
    raymap = RayMap.open(second.path)
    assert raymap.scene.sources["S"].kind == "rays"
    assert compile_scene(raymap.scene).scene_hash == second.manifest.scene_hash
    assert [f.text for f in check_map(second.path) if f.is_fault] == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"detector": "Gat"}, "unknown detector 'Gat'; known: 'Gate'"),
        ({"map": "first.scene.json"}, "is not a Ray Map"),
        ({"detector": "Missed"}, "has registered no ray"),
        ({"detector": "Sky"}, "is no rectangle"),
    ],
)
def test_crossings_that_can_not_be_emitted_are_told(tmp_path, change, words):
    detectors = {
        "Gate": rectangle((0, 0, 10), 4, 4), "Missed": rectangle((0, 0, -10), 4, 4), "Sky": {"kind": "far_field"},
    }  # fmt: skip
    detectors = {k: v for k, v in detectors.items() if k in ("Gate", change.get("detector"))}
    traced(
        tmp_path, {}, rays=100, name="first", sources={"S": disc_source((0, 0, 0), (0, 0, 1), 1)}, detectors=detectors
    )
    scene = load_scene(write_scene(tmp_path, {}, name="second", sources={"S": crossings_source(**change)}))
    with pytest.raises(SceneError, match=r"^Source 'S'.*" + words):
        compile_scene(scene)


# ------------------------------------------------------------------------------------------------------ shares


def test_shares_of_rays_change_no_flux(tmp_path):
    """Two beams on two detectors: whatever their shares of the rays, each detector has its beam's flux."""

    def run(**shares):
        sources = {
            name: disc_source((20 * k, 0, 0), (0, 0, 1), 1, flux_w=flux) | {"ray_share": shares.get(name)}
            for k, (name, flux) in enumerate({"A": 2.0, "B": 0.5}.items())
        }
        detectors = {n: rectangle((20 * k, 0, 5), 6, 6, normal=[0, 0, -1]) for k, n in enumerate("AB")}
        h = traced(tmp_path, {}, rays=4000, name=f"s{len(shares)}", sources=sources, detectors=detectors)
        flux = [h.flux_w(h.crossings_per_ray(h.through(name)))[0] for name in "AB"]
        return h.raymap.rays_of_source / 4000, flux

    share, flux = run()
    assert share == pytest.approx([0.8, 0.2], abs=2e-3)
    assert flux == pytest.approx([2, 0.5], rel=1e-9)
    share, flux = run(A=1.0, B=3.0)
    assert share == pytest.approx([0.25, 0.75], abs=2e-3)
    assert flux == pytest.approx([2, 0.5], rel=1e-9)
    share, flux = run(B=2.0)
    assert share == pytest.approx([0.5, 0.5], abs=2e-3)
