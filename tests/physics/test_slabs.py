# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scattering and absorbing slabs against published figures and exact solutions.

A box whose side faces are perfect mirrors is an infinite slab: unfolded at its mirrors it fills the layer.
"""

import math

import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline

from raymaps.kinds import EventKind
from tests.physics.adding_doubling import (
    h_function,
    half_space_reflectance,
    henyey_greenstein_moments,
    quadrature,
    scattering_layer,
    slab,
)
from tests.physics.scenes import Histories, agrees, body, box, chi_square_agrees, disc_source, traced

ISOTROPIC = np.array([1.0])
HALF_SPACE = 60.0  # optical depth at which what comes back from below is nothing: exp(-2 * 60 * 0.52) at albedo 0.9


def hg(g):
    return {"kind": "henyey_greenstein", "g": g}


def slab_run(
    folder, albedo, depth, *, phase=None, index=1.0, cosine=1.0, rays=100_000, rgb=(1, 1, 1), seed=1, events=10_000
) -> Histories:
    """A narrow beam onto a slab 1 mm thick, 8 mm wide; ``albedo`` and ``depth`` may be given for three bands."""
    albedo, depth = np.broadcast_to(albedo, 3), np.broadcast_to(depth, 3)
    medium = {
        "refractive_index": index,
        "absorption_per_mm": [float(x) for x in (1 - albedo) * depth],
        "scattering": [
            {"coefficient_per_mm": [float(x) for x in albedo * depth], "phase": phase or {"kind": "isotropic"}}
        ],
    }
    sides = dict.fromkeys(("plus_x", "minus_x", "plus_y", "minus_y"), "side")
    direction = np.array([math.sqrt(1 - cosine**2), 0, -cosine])
    return traced(
        folder,
        {"Slab": body(box((-4, -4, 0), (4, 4, 1)), "polished", "milk", **sides)},
        rays=rays,
        seed=seed,
        media={"milk": medium},
        surfaces={"polished": {"kind": "fresnel"}, "side": {"kind": "mirror", "reflectance": 1.0}},
        sources={"S": disc_source(np.array([0, 0, 1]) - 0.5 * direction, direction, 0.1, rgb=rgb)},
        settings={"max_events": events},
    )


def ends(h: Histories):
    """Which rays left upwards, and downwards; none is killed."""
    left = h.kind[h.last] == EventKind.LEFT
    assert left.sum() + h.count_kind(EventKind.MEDIUM_ABSORPTION) == h.n_rays
    up = h.way[h.last, 2] > 0
    return left & up, left & ~up


def agrees_with(h: Histories, expected, reflectance=None, transmittance=None):
    """Light that leaves up and down, relative to all; published figures in place of the computed ones where given."""
    up, down = ends(h)
    for what, chosen, share in (
        ("reflectance", up, reflectance or expected.reflectance),
        ("transmittance", down, transmittance or expected.transmittance),
    ):
        agrees(what, chosen.mean(), math.sqrt(share * (1 - share) / h.n_rays), share)


# ------------------------------------------------------------------------------------------------- published figures


def test_the_reference_gives_published_figures():
    """Adding and doubling, and the H function, against tables to the last printed digit.

    H. van de Hulst: Multiple Light Scattering (1980): HG g = 0.75, albedo 0.9, depth 2, R = 0.09739, T = 0.66096 (as
    quoted by L. Wang et al.: MCML, 1995). R. Giovanelli: Reflection by semi-infinite
    diffusers, Optica Acta 2 (1955), p. 153: isotropic, albedo 0.9, index 1.5, R = 0.2600 (quoted there too).
    S. Chandrasekhar: Radiative Transfer (1960), table 11: H for albedo 1.
    """
    found = slab(0.9, 2.0, henyey_greenstein_moments(0.75, 40))
    assert (found.reflectance, found.transmittance) == pytest.approx((0.09739, 0.66096), abs=5e-6)

    assert slab(0.9, HALF_SPACE, ISOTROPIC, 1.5).reflectance == pytest.approx(0.2600, abs=1e-4)

    assert h_function(1.0, np.array([1.0, 0.5, 0.1])) == pytest.approx([2.9078, 2.0128, 1.2474], abs=5e-5)
    exact = half_space_reflectance(0.9, 1.0)
    assert slab(0.9, HALF_SPACE, ISOTROPIC).reflectance == pytest.approx(exact, abs=1e-7)


def test_the_reference_gives_van_de_hulsts_table_12():
    """Isotropic scattering, albedo 0.8, depth 2: reflection and transmission functions (pi times the radiance of a slab
    that is irradiated with 1 W per area of its surface) between a direction at cosine 0.5 and others.

    H. van de Hulst: Multiple Light Scattering (1980), volume 1, table 12, pages 260 and 261.
    """
    cosine, weight = quadrature(80, 1.0)
    layer = scattering_layer(cosine, weight, 0.8, 2.0, ISOTROPIC)
    reflection = layer.r_above / (2 * weight * cosine)[:, None]
    transmission = (layer.t_down - np.diag(np.exp(-2.0 / cosine))) / (2 * weight * cosine)[:, None]
    for operator, table in (
        (reflection, {1.0: 0.28616, 0.9: 0.30277, 0.7: 0.34188, 0.5: 0.39102, 0.3: 0.45353, 0.1: 0.53214}),
        (transmission, {1.0: 0.14864, 0.9: 0.14731, 0.7: 0.13963, 0.3: 0.09425, 0.1: 0.06601}),
    ):
        function = RectBivariateSpline(cosine, cosine, operator)
        assert function(0.5, sorted(table))[0] == pytest.approx([table[m] for m in sorted(table)], abs=1.5e-5)


def test_van_de_hulst_slab(tmp_path):
    """The slab that MCML was validated with: scattering 90/cm, absorption 10/cm, g = 0.75, 0.02 cm, no index step."""
    h = slab_run(tmp_path, 0.9, 2.0, phase=hg(0.75), rays=200_000)
    agrees_with(h, None, reflectance=0.09739, transmittance=0.66096)


def test_giovanelli_half_space(tmp_path):
    """Isotropic scattering, albedo 0.9, index 1.5: R = 0.2600 with the 4 % of the surface."""
    h = slab_run(tmp_path, 0.9, HALF_SPACE, index=1.5, rays=100_000)
    up, _ = ends(h)
    expected = slab(0.9, HALF_SPACE, ISOTROPIC, 1.5)
    agrees("R", up.mean(), math.sqrt(0.26 * 0.74 / h.n_rays), 0.2600, rounding=4e-4)  # printed with four digits
    agrees_with(h, expected)
    at_once = h.kind[h.first + 1] == EventKind.FRESNEL_REFLECTION
    agrees("specular", at_once.mean(), math.sqrt(0.04 * 0.96 / h.n_rays), 0.04)


def test_van_de_hulsts_isotropic_slab(tmp_path):
    """The slab of his table 12, with a beam at cosine 0.5: how much leaves at which cosine, up and down."""
    h = slab_run(tmp_path, 0.8, 2.0, cosine=0.5, rays=200_000)
    cosine, weight = quadrature(80, 1.0)
    layer = scattering_layer(cosine, weight, 0.8, 2.0, ISOTROPIC)
    way = h.way[h.last]
    leaving = np.abs(way[:, 2]) / np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    scattered = h.per_ray(h.kind == EventKind.MEDIUM_SCATTERING) > 0
    edges = np.linspace(0, 1, 21)
    x, w = np.polynomial.legendre.leggauss(8)
    m = (edges[:-1, None] + edges[1:, None]) / 2 + x * 0.025
    for what, chosen, operator in (
        ("up", ends(h)[0], layer.r_above),
        ("down", ends(h)[1], layer.t_down - np.diag(np.exp(-2.0 / cosine))),
    ):
        density = RectBivariateSpline(cosine, cosine, operator / weight[:, None])(m.ravel(), 0.5).reshape(m.shape)
        shares = (density * w * 0.025).sum(axis=1)
        counts = np.histogram(leaving[chosen & scattered], edges)[0]
        agrees(what, counts / h.n_rays, np.sqrt(shares * (1 - shares) / h.n_rays), shares, rounding=1e-3)
    through = ends(h)[1] & ~scattered
    agrees("unscattered", through.mean(), math.sqrt(math.exp(-4) / h.n_rays), math.exp(-4))


@pytest.mark.parametrize(("albedo", "cosine"), [(0.5, 1.0), (0.9, 1.0), (0.99, 1.0), (0.9, 0.4)])
def test_chandrasekhar_half_space(tmp_path, albedo, cosine):
    """R = 1 - sqrt(1 - w) H(m0); what leaves has the density w/2 m / (m + m0) H(m) H(m0) over the cosine m
    (Chandrasekhar, Radiative Transfer, chapters 3 and 4).
    """
    depth = 60.0 if albedo < 0.95 else 120.0
    h = slab_run(tmp_path, albedo, depth, cosine=cosine, rays=100_000)
    up, _ = ends(h)
    expected = half_space_reflectance(albedo, cosine)
    agrees("R", up.mean(), math.sqrt(expected * (1 - expected) / h.n_rays), expected)

    edges = np.linspace(0, 1, 21)
    x, w = np.polynomial.legendre.leggauss(16)
    m = (edges[:-1, None] + edges[1:, None]) / 2 + x * 0.025
    density = albedo / 2 * m / (m + cosine) * h_function(albedo, m.ravel()).reshape(m.shape)
    shares = (density * w * 0.025).sum(axis=1) * h_function(albedo, cosine)
    assert shares.sum() == pytest.approx(expected, abs=1e-6)
    way = h.way[h.last[up]]
    leaving = np.histogram(way[:, 2] / np.linalg.norm(way, axis=1), edges)[0]
    chi_square_agrees("cosines", leaving, shares / shares.sum() * up.sum())


# ------------------------------------------------------------------------------------------------------ exact figures


@pytest.mark.parametrize(
    ("albedo", "depth", "g", "index"),
    [
        (0.8, 0.5, 0.0, 1.0),
        (0.99, 4.0, 0.0, 1.0),
        (0.95, 8.0, 0.9, 1.0),
        (0.6, 1.0, -0.5, 1.0),
        (0.9, 1.0, 0.0, 1.4),
        (0.95, 2.0, 0.75, 1.5),
        (0.99, 10.0, 0.9, 1.33),
        (0.9, 2.0, 0.5, 0.75),
    ],
)
def test_slabs(tmp_path, albedo, depth, g, index):
    """Isotropic and Henyey-Greenstein slabs, with and without an index step, against adding and doubling."""
    h = slab_run(tmp_path, albedo, depth, phase=hg(g), index=index, rays=100_000)
    agrees_with(h, slab(albedo, depth, henyey_greenstein_moments(g, 60), index, n=60))


@pytest.mark.parametrize("index", [1.0, 1.5])
def test_nothing_is_lost_without_absorption(tmp_path, index):
    """R + T = 1 exactly, and the ledger has no other entry."""
    h = slab_run(tmp_path, 1.0, 5.0, phase=hg(0.5), index=index, rays=40_000)
    up, down = ends(h)
    assert (up | down).all()
    assert (h.light[h.last].sum(axis=1) == h.light[h.first].sum(axis=1)).all()
    agrees_with(h, slab(1.0, 5.0, henyey_greenstein_moments(0.5, 40), index))


def test_bands_of_different_coefficients(tmp_path):
    """Albedo, depth and light differ by band: the expectation of each band is that of a slab of its own."""
    albedo, depth, rgb = np.array([0.95, 0.8, 0.5]), np.array([1.0, 3.0, 0.4]), np.array([0.5, 0.3, 0.2])
    h = slab_run(tmp_path, albedo, depth, phase=hg(0.5), index=1.3, rgb=tuple(rgb), rays=150_000)
    bands = [slab(a, d, henyey_greenstein_moments(0.5, 40), 1.3) for a, d in zip(albedo, depth, strict=True)]
    for chosen, expected in zip(
        ends(h), ([b.reflectance for b in bands], [b.transmittance for b in bands]), strict=True
    ):
        light = np.where(chosen[:, None], h.light[h.last], 0)
        agrees("bands", light.mean(axis=0), light.std(axis=0) / math.sqrt(h.n_rays), rgb * expected)
        assert light.sum(axis=1)[chosen] == pytest.approx(1, abs=2e-5)


def test_a_tabulated_phase_function(tmp_path):
    """p = 1 + cos(theta) / 2, the linearly anisotropic phase function of Chandrasekhar's chapter 6, in a fine table."""
    angle = np.linspace(0, 180, 181)
    value = 1 + 0.5 * np.cos(np.radians(angle))
    phase = {"kind": "table", "angle_deg": list(map(float, angle)), "value": list(map(float, value))}
    h = slab_run(tmp_path, 0.95, 2.0, phase=phase, rays=100_000)
    agrees_with(h, slab(0.95, 2.0, np.array([1.0, 0.5 / 3])))


@pytest.mark.parametrize("spectrum", ["lines", "table"])
def test_spectra(tmp_path, spectrum):
    """Scattering that falls with the fourth power of the wavelength, absorption that climbs: the expectation of each
    line, or of each band with the means of its coefficients, is that of a slab of its own.
    """
    if spectrum == "lines":
        lines = [450.0, 550.0, 650.0]
        light = {"kind": "lines", "wavelength_nm": lines, "share": [0.5, 0.3, 0.2]}
        shares, nm, bands = np.array([0.5, 0.3, 0.2]), np.array(lines)[:, None], {}
    else:
        light = {"kind": "table", "wavelength_nm": [400, 700], "value": [1, 2]}
        edges = np.linspace(400, 700, 9)
        shares = np.diff(edges + (edges - 400) ** 2 / 600) / 450
        nm = (edges[:-1, None] + (np.arange(1000) + 0.5) / 1000 * np.diff(edges)[:, None]).round(9)
        bands = {"spectrum": {"from_nm": 400, "to_nm": 700, "bands": 8}}
    table = np.arange(400.0, 701.0, 10.0)
    scattering, absorption = 2.0 * (550 / table) ** 4, 0.5 * (table / 550) ** 2
    medium = {
        "refractive_index": 1.3,
        "absorption_per_mm": {"wavelength_nm": list(table), "value": list(absorption)},
        "scattering": [
            {"coefficient_per_mm": {"wavelength_nm": list(table), "value": list(scattering)}, "phase": hg(0.5)}
        ],
    }
    sides = dict.fromkeys(("plus_x", "minus_x", "plus_y", "minus_y"), "side")
    beam = disc_source((0, 0, 1.5), (0, 0, -1), 0.1)
    del beam["rgb"]
    h = traced(
        tmp_path,
        {"Slab": body(box((-4, -4, 0), (4, 4, 1)), "polished", "milk", **sides)},
        rays=100_000,
        media={"milk": medium},
        surfaces={"polished": {"kind": "fresnel"}, "side": {"kind": "mirror", "reflectance": 1.0}},
        sources={"S": {**beam, "spectrum": light}},
        settings={"max_events": 10_000, "store": "spectral", **bands},
    )
    s, a = np.interp(nm, table, scattering).mean(axis=1), np.interp(nm, table, absorption).mean(axis=1)
    exact = [slab(x / (x + y), x + y, henyey_greenstein_moments(0.5, 40), 1.3) for x, y in zip(s, a, strict=True)]
    for chosen, expected in zip(
        ends(h), ([e.reflectance for e in exact], [e.transmittance for e in exact]), strict=True
    ):
        leaving = np.where(chosen[:, None], h.light[h.last], 0)
        agrees("bands", leaving.mean(axis=0), leaving.std(axis=0) / math.sqrt(h.n_rays), shares * expected)
