# SPDX-License-Identifier: LGPL-2.1-or-later
"""Absorption and scattering in media: when a scene calls for them, what is lowered, and the kernels step by step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError

from raymaps.bands import RGB_BANDS, Bands
from raymaps.effects import Lowering, medium_absorption, medium_scattering, needed_effects
from raymaps.effects.medium_scattering import drawn_free_path
from raymaps.errors import SceneError
from raymaps.frame import Frame
from raymaps.kernels import medium_absorption as absorption_kernel
from raymaps.kernels import medium_scattering as scattering_kernel
from raymaps.kernels.random import SCATTER_PLACE, uniforms
from raymaps.kernels.transport import PENDING
from raymaps.kinds import EventKind
from raymaps.materials import Medium
from raymaps.names import Names
from raymaps.scene import Scene
from raymaps.wave import RunKey, Wave
from tests.kernel_types import tables
from tests.physics.scenes import agrees

SCATTERING = int(EventKind.MEDIUM_SCATTERING)
FRAME = Frame(np.zeros(3), 2.0, 2.0**-20)
OPTICAL_DEPTHS = [1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 10.0, 40.0, 800.0, 1e6]


TABLES = tables(plane=[[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 1.0, 1.0]])  # the planes z = 0 and z = 1
KEY = RunKey(np.uint64(5), np.uint64(1000), 0.1)


def wave_of(light, distance, n=None):
    """Rays that fly up from z = 0 to triangle 1, in medium 0."""
    light = np.atleast_2d(np.asarray(light, np.float32))
    n = n or len(light)
    light = np.ascontiguousarray(np.broadcast_to(light, (n, light.shape[1])))
    wave = Wave.allocate(n, light.shape[1])
    wave.direction[:, 2] = 1.0
    wave.distance[:] = distance
    wave.end[:] = wave.direction * float(distance)
    wave.light[:] = light
    wave.triangle[:], wave.hit[:] = -1, 1
    wave.state[:] = PENDING
    return wave


def lowering(*media, bands=RGB_BANDS, frame=FRAME, unused=()):
    names = tuple(f"m{k}" for k in range(len(media)))
    source = {"P": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}}
    bodies = {n: {"geometry": {"file": "a.ply"}, "medium": n, "surface": "polished"} for n in names if n not in unused}
    scene = Scene.model_validate(
        {
            "media": dict(zip(names, media, strict=True)),
            "surfaces": {"polished": {"kind": "fresnel"}},
            "bodies": bodies,
            "sources": source,
        }
    )
    return Lowering(scene, Names((), (), (), names, (), ()), bands, tuple(scene.media.values()), frame)


def scattering(*components, **more):
    parts = [{"coefficient_per_mm": c, **({"phase": p} if p else {})} for c, p in components]
    return {"refractive_index": 1.0, "scattering": parts, **more}


def scattering_data(*coefficients_per_unit):
    """Kernel data of one medium with isotropic components, coefficients in frame units."""
    return medium_scattering.lower(
        lowering(scattering(*((list(np.array(c) / 2), None) for c in coefficients_per_unit)))
    )


def run(wave, data, kernel=scattering_kernel.run, key=KEY, depth=3):
    kernel(np.arange(len(wave.state), dtype=np.int32), wave, TABLES, data, key, depth)
    return wave


# ---------------------------------------------------------------------------------------------- needed, and lowered


def scene_with(medium, **more):
    return Scene.model_validate(
        {
            "media": {"milk": medium, "clear": {"refractive_index": 1.3}},
            "surfaces": {"polished": {"kind": "fresnel"}},
            "bodies": {"Part": {"geometry": {"file": "a.ply"}, "medium": "milk", "surface": "polished"}},
            "sources": {"P": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}},
            **more,
        }
    )


TABLE = {"wavelength_nm": [400, 700], "value": [0.0, 2.0], "outside": "clamp"}
DARK = {"wavelength_nm": [400, 700], "value": [0.0, 0.0], "outside": "clamp"}


@pytest.mark.parametrize(
    ("medium", "needed"),
    [
        ({"refractive_index": 1.3}, False),
        (scattering((0, None)), False),
        (scattering(([0, 0, 0], None), ([0, 0, 1e-9], None)), True),
        (scattering((TABLE, None)), True),
        (scattering((DARK, None)), False),
        (scattering((1, None), extinction=3.0), False),  # light can't travel in a metal
    ],
)
def test_media_call_for_scattering_if_they_scatter(medium, needed):
    because = needed_effects(scene_with(medium)).get("medium_scattering", ())
    assert because == (("medium 'milk' of body 'Part'",) if needed else ())


def test_an_ambient_medium_calls_for_scattering_and_an_unused_one_does_not():
    fog = scattering((0.1, None))
    media = {"milk": {"refractive_index": 1.3}, "fog": fog}
    assert "medium_scattering" not in needed_effects(scene_with({}, media=media))
    because = needed_effects(scene_with({}, media=media, ambient="fog"))["medium_scattering"]
    assert because == ("medium 'fog' of the space around the bodies",)


@pytest.mark.parametrize(
    ("absorption", "needed"), [(0, False), ([0, 0, 1], True), (TABLE, True), (DARK, False)], ids=str
)
def test_media_call_for_absorption_if_they_absorb(absorption, needed):
    medium = {"refractive_index": 1.3, "absorption_per_mm": absorption}
    assert ("medium_absorption" in needed_effects(scene_with(medium))) is needed


def test_scattering_switched_off_is_not_called_for():
    scene = scene_with(scattering((1, None)), settings={"without": ["medium_scattering"]})
    assert "medium_scattering" not in needed_effects(scene)


def test_what_is_lowered():
    """Coefficients per frame unit (2 mm), shares of components, tables one behind the other."""
    table = {"kind": "table", "angle_deg": [0, 90, 180], "value": [2, 1, 1]}
    data = medium_scattering.lower(
        lowering(
            {"refractive_index": 1.0},
            scattering((3, {"kind": "henyey_greenstein", "g": 0.5}), (1, table)),
            scattering(([1, 2, 0], None), ([1, 0, 0], table), (0, None)),
        )
    )
    assert data.mode.tolist() == [0, 1, 2]
    assert data.coefficient.tolist() == [[0, 0, 0], [8, 8, 8], [4, 4, 0]]
    assert data.component_start.tolist() == [0, 0, 2, 5]
    shares = [[0.75] * 3, [0.25] * 3, [0.5, 1, 0], [0.5, 0, 0], [0, 0, 0]]
    assert data.component_share.tolist() == shares
    assert data.g.tolist() == [0.5, 0, 0, 0, 0]
    assert data.table_start.tolist() == [0, 0, 3, 3, 6, 6]
    assert data.angle_rad == pytest.approx([0, math.pi / 2, math.pi] * 2)
    assert data.cumulated[[0, 2, 3, 5]].tolist() == [0, 1, 0, 1]
    # the integral of (2 - 2 t / pi) sin t over the first quarter turn is 2 - 2/pi, that of sin t 1
    assert data.cumulated[1] == pytest.approx((2 - 2 / math.pi) / (3 - 2 / math.pi), rel=1e-14)


def test_coefficients_are_averages_over_bands():
    bands = Bands(np.array([400.0, 500, 532]), np.array([500.0, 600, 532]), True, "x", np.zeros((3, 3)), None)
    value = {"wavelength_nm": [400, 600], "value": [0.0, 2.0]}
    data = medium_scattering.lower(lowering(scattering((value, None)), bands=bands))
    assert data.coefficient[0] == pytest.approx(2 * np.array([0.5, 1.5, 1.32]))
    absorbing = {"refractive_index": 1.0, "absorption_per_mm": value}
    data = medium_absorption.lower(lowering(absorbing, bands=bands))
    assert data.absorption[0] == pytest.approx(2 * np.array([0.5, 1.5, 1.32]))


def test_a_table_that_says_nothing_of_a_band_is_refused():
    bands = Bands(np.array([400.0]), np.array([700.0]), True, "x", np.zeros((1, 3)), None)
    value = {"wavelength_nm": [450, 650], "value": [0.0, 2.0]}
    with pytest.raises(SceneError, match=r"Medium 'm0', scattering 2: .*450 to 650 nm"):
        medium_scattering.lower(lowering(scattering((1, None), (value, None)), bands=bands))


def test_nothing_is_asked_of_media_that_light_does_not_meet():
    bands = Bands(np.array([400.0]), np.array([700.0]), True, "x", np.zeros((1, 3)), None)
    short = scattering(({"wavelength_nm": [450, 650], "value": [0.0, 2.0]}, None))
    metal = {**short, "extinction": 3.0}
    data = medium_scattering.lower(lowering(short, scattering((1, None)), metal, bands=bands, unused=("m0",)))
    assert data.mode.tolist() == [0, 1, 0]
    assert data.component_start.tolist() == [0, 0, 1, 1]


# --------------------------------------------------------------------------------------------------- the model's limits


@pytest.mark.parametrize(
    ("phase", "message"),
    [
        ({"kind": "henyey_greenstein", "g": 1}, "less than 1"),
        ({"kind": "henyey_greenstein", "g": -1}, "greater than -1"),
        ({"kind": "henyey_greenstein", "g": math.nan}, "finite"),
        ({"kind": "mie", "g": 0.5}, "isotropic"),
        (
            {"kind": "table", "angle_deg": [0, 90, 180], "value": [1, 1]},
            "3 angles need as many values of the phase function",
        ),
        ({"kind": "table", "angle_deg": [0, 90], "value": [1, 1]}, "from 0 to 180"),
        ({"kind": "table", "angle_deg": [10, 180], "value": [1, 1]}, "from 0 to 180"),
        ({"kind": "table", "angle_deg": [0, 90, 45, 180], "value": [1, 1, 1, 1]}, "45 follows 90"),
        ({"kind": "table", "angle_deg": [0, 90, 90, 180], "value": [1, 1, 1, 1]}, "90 follows 90"),
        ({"kind": "table", "angle_deg": [0, 3.14159], "value": [1, 1]}, "in degrees"),
        ({"kind": "table", "angle_deg": [0, 180], "value": [0, 0]}, "above 0 somewhere"),
        ({"kind": "table", "angle_deg": [0, 180], "value": [1, -1]}, "greater than or equal to 0"),
        ({"kind": "table", "angle_deg": [0, 180], "value": ["1", 1]}, "number"),
        ({"kind": "table", "angle_deg": [0], "value": [1]}, "at least 2"),
        ({"kind": "table", "angle_deg": [0, 1e-13, 180], "value": [1, 1, 1]}, "closer than"),
    ],
)
def test_phase_functions_that_can_not_be(phase, message):
    with pytest.raises(ValidationError, match=message):
        Medium.model_validate(scattering((1, phase)))


@pytest.mark.parametrize(
    ("coefficient", "message"),
    [
        (-1, "greater than or equal to 0"),
        ([1, 2], "Field required"),
        (math.inf, "finite"),
        (1e13, "above 1e.12"),
        ({"wavelength_nm": [400, 500], "value": [1, -2]}, "greater than or equal to 0"),
        ({"wavelength_nm": [400, 500], "value": [1, 2e12]}, "above 1e.12"),
        ("1/mm", "valid"),
    ],
)
def test_coefficients_that_can_not_be(coefficient, message):
    with pytest.raises(ValidationError, match=message):
        Medium.model_validate(scattering((coefficient, None)))


# ------------------------------------------------------------------------------------------------------- the free path


@pytest.mark.parametrize("depth", OPTICAL_DEPTHS)
@pytest.mark.parametrize("shades", [(1, 1, 1), (1, 0.5, 0), (1, 1e-9, 1e3), (0, 0, 1)], ids=str)
def test_free_paths_of_all_optical_depths(depth, shades):
    """Light keeps its sum; places lie on the way; what has no light gets none; nothing is infinite or NaN."""
    rgb = np.array([0.5, 0.3, 0.2])
    wave = run(wave_of(rgb, 0.25, 20_000), scattering_data(4 * depth * np.array(shades)))
    scattered = wave.state == SCATTERING
    assert np.isfinite(wave.light).all()
    assert (wave.light >= 0).all()
    assert wave.light.sum(axis=1) == pytest.approx(1, abs=3e-7)
    assert (wave.distance > 0).all()
    assert (wave.distance <= 0.25).all()
    assert np.array_equal(wave.end, wave.position + wave.distance[:, None] * wave.direction)
    assert (wave.state[~scattered] == PENDING).all()
    assert (wave.hit[~scattered] == 1).all()
    assert (wave.hit[scattered] == -1).all()
    assert (wave.distance[~scattered] == 0.25).all()
    share = float((rgb * -np.expm1(-depth * np.array(shades))).sum())
    agrees("scattered", scattered.mean(), math.sqrt(share * (1 - share) / 20_000), share, rounding=1e-6)
    assert (wave.light[scattered][:, np.array(shades) == 0] == 0).all()
    if len(set(shades)) == 1:
        assert (wave.light == rgb.astype(np.float32)).all()


def test_tiny_depths_are_not_lost_in_the_steps_of_random_numbers():
    """At an optical depth of 1e-9, far below a step of 2^-32, as many of 2^-32's multiples as are due."""
    n = 200_000
    grey, coloured = (
        sum(
            int((run(wave_of([1, 1, 1], 1.0, n), scattering_data(data), key=KEY._replace(seed=np.uint64(s))).state
                 == SCATTERING).sum())
            for s in range(10)
        )
        for data in ([1e-5] * 3, [2e-5, 1e-5, 0])
    )  # fmt: skip
    agrees("grey", grey, math.sqrt(20), 20)
    agrees("coloured", coloured, math.sqrt(20), 20)
    low = scattering_kernel.fine.py_func(2.0**-33, 0.25)
    assert low == 2.0**-34
    assert scattering_kernel.fine.py_func(1 - 2.0**-33, 1 - 2.0**-33) == 1 - 2.0**-53


@pytest.mark.parametrize("coefficient", [(1.0, 1.0, 1.0), (0.2, 1.0, 5.0), (3.0, 0.0, 1.0), (1e-7, 2e-7, 0.0)], ids=str)
def test_the_kernel_follows_the_reference(coefficient):
    rng = np.random.default_rng(2)
    light = rng.dirichlet((1, 1, 1), 500).astype(np.float32)
    wave = run(wave_of(light, 0.8), scattering_data(coefficient))
    for i in range(len(light)):
        a, b, c, d = uniforms(KEY.seed, KEY.first_ray + np.uint64(i), 3, SCATTER_PLACE)
        u, v = (a - 2.0**-33) + b * 2.0**-32, (c - 2.0**-33) + d * 2.0**-32
        # in mm: a frame unit is 2 mm
        expected = drawn_free_path(light[i].astype(float), np.array(coefficient) / 2, 1.6, u, v)
        assert (wave.state[i] == SCATTERING) == expected.is_scattered
        assert 2 * wave.distance[i] == pytest.approx(expected.distance_mm, rel=1e-9)
        assert wave.light[i] == pytest.approx(expected.light, abs=3e-7)


def test_each_band_has_its_expectation():
    """Band b gets through with l_b exp(-m_b d); what of it is scattered before s is l_b (1 - exp(-m_b s))."""
    rgb, m, d, n = np.array([0.2, 0.3, 0.5]), np.array([0.3, 2.0, 0.0]), 0.9, 400_000
    wave = run(wave_of(rgb, d, n), scattering_data(m))
    scattered = wave.state == SCATTERING
    for what, chosen, expected in (
        ("through", ~scattered, rgb * np.exp(-m * d)),
        ("scattered in the first half", scattered & (wave.distance < d / 2), rgb * -np.expm1(-m * d / 2)),
        ("scattered", scattered, rgb * -np.expm1(-m * d)),
    ):
        light = np.where(chosen[:, None], wave.light, 0.0)
        agrees(what, light.mean(axis=0), light.std(axis=0) / math.sqrt(n), expected)


def test_rays_without_a_way_or_light_stay_as_they_are():
    for kernel_data in (scattering_data([1, 1, 1]), scattering_data([3, 2, 1])):
        wave = run(wave_of([0.5, 0.25, 0.25], 0.0, 100), kernel_data)
        assert (wave.state == PENDING).all()
        assert (wave.light == [0.5, 0.25, 0.25]).all()
        wave = run(wave_of([0.0, 0.0, 0.0], 1.0, 100), kernel_data)
        assert (wave.light == 0).all()


def test_clear_media_take_no_part():
    data = medium_scattering.lower(lowering({"refractive_index": 1.0}, scattering((5, None))))
    wave = wave_of([1, 1, 1], 1.0, 100)
    wave.medium[50:] = 1
    run(wave, data)
    assert (wave.state[:50] == PENDING).all()
    assert (wave.state[50:] == SCATTERING).any()


# ------------------------------------------------------------------------------------------------------- the direction


def test_only_scattered_rays_turn():
    data = scattering_data([1, 1, 1])
    wave = wave_of([1, 1, 1], 1.0, 1000)
    wave.state[::2] = SCATTERING
    wave.state[1] = EventKind.MEDIUM_ABSORPTION
    run(wave, data, scattering_kernel.scatter)
    turned = (wave.direction != [0, 0, 1]).any(axis=1)
    assert turned[::2].all()
    assert not turned[1::2].any()
    assert np.linalg.norm(wave.direction, axis=1) == pytest.approx(1, abs=1e-14)


def test_the_scatterer_is_drawn_by_its_share_of_the_light():
    """Two scatterers ahead and back: each sends l_b times its share of band b's coefficient its way."""
    ahead, back = np.array([1.0, 3.0, 0.0]), np.array([1.0, 1.0, 2.0])
    near = [{"kind": "henyey_greenstein", "g": g} for g in (1 - 1e-9, -1 + 1e-9)]
    data = medium_scattering.lower(lowering(scattering((list(ahead / 2), near[0]), (list(back / 2), near[1]))))
    rgb, n = np.array([0.5, 0.3, 0.2]), 200_000
    wave = wave_of(rgb, 1.0, n)
    wave.state[:] = SCATTERING
    run(wave, data, scattering_kernel.scatter)
    assert wave.light.sum(axis=1) == pytest.approx(1, abs=3e-7)
    for what, chosen, part in (("ahead", wave.direction[:, 2] > 0, ahead), ("back", wave.direction[:, 2] < 0, back)):
        light = np.where(chosen[:, None], wave.light, 0.0)
        expected = rgb * part / (ahead + back)
        agrees(what, light.mean(axis=0), light.std(axis=0) / math.sqrt(n), expected)


def test_scatterers_of_equal_shares_do_not_recolour():
    data = scattering_data([1, 1, 1], [3, 3, 3])
    wave = wave_of([0.5, 0.3, 0.2], 1.0, 1000)
    wave.state[:] = SCATTERING
    run(wave, data, scattering_kernel.scatter)
    assert wave.light == pytest.approx(np.broadcast_to([0.5, 0.3, 0.2], (1000, 3)), abs=1e-7)


# ---------------------------------------------------------------------------------------------- with absorption besides


def test_absorption_and_scattering_are_independent():
    """The nearer of two exponentials ends the way: absorbed are l_b a_b / (a_b + m_b) of what does not get through."""
    a, m, rgb, n, d = np.array([0.5, 1.0, 0.0]), np.array([1.5, 0.2, 1.0]), np.array([0.4, 0.4, 0.2]), 400_000, 1.2
    wave = run(wave_of(rgb, d, n), scattering_data(m))
    medium = {"refractive_index": 1.0, "absorption_per_mm": list(a / 2)}
    run(wave, medium_absorption.lower(lowering(medium)), absorption_kernel.run)
    ended = rgb * -np.expm1(-(a + m) * d)
    for what, chosen, expected in (
        ("scattered", wave.state == SCATTERING, ended * m / (a + m)),
        ("through", wave.state == PENDING, rgb * np.exp(-(a + m) * d)),
    ):
        light = np.where(chosen[:, None], wave.light, 0.0)
        agrees(what, light.mean(axis=0), light.std(axis=0) / math.sqrt(n), expected)
    absorbed = wave.state == EventKind.MEDIUM_ABSORPTION
    share = (ended * a / (a + m)).sum()
    agrees("absorbed", absorbed.mean(), math.sqrt(share * (1 - share) / n), share)
    early = (rgb * a / (a + m) * -np.expm1(-(a + m) * d / 3)).sum()
    agrees("absorbed early", (absorbed & (wave.distance < d / 3)).mean(), math.sqrt(early * (1 - early) / n), early)
    assert (wave.light[absorbed] == 0).all()
