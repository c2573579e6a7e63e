# SPDX-License-Identifier: LGPL-2.1-or-later
"""Thin films: the characteristic matrix against closed forms, its tables, and coated surfaces in a scene."""

import math

import numpy as np
import pytest

from raymaps.effects.conductor import metal_reflectance
from raymaps.effects.fresnel import fresnel_reflectance
from raymaps.effects.thin_film import stack_shares
from raymaps.errors import SceneError
from raymaps.kernels.thin_film import place_in_table
from raymaps.kinds import EventKind
from tests.physics.scenes import agrees, body, box, disc_source, traced, unit
from tests.physics.surface_bench import lines, lowered, meet, scene_with, spectrum

REFLECTION, REFRACTION = EventKind.FRESNEL_REFLECTION, EventKind.FRESNEL_REFRACTION
NM = 550.0


def shares(sine, n_i, layers, n_t, nm=NM):
    """Reflected and transmitted share; layers are (index, thickness in nm)."""
    sine = np.atleast_1d(np.asarray(sine, float))
    index = np.array([n for n, _ in layers], complex).reshape(-1, 1) * np.ones_like(sine)
    return stack_shares(sine, n_i, index, np.array([d for _, d in layers], float), n_t, np.array(nm))


def quarter(n):
    return n, NM / 4 / n


# ------------------------------------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("n_layer", [1.2, 1.38, 1.6, 2.35])
@pytest.mark.parametrize(("n_0", "n_s"), [(1.0, 1.52), (1.33, 1.8), (1.52, 1.0)])
def test_quarter_wave_layer(n_layer, n_0, n_s):
    """R = ((n0 ns - n1²) / (n0 ns + n1²))²: M. Born, E. Wolf: Principles of Optics, 7th ed., section 1.6.4, eq. 60."""
    expected = ((n_0 * n_s - n_layer**2) / (n_0 * n_s + n_layer**2)) ** 2
    reflected, transmitted = shares(0.0, n_0, [quarter(n_layer)], n_s)
    assert reflected[0] == pytest.approx(expected, abs=1e-12)
    assert transmitted[0] == pytest.approx(1 - expected, abs=1e-12)


def test_magnesium_fluoride_on_crown_glass():
    """A quarter wave of index 1.38 on glass of 1.52 reflects 1.3 % (Macleod: Thin-Film Optical Filters, section 4.2);
    one of index sqrt(1.52) nothing.
    """
    assert shares(0.0, 1.0, [quarter(1.38)], 1.52)[0][0] == pytest.approx(0.0126, abs=5e-5)
    assert shares(0.0, 1.0, [quarter(math.sqrt(1.52))], 1.52)[0][0] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("pairs", [0, 1, 4, 12])
def test_quarter_wave_stack(pairs):
    """(HL)^N H reflects ((n0 - Y) / (n0 + Y))² with Y = (nH/nL)^2N nH²/ns; (HL)^N with Y = (nH/nL)^2N ns: Macleod,
    section 6.1; Born & Wolf, section 1.6.5, eq. 96.
    """
    high, low, n_s = 2.3, 1.35, 1.52
    ratio = (high / low) ** (2 * pairs)
    for layers, y in (
        ([quarter(high), quarter(low)] * pairs + [quarter(high)], ratio * high**2 / n_s),
        ([quarter(high), quarter(low)] * pairs, ratio * n_s),
    ):
        expected = ((1 - y) / (1 + y)) ** 2
        reflected, transmitted = shares(0.0, 1.0, layers, n_s)
        assert reflected[0] == pytest.approx(expected, abs=1e-12)
        assert transmitted[0] == pytest.approx(1 - expected, abs=1e-12)


def test_half_wave_layers_are_absent():
    """At the wavelength at which a layer is half a wave thick it might as well not be there (Macleod, section 2.9)."""
    for n_layer in (1.38, 2.3, 4.0):
        half = (n_layer, NM / 2 / n_layer)
        assert shares(0.0, 1.0, [half], 1.52)[0][0] == pytest.approx((0.52 / 2.52) ** 2, abs=1e-12)
        coated = shares(0.0, 1.0, [quarter(1.38), half, half], 1.52)
        assert coated[0][0] == pytest.approx(shares(0.0, 1.0, [quarter(1.38)], 1.52)[0][0], abs=1e-12)


def test_layers_of_no_thickness_or_of_the_same_media_leave_the_interface():
    """Fresnel's reflectance at all angles, both ways, beyond the critical angle too; of metals with n + ik."""
    sine = np.linspace(0, 0.9999, 101)
    cos = np.sqrt(1 - sine**2)
    for n_i, n_t in ((1.0, 1.52), (1.52, 1.0), (1.3, 1.3)):
        expected = fresnel_reflectance(cos, n_i, n_t)
        for layers in ([(2.3, 1e-9)], [(n_i, 321.0)], [(n_t, 123.0)], [(n_i, 100.0), (n_t, 77.0)]):
            reflected, transmitted = shares(sine, n_i, layers, n_t)
            assert reflected == pytest.approx(expected, abs=1e-6)
            assert reflected + transmitted == pytest.approx(1, abs=1e-6)
    metal = shares(sine, 1.0, [(0.96 + 6.69j, 400.0)], 0.96 + 6.69j)[0]
    assert metal == pytest.approx(metal_reflectance(cos, 1.0, 0.96, 6.69), abs=1e-9)
    thick = shares(sine, 1.0, [(0.96 + 6.69j, 5e5)], 1.5)  # a metal so thick that nothing gets through, and no overflow
    assert thick[0] == pytest.approx(metal_reflectance(cos, 1.0, 0.96, 6.69), abs=1e-9)
    assert (thick[1] == 0).all()


def airy(sine, n_i, layers, n_t, nm):
    """The same by Airy's sum over all reflections, layer by layer from the last one: r = (r12 + r e) / (1 + r12 r e),
    t = t12 t sqrt(e) / (1 + r12 r e), e = exp(2 i phase) (Born & Wolf, section 1.6.4, eq. 55 and 56).
    """
    both = []
    for is_p in (False, True):
        index = [complex(n_i), *(complex(n) for n, _ in layers), complex(n_t)]
        along = n_i * sine
        q = [np.sqrt(n * n - along * along + 0j) for n in index]
        y = [n * n / k if is_p else k for n, k in zip(index, q, strict=True)]
        r, t = (y[-2] - y[-1]) / (y[-2] + y[-1]), 2 * y[-2] / (y[-2] + y[-1])
        for j in range(len(layers) - 1, -1, -1):
            phase = 2 * np.pi * layers[j][1] * q[j + 1] / nm
            r12, t12 = (y[j] - y[j + 1]) / (y[j] + y[j + 1]), 2 * y[j] / (y[j] + y[j + 1])
            bottom = 1 + r12 * r * np.exp(2j * phase)
            r, t = (r12 + r * np.exp(2j * phase)) / bottom, t12 * t * np.exp(1j * phase) / bottom
        both.append((abs(r) ** 2, abs(t) ** 2 * (y[-1].real / y[0].real)))
    return np.mean(both, axis=0)


def test_any_stack_is_the_sum_of_all_reflections():
    """Random stacks with absorbing and metal layers, over the angle, beyond critical angles of single layers too."""
    rng = np.random.default_rng(12)
    for _ in range(200):
        layers = [
            (complex(rng.uniform(0.1, 3.0), rng.choice([0.0, 0.01, 3.0])), rng.uniform(5, 400))
            for _ in range(rng.integers(1, 7))
        ]
        n_i, n_t = rng.uniform(1, 2, 2)
        sine, nm = rng.uniform(0, 0.999), rng.uniform(300, 1500)
        reflected, transmitted = shares(sine, n_i, layers, n_t, nm)
        expected = airy(sine, n_i, layers, n_t, nm)
        assert (reflected[0], transmitted[0]) == pytest.approx(expected, abs=1e-9)
        assert 0 <= transmitted[0] <= 1 - reflected[0] <= 1


def test_light_goes_through_alike_both_ways():
    """With clear media on both sides the transmittance is the same from either, also of layers that absorb (Macleod,
    section 2.10); what is reflected differs.
    """
    layers = [(0.13 + 3.3j, 25.0), (1.9, 80.0), (1.6 + 0.4j, 60.0)]
    for sine in (0.0, 0.4, 0.6):
        there = shares(sine, 1.0, layers, 1.5)
        back = shares(sine / 1.5, 1.5, layers[::-1], 1.0)
        assert there[1] == pytest.approx(back[1], abs=1e-12)
        assert abs(there[0] - back[0]) > 0.01


@pytest.mark.parametrize("degrees", [45.0, 60.0, 75.0])
@pytest.mark.parametrize("gap_nm", [50.0, 300.0, 3000.0])
def test_frustrated_total_reflection(gap_nm, degrees):
    """Through a gap between two prisms: T = 1 / (1 + ((u² + v²) / 2uv)² sinh²(2 pi d v / lambda)), u = n cos, v =
    sqrt(n² sin² - 1), for p with u/n² in place of u (the waves on both sides of the gap matched; the same as for a
    particle and a barrier, e.g. S. Zhu et al.: Frustrated total internal reflection, Am. J. Phys. 54 (1986), p. 601).
    """
    n, angle = 1.52, math.radians(degrees)
    u, v = n * math.cos(angle), math.sqrt((n * math.sin(angle)) ** 2 - 1)
    through = [
        1 / (1 + ((w**2 + v**2) / (2 * w * v)) ** 2 * math.sinh(2 * math.pi * gap_nm * v / NM) ** 2)
        for w in (u, u / n**2)
    ]
    reflected, transmitted = shares(math.sin(angle), n, [(1.0, gap_nm)], n)
    assert transmitted[0] == pytest.approx(np.mean(through), abs=1e-9)
    assert reflected[0] == pytest.approx(1 - np.mean(through), abs=1e-9)


def test_surface_plasmon():
    """Silver of 50 nm on a prism: p light is absorbed where n sin = Re sqrt(e / (1 + e)), e = (n + ik)² of the silver
    (H. Raether: Surface Plasmons, 1988, eq. 2.7), to half a degree for this thickness.
    """
    silver = 0.135 + 3.988j  # at 632.8 nm
    degrees = np.linspace(42.5, 50, 3001)
    reflected = shares(np.sin(np.radians(degrees)), 1.515, [(silver, 50.0)], 1.0, 632.8)[0]
    expected = math.degrees(math.asin(np.sqrt(silver**2 / (1 + silver**2)).real / 1.515))
    assert degrees[reflected.argmin()] == pytest.approx(expected, abs=0.5)
    assert reflected.min() < 0.55  # all of the p half but little
    assert reflected.max() > 0.9


# ------------------------------------------------------------------------------------------------------- tables


LAYERS = [("dense", 55.0), ("rare", 120.0), ("gold", 8.0)]
MEDIA = {
    "inside": {"refractive_index": 1.52},
    "around": {"refractive_index": 1.0},
    "dense": {"refractive_index": 2.3},
    "rare": {"refractive_index": 1.38},
    "gold": {"refractive_index": 0.47, "extinction": 2.83},
}
INDEX = {"dense": 2.3, "rare": 1.38, "gold": 0.47 + 2.83j}


def film(layers):
    return {"kind": "thin_film", "layers": [{"medium": m, "thickness_nm": d} for m, d in layers]}


@pytest.mark.parametrize("layers", [LAYERS, LAYERS[:2] * 6, [("rare", 3000.0)]])
@pytest.mark.parametrize("from_back", [False, True])
def test_tables_are_right_to_their_tolerance(layers, from_back):
    """Rays at any angle, from both sides: shares that the kernel draws from against the exact ones, to 3e-4."""
    data = lowered("thin_film", scene_with(film(layers), MEDIA), lines(500.0, 633.0))
    n_i, n_t = (1.52, 1.0) if from_back else (1.0, 1.52)
    media = (0, 1)[:: -1 if from_back else 1]
    row = data.row[0, int(from_back), media[0], media[1]]
    assert row >= 0
    grid = data.share.shape[2] - 1
    given = [(INDEX[m], d) for m, d in layers][:: -1 if from_back else 1]
    for degrees in np.random.default_rng(4).uniform(0, 90, 300):
        sine, cos = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
        sine_t = n_i / n_t * sine
        cos_t = math.sqrt(1 - sine_t**2) if sine_t < 1 else -1.0
        place = place_in_table(cos, cos_t, n_i, n_t) * grid
        assert 0 <= place <= grid
        table = data.share[row, int(cos_t < 0)]
        step = min(int(place), grid - 1)
        found = table[step] + (place - step) * (table[step + 1] - table[step])
        for band, nm in enumerate((500.0, 633.0)):
            assert found[:, band] == pytest.approx(np.ravel(shares(sine, n_i, given, n_t, nm)), abs=3e-4)


def test_bands_are_averages_and_lines_exact():
    """A film of many orders over broad bands: the mean over wavelengths of each band, summed in fine steps."""
    bands = spectrum(400.0, 700.0, 3)
    data = lowered("thin_film", scene_with(film([("dense", 800.0)]), MEDIA), bands)
    normal = data.share[data.row[0, 0, 0, 1], 0, -1]
    for band, low in enumerate((400.0, 500.0, 600.0)):
        nm = low + (np.arange(2000) + 0.5) / 20
        mean = np.mean([shares(0.0, 1.0, [(2.3, 800.0)], 1.52, w) for w in nm], axis=0)
        assert normal[:, band] == pytest.approx(mean.ravel(), abs=1e-6)
    line = lowered("thin_film", scene_with(film([("dense", 800.0)]), MEDIA), lines(612.3))
    exact = np.ravel(shares(0.0, 1.0, [(2.3, 800.0)], 1.52, 612.3))
    assert line.share[line.row[0, 0, 0, 1], 0, -1, :, 0] == pytest.approx(exact, abs=1e-12)


def test_layers_disperse_and_absorb_as_their_media_do():
    """A layer with a table of n, and absorption a that stands for k = a lambda / (4 pi)."""
    media = MEDIA | {
        "dense": {
            "refractive_index": {"wavelength_nm": [400, 800], "n": [2.5, 2.1]},
            "absorption_per_mm": {"wavelength_nm": [400, 800], "value": [2000.0, 0.0]},
        }
    }
    data = lowered("thin_film", scene_with(film([("dense", 150.0)]), media), lines(500.0, 700.0))
    for band, (nm, n, absorption) in enumerate(((500.0, 2.4, 1500.0), (700.0, 2.2, 500.0))):
        k = absorption * 1e-6 * nm / (4 * math.pi)
        expected = np.ravel(shares(0.0, 1.0, [(n + 1j * k, 150.0)], 1.52, nm))
        assert data.share[data.row[0, 0, 0, 1], 0, -1, :, band] == pytest.approx(expected, abs=1e-9)


def test_a_layer_too_thick_to_interfere_is_refused():
    with pytest.raises(SceneError, match=r"^Surface 'tested': its layers, 900000 nm in all, .* bodies of their own\.$"):
        lowered("thin_film", scene_with(film([("dense", 900_000.0)]), MEDIA), lines(500.0))


def test_an_index_that_is_not_known_there_is_refused():
    media = MEDIA | {"dense": {"refractive_index": {"wavelength_nm": [400, 600], "n": [2.5, 2.1]}}}
    with pytest.raises(
        SceneError, match=r"^Medium 'dense': its refractive index is known from 400 to 600 nm, but light"
    ):
        lowered("thin_film", scene_with(film([("dense", 100.0)]), media), lines(700.0))


# --------------------------------------------------------------------------------------------------- the kernel


@pytest.mark.parametrize("from_back", [False, True])
@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0])
def test_kernel_reflects_refracts_and_absorbs_by_the_tables(degrees, from_back):
    n = 100_000
    data = lowered("thin_film", scene_with(film(LAYERS), MEDIA), lines(450.0, 550.0, 650.0))
    n_i, n_t = (1.52, 1.0) if from_back else (1.0, 1.52)
    sine = math.sin(math.radians(degrees))
    given = [(INDEX[m], d) for m, d in LAYERS][:: -1 if from_back else 1]
    exact = np.stack([np.ravel(shares(sine, n_i, given, n_t, nm)) for nm in (450.0, 550.0, 650.0)], axis=1)
    met = meet("thin_film", data, math.radians(degrees), n, n_near=n_i, n_far=n_t, from_back=from_back)
    light = np.array([0.5, 0.3, 0.2])
    for kind, share in zip((REFLECTION, REFRACTION), exact, strict=True):
        taken = np.where((met.kind == kind)[:, None], met.light, 0.0)
        stderr = np.maximum(taken.std(axis=0), 1e-12) / math.sqrt(n)
        agrees(kind.label, taken.mean(axis=0), stderr, light * share, rounding=5e-4)
    reflected, refracted = met.kind == REFLECTION, met.kind == REFRACTION
    assert np.abs(met.direction[reflected] - [sine, 0, math.sqrt(1 - sine**2)]).max() < 1e-12
    if n_i * sine < n_t:
        out = [n_i / n_t * sine, 0, -math.sqrt(1 - (n_i / n_t * sine) ** 2)]
        assert np.abs(met.direction[refracted] - out).max() < 1e-12
        assert (met.side[refracted] == -1).all()
        assert (met.medium[refracted] == 1).all()
    else:
        assert not refracted.any()
    assert (met.kind == EventKind.ABSORPTION).any()


def test_clear_coating_loses_nothing():
    data = lowered("thin_film", scene_with(film([("dense", 70.0), ("rare", 90.0)]), MEDIA))
    angle = np.linspace(0, 1.5707, 20_000)
    for from_back in (False, True):
        n_i, n_t = (1.52, 1.0) if from_back else (1.0, 1.52)
        met = meet("thin_film", data, angle, len(angle), n_near=n_i, n_far=n_t, from_back=from_back, threshold=0.0)
        assert np.isin(met.kind, (REFLECTION, REFRACTION)).all()
        # each band's share is its own, but what is reflected and refracted adds up to all
        assert met.light.sum(axis=1) == pytest.approx(1, rel=1e-6)


def test_coated_metal_reflects_or_absorbs():
    """A protected mirror: a layer in front of n + ik."""
    media = MEDIA | {"inside": {"refractive_index": 0.96, "extinction": 6.69}}
    data = lowered("thin_film", scene_with(film([("rare", 100.0)]), media), lines(550.0))
    for degrees in (0.0, 60.0, 85.0):
        angle = math.radians(degrees)
        met = meet("thin_film", data, angle, 2000, light=(1.0,), threshold=0.0)
        expected = shares(math.sin(angle), 1.0, [(1.38, 100.0)], 0.96 + 6.69j)[0][0]
        assert (met.kind == REFLECTION).all()
        assert met.light[:, 0] == pytest.approx(expected, abs=2e-4)


# --------------------------------------------------------------------------------------------------- in a scene


def test_quarter_wave_coating_in_a_scene(tmp_path):
    """A laser beam onto glass coated with a quarter wave of MgF2, at three angles, from outside and from inside."""
    angles = [0.0, 45.0, 70.0]
    inner = [math.degrees(math.asin(math.sin(math.radians(a)) / 1.52)) for a in angles] + [50.0]
    sources = {}
    for name, sign, list_deg in (("out", -1, angles), ("in", 1, inner)):
        for degrees in list_deg:
            direction = np.array([math.sin(math.radians(degrees)), 0, sign * math.cos(math.radians(degrees))])
            sources[f"{name} {degrees:.3f}"] = disc_source(-10 * unit(direction), unit(direction), 0.01) | {
                "spectrum": {"kind": "lines", "wavelength_nm": [NM]}
            }
            del sources[f"{name} {degrees:.3f}"]["rgb"]
    h = traced(
        tmp_path,
        {"Block": body(box((-200, -200, -100), (200, 200, 0)), "black", "inside", plus_z="coated")},
        rays=280_000,
        sources=sources,
        media={"inside": {"refractive_index": 1.52}, "mgf2": {"refractive_index": 1.38}},
        surfaces={"coated": film([("mgf2", NM / 4 / 1.38)]), "black": {"kind": "absorber"}},
    )
    first = h.first + 1
    assert np.isin(h.kind[first], (REFLECTION, REFRACTION)).all()
    for i, name in enumerate(sources):
        where, degrees = name.split()
        n_i, n_t = (1.0, 1.52) if where == "out" else (1.52, 1.0)
        expected = airy(math.sin(math.radians(float(degrees))), n_i, [(1.38, NM / 4 / 1.38)], n_t, NM)[0]
        kinds = h.kind[first[h.ray_source == i]]
        n = len(kinds)
        stderr = math.sqrt(max(expected * (1 - expected), 1e-12) / n)
        agrees(name, (kinds == REFLECTION).mean(), stderr, expected, rounding=1e-3)
    assert expected == pytest.approx(1)  # the last one is beyond the critical angle
