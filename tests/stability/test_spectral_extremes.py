# SPDX-License-Identifier: LGPL-2.1-or-later
"""Spectral light at its limits: one band and a thousand, lines by the hundred, far infrared, tables that just reach."""

from __future__ import annotations

import math

import numpy as np
import pytest

from raymaps.errors import SceneError
from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from tests.physics.scenes import Histories, agrees, body, box, disc_source, share_agrees, traced

D65 = {"kind": "illuminant", "name": "D65"}
BK7 = {
    "formula": "sellmeier",
    "coefficients": [1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653],
}
SURFACES = {"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}}


def window(
    folder, light, index, *, absorption=0.0, rays=20_000, tilt_deg=0.0, store="spectral", name="scene", **settings
) -> Histories:
    """A beam through a plane window 5 mm thick."""
    tilt = math.radians(tilt_deg)
    direction = np.array([math.sin(tilt), 0, math.cos(tilt)])
    return traced(
        folder,
        {"Window": body(box((-30, -30, 0), (30, 30, 5)), "polished", "glass")},
        rays=rays,
        name=name,
        media={"glass": {"refractive_index": index, "absorption_per_mm": absorption}},
        surfaces=SURFACES,
        sources={"S": {**disc_source(-10 * direction, direction, 1), "spectrum": light}},
        settings={"store": store, **settings},
    )


def wavelengths(h: Histories) -> np.ndarray:
    return np.concatenate([p.ray_wavelength_nm for p in h.raymap.portions]).astype(float)


def through(h: Histories) -> np.ndarray:
    """Rays that leave upwards."""
    return (h.kind[h.last] == EventKind.LEFT) & (h.way[h.last, 2] > 0)


def assert_sound(h: Histories) -> None:
    """Nothing lost, nothing stuck, every figure finite."""
    ledger = energy_ledger(h.raymap)
    assert ledger.killed_w == 0
    assert ledger.absorbed_w + ledger.escaped_w == pytest.approx(1, rel=1e-9)
    for portion in h.raymap.portions:
        assert np.isfinite(portion.lights.values).all()
        assert np.isfinite(portion.lights.shown).all()
        assert np.isfinite(portion.position_mm).all()
        assert portion.content() == portion.summary.content


# ---------------------------------------------------------------------------------------------------------------------
# How many bands


@pytest.mark.parametrize("store", ["rgb", "spectral"])
@pytest.mark.parametrize("n", [1, 2, 999, 1000])
def test_as_few_and_as_many_bands_as_there_may_be(tmp_path, n, store):
    """(1 - R) / (1 + R) gets through whatever the bands, R being that of N-BK7 to within its dispersion."""
    h = window(tmp_path, D65, BK7, rays=3_000, store=store, spectrum={"bands": n})
    assert h.raymap.bands.n == n
    assert_sound(h)
    assert ((wavelengths(h) >= 380) & (wavelengths(h) <= 780)).all()
    r = (0.518 / 2.518) ** 2
    share_agrees("through", through(h).sum(), h.n_rays, (1 - r) / (1 + r))


def test_more_bands_than_a_thousand_are_refused(tmp_path):
    for n in (0, 1001, -3):
        with pytest.raises(SceneError, match="bands"):
            window(tmp_path, D65, BK7, spectrum={"bands": n}, name=f"n{n}")


def test_a_single_wavelength_alone(tmp_path):
    h = window(tmp_path, {"kind": "lines", "wavelength_nm": [589.3]}, BK7, rays=2_000)
    assert h.raymap.bands.n == 1
    assert (wavelengths(h) == np.float32(589.3)).all()
    assert_sound(h)


@pytest.mark.parametrize("store", ["rgb", "spectral"])
def test_three_hundred_lines(tmp_path, store):
    nm = [380.0 + 1.25 * k for k in range(300)]
    share = [1.0 + (k % 7) for k in range(300)]
    h = window(tmp_path, {"kind": "lines", "wavelength_nm": nm, "share": share}, BK7, rays=30_000, store=store)
    assert h.raymap.bands.n == 300
    assert_sound(h)
    counts = np.array([(wavelengths(h) == np.float32(one)).sum() for one in nm])
    assert counts.sum() == h.n_rays
    share_agrees("lines", counts, h.n_rays, np.array(share) / sum(share))


def test_lines_of_a_comb_and_as_many_bands_beside(tmp_path):
    """A thousand bands and a thousand lines; more than two thousand in all are refused in one sentence."""

    def scene(n_lines: int, name: str) -> Histories:
        nm = [400.0 + 0.25 * k for k in range(n_lines)]
        return traced(
            tmp_path,
            {},
            rays=200,
            name=name,
            sources={
                "Comb": {**disc_source((0, 0, 0), (0, 0, 1), 1), "spectrum": {"kind": "lines", "wavelength_nm": nm}},
                "Lamp": {**disc_source((0, 0, 0), (0, 0, 1), 1), "spectrum": D65},
            },
            settings={"store": "spectral", "spectrum": {"bands": 1000}},
        )

    h = scene(1000, "most")
    assert h.raymap.bands.n == 2000
    assert h.light[h.first].sum(axis=1) == pytest.approx(1, abs=1e-6)
    with pytest.raises(SceneError, match=r"1000 bands and 1001 single wavelengths.*2000") as error:
        scene(1001, "too many")
    assert "\n" not in str(error.value)


def test_lines_closer_than_float32_tells_apart(tmp_path):
    nm = [589.0, np.nextafter(589.0, 600), 589.0 + 1e-9]
    nm.sort()
    h = window(tmp_path, {"kind": "lines", "wavelength_nm": nm}, BK7, rays=300)
    assert h.raymap.bands.n == 3
    assert_sound(h)


@pytest.mark.parametrize("width_nm", [1e-9, 0.01])
def test_a_range_of_almost_no_width(tmp_path, width_nm):
    h = window(tmp_path, D65, BK7, rays=2_000, spectrum={"from_nm": 550.0, "to_nm": 550.0 + width_nm, "bands": 4})
    assert h.raymap.bands.n == 4
    assert np.abs(wavelengths(h) - 550).max() < width_nm + 1e-4
    assert_sound(h)


# ---------------------------------------------------------------------------------------------------------------------
# Spectra


def test_a_spike_a_hundredth_of_a_nanometre_wide(tmp_path):
    """All light in it: every ray is narrowed to it, and its refraction is that of its wavelength."""
    spike = {"kind": "table", "wavelength_nm": [546.069, 546.074, 546.079], "value": [0, 1, 0]}
    h = window(tmp_path, spike, BK7, rays=3_000, tilt_deg=60)
    assert h.raymap.bands.n == 1
    assert np.abs(wavelengths(h) - 546.074).max() < 0.0051
    refracted = h.first[h.kind[h.first + 1] == EventKind.FRESNEL_REFRACTION] + 2
    sine = h.way[refracted, 0] / np.linalg.norm(h.way[refracted], axis=1)
    assert np.median(math.sin(math.radians(60)) / sine) == pytest.approx(1.51872, abs=6e-5)  # SCHOTT, n_e


def test_spectra_with_zeros(tmp_path):
    """Dark bands in the middle have no light, no rays, and no wavelengths."""
    holes = {"kind": "table", "wavelength_nm": [400, 450, 451, 600, 601, 700], "value": [1, 1, 0, 0, 1, 1]}
    h = window(tmp_path, holes, BK7, spectrum={"bands": 400})
    nm = wavelengths(h)
    assert not ((nm > 451) & (nm < 600)).any()
    assert h.raymap.bands.n == 51 + 100
    share_agrees("blue", (nm < 500).sum(), h.n_rays, 50.5 / 150)
    assert_sound(h)


def test_very_weak_bands_are_neither_lost_nor_too_strong(tmp_path):
    """A black body of 1000 K in the visible: from blue to red its light climbs by more than a million."""
    h = window(tmp_path, {"kind": "black_body", "temperature_k": 1000}, BK7, rays=20_000)
    light = h.light[h.first[0]]
    assert 0 < light[light > 0].min() < 1e-6
    assert light.sum() == 1
    assert_sound(h)


def test_a_hot_black_body_far_in_the_ultraviolet(tmp_path):
    h = window(
        tmp_path, {"kind": "black_body", "temperature_k": 100_000}, 1.5, rays=200, spectrum={"from_nm": 10, "to_nm": 50}
    )
    assert_sound(h)


@pytest.mark.parametrize("scale", [1e-307, 1e307])
def test_the_scale_of_a_spectrum_does_not_matter(tmp_path, scale):
    table = {"kind": "table", "wavelength_nm": [400, 500, 700], "value": [scale, scale / 2, scale]}
    h = window(tmp_path, table, BK7, rays=500)
    plain = window(tmp_path, {**table, "value": [1, 0.5, 1]}, BK7, rays=500, name="plain")
    assert np.array_equal(h.light, plain.light)
    assert wavelengths(h) == pytest.approx(wavelengths(plain), rel=1e-7)
    assert_sound(h)


# ---------------------------------------------------------------------------------------------------------------------
# Far from the visible


def test_a_carbon_dioxide_laser_through_zinc_selenide(tmp_path):
    """n = 2.4028 at 10.6 µm (II-VI Infrared's data sheet of ZnSe): by a table of its own."""
    zinc_selenide = {
        "wavelength_nm": [8000, 9000, 10000, 10600, 11000, 12000],
        "n": [2.4173, 2.4122, 2.4065, 2.4028, 2.4001, 2.3930],
    }
    h = window(tmp_path, {"kind": "lines", "wavelength_nm": [10600]}, zinc_selenide, tilt_deg=60, absorption=0.00005)
    assert_sound(h)
    refracted = h.first[h.kind[h.first + 1] == EventKind.FRESNEL_REFRACTION] + 2
    sine = h.way[refracted, 0] / np.linalg.norm(h.way[refracted], axis=1)
    assert math.sin(math.radians(60)) / np.median(sine) == pytest.approx(2.4028, abs=1e-4)  # of the grid of places
    assert (h.raymap.bands.lumen_per_w == 0).all()
    lit = h.light.sum(axis=1) > 0
    shown = np.concatenate([p.shown_light for p in h.raymap.portions])
    assert (shown[lit].max(axis=1) > 0).all()


def test_visible_light_and_a_far_infrared_laser_in_one_scene(tmp_path):
    """The index of germanium would be asked for at 500 nm; that of a clear medium is known at both."""
    h = traced(
        tmp_path,
        {"Window": body(box((-30, -30, 0), (30, 30, 5)), "polished", "clear")},
        rays=10_000,
        media={"clear": {"refractive_index": {"wavelength_nm": [400, 12000], "n": [1.6, 1.4], "outside": "clamp"}}},
        surfaces=SURFACES,
        sources={
            "Far": {**disc_source((0, 0, -5), (0, 0, 1), 1), "spectrum": {"kind": "lines", "wavelength_nm": [10600]}},
            "Near": {**disc_source((0, 0, -5), (0, 0, 1), 1), "spectrum": D65},
        },
        settings={"store": "spectral"},
    )
    nm = wavelengths(h)
    assert (nm[h.ray_source == 0] == 10600).all()
    assert (nm[h.ray_source == 1] < 781).all()
    for k, n in ((0, 1.6 - 0.2 * 10200 / 11600), (1, 1.5971)):
        r = ((n - 1) / (n + 1)) ** 2
        mine = h.ray_source == k
        share_agrees(f"source {k}", through(h)[mine].sum(), mine.sum(), (1 - r) / (1 + r))


@pytest.mark.parametrize(("low", "high"), [(10, 20), (900_000, 1_000_000), (10, 1_000_000)])
def test_from_the_shortest_to_the_longest_wavelength(tmp_path, low, high):
    flat = {"kind": "table", "wavelength_nm": [10, 1e6], "value": [1, 1]}
    index = {"wavelength_nm": [10, 1e6], "n": [1.5, 1.4]}
    h = window(tmp_path, flat, index, rays=1_000, spectrum={"from_nm": low, "to_nm": high})
    nm = wavelengths(h)
    assert ((nm >= low) & (nm <= high)).all()
    assert nm.mean() == pytest.approx((low + high) / 2, abs=5 * (high - low) / math.sqrt(12 * 1_000))
    assert_sound(h)


# ---------------------------------------------------------------------------------------------------------------------
# Indices and tables


def test_an_index_of_exactly_one_reflects_nothing(tmp_path):
    """Even as a table: light is narrowed, and goes straight on."""
    h = window(tmp_path, D65, {"wavelength_nm": [380, 780], "n": [1.0, 1.0]}, tilt_deg=45, rays=2_000)
    assert h.count_kind(EventKind.FRESNEL_REFLECTION) == 0
    assert through(h).all()
    way = h.way[h.first + 2]
    assert way[:, 0] / np.linalg.norm(way, axis=1) == pytest.approx(math.sqrt(0.5), abs=1e-5)


def test_an_index_that_crosses_one(tmp_path):
    """Between 0.9 and 1.1, at grazing incidence: total reflection for one half of the spectrum only."""
    h = window(
        tmp_path,
        {"kind": "table", "wavelength_nm": [380, 780], "value": [1, 1]},
        {"wavelength_nm": [380, 780], "n": [0.9, 1.1]},
        tilt_deg=75,
    )
    nm = wavelengths(h)
    sine = math.sin(math.radians(75))
    border = 380 + 400 * (sine - 0.9) / 0.2
    refracted = h.kind[h.first + 1] == EventKind.FRESNEL_REFRACTION
    assert nm[refracted].min() > border - 0.01
    assert nm[refracted].min() < border + 1
    assert_sound(h)


@pytest.mark.parametrize("n_bands", [1, 7, 32, 1000])
def test_an_index_that_is_known_just_as_far_as_light_is_simulated(tmp_path, n_bands):
    """Refracted by the table right up to its borders: linear between its points, nothing made up beyond."""
    index = {"wavelength_nm": [500, 510], "n": [1.3, 1.8]}
    even = {"kind": "table", "wavelength_nm": [500, 510], "value": [1, 1]}
    h = window(
        tmp_path, even, index, tilt_deg=40, rays=5_000, spectrum={"from_nm": 500, "to_nm": 510, "bands": n_bands}
    )
    refracted = np.flatnonzero(h.kind[h.first + 1] == EventKind.FRESNEL_REFRACTION)
    way = h.way[h.first[refracted] + 2]
    n = math.sin(math.radians(40)) / (way[:, 0] / np.linalg.norm(way, axis=1))
    nm = wavelengths(h)[refracted]
    assert np.ptp(nm) > 9.9
    assert np.abs(n - (1.3 + 0.05 * (nm - 500))).max() < 1e-4  # of the grid of places


@pytest.mark.parametrize("border", [(380.0000001, 780.0), (380.0, 779.9)])
def test_an_index_that_is_known_not_quite_as_far_is_refused(tmp_path, border):
    index = {"wavelength_nm": list(border), "n": [1.5, 1.5]}
    with pytest.raises(SceneError, match=r"'glass'.*380 to 780 nm is simulated") as error:
        window(tmp_path, D65, index)
    assert "\n" not in str(error.value)


def test_tables_of_one_entry_are_enough_for_a_single_wavelength(tmp_path):
    """(1 - R)² e / (1 - R² e²), Born & Wolf, section 7.6.1, with R of n = 1.6 and e = exp(-0.1 * 5)."""
    absorption = {"wavelength_nm": [532], "value": [0.1]}
    h = window(
        tmp_path, {"kind": "lines", "wavelength_nm": [532]}, {"wavelength_nm": [532], "n": [1.6]}, absorption=absorption
    )
    r, e = (0.6 / 2.6) ** 2, math.exp(-0.5)
    share_agrees("through", through(h).sum(), h.n_rays, (1 - r) ** 2 * e / (1 - (r * e) ** 2))
    with pytest.raises(SceneError, match="from 532 to 532 nm"):
        window(tmp_path, D65, 1.5, absorption=absorption, name="white")


def test_a_formula_right_up_to_where_it_ends(tmp_path):
    """A formula that is given for 400 to 700 nm, and light just there."""
    formula = {**BK7, "from_nm": 400, "to_nm": 700}
    h = window(tmp_path, D65, formula, rays=2_000, spectrum={"from_nm": 400, "to_nm": 700})
    assert_sound(h)
    with pytest.raises(SceneError, match="400 to 700"):
        window(tmp_path, D65, formula, rays=2_000, name="wider")


def test_a_wavelength_at_the_end_of_a_formula_that_is_not_real_beyond(tmp_path):
    """n² = 1 + λ² / (λ² - 0.04) - 0.98 λ²: imaginary from some wavelength on, and light of just the last one before."""
    coefficients = [1.0, 0.04]
    edge = 210.0  # 10 nm above the pole at 200 nm
    formula = {"formula": "sellmeier", "coefficients": coefficients, "from_nm": edge, "to_nm": 900}
    h = window(tmp_path, {"kind": "lines", "wavelength_nm": [edge, 800]}, formula, rays=2_000)
    assert_sound(h)
    n = [math.sqrt(1 + um**2 / (um**2 - 0.04)) for um in (0.21, 0.8)]
    nm = wavelengths(h)
    for k, one in enumerate((edge, 800)):
        mine = nm == one
        r = ((n[k] - 1) / (n[k] + 1)) ** 2
        share_agrees(f"{one} nm", through(h)[mine].sum(), mine.sum(), (1 - r) / (1 + r))


def test_strong_and_narrow_absorption(tmp_path):
    """A line of absorption of 0.02 nm within one band: its mean, not its value at some point, counts for the band."""
    nm = [380, 549.99, 550.0, 550.01, 780]
    h = window(tmp_path, D65, 1.0, absorption={"wavelength_nm": nm, "value": [0, 0, 400, 0, 0]}, spectrum={"bands": 40})
    rows = h.kind == EventKind.LEFT
    flux, stderr = h.flux_w(h.per_ray(rows, h.light[rows]))
    band = int(np.searchsorted(h.raymap.bands.high_nm, 550.0))
    light = h.light[h.first[0]]
    # half of the line lies in each of the two bands that meet at 550 nm: 400 * 0.01 / 2 over 10 nm
    expected = light.copy()
    expected[[band, band + 1]] *= math.exp(-5 * 0.2)
    agrees("flux by band", flux, stderr, expected)
    assert_sound(h)
