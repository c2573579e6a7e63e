# SPDX-License-Identifier: LGPL-2.1-or-later
"""Smooth metals: Fresnel's equations with a complex index."""

import cmath
import math

import numpy as np
import pytest

from raymaps.effects.conductor import metal_reflectance
from raymaps.effects.fresnel import fresnel_reflectance
from raymaps.kernels import reflectance
from raymaps.kinds import EventKind, SurfaceKind
from tests.physics.scenes import agrees, body, box, disc_source, traced, unit
from tests.physics.surface_bench import lines, lowered, meet, scene_with

ANGLES_DEG = [0.0, 20.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0, 89.9]
#: Index n + ik at 589.3 nm and the reflectance at normal incidence in air: M. Born, E. Wolf: Principles of Optics, 7th
#: ed., table 14.1.
BORN_WOLF = {"silver": (0.20, 3.44, 0.94), "gold": (0.47, 2.83, 0.82), "copper": (0.62, 2.57, 0.73)}
#: Aluminium at 2.0, 2.2 and 2.4 eV: n, k, reflectance at normal incidence in vacuum. CRC Handbook of Chemistry and
#: Physics, optical properties of selected elements (J. Weaver, H. Frederikse).
ALUMINIUM = [(1.304, 7.479, 0.9148), (1.018, 6.846, 0.9200), (0.826, 6.283, 0.9228)]


def closed_form(angle_rad, n_i, index):
    """Born & Wolf, section 1.5.2, eq. 21, with the complex angle of refraction of section 14.2, eq. 1."""
    t = cmath.asin(n_i * math.sin(angle_rad) / index)
    if angle_rad < 1e-6:
        return abs((index - n_i) / (index + n_i)) ** 2
    r_p = cmath.tan(angle_rad - t) / cmath.tan(angle_rad + t)
    r_s = cmath.sin(angle_rad - t) / cmath.sin(angle_rad + t)
    return 0.5 * (abs(r_p) ** 2 + abs(r_s) ** 2)


@pytest.mark.parametrize(("n", "k", "published"), [*BORN_WOLF.values(), *ALUMINIUM])
def test_normal_incidence_of_published_metals(n, k, published):
    digits = 0.005 if round(published, 2) == published else 0.00011
    assert metal_reflectance(1.0, 1.0, n, k) == pytest.approx(published, abs=digits + 1e-9)
    assert reflectance.of_metal(1.0, 1.0, n, k) == pytest.approx(published, abs=digits + 1e-9)


@pytest.mark.parametrize("n_i", [1.0, 1.333, 1.8])
@pytest.mark.parametrize(("n", "k"), [(0.05, 4.2), (0.47, 2.83), (1.304, 7.479), (3.2, 3.3), (4.0, 0.02), (0.0, 1.5)])
def test_kernel_reference_and_closed_form_over_the_angle(n, k, n_i):
    for degrees in ANGLES_DEG:
        angle = math.radians(degrees)
        expected = closed_form(angle, n_i, complex(n, k))
        assert metal_reflectance(math.cos(angle), n_i, n, k) == pytest.approx(expected, abs=1e-9)
        assert reflectance.of_metal(math.cos(angle), n_i, n, k) == pytest.approx(expected, abs=1e-9)


def test_without_extinction_it_is_an_interface_of_clear_media():
    cos = np.cos(np.radians(ANGLES_DEG))
    for n_i, n in ((1.0, 1.5), (1.5, 1.0), (1.33, 1.33)):
        expected = fresnel_reflectance(cos, n_i, n)
        assert metal_reflectance(cos, n_i, n, 0.0) == pytest.approx(expected, abs=1e-12)
        assert [reflectance.of_metal(c, n_i, n, 0.0) for c in cos] == pytest.approx(expected, abs=1e-12)


def test_limits():
    """Nothing is absorbed at grazing incidence, nor by a metal without a real part of the index."""
    assert metal_reflectance(0.0, 1.0, 1.3, 7.5) == pytest.approx(1)
    assert metal_reflectance(np.linspace(0, 1, 11), 1.2, 0.0, 3.0) == pytest.approx(1, abs=1e-12)
    assert reflectance.of_metal(0.3, 1.2, 0.0, 3.0) == pytest.approx(1, abs=1e-12)


def test_metal_takes_over_from_the_interface_and_clear_media_stay_with_it():
    metal = {"inside": {"refractive_index": 0.5, "extinction": [3.0, 1.0, 0.5]}}
    data = lowered("conductor", scene_with({"kind": "fresnel"}, metal))
    assert data.is_conductor.tolist() == [False, True]
    met = meet("conductor", data, 0.7, 1000, kind=SurfaceKind.FRESNEL, threshold=0.0)
    expected = [closed_form(0.7, 1.0, complex(0.5, k)) for k in (3.0, 1.0, 0.5)]
    assert (met.kind == EventKind.FRESNEL_REFLECTION).all()
    assert met.light == pytest.approx(np.tile(np.array([0.5, 0.3, 0.2]) * expected, (1000, 1)), rel=1e-6)
    assert met.direction == pytest.approx(np.tile([math.sin(0.7), 0, math.cos(0.7)], (1000, 1)), abs=1e-12)
    assert (met.side == 1).all()
    assert (met.medium == 0).all()
    outside = meet("conductor", data, 0.7, 10, kind=SurfaceKind.FRESNEL, media=(1, 0))
    assert (outside.kind == 255).all()  # left to the interface of clear media


def test_index_of_each_line():
    """At a laser line n and k are those of the table there."""
    metal = {
        "inside": {
            "refractive_index": {"wavelength_nm": [400, 800], "n": [0.2, 1.0]},
            "extinction": {"wavelength_nm": [400, 800], "value": [2.0, 8.0]},
        }
    }
    data = lowered("conductor", scene_with({"kind": "fresnel"}, metal), lines(500, 700))
    assert data.n[1] == pytest.approx([0.4, 0.8])
    assert data.k[1] == pytest.approx([3.5, 6.5])


@pytest.mark.parametrize("ambient", [1.0, 1.333])
def test_beams_onto_a_metal_block(tmp_path, ambient):
    """What is not reflected is absorbed by the body, band by band, at 0, 60, 70 and 80 degrees."""
    angles = np.radians([0.0, 60.0, 70.0, 80.0])
    k = (3.44, 2.83, 1.2)
    sources, rgb = {}, np.array([0.5, 0.3, 0.2])
    for i, angle in enumerate(angles):
        direction = unit(np.array([math.sin(angle), 0.0, -math.cos(angle)]))
        sources[f"S{i}"] = disc_source(-10 * direction, direction, 0.01, rgb=tuple(rgb))
    h = traced(
        tmp_path,
        {"Block": body(box((-200, -200, -100), (200, 200, 0)), "polished", "metal")},
        rays=100_000,
        sources=sources,
        ambient="around",
        media={"metal": {"refractive_index": 0.47, "extinction": list(k)}, "around": {"refractive_index": ambient}},
        surfaces={"polished": {"kind": "fresnel"}},
        settings={"roulette_threshold": 0.9},
    )
    first = h.first + 1
    assert set(np.unique(h.kind[first])) == {EventKind.FRESNEL_REFLECTION, EventKind.ABSORPTION}
    for i, angle in enumerate(angles):
        mine = h.ray_source == i
        light = h.light[first[mine]]
        expected = rgb * [closed_form(angle, ambient, complex(0.47, b)) for b in k]
        stderr = light.std(axis=0, ddof=1) / math.sqrt(mine.sum())
        agrees(f"reflected at {math.degrees(angle):.0f} degrees", light.mean(axis=0), stderr, expected)
    assert h.on_body("Block")[first].all()
