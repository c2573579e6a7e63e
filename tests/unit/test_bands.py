# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bands of light: means of tables, shares of spectra, colours and lumens, against integrals done by hand."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy import integrate

from raymaps.bands import RGB_BANDS, Bands, spectral_bands, spectral_density
from raymaps.effects.dispersion import Data, drawn_wavelength, interpolated_index, lower
from raymaps.effects.lowering import Lowering
from raymaps.errors import SceneError
from raymaps.frame import Frame
from raymaps.kernels import dispersion as kernels
from raymaps.materials import Medium, SpectrumTable
from raymaps.names import Names
from raymaps.scene import Scene
from raymaps.sources import quantised
from raymaps.spectral_data import basis_functions, black_body, illuminant

#: Fraunhofer lines and others by which glass is specified, DIN/ISO 7944 and Schott, TIE-29.
LINES_NM = (486.1327, 587.5618, 656.2725)
TRIANGLE = {"kind": "table", "wavelength_nm": [500, 560, 600], "value": [0, 3, 0]}
EVEN = {"kind": "table", "wavelength_nm": [100, 2000], "value": [1, 1]}


def scene_of(*spectra: dict, without: tuple[str, ...] = (), rgb=(1, 1, 1), **spectrum) -> Scene:
    """A scene with a point source for each spectrum; None is a source of red, green and blue."""
    source = {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0], "rgb": list(rgb)}
    sources = {f"S{k}": source | ({"spectrum": s} if s else {}) for k, s in enumerate(spectra)}
    settings = {"spectrum": spectrum, "without": list(without)}
    return Scene.model_validate({"format": "raymaps-scene", "version": 1, "sources": sources, "settings": settings})


def bands_and_light(spectrum: dict | None, **settings) -> tuple[Bands, np.ndarray]:
    scene = scene_of(spectrum, **settings)
    bands = spectral_bands(scene)
    return bands, bands.light_of(scene.sources["S0"])


def table(nm, value, outside="refuse") -> SpectrumTable:
    return SpectrumTable(wavelength_nm=tuple(map(float, nm)), value=tuple(map(float, value)), outside=outside)


def integral_of(table_nm, values, low: float, high: float) -> float:
    """Integral of what is linear between points and zero outside: a trapezoid for each piece, in Python."""
    total = 0.0
    points = list(zip(table_nm, values, strict=True))
    for (x0, y0), (x1, y1) in zip(points, points[1:], strict=False):
        a, b = max(low, x0), min(high, x1)
        if a < b:
            at_a, at_b = (y0 + (y1 - y0) * (x - x0) / (x1 - x0) for x in (a, b))
            total += (b - a) * (at_a + at_b) / 2
    return total


# ---------------------------------------------------------------------------------------------------------------------
# Which bands there are


def test_bands_are_those_of_the_settings():
    bands, light = bands_and_light(EVEN, from_nm=400, to_nm=700, bands=6)
    assert bands.low_nm.tolist() == [400, 450, 500, 550, 600, 650]
    assert bands.high_nm.tolist() == [450, 500, 550, 600, 650, 700]
    assert bands.center_nm.tolist() == [425, 475, 525, 575, 625, 675]
    assert light == pytest.approx([1 / 6] * 6, rel=1e-12)


def test_every_single_wavelength_has_a_band_without_width_behind_the_others():
    lines = {"kind": "lines", "wavelength_nm": [486.1327, 656.2725], "share": [1, 3]}
    more = {"kind": "lines", "wavelength_nm": [404.6561, 486.1327]}
    scene = scene_of(EVEN, lines, more, from_nm=400, to_nm=700, bands=3)
    bands = spectral_bands(scene)
    assert bands.low_nm.tolist() == [400, 500, 600, 404.6561, 486.1327, 656.2725]
    assert bands.high_nm.tolist() == [500, 600, 700, 404.6561, 486.1327, 656.2725]
    light = [bands.light_of(source).tolist() for source in scene.sources.values()]
    assert light[0] == pytest.approx([1 / 3, 1 / 3, 1 / 3, 0, 0, 0])
    assert light[1:] == [[0, 0, 0, 0, 0.25, 0.75], [0, 0, 0, 0.5, 0.5, 0]]


def test_lines_alone_need_no_bands_of_the_settings_and_may_lie_outside_them():
    bands, light = bands_and_light({"kind": "lines", "wavelength_nm": [266.0, 532.0, 10600.0]})
    assert bands.low_nm.tolist() == bands.high_nm.tolist() == [266, 532, 10600]
    assert light.tolist() == [1 / 3] * 3


def test_bands_without_light_are_left_out():
    """Light that ends at a border of bands has no share beyond it, not even of rounding."""
    bands, _ = bands_and_light({"kind": "table", "wavelength_nm": [400, 500], "value": [1, 1]}, bands=40)
    assert (bands.low_nm[0], bands.high_nm[-1], bands.n) == (400, 500, 10)
    two = {"kind": "table", "wavelength_nm": [400, 420, 430, 600, 610, 620], "value": [1, 1, 0, 0, 1, 1]}
    bands, _ = bands_and_light(two, bands=40)
    assert bands.low_nm.tolist() == [400, 410, 420, 600, 610]


def test_a_jump_to_zero_at_the_end_of_a_table_puts_no_light_beyond_it():
    """Within a band the light of a table that starts at 405.25 starts there too."""
    bands, light = bands_and_light({"kind": "table", "wavelength_nm": [405.25, 420], "value": [1, 1]}, bands=40)
    assert bands.low_nm.tolist() == [400, 410]
    assert light == pytest.approx([4.75 / 14.75, 10 / 14.75], rel=1e-9)


@pytest.mark.parametrize("n", [1, 2, 7, 32, 1000])
def test_shares_add_up_to_one_exactly_once_quantised(n):
    for spectrum in (
        EVEN,
        TRIANGLE,
        {"kind": "illuminant", "name": "D65"},
        {"kind": "black_body", "temperature_k": 800},
    ):
        _, light = bands_and_light(spectrum, bands=n)
        assert light.sum() == pytest.approx(1, rel=1e-14)
        steps = quantised(light[None])[0].astype(np.float64)
        assert steps.sum() == 1.0
        off = np.abs(steps - light) * 2.0**24
        brightest = np.argmax(steps)
        assert off[brightest] <= n / 50 + 1  # it gives to bands that would have none
        assert np.delete(off, brightest).max(initial=0) <= 1


def test_a_source_without_light_in_the_range_is_refused_by_name():
    with pytest.raises(SceneError, match=r"Source 'S1'.* 380 to 780 nm.*settings\.spectrum") as error:
        spectral_bands(scene_of(EVEN, {"kind": "table", "wavelength_nm": [900, 950], "value": [1, 1]}))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["D66", "", "daylight"])
def test_an_unknown_illuminant_lists_the_known(name):
    with pytest.raises(SceneError, match=f"illuminant '{name}'; known: 'A', .*'D65'"):
        spectral_bands(scene_of({"kind": "illuminant", "name": name}))


# ---------------------------------------------------------------------------------------------------------------------
# Shares of light


@pytest.mark.parametrize(("n", "low", "high"), [(1, 380, 780), (32, 380, 780), (7, 513.3, 588.8), (1000, 380, 780)])
def test_shares_of_tables_are_their_integrals(n, low, high):
    bands, light = bands_and_light(TRIANGLE, from_nm=low, to_nm=high, bands=n)
    nm, value = TRIANGLE["wavelength_nm"], TRIANGLE["value"]
    each = np.array([integral_of(nm, value, a, b) for a, b in zip(bands.low_nm, bands.high_nm, strict=True)])
    assert light == pytest.approx(each / integral_of(nm, value, low, high), rel=1e-9, abs=1e-13)


def test_a_spike_of_a_hundredth_of_a_nanometre_is_not_overlooked():
    """An even spectrum of 400 in all, with a spike of area 100 at 532.1 nm."""
    spike = {"wavelength_nm": [380, 532.095, 532.1, 532.105, 780], "value": [1, 1, 20001, 1, 1]}
    bands, light = bands_and_light({"kind": "table", **spike}, bands=32)
    expected = np.full(32, 12.5)
    expected[np.searchsorted(bands.high_nm, 532.1)] += 100
    assert light == pytest.approx(expected / 500, rel=1e-9)


def test_shares_of_a_black_body_are_integrals_of_plancks_law():
    """c2 = 14387.769 µm K (CODATA 2018)."""
    bands, light = bands_and_light({"kind": "black_body", "temperature_k": 2856}, bands=16)

    def planck(um):
        return um**-5 / math.expm1(14387.76877 / (um * 2856))

    each = np.array(
        [
            integrate.quad(planck, a, b, epsabs=0)[0]
            for a, b in zip(bands.low_nm / 1e3, bands.high_nm / 1e3, strict=True)
        ]
    )
    assert light == pytest.approx(each / each.sum(), rel=1e-5)


@pytest.mark.parametrize(("kelvin", "at_um"), [(1000.0, 2.897771955), (5772.0, 0.502039492)])
def test_a_black_body_is_brightest_by_wiens_displacement_law(kelvin, at_um):
    """b = 2897.771955 µm K (CODATA 2018)."""
    nm = np.arange(100.0, 6000.0, 0.01)
    assert nm[np.argmax(black_body(nm, kelvin))] == pytest.approx(1e3 * at_um, abs=0.02)
    assert 1e3 * at_um == pytest.approx(2.897771955e6 / kelvin, rel=1e-6)


def test_share_of_a_black_body_below_a_wavelength():
    """F(0 to 4107.3 µm K) = 0.5: half of the light of a black body lies below it.

    M. Modest: Radiative Heat Transfer, 3rd ed., appendix C.
    """
    nm = np.linspace(50, 60_000, 200_001)
    below = integrate.cumulative_trapezoid(black_body(nm, 2000), nm, initial=0)
    stefan = math.pi**4 / 15  # of the integral of x³ / (e^x - 1); the rest lies beyond 60 µm
    x = 14387.76877 / (60 * 2000)
    beyond = integrate.quad(lambda t: t**3 / math.expm1(t), 0, x)[0] / stefan
    total = below[-1] / (1 - beyond)
    assert np.interp(0.5 * total, below, nm) * 2 == pytest.approx(4107.3, abs=0.5)  # 2000 K, in µm K


def test_the_spectrum_of_d65_is_that_of_its_table():
    """CIE 015, table T.1: S(560) = 100, S(400) = 82.7549, S(700) = 71.6091; zero where the table ends."""
    assert illuminant(np.array([560.0, 400, 700, 200, 900]), "D65").tolist() == [100, 82.7549, 71.6091, 0, 0]


# ---------------------------------------------------------------------------------------------------------------------
# Wavelengths within a band


def data_of(scene: Scene) -> tuple[Data, Bands]:
    """What the kernel of dispersion reads to draw wavelengths."""
    bands = spectral_bands(scene)
    nm, cumulated = bands.spread(scene.sources.values())
    first, last = np.searchsorted(nm, bands.low_nm), np.searchsorted(nm, bands.high_nm)
    return Data(np.zeros(0), np.zeros(0), 0.0, 1.0, np.zeros((0, 4)), nm, cumulated, first, last), bands


def test_wavelengths_drawn_within_a_band_are_its_quantiles():
    """Of a triangle that climbs from 500 to 560 nm the share up to λ is ((λ - 500) / 60)²."""
    data, _ = data_of(scene_of(TRIANGLE, from_nm=500, to_nm=560, bands=1))
    u = np.linspace(0, 1, 201)
    nm = np.array([drawn_wavelength(data, 0, 0, x) for x in u])
    assert nm == pytest.approx(500 + 60 * np.sqrt(u), abs=0.3)
    assert ((nm[20:] - 500) / 60) ** 2 == pytest.approx(u[20:], abs=2e-5)
    assert (nm[0], nm[-1]) == (500, 560)


def test_no_wavelength_is_drawn_where_a_source_has_no_light():
    gap = {"kind": "table", "wavelength_nm": [500, 510, 510.01, 589.99, 590, 600], "value": [1, 1, 0, 0, 1, 1]}
    data, _ = data_of(scene_of(gap, from_nm=500, to_nm=600, bands=1))
    nm = np.array([drawn_wavelength(data, 0, 0, u) for u in np.linspace(0, 1, 999)])
    assert not ((nm > 510.01) & (nm < 589.99)).any()
    assert (nm < 550).mean() == pytest.approx(0.5, abs=1e-3)


def test_a_single_wavelength_is_drawn_exactly():
    lines = {"kind": "lines", "wavelength_nm": list(LINES_NM)}
    data, _ = data_of(scene_of(EVEN, lines, bands=5))
    for band in range(5, 8):
        for u in (1e-9, 0.4, 1 - 1e-9):
            assert drawn_wavelength(data, 1, band, u) == LINES_NM[band - 5]


def test_a_band_in_which_the_source_itself_has_no_light_is_drawn_evenly():
    """So that light that a ray brings from elsewhere has a wavelength of its band."""
    data, _ = data_of(scene_of(EVEN, TRIANGLE, from_nm=400, to_nm=700, bands=30))
    assert drawn_wavelength(data, 1, 0, 0.25) == pytest.approx(402.5)


def test_the_kernel_draws_the_wavelengths_of_the_reference():
    spike = {"kind": "table", "wavelength_nm": [400, 532.0, 532.1, 532.2, 700], "value": [0, 1, 500, 0, 1]}
    data, bands = data_of(scene_of(spike, EVEN, {"kind": "lines", "wavelength_nm": [555]}, bands=7))
    for source, band, u in itertools.product(range(3), range(bands.n), (1e-10, 0.1, 0.5, 0.93, 1 - 1e-10)):
        assert kernels.wavelength_in(data, source, band, u) == drawn_wavelength(data, source, band, u)


# ---------------------------------------------------------------------------------------------------------------------
# Index between the points of its grid

BK7 = {
    "formula": "sellmeier",
    "coefficients": [1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653],
}
SF11 = {
    "formula": "sellmeier",
    "coefficients": [1.73759695, 0.013188707, 0.313747346, 0.0623068142, 1.89878101, 155.23629],
}


def index_data(index: dict, spectrum: dict, **settings) -> tuple[Data, Bands, Medium]:
    """What the kernel reads of a medium around all."""
    data = scene_of(spectrum, **settings).model_dump() | {"ambient": "m", "media": {"m": {"refractive_index": index}}}
    scene = Scene.model_validate(data)
    bands = spectral_bands(scene)
    names = Names(("S0",), (), (), ("m",), (), ())
    frame = Frame(np.zeros(3), 1.0, 1e-6)
    return lower(Lowering(scene, names, bands, (scene.media["m"],), frame)), bands, scene.media["m"]


@pytest.mark.parametrize("index", [BK7, SF11], ids=["N-BK7", "N-SF11"])
@pytest.mark.parametrize(("low", "high"), [(400, 700), (379.3, 781.9), (550, 550.5), (1000, 2000)])
def test_the_index_between_the_points_is_that_of_the_formula(index, low, high):
    data, bands, medium = index_data(index, EVEN, from_nm=low, to_nm=high)
    nm = np.random.default_rng(2).uniform(bands.low_nm.min(), bands.high_nm.max(), 500)
    nm = np.concatenate([nm, bands.low_nm[:1], bands.high_nm[-1:]])
    for function in (interpolated_index, kernels.index_at):
        found = np.array([function(data, 0, one) for one in nm])
        assert np.abs(found - medium.index_at(nm)).max() < 1e-9


def test_the_index_at_a_single_wavelength_is_that_of_the_formula():
    data, _, medium = index_data(SF11, {"kind": "lines", "wavelength_nm": [587.5618]})
    assert (
        kernels.index_at(data, 0, 587.5618) == float(medium.index_at(587.5618)) == interpolated_index(data, 0, 587.5618)
    )


def test_the_index_of_a_table_that_bends_overshoots_nowhere():
    bent = {"wavelength_nm": [300, 500, 510, 511, 520, 800], "n": [1.0, 1.0, 1.0, 2.0, 2.0, 1.9]}
    data, _, medium = index_data(bent, EVEN)
    nm = np.linspace(380, 780, 4001)
    for function in (interpolated_index, kernels.index_at):
        found = np.array([function(data, 0, one) for one in nm])
        assert found.min() >= 1
        assert found.max() <= 2
        off = np.abs(found - medium.index_at(nm))
        assert off[np.abs(nm - 510.5) > 3].max() < 1e-4


# ---------------------------------------------------------------------------------------------------------------------
# Means of coefficients


def test_means_of_tables_are_exact():
    """Kinks between the points that are looked at, steep notches, and a table of one point."""
    bands, _ = bands_and_light(EVEN, bands=32)
    nm = [380, 401.23, 401.24, 401.25, 533.337, 612.7, 780]
    value = [0.1, 0.9, 0.0, 0.9, 0.2, 1.0, 0.4]
    expected = [integral_of(nm, value, a, b) / (b - a) for a, b in zip(bands.low_nm, bands.high_nm, strict=True)]
    assert bands.average(table(nm, value), "x") == pytest.approx(expected, rel=1e-9)
    assert (bands.average(table([500], [0.3], "clamp"), "x") == 0.3).all()


@pytest.mark.parametrize("n", [1, 3, 1000])
def test_the_mean_of_a_constant_table_is_that_constant(n):
    bands, _ = bands_and_light(EVEN, bands=n, from_nm=300, to_nm=900)
    assert (bands.average(table([200, 555.55, 1000], [1, 1, 1]), "x") <= 1).all()
    assert bands.average(table([200, 555.55, 1000], [1, 1, 1]), "x") == pytest.approx(1, rel=1e-12)
    nm = np.sort(np.random.default_rng(1).uniform(250, 950, 300))
    assert (bands.average(table(nm, np.ones(300), "clamp"), "x") <= 1).all()


def test_the_mean_in_a_band_without_width_is_the_value_there():
    bands, _ = bands_and_light({"kind": "lines", "wavelength_nm": list(LINES_NM)})
    slope = table([400, 700], [0.0, 0.3])
    assert bands.average(slope, "x") == pytest.approx((np.array(LINES_NM) - 400) / 1000, rel=1e-12)


def test_tables_that_say_nothing_of_some_light_are_refused_unless_they_clamp():
    bands, _ = bands_and_light(EVEN, bands=4)
    for nm in ([381, 780], [380, 779.9], [500, 600]):
        with pytest.raises(SceneError, match=r'surface y: the table holds from .*380 to 780 nm.*"clamp"'):
            bands.average(table(nm, [0.5, 0.7]), "surface y")
    assert bands.average(table([500, 600], [0.5, 0.7], "clamp"), "x").tolist() == pytest.approx(
        [0.5, 0.564, 0.696, 0.7]
    )


@pytest.mark.parametrize("n", [1, 4, 32])
def test_a_table_that_just_reaches_the_border_is_enough(n):
    bands, _ = bands_and_light(EVEN, bands=n)
    assert bands.average(table([380, 780], [0, 1]), "x") == pytest.approx((bands.center_nm - 380) / 400)


def test_only_light_that_is_simulated_must_be_known_of():
    """A table from 500 to 600 nm is enough for a source that shines there."""
    bands, _ = bands_and_light(TRIANGLE, bands=40)
    assert bands.average(table([500, 600], [0.5, 0.5]), "x") == pytest.approx(0.5)


def test_rgb_triples_are_shares_of_three_functions_that_add_up_to_one():
    """I. Mallett, C. Yuksel, EGSR 2019: grey stays grey, red is red, and nothing is above one or below zero."""
    nm = np.linspace(200, 1200, 5001)
    basis = basis_functions(nm)
    assert basis.sum(axis=0) == pytest.approx(1, rel=1e-12)
    assert basis.min() >= 0
    bands, _ = bands_and_light(EVEN, bands=16)
    red, green, blue = (bands.average(tuple(row), "x") for row in np.eye(3))
    assert red + green + blue == pytest.approx(1, rel=1e-12)
    assert bands.average((0.3, 0.3, 0.3), "x").tolist() == [0.3] * 16
    assert bands.average((0.2, 0.5, 0.9), "x") == pytest.approx(0.2 * red + 0.5 * green + 0.9 * blue)
    at = np.searchsorted(bands.high_nm, [450, 650])
    assert blue[at[0]] > 0.9
    assert red[at[1]] > 0.9
    assert 500 < bands.center_nm[np.argmax(green)] < 580


@pytest.mark.parametrize(
    "triple", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.8, 0.3, 0.1), (0.2, 0.5, 0.9)]
)
def test_under_d65_a_triple_has_the_colour_that_it_says(triple):
    """What the basis is made for (Mallett, Yuksel, section 3): reflected D65 has the sRGB of the reflectance."""
    for n, tolerance in ((32, 1e-2), (400, 1.3e-3)):
        bands, light = bands_and_light({"kind": "illuminant", "name": "D65"}, bands=n)
        reflected = (light * bands.average(triple, "x")) @ bands.rgb_per_w
        assert reflected / (light @ bands.rgb_per_w) == pytest.approx(triple, abs=tolerance)


def test_in_rgb_a_triple_is_itself_and_a_table_its_mean_over_each_colour():
    assert RGB_BANDS.average((0.2, 0.5, 0.9), "x").tolist() == [0.2, 0.5, 0.9]
    assert RGB_BANDS.average(table([300, 900], [0.4, 0.4]), "x") == pytest.approx([0.4] * 3)
    red, green, blue = RGB_BANDS.average(table([580, 600], [0, 1], "clamp"), "x")
    assert red > 0.85 > 0.5 > max(green, blue)


# ---------------------------------------------------------------------------------------------------------------------
# Colours and lumens


def lumen_per_w(spectrum: dict, **settings) -> float:
    bands, light = bands_and_light(spectrum, **settings)
    return float(light @ bands.lumen_per_w)


@pytest.mark.parametrize(
    ("nm", "expected"),
    [(555.0, 683.0), (507.0, 683 * 0.444310), (450.0, 683 * 0.038), (650.0, 683 * 0.107), (380.0, 683 * 0.000039)],
)
def test_lumens_of_single_wavelengths(nm, expected):
    """CIE 018: V(λ) of photopic vision, 683 lm/W at 555 nm."""
    assert lumen_per_w({"kind": "lines", "wavelength_nm": [nm]}) == pytest.approx(expected, rel=1e-3)


def test_light_that_no_eye_sees_has_no_lumens_and_is_not_refused():
    for nm in (266.0, 10600.0):
        assert lumen_per_w({"kind": "lines", "wavelength_nm": [nm]}) == 0


@pytest.mark.parametrize("name", ["A", "D65", "FL2", "LED-B3"])
@pytest.mark.parametrize("n", [32, 200])
def test_lumens_of_illuminants_are_those_of_colour_science(name, n):
    """Its own sum over its own tables; a band counts with its mean efficacy, which 32 bands make 0.5 % of at most."""
    import colour

    shape = colour.SpectralShape(380, 780, 1)
    spectrum = colour.SDS_ILLUMINANTS[name].copy().interpolate(shape, interpolator=colour.LinearInterpolator)
    efficacy = colour.luminous_efficacy(spectrum.trim(shape))
    tolerance = 5e-3 if n == 32 else 1e-3
    assert lumen_per_w({"kind": "illuminant", "name": name}, bands=n) == pytest.approx(efficacy, rel=tolerance)


@pytest.mark.parametrize(
    ("observer", "names"),
    [("cie_1931_2deg", ("A", "C", "D65", "FL2", "FL11")), ("cie_1964_10deg", ("A", "C", "D65", "FL2", "FL11"))],
)
def test_chromaticity_of_illuminants(observer, names):
    """CIE 015, tables T.3 (of A, C, D65) and T.8 (of fluorescent lamps) give x and y to four or five digits."""
    from colour import CCS_ILLUMINANTS

    published = CCS_ILLUMINANTS[
        {
            "cie_1931_2deg": "CIE 1931 2 Degree Standard Observer",
            "cie_1964_10deg": "CIE 1964 10 Degree Standard Observer",
        }[observer]
    ]
    to_xyz = np.linalg.inv([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
    for name in names:
        scene = scene_of({"kind": "illuminant", "name": name}, bands=400, observer=observer)
        bands = spectral_bands(scene)
        xyz = to_xyz @ (bands.light_of(scene.sources["S0"]) @ bands.rgb_per_w)
        assert xyz[:2] / xyz.sum() == pytest.approx(published[name], abs=3e-4), name


def test_colours_of_d65_are_grey_and_as_bright_as_its_lumens():
    """IEC 61966-2-1: the white of sRGB is D65; Y in units of 683 lm/W by the observer's own y function."""
    bands, light = bands_and_light({"kind": "illuminant", "name": "D65"}, bands=400)
    rgb = light @ bands.rgb_per_w
    assert rgb / rgb.mean() == pytest.approx([1, 1, 1], abs=2e-3)
    luminance = rgb @ [0.2126, 0.7152, 0.0722]
    assert luminance == pytest.approx(light @ bands.lumen_per_w / 683, rel=2e-3)


def test_an_rgb_of_a_source_gives_light_of_that_hue():
    """Recovered by colour-science's sRGB primaries under D65, not under equal energy: hues, not exact colours."""
    for rgb, wanted in (((1, 0, 0), 0), ((0, 1, 0), 1), ((0, 0, 1), 2)):
        bands, light = bands_and_light(None, rgb=rgb)
        assert int(np.argmax(light @ bands.rgb_per_w)) == wanted
    bands, light = bands_and_light(None)
    assert light == pytest.approx(1 / 32, rel=1e-9)


# ---------------------------------------------------------------------------------------------------------------------
# In an RGB simulation, and as stored


def rgb_light(spectrum: dict) -> list[float]:
    return RGB_BANDS.light_of(scene_of(spectrum).sources["S0"]).tolist()


def test_spectra_become_colours_where_spectral_light_is_switched_off():
    assert rgb_light({"kind": "illuminant", "name": "D65"}) == pytest.approx([1 / 3] * 3, abs=2e-3)
    assert rgb_light({"kind": "lines", "wavelength_nm": [650]}) == pytest.approx([1, 0, 0])
    assert rgb_light({"kind": "lines", "wavelength_nm": [10600]}) == pytest.approx([1 / 3] * 3)
    assert rgb_light({"kind": "table", "wavelength_nm": [900, 950], "value": [1, 1]}) == pytest.approx([1 / 3] * 3)
    warm, cold = (
        rgb_light({"kind": "black_body", "temperature_k": 2000}),
        rgb_light({"kind": "black_body", "temperature_k": 20000}),
    )
    assert warm[0] > warm[1] > warm[2] < cold[2] > cold[0]


def test_a_spike_between_the_wavelengths_looked_at_has_its_colour():
    spike = {"kind": "table", "wavelength_nm": [650.495, 650.5, 650.505], "value": [0, 1, 0]}
    assert rgb_light(spike) == pytest.approx([1, 0, 0])


def test_bands_come_back_from_a_manifest():
    import json

    for bands in (RGB_BANDS, bands_and_light(EVEN, bands=5)[0]):
        back = Bands.from_dict(json.loads(json.dumps(bands.to_dict())))
        for name in ("low_nm", "high_nm", "rgb_per_w"):
            assert np.array_equal(getattr(back, name), getattr(bands, name))
            assert not getattr(back, name).flags.writeable
        assert (back.is_spectral, back.observer, back.n) == (bands.is_spectral, bands.observer, bands.n)
        assert (back.lumen_per_w is None) == (bands.lumen_per_w is None)


def test_the_density_of_a_source_of_red_green_and_blue_is_that_of_its_basis():
    source = scene_of(None, rgb=(2, 1, 1)).sources["S0"]
    nm = np.array([430.0, 550.0, 680.0])
    assert spectral_density(source, nm) == pytest.approx(np.array([2, 1, 1]) @ basis_functions(nm))
