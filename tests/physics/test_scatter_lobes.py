# SPDX-License-Identifier: LGPL-2.1-or-later
"""Gaussian and ABg lobes about the specular direction."""

import math

import numpy as np
import pytest

from raymaps.effects.abg import abg_bsdf, ring_edges, ring_shares, scatter_nodes
from raymaps.effects.gaussian import lobe_density
from raymaps.jit import kernel
from raymaps.kernels.abg import scattered_share
from raymaps.kernels.lobes import abg_point, gaussian_point
from raymaps.kinds import EventKind
from raymaps.materials.scatter import abg_total_scatter
from tests.physics.scenes import agrees, body, box, disc_source, follows, share_agrees, traced, unit
from tests.physics.surface_bench import cells_agree, lambertian_angles, lowered, meet, reciprocal, scene_with

KINDS = (
    EventKind.BSDF_SPECULAR_REFLECTION,
    EventKind.BSDF_SPECULAR_REFRACTION,
    EventKind.BSDF_DIFFUSE_REFLECTION,
    EventKind.BSDF_DIFFUSE_REFRACTION,
)
#: B and g of the model: fine polish, steep, flat, wide, and as good as constant.
ABG = [(1e-4, 2.0), (1e-6, 3.0), (1e-3, 1.5), (0.05, 4.0), (1e-9, 1.2), (1.0, 0.0), (1e-12, 0.3), (0.5, 10.0)]


@kernel
def gaussian_points(specular, sigma, seed, points):
    for i in range(len(points)):
        points[i, 0], points[i, 1] = gaussian_point(specular, sigma, seed, np.uint64(i), 3)


@kernel
def abg_points(specular, b, g, edges, shares, seed, points):
    for i in range(len(points)):
        points[i, 0], points[i, 1] = abg_point(specular, b, g, edges, shares, seed, np.uint64(i), 3)


# ------------------------------------------------------------------------------------------------ total scatter


def test_total_scatter_in_closed_form():
    """At normal incidence 2 pi A times the integral of r / (B + r^g) from 0 to 1: for g = 2 pi A ln(1 + 1/B), for g = 0
    pi A / (1 + B) at all angles, for g = 1 2 pi A (1 - B ln(1 + 1/B)), for g = 4 pi A arctan(1/sqrt B) / sqrt B.
    """
    for b in (1e-9, 1e-4, 0.03, 1.0, 20.0):
        assert abg_total_scatter(0.0, 0.3, b, 2.0) == pytest.approx(0.3 * math.pi * math.log1p(1 / b), rel=1e-9)
        assert abg_total_scatter([0.0, 0.5, 1.0], 0.3, b, 0.0) == pytest.approx(0.3 * math.pi / (1 + b), rel=1e-8)
        one = 2 * math.pi * (1 - b * math.log1p(1 / b))
        assert abg_total_scatter(0.0, 1.0, b, 1.0) == pytest.approx(one, rel=1e-7)
        four = math.pi * math.atan(1 / math.sqrt(b)) / math.sqrt(b)
        assert abg_total_scatter(0.0, 1.0, b, 4.0) == pytest.approx(four, rel=1e-7)


@pytest.mark.parametrize(("b", "g"), ABG)
@pytest.mark.parametrize("specular", [0.0, 0.3, 0.8, 0.99, 1.0])
def test_total_scatter_is_the_integral_over_the_disc(b, g, specular):
    """Summed over rings and azimuths about the specular direction, point by point."""
    reach = 1 + specular
    edge = np.concatenate([[0.0], np.geomspace(1e-7, reach, 4000)])
    r = (edge[1:] + edge[:-1]) / 2
    azimuth = (np.arange(1000) + 0.5) * math.pi / 1000
    inside = specular**2 + 2 * specular * r[:, None] * np.cos(azimuth) + r[:, None] ** 2 < 1
    total = (abg_bsdf(r, 0.7, b, g) * np.diff(edge**2) / 2 * inside.mean(axis=1)).sum() * 2 * math.pi
    assert abg_total_scatter(specular, 0.7, b, g)[0] == pytest.approx(total, rel=3e-3)


@pytest.mark.parametrize(("b", "g"), ABG)
def test_table_of_the_total_scatter(b, g):
    """Between its nodes it is linear to 1e-4 of the largest value; scatter falls from normal to grazing incidence."""
    nodes = scatter_nodes(b, g)
    values = abg_total_scatter(nodes, 1.0, b, g)
    at = np.concatenate([np.random.default_rng(5).uniform(size=200), 1 - np.geomspace(1e-8, 0.1, 50), [0.0, 1.0]])
    table = np.array([scattered_share(s, nodes, values) for s in at])
    assert np.abs(table - abg_total_scatter(at, 1.0, b, g)).max() < 1e-4 * values.max()
    assert values.argmax() == 0 or g == 0
    assert np.diff(values).max() <= 1e-7 * values[0]


# ----------------------------------------------------------------------------------------------------- samplers


def radial_cells(points, specular, radii):
    """Counts by distance from the specular direction and by the half of the plane of azimuths, and azimuth cosines."""
    p, q = points[:, 0] - specular, points[:, 1]
    azimuth = np.arctan2(np.abs(q), p)
    return np.histogram2d(np.hypot(p, q), azimuth, [radii, np.linspace(0, math.pi, 9)])[0]


def expected_cells(density, specular, radii, n):
    """The integral of a density (of distance) over the same cells, cut off at the unit disc; not normalised."""
    expected = np.zeros((len(radii) - 1, 8))
    for i, (low, high) in enumerate(zip(radii, radii[1:], strict=False)):
        edge = np.sqrt(np.linspace(low**2, high**2, 401))
        r = np.sqrt((edge[1:] ** 2 + edge[:-1] ** 2) / 2)
        azimuth = (np.arange(800) + 0.5) * math.pi / 800
        inside = specular**2 + 2 * specular * r[:, None] * np.cos(azimuth) + r[:, None] ** 2 < 1
        share = inside.reshape(400, 8, 100).mean(axis=2) / 8
        expected[i] = (density(r)[:, None] * share * np.diff(edge**2)[:, None]).sum(axis=0)
    return expected / expected.sum() * n


@pytest.mark.parametrize("sigma", [0.01, 0.2, 0.7, 2.0])
@pytest.mark.parametrize("specular", [0.0, 0.6, 0.98, 1.0])
def test_gaussian_points_follow_their_density(sigma, specular):
    n = 100_000
    points = np.empty((n, 2))
    gaussian_points(specular, sigma, np.uint64(7), points)
    assert (np.hypot(*points.T) < 1).all()
    radii = np.linspace(0, min(1 + specular, 5 * sigma), 21)
    expected = expected_cells(lambda r: np.exp(-(r**2) / (2 * sigma**2)), specular, radii, n)
    if radii[-1] < 1 + specular:
        expected *= (np.hypot(points[:, 0] - specular, points[:, 1]) < radii[-1]).mean()
        assert (np.hypot(points[:, 0] - specular, points[:, 1]) > radii[-1]).sum() < 20
    counts = radial_cells(points, specular, radii)
    cells_agree(f"sigma {sigma}, specular {specular}", counts, expected * counts.sum() / expected.sum())


@pytest.mark.parametrize("specular", [0.0, 0.5, 0.95])
def test_gaussian_reference_is_a_density(specular):
    """Its sum over the disc is 1, and it falls by exp(-1/2) at sigma."""
    grid = (np.arange(1200) + 0.5) / 600 - 1
    p, q = np.meshgrid(grid, grid)
    for sigma in (0.1, 0.5, 2.0):
        assert lobe_density(p, q, specular, sigma).sum() / 600**2 == pytest.approx(1, abs=2e-3)
        top, side = lobe_density(np.array([specular] * 2), np.array([0.0, min(sigma, 0.3)]), specular, sigma)
        assert side / top == pytest.approx(math.exp(-(min(sigma, 0.3) ** 2) / (2 * sigma**2)))


@pytest.mark.parametrize(("b", "g", "coarse"), [*((b, g, False) for b, g in ABG), (1e-4, 2.0, True), (0.05, 4.0, True)])
@pytest.mark.parametrize("specular", [0.0, 0.7, 1.0])
def test_abg_points_follow_their_density(b, g, specular, coarse):
    """Cells of about equal share from the lobe's centre to its farthest end; exact however coarse the rings are."""
    n = 100_000
    points = np.empty((n, 2))
    edges = ring_edges(b, g)
    edges = edges[::64] if coarse else edges
    assert (edges[0], edges[-1]) == (0.0, 2.0)
    abg_points(specular, b, g, edges, ring_shares(edges, b, g), np.uint64(11), points)
    assert (np.hypot(*points.T) < 1).all()
    fine = np.geomspace(1e-12, 1 + specular, 4001)
    weight = np.cumsum(np.diff(fine**2) / (b + fine[1:] ** g))
    inner = np.interp(np.linspace(0, 1, 21)[1:-1], weight / weight[-1], fine[1:])
    radii = np.concatenate([[0.0], inner, [1 + specular]])
    expected = expected_cells(lambda r: 1 / (b + r**g), specular, radii, n)
    cells_agree(f"B {b}, g {g}, specular {specular}", radial_cells(points, specular, radii), expected)


# ------------------------------------------------------------------------------------------------- the kernels


def gaussian_data(**fields):
    return lowered("gaussian", scene_with({"kind": "gaussian", **fields}))


def abg_data(**fields):
    return lowered("abg", scene_with({"kind": "abg", **fields}))


@pytest.mark.parametrize("threshold", [0.0, 1.0])
@pytest.mark.parametrize("degrees", [0.0, 50.0, 85.0])
@pytest.mark.parametrize("name", ["gaussian", "abg"])
def test_shares_kinds_and_directions(name, degrees, threshold):
    """Each band's share of each outcome; specular light by the laws of reflection and refraction; scattered light lies
    around it, on the far side around the refracted direction (projections: sin / n).
    """
    n, angle = 200_000, math.radians(degrees)
    light, reflectance, transmittance = np.array([0.5, 0.3, 0.2]), np.array([0.5, 0.3, 0.4]), np.array([0.3, 0.4, 0.6])
    common = {"reflectance": reflectance.tolist(), "transmittance": transmittance.tolist()}
    sine = math.sin(angle)
    specular = (sine, sine / 1.5)
    if name == "gaussian":
        data = gaussian_data(**common, scattered_share=0.3, sigma=0.05)
        scattered = np.stack([0.3 * reflectance, 0.3 * transmittance])
    else:
        data = abg_data(**common, a=0.01, b=1e-3, g=2.0)
        scattered = np.tile(abg_total_scatter(np.array(specular), 0.01, 1e-3, 2.0)[:, None], 3)
    met = meet(name, data, angle, n, threshold=threshold)
    shares = (reflectance - scattered[0], transmittance - scattered[1], scattered[0], scattered[1])
    for kind, share in zip(KINDS, shares, strict=True):
        taken = np.where((met.kind == kind)[:, None], met.light, 0.0)
        agrees(kind.label, taken.mean(axis=0), taken.std(axis=0) / math.sqrt(n), light * share, rounding=2e-4)
    gone = met.kind == EventKind.ABSORPTION
    assert not met.light[gone].any()
    assert np.isin(met.kind[~gone], KINDS).all()
    through = np.isin(met.kind, KINDS[1::2])
    assert (met.medium[~gone] == through[~gone]).all()
    assert (met.side[~gone] == np.where(through, -1, 1)[~gone]).all()
    assert (np.sign(met.direction[~gone, 2]) == met.side[~gone]).all()
    for kind, p, sign in zip(KINDS[:2], specular, (1, -1), strict=True):
        assert np.abs(met.direction[met.kind == kind] - [p, 0, sign * math.sqrt(1 - p * p)]).max() < 1e-9
    for kind, p in zip(KINDS[2:], specular, strict=True):
        out = met.direction[met.kind == kind][:, :2]
        if name == "abg":  # r = |b - b0| lies below any radius with the share of the TIS within it
            r = np.hypot(out[:, 0] - p, out[:, 1])
            if p == 0:
                follows("distance", np.log1p(r**2 / 1e-3) / math.log1p(1e3))
        elif p < 0.7:
            follows("distance", -np.expm1(-((out[:, 0] - p) ** 2 + out[:, 1] ** 2) / (2 * 0.05**2)))
        assert abs(np.median(out[:, 1])) < 0.02


@pytest.mark.parametrize("name", ["gaussian", "abg"])
def test_white_surface_loses_nothing_at_any_angle(name):
    fields = {"reflectance": 0.45, "transmittance": 0.55}
    lobe = {"scattered_share": 0.5, "sigma": 0.8} if name == "gaussian" else {"a": 0.03, "b": 0.01, "g": 2.0}
    data = lowered(name, scene_with({"kind": name, **fields, **lobe}))
    angle = np.linspace(0, math.pi / 2 - 1e-6, 50_000)
    for n_near, n_far in ((1.0, 1.5), (1.5, 1.0), (1.0, 1.0)):
        met = meet(name, data, angle, len(angle), n_near=n_near, n_far=n_far)
        assert np.isin(met.kind, KINDS).all()
        assert met.light.sum(axis=1) == pytest.approx(1, rel=1e-6)
        share_agrees("reflected before the critical angle", (met.side[:20_000] == 1).sum(), 20_000, 0.45)
        beyond = n_near / n_far * np.sin(angle) >= 1
        assert (met.side[beyond] == 1).all()  # total reflection sends back what would pass


@pytest.mark.parametrize("name", ["gaussian", "abg"])
def test_metals_let_nothing_in(name):
    lobe = {"sigma": 0.1} if name == "gaussian" else {"a": 0.001, "b": 0.01, "g": 2.0}
    metal = {"inside": {"refractive_index": 1.0, "extinction": 5.0}}
    surface = {"kind": name, "reflectance": 0.3, "transmittance": 0.6, **lobe}
    met = meet(name, lowered(name, scene_with(surface, metal)), 0.3, 2000, threshold=0.0)
    assert (met.side == 1).all()
    assert met.light.sum(axis=1) == pytest.approx(0.3, rel=1e-6)


def test_abg_without_reflectance_has_no_lobe_there():
    data = abg_data(transmittance=0.9, a=0.01, b=0.01, g=2.0)
    met = meet("abg", data, 0.4, 50_000)
    seen = set(np.unique(met.kind))
    assert seen == {EventKind.BSDF_SPECULAR_REFRACTION, EventKind.BSDF_DIFFUSE_REFRACTION, EventKind.ABSORPTION}


def test_abg_reflection_is_reciprocal():
    """f(i, o) = f(o, i): for light that is equally bright from all sides as much goes from cell i to cell o as back."""
    n = 1_000_000
    data = abg_data(reflectance=1.0, a=0.05, b=0.01, g=2.0)
    angle = lambertian_angles(n, 3)
    met = meet("abg", data, angle, n)
    scattered = met.kind == EventKind.BSDF_DIFFUSE_REFLECTION
    cells = [np.minimum((s**2 * 12).astype(int), 11) for s in (np.sin(angle), np.hypot(*met.direction.T[:2]))]
    flux = np.zeros((12, 12), int)
    np.add.at(flux, (cells[0][scattered], cells[1][scattered]), 1)
    upper = np.triu_indices(12, 1)
    reciprocal("cells", np.diag(flux[upper]), np.diag(flux.T[upper]), n, n, 1.0)


def test_narrow_lobes_go_over_into_the_mirror():
    for name, lobe in (("gaussian", {"sigma": 1e-5}), ("abg", {"a": 1e-8, "b": 1e-13, "g": 3.0})):
        data = lowered(name, scene_with({"kind": name, "reflectance": 1.0, **lobe}))
        met = meet(name, data, 0.8, 20_000)
        off = np.linalg.norm(met.direction - [math.sin(0.8), 0, math.cos(0.8)], axis=1)
        assert np.quantile(off, 0.9) < 1e-3


# --------------------------------------------------------------------------------------------------- in a scene


def beam_on_plate(folder, surface, degrees, rays, medium=None):
    direction = unit(np.array([math.sin(math.radians(degrees)), 0.0, -math.cos(math.radians(degrees))]))
    return traced(
        folder,
        {"Plate": body(box((-500, -500, -50), (500, 500, 0)), "black", medium, plus_z="tested")},
        rays=rays,
        surfaces={"tested": surface, "black": {"kind": "absorber"}},
        media={"glass": {"refractive_index": 1.5}},
        sources={"S": disc_source(-10 * direction, direction, 0.01)},
    )


def test_gaussian_mirror_in_a_scene(tmp_path):
    """At normal incidence a share (1 - exp(-s²/2 sigma²)) / (1 - exp(-1/2 sigma²)) of the scattered light leaves with a
    sine below s: the integral of the lobe over the disc.
    """
    sigma = 0.4
    h = beam_on_plate(
        tmp_path, {"kind": "gaussian", "reflectance": 0.8, "scattered_share": 0.75, "sigma": sigma}, 0.0, 100_000
    )
    first = h.first + 1
    for kind, share in ((KINDS[0], 0.2), (KINDS[2], 0.6)):
        rows = first[h.kind[first] == kind]
        agrees(kind.label, *h.flux_w(h.per_ray(rows, h.light[rows].sum(axis=1))), share)
    rows = first[h.kind[first] == KINDS[2]]
    sine2 = 1 - unit(h.way[rows + 1])[:, 2] ** 2
    follows("sine", np.expm1(-sine2 / (2 * sigma**2)) / math.expm1(-1 / (2 * sigma**2)))


def test_abg_glass_in_a_scene(tmp_path):
    """At normal incidence pi A ln(1 + 1/B) scatters to each side (g = 2), a share ln(1 + s²/B) / ln(1 + 1/B) of it with
    a sine below s, in glass too.
    """
    a, b = 0.02, 0.01
    tis = math.pi * a * math.log1p(1 / b)
    h = beam_on_plate(
        tmp_path,
        {"kind": "abg", "reflectance": 0.35, "transmittance": 0.6, "a": a, "b": b, "g": 2},
        0.0,
        200_000,
        "glass",
    )
    first = h.first + 1
    for kind, share in zip(KINDS, (0.35 - tis, 0.6 - tis, tis, tis), strict=True):
        rows = first[h.kind[first] == kind]
        agrees(kind.label, *h.flux_w(h.per_ray(rows, h.light[rows].sum(axis=1))), share)
        if kind in KINDS[2:]:
            sine2 = 1 - unit(h.way[rows + 1])[:, 2] ** 2
            follows("sine", np.log1p(sine2 / b) / math.log1p(1 / b))
