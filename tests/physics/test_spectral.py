# SPDX-License-Identifier: LGPL-2.1-or-later
"""Spectral light without dispersion: filters, paints, colours and lumens, against closed forms and colour-science."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import integrate

from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from raymaps.spectral_data import illuminant
from tests.physics.scenes import Histories, agrees, ball, body, box, disc_source, rectangle, share_agrees, traced

D65 = {"kind": "illuminant", "name": "D65"}
SURFACES = {"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}}
#: To XYZ from linear sRGB, IEC 61966-2-1, from the inverse that the standard prints.
TO_XYZ = np.linalg.inv([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])


def curve(nm, value, **more) -> dict:
    return {"wavelength_nm": [float(x) for x in nm], "value": [float(x) for x in value], **more}


def table_source(nm, value) -> dict:
    return {"kind": "table", **curve(nm, value)}


def edges_of(h: Histories) -> np.ndarray:
    """(n_bands + 1,) where bands follow one another."""
    bands = h.raymap.bands
    assert (bands.low_nm[1:] == bands.high_nm[:-1]).all()
    return np.append(bands.low_nm, bands.high_nm[-1])


def over_bands(function, edges) -> np.ndarray:
    """Integral of a function of nm over each band."""
    nm = [np.linspace(a, b, 1001) for a, b in zip(edges, edges[1:], strict=False)]
    return np.array([integrate.trapezoid(function(x), x) for x in nm])


def leaving(h: Histories) -> tuple[np.ndarray, np.ndarray]:
    """Flux by band of what leaves, and its standard error."""
    rows = h.kind == EventKind.LEFT
    return h.flux_w(h.per_ray(rows, h.light[rows]))


def filter_scene(folder, spectrum, absorption, rays, *, thickness=10.0, **spectrum_settings) -> Histories:
    """A beam through a slab of the index of its surroundings."""
    return traced(
        folder,
        {"Slab": body(box((-20, -20, 0), (20, 20, thickness)), "polished", "dye")},
        rays=rays,
        media={"dye": {"refractive_index": 1.0, "absorption_per_mm": absorption}},
        surfaces=SURFACES,
        sources={"S": {**disc_source((0, 0, -5), (0, 0, 1), 1, 2.5), "spectrum": spectrum}},
        settings={"store": "spectral", "spectrum": spectrum_settings},
    )


# ---------------------------------------------------------------------------------------------------------------------
# Filters and paints


def test_beer_lambert_band_by_band(tmp_path):
    """exp(-a d) with the mean coefficient of each band: A. Beer's law, Born & Wolf, section 4.11."""
    nm, a = [380, 450, 520, 521, 600, 780], [0.5, 0.01, 0.05, 0.3, 0.0, 0.12]
    h = filter_scene(tmp_path, D65, curve(nm, a), 100_000)
    edges = edges_of(h)
    mean = over_bands(lambda x: np.interp(x, nm, a), edges) / np.diff(edges)
    light = over_bands(lambda x: illuminant(x, "D65"), edges)
    flux, stderr = leaving(h)
    agrees("flux by band", flux, stderr, 2.5 * light / light.sum() * np.exp(-10 * mean), rounding=1e-5)


def test_narrow_bands_give_the_integral_over_the_spectrum(tmp_path):
    """A dye with a line of absorption: the whole flux is the integral of S exp(-a d)."""
    nm = np.linspace(380, 780, 401)
    a = 0.6 * np.exp(-(((nm - 560) / 12) ** 2))
    h = filter_scene(tmp_path, D65, curve(nm, a), 60_000, bands=200)

    def share(x):
        return illuminant(x, "D65") * np.exp(-10 * np.interp(x, nm, a))

    edges = edges_of(h)
    expected = 2.5 * over_bands(share, edges).sum() / over_bands(lambda x: illuminant(x, "D65"), edges).sum()
    rows = h.kind == EventKind.LEFT
    flux, stderr = h.flux_w(h.per_ray(rows, h.light[rows].sum(axis=1)))
    agrees("flux", flux, stderr, expected, rounding=2e-4)  # of bands of 2 nm


def test_single_wavelengths_through_a_filter_are_exact(tmp_path):
    """A line has the coefficient at its wavelength, not that of the bands around it."""
    nm, shares = [441.6, 532.0, 632.8, 1064.0], [1, 2, 4, 3]
    a = curve([400, 1100], [0.0, 0.35])
    h = filter_scene(tmp_path, {"kind": "lines", "wavelength_nm": nm, "share": shares}, a, 100_000)
    flux, stderr = leaving(h)
    expected = 2.5 * np.array(shares) / 10 * np.exp(-10 * (np.array(nm) - 400) / 2000)
    agrees("flux by line", flux, stderr, expected)


@pytest.mark.parametrize("n_bounces", [1, 4])
def test_reflectance_over_several_mirrors(tmp_path, n_bounces):
    """Without roulette nothing is drawn: each ray carries S ρ^k exactly, to the float32 that it is kept in."""
    nm, reflectance = [380, 470, 550, 640, 780], [0.3, 0.99, 0.6, 1.0, 0.8]
    # between two mirrors 10 mm apart at 45 degrees the beam climbs 10 mm from one to the next
    height = 10 * n_bounces
    direction = np.array([1, 0, 1]) / math.sqrt(2)
    h = traced(
        tmp_path,
        {
            "Right": body(box((5, -5, 0), (6, 5, height)), "gold"),
            "Left": body(box((-6, -5, 0), (-5, 5, height)), "gold"),
        },
        rays=500,
        surfaces={"gold": {"kind": "mirror", "reflectance": curve(nm, reflectance)}},
        sources={"S": {**disc_source((0, 0, 0), direction, 0.5), "spectrum": D65}},
        settings={"store": "spectral", "roulette_threshold": 0.0, "spectrum": {"bands": 16}},
    )
    assert (np.diff(h.offsets) == n_bounces + 2).all()
    edges = edges_of(h)
    mean = over_bands(lambda x: np.interp(x, nm, reflectance), edges) / np.diff(edges)
    light = over_bands(lambda x: illuminant(x, "D65"), edges)
    assert h.light[h.last] == pytest.approx(np.tile(light / light.sum() * mean**n_bounces, (500, 1)), rel=2e-5)


@pytest.mark.parametrize("threshold", [0.01, 0.1, 1.0])
def test_integrating_sphere_with_a_spectral_paint(tmp_path, threshold):
    """In a closed cavity of any shape the wall gets 1 / (1 - ρ) times the light of each band (see
    test_integrating_sphere); roulette and the sharing of histories between bands change no expectation.
    """
    nm, rho = [380, 480, 560, 640, 780], [0.2, 0.9, 0.5, 0.95, 0.7]
    h = traced(
        tmp_path,
        {"Sphere": body(ball(20, 2), "paint")},
        rays=30_000,
        surfaces={"paint": {"kind": "lambertian", "reflectance": curve(nm, rho)}},
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [3, 0, 0], "spectrum": D65}},
        settings={"store": "spectral", "roulette_threshold": threshold, "spectrum": {"bands": 8}, "max_events": 3000},
    )
    edges = edges_of(h)
    mean = over_bands(lambda x: np.interp(x, nm, rho), edges) / np.diff(edges)
    light = over_bands(lambda x: illuminant(x, "D65"), edges) / over_bands(lambda x: illuminant(x, "D65"), edges).sum()
    wall = h.number > 0
    flux, stderr = h.flux_w(h.per_ray(wall, h.light_before[wall]))
    agrees("light on the wall by band", flux, stderr, light / (1 - mean), rounding=1e-5)
    assert (h.light.sum(axis=1) - h.light_before.sum(axis=1))[wall].max() < 1e-6


# ---------------------------------------------------------------------------------------------------------------------
# Red, green and blue in a spectral scene


def test_triples_in_a_spectral_scene_are_spectra_of_their_basis(tmp_path):
    """Of a mirror of (r, g, b) every band reflects between the least and the largest, and grey bands all alike."""
    spectra = {}
    for name, rgb in {
        "grey": 0.37,
        "pink": [0.9, 0.4, 0.4],
        "red": [1, 0, 0],
        "green": [0, 1, 0],
        "blue": [0, 0, 1],
    }.items():
        h = traced(
            tmp_path / name,
            {"Mirror": body(box((-5, -5, -1), (5, 5, 0)), "m")},
            rays=50,
            surfaces={"m": {"kind": "mirror", "reflectance": rgb}},
            sources={"S": {**disc_source((0, 0, 5), (0, 0, -1), 1), "spectrum": D65}},
            settings={"store": "spectral", "roulette_threshold": 0},
        )
        spectra[name] = h.light[h.last[0]] / h.light[h.first[0]]
    assert spectra["grey"] == pytest.approx(0.37, rel=1e-6)
    assert spectra["red"] + spectra["green"] + spectra["blue"] == pytest.approx(1, rel=1e-5)
    assert spectra["pink"] == pytest.approx(0.4 + 0.5 * spectra["red"], rel=1e-5)


def mixed_scene(folder, spectrum: dict | None, name: str, **settings) -> Histories:
    """Grey surfaces of several kinds, a grey medium and an index without dispersion."""
    source = {"kind": "point", "flux_w": 3, "position_mm": [0, 0, 0]} | ({"spectrum": spectrum} if spectrum else {})
    return traced(
        folder,
        {
            "Room": body(box((-20, -20, -20), (20, 20, 20)).inside_out, "white", plus_z="mixed"),
            "Lens": body(ball(6, 2).moved(10, 0, 0), "polished", "glass"),
        },
        rays=20_000,
        name=name,
        media={"glass": {"refractive_index": 1.6, "absorption_per_mm": 0.02}},
        surfaces={
            "white": {"kind": "lambertian", "reflectance": 0.7, "transmittance": 0.1},
            "mirror": {"kind": "mirror", "reflectance": 0.9},
            "mixed": {
                "kind": "mixture",
                "parts": [{"weight": 0.4, "surface": "white"}, {"weight": 0.6, "surface": "mirror"}],
            },
            **SURFACES,
        },
        sources={"S": source},
        detectors={"D": rectangle((0, 0, -10), 20, 20, side="both")},
        settings={"store": "spectral", **settings},
    )


@pytest.mark.parametrize(
    "spectrum", [D65, {"kind": "lines", "wavelength_nm": [500, 600]}, {"kind": "black_body", "temperature_k": 3000}]
)
def test_where_nothing_depends_on_wavelength_spectra_change_nothing(tmp_path, spectrum):
    """The very histories of the RGB simulation: same places, same kinds, same power, but for float32."""
    plain = mixed_scene(tmp_path, None, "rgb")
    h = mixed_scene(tmp_path, spectrum, "spectral")
    assert not plain.raymap.bands.is_spectral
    assert h.raymap.bands.is_spectral
    same = np.diff(h.offsets) == np.diff(plain.offsets)
    assert same.mean() > 0.9999  # where rounding decides a draw in 10^5
    for column in ("kind", "position", "face"):
        one, other = getattr(h, column)[same[h.ray]], getattr(plain, column)[same[plain.ray]]
        assert (one == other).mean() > 0.9999
    ours, theirs = energy_ledger(h.raymap), energy_ledger(plain.raymap)
    assert ours.absorbed_by_body_w["Room"] == pytest.approx(theirs.absorbed_by_body_w["Room"], rel=2e-4)
    assert ours.absorbed_by_medium_w["glass"] == pytest.approx(theirs.absorbed_by_medium_w["glass"], rel=2e-3)
    # and each band keeps its share of all light, event by event
    share = h.light[h.first[0]]
    power = h.light.sum(axis=1)
    assert np.abs(h.light - power[:, None] * share).max() < 2e-6


def test_grey_light_of_red_green_and_blue_is_even_over_wavelengths(tmp_path):
    """An rgb source in a spectral scene: white is equal energy, and its bands add up to one."""
    h = traced(
        tmp_path,
        {},
        rays=100,
        sources={
            "White": disc_source((0, 0, 0), (0, 0, 1), 1),
            "Red": disc_source((0, 0, 0), (0, 0, 1), 1, rgb=(1, 0, 0)),
            "Line": {**disc_source((0, 0, 0), (0, 0, 1), 1), "spectrum": {"kind": "lines", "wavelength_nm": [600]}},
        },
        settings={"store": "spectral"},
    )
    lights = [h.light[h.first[np.flatnonzero(h.ray_source == k)[0]]] for k in range(3)]
    assert lights[0] == pytest.approx([1 / 32] * 32 + [0], abs=1e-7)
    assert lights[1].sum() == pytest.approx(1, abs=1e-7)
    assert lights[1][h.raymap.bands.center_nm > 600].sum() > 0.6
    assert lights[2].tolist() == [0] * 32 + [1]


# ---------------------------------------------------------------------------------------------------------------------
# Colours and lumens


def test_colour_of_d65_through_a_filter(tmp_path):
    """x and y of the light behind a filter, by colour-science's own sum over its own tables, ASTM E308 aside."""
    import colour

    nm = np.arange(380, 781, 5.0)
    a = 0.25 * (1 + np.tanh((nm - 545) / 25)) + 0.03
    h = filter_scene(tmp_path, D65, curve(nm, a), 60_000, bands=80)

    shape = colour.SpectralShape(380, 780, 1)
    cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    light = colour.SDS_ILLUMINANTS["D65"].copy().interpolate(shape, interpolator=colour.LinearInterpolator)
    light = light.trim(shape)
    through = colour.SpectralDistribution(np.exp(-10 * np.interp(shape.wavelengths, nm, a)), shape)
    xyz = colour.sd_to_XYZ(light * through, cmfs, method="Integration")
    expected = np.asarray(colour.XYZ_to_xy(xyz))

    rows = h.kind == EventKind.LEFT
    per_ray = h.per_ray(rows, h.light[rows] @ h.raymap.bands.rgb_per_w @ TO_XYZ.T)
    mean = per_ray.mean(axis=0)
    xy = mean[:2] / mean.sum()
    # the error of a quotient of means, to first order
    off = (per_ray[:, :2] - xy * per_ray.sum(axis=1, keepdims=True)) / mean.sum()
    stderr = off.std(axis=0) / math.sqrt(h.n_rays)
    assert stderr.max() < 1e-3
    agrees("x and y", xy, stderr, expected, rounding=1e-3)
    assert abs(expected - [0.3127, 0.3290]).max() > 0.05  # a colour indeed


def test_colours_stored_are_those_of_the_spectra(tmp_path):
    """The same rays stored either way have the same red, green, blue, lumens and power."""
    nm = [380, 500, 780]
    h = filter_scene(tmp_path / "a", D65, curve(nm, [0.3, 0.0, 0.1]), 2_000)
    scene = tmp_path / "a" / "scene.scene.json"
    from raymaps.run import simulate

    colours = simulate(scene, tmp_path / "colours.raymap", rays=2_000, store="rgb", threads=1)
    for one, other in zip(h.raymap.portions, colours.portions, strict=True):
        assert one.lights.has_spectra
        assert not other.lights.has_spectra
        assert np.array_equal(one.position_mm, other.position_mm)
        for name in ("rgb", "lumen_per_w", "power"):
            a, b = (getattr(p.lights, name)[p.event_light] for p in (one, other))
            assert a == pytest.approx(b, rel=1e-5, abs=1e-6), name


@pytest.mark.parametrize("name", ["A", "D65", "E"])
def test_lumens_of_illuminants_that_arrive(tmp_path, name):
    """Luminous efficacy of radiation between 380 and 780 nm from sums over the tables of CIE 015 and CIE 018; for equal
    energy the integral of V(λ), 106.86 nm, is known.
    """
    import colour

    h = filter_scene(tmp_path, {"kind": "illuminant", "name": name}, 0.0, 200)
    rows = h.kind == EventKind.LEFT
    lumens = h.raymap.ray_flux_w[0] * (h.light[rows] @ h.raymap.bands.lumen_per_w).sum()
    table, v = colour.SDS_ILLUMINANTS[name], colour.SDS_LEFS["CIE 1924 Photopic Standard Observer"]
    at = np.arange(380, 781, 5)
    s, v = (np.interp(at, one.wavelengths, one.values) for one in (table, v))
    expected = 683 * integrate.trapezoid(s * v, at) / integrate.trapezoid(s, at)
    assert lumens == pytest.approx(2.5 * expected, rel=3e-3)  # of bands of 12.5 nm
    if name == "E":
        assert lumens == pytest.approx(2.5 * 683 * 106.86 / 400, rel=1e-3)


def test_a_watt_at_555_nm_is_683_lumens(tmp_path):
    """BIPM: the candela; V(555) = 1."""
    h = filter_scene(tmp_path, {"kind": "lines", "wavelength_nm": [555.0]}, 0.0, 100)
    portion = h.raymap.portions[0]
    assert portion.lights.lumen_per_w[portion.event_light[0]] == pytest.approx(683, rel=1e-9)


def test_light_outside_the_simulated_range_is_not_counted(tmp_path):
    """flux_w is that of the wavelengths that are simulated: an even table over twice the range gives no less."""
    h = filter_scene(tmp_path, table_source([200, 1400], [1, 1]), 0.0, 100, from_nm=400, to_nm=500, bands=4)
    flux, _ = leaving(h)
    assert flux == pytest.approx([2.5 / 4] * 4, rel=1e-6)


def test_rays_of_two_sources_share_bands_but_not_light(tmp_path):
    """A laser and a lamp through the same filter: the laser's light stays in its line, the lamp's out of it."""
    h = traced(
        tmp_path,
        {"Slab": body(box((-20, -20, 0), (20, 20, 10)), "polished", "dye")},
        rays=50_000,
        media={"dye": {"refractive_index": 1.0, "absorption_per_mm": curve([300, 900], [0.0, 0.3])}},
        surfaces=SURFACES,
        sources={
            "Laser": {
                **disc_source((0, 0, -5), (0, 0, 1), 1, 1.0),
                "spectrum": {"kind": "lines", "wavelength_nm": [600]},
            },
            "Lamp": {**disc_source((0, 0, -5), (0, 0, 1), 1, 1.0), "spectrum": D65},
        },
        settings={"store": "spectral"},
    )
    laser = h.ray_source[h.ray] == 0
    assert (h.light[laser][:, :-1] == 0).all()
    assert (h.light[~laser][:, -1] == 0).all()
    n = int((h.ray_source == 0).sum())
    share_agrees("laser", (h.kind[h.last] == EventKind.LEFT)[h.ray_source == 0].sum(), n, math.exp(-1.5))
