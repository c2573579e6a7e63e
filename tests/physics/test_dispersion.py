# SPDX-License-Identifier: LGPL-2.1-or-later
"""Dispersion: prisms and lenses wavelength by wavelength, and that narrowing rays to one wavelength biases nothing.

Glass data: coefficients of Sellmeier's formula and refractive indices of SCHOTT's data sheets N-BK7 517642.251 and
N-SF11 785257.322; spectral lines of SCHOTT, technical information TIE-29.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import integrate

from raymaps.kinds import EventKind
from raymaps.spectral_data import illuminant
from tests.physics.scenes import (
    Histories,
    Shape,
    agrees,
    body,
    box,
    chi_square_agrees,
    disc_source,
    follows,
    prism,
    share_agrees,
    traced,
    unit,
)

#: B1 C1 B2 C2 B3 C3, C in µm².
SELLMEIER = {
    "N-BK7": [1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653],
    "N-SF11": [1.73759695, 0.013188707, 0.313747346, 0.0623068142, 1.89878101, 155.23629],
}
LINES_NM = {"g": 435.8343, "F": 486.1327, "e": 546.0740, "d": 587.5618, "C": 656.2725}
PUBLISHED_INDEX = {
    "N-BK7": {"g": 1.52668, "F": 1.52238, "e": 1.51872, "d": 1.51680, "C": 1.51432},
    "N-SF11": {"g": 1.82533, "F": 1.80651, "e": 1.79192, "d": 1.78472, "C": 1.77596},
}
ABBE_NUMBER = {"N-BK7": 64.17, "N-SF11": 25.68}

SURFACES = {"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}}
D65 = {"kind": "illuminant", "name": "D65"}
EVEN = {"kind": "table", "wavelength_nm": [300, 900], "value": [1, 1]}
TRIANGLE = {"kind": "table", "wavelength_nm": [400, 620, 700], "value": [0, 1, 0]}
PLANCK = {"kind": "black_body", "temperature_k": 3200}


def glass(name: str) -> dict:
    return {"refractive_index": {"formula": "sellmeier", "coefficients": SELLMEIER[name]}}


def sellmeier(name: str, nm):
    """n² = 1 + Σ B λ² / (λ² - C): W. Sellmeier, Ann. Phys. 219 (1871) 272."""
    um2 = (np.asarray(nm, float) / 1000) ** 2
    c = SELLMEIER[name]
    return np.sqrt(1 + sum(b * um2 / (um2 - p) for b, p in zip(c[::2], c[1::2], strict=True)))


def line(nm: float) -> dict:
    return {"kind": "lines", "wavelength_nm": [nm]}


def lit(source: dict, spectrum: dict) -> dict:
    return {**source, "spectrum": spectrum}


def wavelengths(h: Histories) -> np.ndarray:
    """(n_rays,) in nm, 0 where a ray was not narrowed."""
    return np.concatenate([p.ray_wavelength_nm for p in h.raymap.portions]).astype(float)


def density(spectrum: dict, nm):
    """Relative flux per nm, written down anew."""
    if spectrum["kind"] == "illuminant":
        return illuminant(np.asarray(nm, float), spectrum["name"])
    if spectrum["kind"] == "black_body":
        um = np.asarray(nm, float) / 1000
        return um**-5 / np.expm1(14387.76877 / (um * spectrum["temperature_k"]))
    return np.interp(nm, spectrum["wavelength_nm"], spectrum["value"], left=0, right=0)


@pytest.mark.parametrize("name", SELLMEIER)
def test_the_coefficients_here_are_those_of_the_data_sheet(name):
    for which, nm in LINES_NM.items():
        assert sellmeier(name, nm) == pytest.approx(PUBLISHED_INDEX[name][which], abs=6e-6)
    n = {which: float(sellmeier(name, nm)) for which, nm in LINES_NM.items()}
    assert (n["d"] - 1) / (n["F"] - n["C"]) == pytest.approx(ABBE_NUMBER[name], abs=6e-3)


# ---------------------------------------------------------------------------------------------------------------------
# Prisms

APEX = math.radians(60)


def prism_scene(folder, name: str, beams: list[tuple[float, dict]], rays: int, apex: float = APEX) -> Histories:
    """Beams from the left onto a prism, a source for each (angle of incidence in rad, spectrum); its base is black."""
    sources = {}
    for k, (incidence, spectrum) in enumerate(beams):
        # the left face: its outward normal, and the middle of its upper half
        normal = np.array([-math.cos(apex / 2), 0, math.sin(apex / 2)])
        along = np.array([-math.sin(apex / 2), 0, -math.cos(apex / 2)])
        direction = -normal * math.cos(incidence) - along * math.sin(incidence)
        sources[f"S{k}"] = lit(disc_source(10 * along - 30 * direction, direction, 0.2), spectrum)
    return traced(
        folder,
        {"Prism": body(prism(apex, 40, 20), "polished", "glass", rest="black")},
        rays=rays,
        media={"glass": glass(name)},
        surfaces=SURFACES,
        sources=sources,
        settings={"store": "spectral"},
    )


def deviation(h: Histories) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rays that go straight through both faces: (rays, deviation in rad, by how much rounding may change it)."""
    rays = np.flatnonzero(np.diff(h.offsets) == 4)
    first = h.first[rays]
    through = (h.kind[first + 1] == EventKind.FRESNEL_REFRACTION) & (h.kind[first + 2] == EventKind.FRESNEL_REFRACTION)
    rays = rays[through & (h.kind[first + 3] == EventKind.LEFT)]
    row = h.first[rays]
    before, after = h.way[row + 1], h.way[row + 3]
    grid = math.sqrt(3) * h.raymap.manifest.grid_mm
    slack = grid / np.linalg.norm(before, axis=1) + grid / np.linalg.norm(after, axis=1)
    cross = np.cross(unit(before), unit(after))[:, 1]
    return rays, np.arcsin(cross), slack


def deviation_by_snell(n, incidence, apex: float = APEX):
    """Deviation of a prism: M. Born, E. Wolf, Principles of Optics, 7th ed., section 4.7.2, eq. 27 to 30."""
    inside = np.arcsin(np.sin(incidence) / n)
    return incidence + np.arcsin(n * np.sin(apex - inside)) - apex


@pytest.mark.parametrize("name", SELLMEIER)
def test_minimum_deviation_at_the_spectral_lines(tmp_path, name):
    """D = 2 asin(n sin(A / 2)) - A (Born & Wolf, section 4.7.2, eq. 34) with the index of the data sheet, which is
    rounded to 5e-6; 1 degree to both sides of that incidence light deviates more.
    """
    apex = APEX if name == "N-BK7" else math.radians(50)
    beams = []
    for nm in LINES_NM.values():
        best = math.asin(float(sellmeier(name, nm)) * math.sin(apex / 2))
        beams += [(best + math.radians(aside), line(nm)) for aside in (-1, 0, 1)]
    h = prism_scene(tmp_path, name, beams, 6_000, apex)
    rays, angle, slack = deviation(h)
    for k, (which, nm) in enumerate(LINES_NM.items()):
        n = PUBLISHED_INDEX[name][which]
        least = 2 * math.asin(n * math.sin(apex / 2)) - apex
        per_index = 2 * math.sin(apex / 2) / math.sqrt(1 - (n * math.sin(apex / 2)) ** 2)
        below, at, above = (h.ray_source[rays] == 3 * k + j for j in range(3))
        assert min(below.sum(), at.sum(), above.sum()) > 200
        assert np.abs(angle[at] - least).max() < slack[at].max() + 6e-6 * per_index
        assert min(angle[below].min(), angle[above].min()) > angle[at].max() + 1e-5
        assert np.abs(wavelengths(h)[rays[at]] - nm).max() < 4e-5  # kept as float32
        exact = deviation_by_snell(sellmeier(name, nm), [beams[3 * k + j][0] for j in range(3)], apex)
        for rows, wanted in zip((below, at, above), exact, strict=True):
            assert np.abs(angle[rows] - wanted).max() < slack[rows].max() + 1e-9


@pytest.mark.parametrize("name", SELLMEIER)
@pytest.mark.parametrize("spectrum", [D65, PLANCK, TRIANGLE], ids=lambda s: s["kind"])
def test_white_light_is_spread_by_wavelength(tmp_path, name, spectrum):
    """Every single ray deviates as Snell's law says of its wavelength, over the whole spectrum."""
    incidence = math.radians(70)
    h = prism_scene(tmp_path, name, [(incidence, spectrum)], 20_000)
    rays, angle, slack = deviation(h)
    assert len(rays) > 8_000
    nm = wavelengths(h)[rays]
    low, high = (400, 700) if spectrum is TRIANGLE else (380, 780)
    assert low <= nm.min() < low + 40
    assert high - 40 < nm.max() <= high
    assert np.ptp(angle) > 0.015
    assert np.all(np.abs(angle - deviation_by_snell(sellmeier(name, nm), incidence)) < slack + 1e-8)


@pytest.mark.parametrize("name", SELLMEIER)
def test_angular_dispersion_between_the_sodium_lines(tmp_path, name):
    """dD/dλ = sin(A) / (cos i2' cos i1') dn/dλ (Born & Wolf, section 4.7.2, eq. 36) between 588.995 and 589.592 nm."""
    incidence = math.radians(65)
    nm = (588.995, 589.592)
    h = prism_scene(tmp_path, name, [(incidence, line(one)) for one in nm], 4_000)
    rays, angle, _ = deviation(h)
    means = [angle[h.ray_source[rays] == k].mean() for k in range(2)]
    at = 0.5 * (nm[0] + nm[1])
    n = float(sellmeier(name, at))
    inside = math.asin(math.sin(incidence) / n)
    outside = math.asin(n * math.sin(APEX - inside))
    slope = float(sellmeier(name, at + 0.5) - sellmeier(name, at - 0.5))
    expected = math.sin(APEX) / (math.cos(outside) * math.cos(inside)) * slope * (nm[1] - nm[0])
    # rounding to the grid moves directions by an even distribution, whose mean is found far better than each
    grid = h.raymap.manifest.grid_mm / 20 / math.sqrt(min(np.bincount(h.ray_source[rays])))
    assert means[1] - means[0] == pytest.approx(expected, abs=5 * grid + 1e-4 * abs(expected))
    assert abs(expected) > 50 * grid


# ---------------------------------------------------------------------------------------------------------------------
# A lens whose zones are flat facets, so that the exact answer for each is known


def zone_lens(radius: float, angles: np.ndarray, length: float) -> Shape:
    """A plano-convex cylindrical lens along y of flat facets, its flat side down at z = 0.

    The facets are chords of a circle; that between two of the ``angles`` has the slope of the circle in its middle.
    """
    x, z = radius * np.sin(angles), radius * (np.cos(angles) - np.cos(angles[-1])) + 0.5
    section = np.vstack([np.column_stack([x, z]), [[x[-1], 0.0], [x[0], 0.0]]])
    m = len(section)
    vertices = np.array([[a, y, b] for y in (-length / 2, length / 2) for a, b in section])
    around = np.arange(m)
    after = np.roll(around, -1)
    sides = np.stack([np.stack([around, after, after + m], 1), np.stack([around, after + m, around + m], 1)], 1)
    fan = np.stack([np.zeros(m - 2, int), around[1:-1], around[2:]], axis=1)
    triangles = np.concatenate([sides.reshape(-1, 3), fan[:, ::-1], fan + m])
    shape = Shape(vertices, triangles, (("Face1", len(triangles)),))
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return shape if np.einsum("ij,ij->", a, np.cross(b, c)) > 0 else shape.inside_out


@pytest.mark.parametrize("name", SELLMEIER)
def test_chromatic_focal_shift_of_a_thin_lens(tmp_path, name):
    """Light that enters through the flat side head-on leaves a zone of slope a at asin(n sin a) - a towards the axis.

    Exact for facets. Near the axis the focal length is R / (n - 1), so 1 / f_F - 1 / f_C = 1 / (f_d V), and f_C - f_F
    is f_d / V to first order (W. Smith, Modern Optical Engineering, 4th ed., section on the thin lens: LchA = -f / V).
    """
    radius, n_zones = 100.0, 20
    # a narrow paraxial zone at x = 0.4 mm, and facets of equal width of angle farther out
    angles = np.concatenate([[-0.02, 0.003, 0.005], np.linspace(0.02, 0.3, n_zones)])
    middle = (angles[1:] + angles[:-1]) / 2
    used = [1, *range(3, len(middle), 4)]
    shape = zone_lens(radius, angles, 10)
    sources = {
        f"{which} {k}": lit(
            disc_source((radius * (math.sin(angles[k]) + math.sin(angles[k + 1])) / 2, 0, -5), (0, 0, 1), 0.01),
            line(nm),
        )
        for k in used
        for which, nm in LINES_NM.items()
    }
    h = traced(
        tmp_path,
        {"Lens": body(shape, "polished", "glass"), "Catcher": body(box((-60, -9, 260), (60, 9, 261)), "black")},
        rays=20_000,
        media={"glass": glass(name)},
        surfaces=SURFACES,
        sources=sources,
    )
    focal: dict[tuple[str, int], float] = {}
    for k in used:
        for which, nm in LINES_NM.items():
            rays = np.flatnonzero((h.ray_source == h.index("sources", f"{which} {k}")) & (np.diff(h.offsets) == 4))
            rays = rays[h.body[h.last[rays]] == h.index("bodies", "Catcher")]
            assert len(rays) > 200
            facet, end = h.position[h.first[rays] + 2], h.position[h.last[rays]]
            tangent = (facet[:, 0] - end[:, 0]) / (end[:, 2] - facet[:, 2])
            n = float(sellmeier(name, nm))
            exact = math.tan(math.asin(n * math.sin(middle[k])) - middle[k])
            grid = h.raymap.manifest.grid_mm
            assert np.abs(tangent - exact).max() < 2 * grid / 200, (which, k)
            # from the second principal plane; the zone's circle, not its chord, stands for the lens
            focal[which, k] = radius * math.sin(middle[k]) / tangent.mean()
    f = {which: focal[which, 1] for which in LINES_NM}
    assert f["d"] == pytest.approx(radius / (PUBLISHED_INDEX[name]["d"] - 1), rel=2e-4)
    assert 1 / f["F"] - 1 / f["C"] == pytest.approx(1 / (f["d"] * ABBE_NUMBER[name]), rel=1e-2)
    assert f["C"] - f["F"] == pytest.approx(f["d"] / ABBE_NUMBER[name], rel=2e-2)
    assert f["g"] < f["F"] < f["e"] < f["d"] < f["C"]


# ---------------------------------------------------------------------------------------------------------------------
# Narrowing to one wavelength

#: Far stronger than any glass, so that what depends on wavelength shows.
STRONG = {"wavelength_nm": [380, 780], "n": [3.0, 1.2]}
N_BANDS = 10


def strong_index(nm):
    return np.interp(nm, STRONG["wavelength_nm"], STRONG["n"])


def normal_reflectance(n):
    """Born & Wolf, section 1.5.2, eq. 23."""
    return ((n - 1) / (n + 1)) ** 2


def over_bands(function, edges) -> np.ndarray:
    """Integral of a function of nm over each band."""
    nm = [np.linspace(a, b, 2001) for a, b in zip(edges, edges[1:], strict=False)]
    return np.array([integrate.simpson(function(x), x=x) for x in nm])


def slab_scene(
    folder, spectrum, rays, *, absorption=0.0, filtered=None, threshold=0.1, n_bands=N_BANDS, edges=(380, 780)
):
    """A beam head-on through a slab of a strongly dispersive medium; before that by a mirror if ``filtered``."""
    bodies = {"Slab": body(box((-20, -20, 0), (20, 20, 5)), "polished", "strong")}
    surfaces = dict(SURFACES)
    source = disc_source((0, 0, -10), (0, 0, 1), 1)
    if filtered:
        surfaces["filter"] = {"kind": "mirror", "reflectance": filtered}
        mirror = box((-10, -10, -1), (10, 10, 0)).turned(math.pi / 4, (0, 1, 0)).moved(0, 0, -20)
        bodies["Mirror"] = body(mirror, "filter")  # what the slab sends back leaves sideways
        source = disc_source((20, 0, -20), (-1, 0, 0), 1)
    return traced(
        folder,
        bodies,
        rays=rays,
        media={"strong": {"refractive_index": STRONG, "absorption_per_mm": absorption}},
        surfaces=surfaces,
        sources={"S": lit(source, spectrum)},
        settings={
            "store": "spectral",
            "roulette_threshold": threshold,
            "spectrum": {"bands": n_bands, "from_nm": edges[0], "to_nm": edges[1]},
        },
    )


def left(h: Histories, *, upwards: bool) -> np.ndarray:
    """Which events are rays that leave, up or down."""
    return (h.kind == EventKind.LEFT) & ((h.way[:, 2] > 0) == upwards)


@pytest.mark.parametrize("spectrum", [D65, EVEN, PLANCK], ids=lambda s: s["kind"])
def test_flux_by_band_behind_a_dispersive_slab(tmp_path, spectrum):
    """With all reflections inside, (1 - R) / (1 + R) of each wavelength gets through, 2 R / (1 + R) comes back
    (Born & Wolf, section 7.6.1, the sum of intensities).
    """
    h = slab_scene(tmp_path, spectrum, 200_000)
    edges = np.append(h.raymap.bands.low_nm, h.raymap.bands.high_nm[-1])
    total = over_bands(lambda nm: density(spectrum, nm), edges).sum()
    for upwards in (True, False):
        rows = left(h, upwards=upwards)
        flux, stderr = h.flux_w(h.per_ray(rows, h.light[rows]))

        def share(nm, upwards=upwards):
            r = normal_reflectance(strong_index(nm))
            return density(spectrum, nm) * ((1 - r) if upwards else 2 * r) / (1 + r)

        agrees("flux by band", flux, stderr, over_bands(share, edges) / total)


def test_flux_by_band_behind_an_absorbing_slab_after_a_coloured_mirror(tmp_path):
    """The spectrum at the slab is no more that of the source; absorption is by band: (1 - R)² e / (1 - R² e²)."""
    nm, reflectance = [380, 450, 550, 650, 780], [0.9, 0.15, 0.7, 0.3, 0.95]
    a_nm, absorption = [380, 500, 780], [0.3, 0.02, 0.1]
    h = slab_scene(
        tmp_path,
        D65,
        200_000,
        filtered={"wavelength_nm": nm, "value": reflectance},
        absorption={"wavelength_nm": a_nm, "value": absorption},
        threshold=0.4,
    )
    edges = np.append(h.raymap.bands.low_nm, h.raymap.bands.high_nm[-1])
    widths = np.diff(edges)
    mirror = over_bands(lambda x: np.interp(x, nm, reflectance), edges) / widths
    inside = np.exp(-5 * over_bands(lambda x: np.interp(x, a_nm, absorption), edges) / widths)
    total = over_bands(lambda x: density(D65, x), edges).sum()
    expected = np.zeros(N_BANDS)
    for b in range(N_BANDS):

        def share(x, b=b):
            r = normal_reflectance(strong_index(x))
            return density(D65, x) * (1 - r) ** 2 * inside[b] / (1 - (r * inside[b]) ** 2)

        expected[b] = mirror[b] * over_bands(share, edges[b : b + 2])[0] / total
    rows = left(h, upwards=True)
    flux, stderr = h.flux_w(h.per_ray(rows, h.light[rows]))
    agrees("flux by band", flux, stderr, expected)


def test_expectation_of_each_band_is_the_same_before_and_after(tmp_path):
    """Where a ray is narrowed it keeps all its light, in one band, and the mean over rays stays that of each band."""
    nm, reflectance = [380, 450, 550, 650, 780], [0.9, 0.15, 0.7, 0.3, 0.95]
    h = slab_scene(tmp_path, TRIANGLE, 100_000, filtered={"wavelength_nm": nm, "value": reflectance}, threshold=0.0)
    before, after = h.light[h.first + 1], h.light[h.first + 2]
    assert (h.kind[h.first + 1] == EventKind.SPECULAR_REFLECTION).all()
    assert ((after > 0).sum(axis=1) == 1).all()
    assert np.abs(after.sum(axis=1) - before.sum(axis=1)).max() < 1e-6
    assert (before == before[0]).all()
    drawn = np.argmax(after, axis=1)
    chi_square_agrees(
        "bands drawn", np.bincount(drawn, minlength=h.light.shape[1]), before[0] / before[0].sum() * 100_000
    )
    nm = wavelengths(h)
    low, high = h.raymap.bands.low_nm[drawn], h.raymap.bands.high_nm[drawn]
    assert ((nm >= low - 1e-4) & (nm <= high + 1e-4)).all()


@pytest.mark.parametrize("n_bands", [1, 7, 40])
@pytest.mark.parametrize("spectrum", [D65, TRIANGLE, PLANCK], ids=lambda s: s["kind"])
def test_drawn_wavelengths_follow_the_spectrum(tmp_path, spectrum, n_bands):
    """Chi-square against the source's own spectrum, whatever the bands; 400 cells of it, finer than any band."""
    h = slab_scene(tmp_path, spectrum, 100_000, n_bands=n_bands)
    nm = wavelengths(h)
    assert (nm > 0).all()
    at = np.linspace(380, 780, 8001)
    below = integrate.cumulative_trapezoid(density(spectrum, at), at, initial=0)
    follows("wavelengths", np.interp(nm, at, below / below[-1]), bins=400)


def test_single_wavelengths_are_drawn_by_their_shares(tmp_path):
    shares = np.array([5, 1, 3, 1])
    lines = {"kind": "lines", "wavelength_nm": [404.6561, 435.8343, 546.074, 578.0], "share": shares.tolist()}
    h = slab_scene(tmp_path, lines, 50_000)
    nm = wavelengths(h)
    for one, share in zip(lines["wavelength_nm"], shares / shares.sum(), strict=True):
        share_agrees(f"{one} nm", (nm == np.float32(one)).sum(), h.n_rays, share)
    assert np.isin(nm, np.float32(lines["wavelength_nm"])).all()


def test_a_spike_within_a_band_is_drawn_by_its_share(tmp_path):
    """An even spectrum of 400 in all, with a spike of area 400, a hundredth of a nanometre wide, in the only band."""
    spike = {"kind": "table", "wavelength_nm": [380, 532.095, 532.1, 532.105, 780], "value": [1, 1, 80001, 1, 1]}
    h = slab_scene(tmp_path, spike, 50_000, n_bands=1)
    nm = wavelengths(h)
    inside = np.abs(nm - 532.1) < 0.0052
    share_agrees("spike", inside.sum(), h.n_rays, 400.01 / 800)
    follows("the rest", (nm[~inside] - 380) / 400, bins=100)


def test_sources_keep_their_own_spectra(tmp_path):
    """Two sources that shine in the same bands, differently: wavelengths follow that of each."""
    rising = {"kind": "table", "wavelength_nm": [380, 780], "value": [0, 1]}
    falling = {"kind": "table", "wavelength_nm": [380, 780], "value": [1, 0]}
    h = traced(
        tmp_path,
        {"Slab": body(box((-20, -20, 0), (20, 20, 5)), "polished", "strong")},
        rays=60_000,
        media={"strong": {"refractive_index": STRONG}},
        surfaces=SURFACES,
        sources={
            "Up": lit(disc_source((0, 0, -10), (0, 0, 1), 1), rising),
            "Down": lit(disc_source((0, 0, 15), (0, 0, -1), 1), falling),
        },
        settings={"spectrum": {"bands": 2}},
    )
    u = (wavelengths(h) - 380) / 400
    follows("rising", u[h.ray_source == 0] ** 2)
    follows("falling", (1 - u[h.ray_source == 1]) ** 2)


def test_a_ray_is_narrowed_once_and_keeps_its_wavelength(tmp_path):
    """Through three slabs of different glasses: the light is in one band from the first surface on."""
    slabs = {f"Slab{k}": body(box((-20, -20, 20 * k), (20, 20, 20 * k + 5)), "polished", f"m{k}") for k in range(3)}
    h = traced(
        tmp_path,
        slabs,
        rays=5_000,
        media={"m0": glass("N-BK7"), "m1": glass("N-SF11"), "m2": {"refractive_index": STRONG}},
        surfaces=SURFACES,
        sources={"S": lit(disc_source((0, 0, -10), (0.3, 0, 1), 1), D65)},
        settings={"store": "spectral"},
    )
    in_bands = (h.light > 0).sum(axis=1)
    assert (in_bands[h.number == 0] == 32).all()
    assert (in_bands[h.number > 0] == 1).all()
    band = np.argmax(h.light, axis=1)
    assert (band[h.number > 0] == band[h.first + 1][h.ray[h.number > 0]]).all()
    # refracted three times, each ray travels along Snell's law of its wavelength in every slab
    nm = wavelengths(h)
    for k, name in enumerate(("N-BK7", "N-SF11")):
        rows = np.flatnonzero(h.medium == h.index("media", f"m{k}"))
        rows = rows[(h.kind[rows] == EventKind.FRESNEL_REFRACTION) & (h.last[h.ray[rows]] > rows)]
        way = h.way[rows + 1]
        sine = np.hypot(way[:, 0], way[:, 1]) / np.linalg.norm(way, axis=1)
        n = sellmeier(name, nm[h.ray[rows]])
        tolerance = 2 * h.raymap.manifest.grid_mm / np.linalg.norm(way, axis=1)
        assert len(rows) > 3_000
        assert np.all(np.abs(sine - 0.3 / math.hypot(0.3, 1) / n) < tolerance)


STRAIGHT_ON = {
    "comes_from": "front",
    "goes_to": "transmission",
    "incoming": {"polar_deg": [0]},
    "outgoing": [{"ring_deg": [0, 90], "azimuth_deg": [[0, 360]]}],
    "value": [[[0.0]]],
    "specular": [[1.0]],
}
REFRACTING = {
    "fresnel": {"kind": "fresnel"},
    "coefficients": {"kind": "coefficients", "specular_transmittance": 1},
    "thin_film": {"kind": "thin_film", "layers": [{"medium": "film", "thickness_nm": 120}]},
    "rough": {"kind": "rough", "roughness": 0.001},
    "gaussian": {"kind": "gaussian", "transmittance": 1, "scattered_share": 0.0, "sigma": 0.1},
    "abg": {"kind": "abg", "transmittance": 1, "a": 0.0, "b": 1, "g": 1},
    "bsdf": {"kind": "bsdf", "data": {"lobes": [STRAIGHT_ON]}},
}


@pytest.mark.parametrize("kind", REFRACTING)
def test_every_surface_that_refracts_narrows_rays_and_bends_them_by_their_wavelength(tmp_path, kind):
    """Snell's law ray by ray; microfacets of slope 0.001 spread it by a little."""
    direction = (math.sin(0.7), 0, -math.cos(0.7))
    h = traced(
        tmp_path,
        {"Block": body(box((-40, -40, -20), (40, 40, 0)), "black", "strong", plus_z="top")},
        rays=4_000,
        media={"strong": {"refractive_index": STRONG}, "film": {"refractive_index": 1.38}},
        surfaces={"top": REFRACTING[kind], "black": {"kind": "absorber"}},
        sources={"S": lit(disc_source((-5 * direction[0], 0, 5 * math.cos(0.7)), direction, 1), D65)},
        settings={"store": "spectral"},
    )
    nm = wavelengths(h)
    assert (nm > 0).all()
    inside = np.flatnonzero(h.position[h.last, 2] < -1)
    assert len(inside) > 3_000
    way = h.way[h.first[inside] + 2]
    sine = way[:, 0] / np.linalg.norm(way, axis=1)
    off = np.abs(math.sin(0.7) / sine - strong_index(nm[inside]))
    assert np.median(off) < (5e-3 if kind == "rough" else 2e-5)
    assert np.quantile(off, 0.9 if kind == "rough" else 1) < (5e-2 if kind == "rough" else 2e-4)  # GGX has long tails
    assert ((h.light[h.first + 1] > 0).sum(axis=1) == 1).all()


def test_rays_that_meet_no_refracting_surface_keep_their_spectrum(tmp_path):
    """Inside a dispersive medium, mirrors and white walls do not ask for a wavelength."""
    h = traced(
        tmp_path,
        {"Cell": body(box((-5, -5, -5), (5, 5, 5)), "white", "glass", plus_z="mirror", minus_z="mixed")},
        rays=2_000,
        media={"glass": glass("N-BK7")},
        surfaces={
            "white": {"kind": "lambertian", "reflectance": 0.5},
            "mirror": {"kind": "mirror", "reflectance": 0.9},
            "mixed": {
                "kind": "mixture",
                "parts": [{"weight": 0.5, "surface": "white"}, {"weight": 0.5, "surface": "mirror"}],
            },
        },
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0], "spectrum": D65}},
        settings={"store": "spectral"},
    )
    assert (wavelengths(h) == 0).all()
    dark = h.light.sum(axis=1) == 0
    assert ((h.light > 0).sum(axis=1)[~dark] == 32).all()


def test_total_reflection_depends_on_the_wavelength(tmp_path):
    """From inside STRONG at 45 degrees light is refracted where n < sqrt(2): above 732.4 nm, none of the rest."""
    border = 780 - 400 * (math.sqrt(2) - 1.2) / 1.8
    direction = (math.sqrt(0.5), 0, math.sqrt(0.5))
    h = traced(
        tmp_path,
        {"Block": body(box((-40, -40, -40), (40, 40, 0)), "black", "strong", plus_z="polished")},
        rays=50_000,
        media={"strong": {"refractive_index": STRONG}},
        surfaces=SURFACES,
        sources={"S": lit(disc_source((-5, 0, -5), direction, 1), EVEN)},
    )
    out = h.kind[h.first + 1] == EventKind.FRESNEL_REFRACTION
    nm = wavelengths(h)
    assert nm[out].min() > border - 0.01
    assert nm[out].min() < border + 5

    def transmittance(x):
        n, sine = strong_index(x), math.sqrt(0.5)
        cos_t = np.sqrt(np.maximum(1 - (n * sine) ** 2, 0))
        s, p = (n * sine - cos_t) / (n * sine + cos_t), (sine - n * cos_t) / (sine + n * cos_t)
        return np.where(n * sine >= 1, 0.0, 1 - (s**2 + p**2) / 2)

    x = np.linspace(border, 780, 200_001)
    share_agrees("refracted", out.sum(), h.n_rays, integrate.trapezoid(transmittance(x), x) / 400)
