# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rough interfaces and metals: microfacets with GGX slopes, every bounce followed."""

import math

import numpy as np
import pytest

from raymaps.effects.conductor import metal_reflectance
from raymaps.effects.fresnel import fresnel_reflectance
from raymaps.effects.rough import facet_density, smith_lambda, walked_direction
from raymaps.jit import kernel
from raymaps.kernels.microsurface import next_height, visible_normal, walk_between_media, walk_on_metal
from raymaps.kernels.random import REJECTION, uniforms
from raymaps.kinds import EventKind
from tests.physics.scenes import agrees, body, box, disc, disc_source, follows, share_agrees, traced, unit
from tests.physics.surface_bench import cells_agree, lambertian_angles, lowered, meet, reciprocal, scene_with

REFLECTION, REFRACTION = EventKind.FRESNEL_REFLECTION, EventKind.FRESNEL_REFRACTION
ALPHAS = [0.05, 0.3, 1.0]


@kernel
def walks(x, y, z, alpha, n_i, n_t, seed, out, bounces):
    for i in range(len(out)):
        out[i, 0], out[i, 1], out[i, 2], bounces[i] = walk_between_media(
            x, y, z, alpha, n_i, n_t, seed, np.uint64(i), 5
        )


@kernel
def metal_walks(x, y, z, alpha, n, k, share, seed, out, bounces):
    for i in range(len(out)):
        out[i, 0], out[i, 1], out[i, 2], bounces[i] = walk_on_metal(
            x, y, z, alpha, 1.0, n, k, share[i], seed, np.uint64(i), 5
        )


@kernel
def normals(x, y, z, alpha, seed, out):
    for i in range(len(out)):
        u, v, _, _ = uniforms(seed, np.uint64(i), 1, 5)
        out[i, 0], out[i, 1], out[i, 2] = visible_normal(x, y, z, alpha, u, v)


def arriving(degrees):
    """Direction towards the surface at an angle of incidence, in the plane y = 0."""
    angle = math.radians(degrees)
    return math.sin(angle), 0.0, -math.cos(angle)


def sphere_cells(n_polar, n_azimuth, sub, from_rad, to_rad):
    """Directions in the middles of sub-cells of cells even in polar angle and azimuth, and their solid angles.

    Returns
    -------
    (n_polar, sub, n_azimuth, sub, 3) and (n_polar, sub, n_azimuth, sub) float64
    """
    polar = from_rad + (to_rad - from_rad) * (np.arange(n_polar * sub) + 0.5) / (n_polar * sub)
    azimuth = 2 * np.pi * (np.arange(n_azimuth * sub) + 0.5) / (n_azimuth * sub)
    polar, azimuth = np.meshgrid(polar, azimuth, indexing="ij")
    directions = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    solid_angle = np.sin(polar) * (to_rad - from_rad) * 2 * np.pi / polar.size
    shape = n_polar, sub, n_azimuth, sub
    return directions.reshape(*shape, 3), solid_angle.reshape(shape)


def count_cells(directions, n_polar, n_azimuth, from_rad, to_rad):
    azimuth = np.arctan2(directions[:, 1], directions[:, 0]) % (2 * np.pi)
    bins = [np.linspace(from_rad, to_rad, n_polar + 1), np.linspace(0, 2 * np.pi, n_azimuth + 1)]
    return np.histogram2d(np.arccos(np.clip(directions[:, 2], -1, 1)), azimuth, bins)[0]


def facets(alpha, n_steps, n_azimuth):
    """Normals even in t and azimuth, and D dOmega of each, (n_steps, n_azimuth).

    A share 1 - (1 - t)² of the surface's projection has facets less steep than cos² = (1 - s) / (1 + s (alpha² - 1)).
    """
    t = (np.arange(n_steps) + 0.5) / n_steps
    s = 1 - (1 - t) ** 2
    z = (np.sqrt((1 - s) / (1 + s * (alpha**2 - 1))))[:, None]
    azimuth = 2 * np.pi * (np.arange(n_azimuth) + 0.5) / n_azimuth
    rho = np.sqrt(1 - z**2)
    normal = np.stack(np.broadcast_arrays(rho * np.cos(azimuth), rho * np.sin(azimuth), z), axis=-1)
    return normal, 2 * (1 - t)[:, None] / n_steps / n_azimuth / z * np.ones(n_azimuth)


# --------------------------------------------------------------------------------------------------- the model


@pytest.mark.parametrize("alpha", ALPHAS)
def test_distribution_of_normals_covers_the_surface_once(alpha):
    """The integral of D cos over the hemisphere is 1 (Walter et al. 2007, eq. 4), and the area seen from any direction
    is cos (1 + Lambda): the integral of D max(0, v·m) (Heitz: Understanding the Masking-Shadowing Function, JCGT 3
    (2014), eq. 7).
    """
    cos = np.linspace(0, 1, 200_001)[1:] - 0.5 / 200_000
    assert (facet_density(cos, alpha) * cos).mean() * 2 * math.pi == pytest.approx(1, rel=1e-4)
    m, area = facets(alpha, 2000, 400)
    for degrees in (0, 30, 70, 85, 110, 150):
        v = np.array([math.sin(math.radians(degrees)), 0, math.cos(math.radians(degrees))])
        seen = (area * np.maximum(0, m @ v)).sum()
        assert seen == pytest.approx(v[2] * (1 + smith_lambda(v[2], alpha)), rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("alpha", [0.01, 0.3, 1.0])
def test_next_height(alpha):
    """A ray that goes up leaves with probability C^Lambda from where a share C of the surface lies below; one that
    comes down meets the surface for sure, below C with probability (C / C0)^(1 + Lambda).
    """
    u = (np.arange(2000) + 0.5) / 2000
    for below, degrees in ((0.7, 20), (0.2, 60), (0.99, 89)):
        x, z = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
        smith = float(smith_lambda(z, alpha))
        up = np.array([next_height(math.log(below), x, 0.0, z, alpha, w) for w in u])
        assert (up >= 0).mean() == pytest.approx(below**smith, abs=1e-3)
        down = np.array([next_height(math.log(below), x, 0.0, -z, alpha, w) for w in u])
        assert np.exp(down) == pytest.approx(below * u ** (1 / (1 + smith)), rel=1e-9)
        assert np.exp(up[up < 0]) == pytest.approx(below * u[up < 0] ** (-1 / smith), rel=1e-6)


@pytest.mark.parametrize("alpha", ALPHAS)
@pytest.mark.parametrize("degrees", [0, 40, 75, 89, 100, 140])
def test_visible_normals_follow_their_density(alpha, degrees):
    """D(m) max(0, v·m) over the area seen (Heitz 2014, eq. 16), for directions from below the horizon too."""
    n = 200_000
    v = np.array([math.sin(math.radians(degrees)), 0, math.cos(math.radians(degrees))])
    drawn = np.empty((n, 3))
    normals(*v, alpha, np.uint64(3), drawn)
    assert (drawn @ v >= -1e-12).all()
    assert np.linalg.norm(drawn, axis=1) == pytest.approx(1)
    sub, n_steps, n_azimuth = 40, 12, 12
    m, area = facets(alpha, n_steps * sub, n_azimuth * sub)
    expected = (area * np.maximum(0, m @ v)).reshape(n_steps, sub, n_azimuth, sub).sum(axis=(1, 3))
    squared = drawn[:, 2] ** 2
    counts = np.histogram2d(
        1 - np.sqrt(squared * alpha**2 / (1 + squared * (alpha**2 - 1))),
        np.arctan2(drawn[:, 1], drawn[:, 0]) % (2 * np.pi),
        [np.linspace(0, 1, n_steps + 1), np.linspace(0, 2 * np.pi, n_azimuth + 1)],
    )[0]
    cells_agree(f"normals seen at {degrees}", counts, expected / expected.sum() * n)


# ---------------------------------------------------------------------------------------------------- the walk


@pytest.mark.parametrize(("n_i", "n_t"), [(1.0, 1.5), (1.5, 1.0), (1.33, 1.33)])
@pytest.mark.parametrize("alpha", [0.001, 0.2, 1.0])
def test_kernel_walks_as_the_reference(alpha, n_i, n_t):
    out, bounces = np.empty((60, 3)), np.empty(60, np.int64)
    for degrees in (0.0, 35.0, 70.0, 88.0):
        direction = arriving(degrees)
        walks(*direction, alpha, n_i, n_t, np.uint64(9), out, bounces)
        for i in range(60):
            draws = np.array([uniforms(np.uint64(9), np.uint64(i), 5, REJECTION + k) for k in range(40)])
            expected, count = walked_direction(np.array(direction), alpha, n_i, n_t, draws)
            assert count == bounces[i]
            assert out[i] == pytest.approx(expected, abs=1e-6)


def single_reflection(o, degrees, alpha, n_i, n_t):
    """Density of light that leaves after one reflection: F D G2 / (4 cos_i), Walter et al. 2007, eq. 20, with the
    shadowing 1 / (1 + Lambda_i + Lambda_o) of one height for both (Heitz 2014, eq. 99).
    """
    i = -np.array(arriving(degrees))
    half = i + o
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    cosine = np.clip(half @ i, 0, 1)
    shadowing = 1 / (1 + smith_lambda(i[2], alpha) + smith_lambda(o[..., 2], alpha))
    return fresnel_reflectance(cosine, n_i, n_t) * facet_density(half[..., 2], alpha) * shadowing / (4 * i[2])


def single_refraction(o, degrees, alpha, n_i, n_t):
    """Density of light that leaves after one refraction: Walter et al. 2007, eq. 21, times cos_o, with the shadowing
    Beta(1 + Lambda_i, 1 + Lambda_o) of heights that are counted from opposite sides (Heitz et al. 2016, section 5).
    """
    from scipy.special import beta

    i = -np.array(arriving(degrees))
    half = -(n_i * i + n_t * o) * np.sign(n_t - n_i)
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    i_m, o_m = half @ i, np.einsum("...k,...k", half, o)
    possible = (i_m > 0) & (o_m < 0) & (half[..., 2] > 0)
    shadowing = beta(1 + smith_lambda(i[2], alpha), 1 + smith_lambda(-o[..., 2], alpha))
    through = 1 - fresnel_reflectance(np.clip(i_m, 0, 1), n_i, n_t)
    with np.errstate(divide="ignore", invalid="ignore"):
        density = np.abs(i_m * o_m) / i[2] * n_t**2 * through * shadowing * facet_density(half[..., 2], alpha)
        density /= (n_i * i_m + n_t * o_m) ** 2
    return np.where(possible, density, 0.0)


@pytest.mark.parametrize(
    ("alpha", "degrees", "n_i", "n_t"),
    [
        *[(*case, *indices) for case in ((0.3, 0), (0.3, 60), (0.7, 30)) for indices in ((1.0, 1.5), (1.5, 1.0))],
        (1.0, 80, 1.0, 1.5),
        (1.0, 40, 1.5, 1.0),
    ],
)
def test_one_bounce_follows_the_closed_form(alpha, degrees, n_i, n_t):
    """Rays that leave after their first microfacet, reflected or refracted, over both hemispheres."""
    n = 400_000
    out, bounces = np.empty((n, 3)), np.empty(n, np.int64)
    walks(*arriving(degrees), alpha, n_i, n_t, np.uint64(4), out, bounces)
    once = out[bounces == 1]
    for name, density, from_rad in (("reflection", single_reflection, 0), ("refraction", single_refraction, np.pi / 2)):
        o, solid_angle = sphere_cells(12, 16, 24, from_rad, from_rad + np.pi / 2)
        expected = (density(o, degrees, alpha, n_i, n_t) * solid_angle).sum(axis=(1, 3)) * n
        counts = count_cells(once, 12, 16, from_rad, from_rad + np.pi / 2)
        cells_agree(f"{name}, alpha {alpha}, {degrees} degrees", counts, expected, n=n)


@pytest.mark.parametrize(("n_i", "n_t"), [(1.0, 1.5), (1.5, 1.0), (1.0, 2.4)])
@pytest.mark.parametrize("alpha", [0.001, 0.5, 1.0])
def test_no_ray_is_lost_between_clear_media(alpha, n_i, n_t):
    """Furnace: at every angle up to grazing all light goes on, unchanged."""
    angle = np.linspace(0, math.pi / 2 - 1e-9, 50_000)
    data = lowered("rough", scene_with({"kind": "rough", "roughness": alpha}))
    met = meet("rough", data, angle, len(angle), n_near=n_i, n_far=n_t)
    assert np.isin(met.kind, (REFLECTION, REFRACTION)).all()
    assert (met.light == np.array([0.5, 0.3, 0.2], np.float32)).all()
    assert ((met.kind == REFLECTION) == (met.direction[:, 2] > 0)).all()
    assert (met.side == np.sign(met.direction[:, 2])).all()
    assert (met.medium == (met.kind == REFRACTION)).all()


@pytest.mark.parametrize("alpha", [0.5, 1.0])
def test_between_media_of_one_index_light_goes_straight_on(alpha):
    """At grazing incidence too, where rays meet more microfacets than are followed."""
    angle = np.linspace(0, math.pi / 2 - 1e-4, 1000)
    data = lowered("rough", scene_with({"kind": "rough", "roughness": alpha}))
    met = meet("rough", data, angle, len(angle), n_near=1.5, n_far=1.5)
    assert (met.kind == REFRACTION).all()
    assert met.direction[:, 2] == pytest.approx(-np.cos(angle), abs=1e-9)
    assert (met.side == -1).all()


def test_a_metal_that_absorbs_nothing_is_white():
    """Furnace: with an index of ik every microfacet reflects all light."""
    metal = {"inside": {"refractive_index": 1e-12, "extinction": 3.0}}
    for alpha in (0.1, 1.0):
        data = lowered("rough", scene_with({"kind": "rough", "roughness": alpha}, metal))
        angle = np.linspace(0, math.pi / 2 - 1e-6, 20_000)
        met = meet("rough", data, angle, len(angle))
        assert (met.kind == REFLECTION).all()
        assert met.light.sum(axis=1) == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize("alpha", [0.3, 1.0])
def test_light_in_equilibrium_stays_so(alpha):
    """Light that is equally bright from all sides, n² as bright in a medium of index n, is so after the interface too:
    as much leaves to each side as came, by Lambert's law (Welford, Winston: High Collection Nonimaging Optics, app. A).
    """
    n_glass, n = 1.5, 400_000
    data = lowered("rough", scene_with({"kind": "rough", "roughness": alpha}))
    n_dense = round(n * n_glass**2)
    air = meet("rough", data, lambertian_angles(n, 1), n, n_near=1.0, n_far=n_glass)
    glass = meet(
        "rough", data, lambertian_angles(n_dense, 2), n_dense, n_near=n_glass, n_far=1.0, from_back=True, seed=8
    )
    into_air = np.concatenate([air.direction[air.side == 1], glass.direction[glass.side == -1]])
    into_glass = np.concatenate([air.direction[air.side == -1], glass.direction[glass.side == 1]])
    transmitted = (air.side == -1).sum(), (glass.side == -1).sum()
    assert abs(transmitted[0] - transmitted[1]) < 5 * math.sqrt(sum(transmitted))
    follows("sin² into air", 1 - into_air[:, 2] ** 2)
    follows("sin² into glass", 1 - into_glass[:, 2] ** 2)


@pytest.mark.parametrize("alpha", [0.2, 1.0])
def test_reciprocity(alpha):
    """f_r(i, o) = f_r(o, i), and n_t² f_t(i, o) back = n_i² f_t(o, i): fluxes of Lambertian light between cells of the
    angle and of the azimuth between both directions (Walter et al. 2007, section 5.2).
    """
    n, n_glass = 500_000, 1.5
    data = lowered("rough", scene_with({"kind": "rough", "roughness": alpha}))

    def flux(met, angle, side):
        chosen = met.side == side
        incoming = np.minimum((np.sin(angle) ** 2 * 8).astype(int), 7)
        outgoing = np.minimum(((1 - met.direction[:, 2] ** 2) * 8).astype(int), 7)
        azimuth = np.abs(np.arctan2(met.direction[:, 1], met.direction[:, 0]))
        sector = np.minimum((azimuth / np.pi * 3).astype(int), 2)
        counts = np.zeros((3, 8, 8), int)
        np.add.at(counts, (sector[chosen], incoming[chosen], outgoing[chosen]), 1)
        return counts

    angle, other = lambertian_angles(n, 5), lambertian_angles(n, 6)
    air = meet("rough", data, angle, n, n_near=1.0, n_far=n_glass)
    glass = meet("rough", data, other, n, n_near=n_glass, n_far=1.0, from_back=True, seed=2)
    for sector in range(3):
        for name, met, at in (("air", air, angle), ("glass", glass, other)):
            counts = flux(met, at, 1)[sector]
            upper = np.triu_indices(8, 1)
            reciprocal(f"reflection in {name}", np.diag(counts[upper]), np.diag(counts.T[upper]), n, n, 1.0)
        there, back = flux(air, angle, -1)[sector], flux(glass, other, -1)[sector]
        reciprocal("refraction", there, back, n, n, n_glass**2)


# --------------------------------------------------------------------------------------------------- its limits


@pytest.mark.parametrize(("n_i", "n_t"), [(1.0, 1.5), (1.5, 1.0)])
@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0, 80.0])
def test_smooth_limit(degrees, n_i, n_t):
    """With alpha towards 0 shares are Fresnel's and directions those of the law of reflection and of Snell's law."""
    n = 50_000
    out, bounces = np.empty((n, 3)), np.empty(n, np.int64)
    walks(*arriving(degrees), 1e-7, n_i, n_t, np.uint64(2), out, bounces)
    reflected = out[:, 2] > 0
    expected = float(fresnel_reflectance(math.cos(math.radians(degrees)), n_i, n_t))
    share_agrees("reflected", reflected.sum(), n, expected)
    sine = math.sin(math.radians(degrees))
    assert np.quantile(np.abs(out[reflected] - [sine, 0, math.sqrt(1 - sine**2)]), 0.999) < 1e-4
    if expected < 1:
        refracted = [n_i / n_t * sine, 0, -math.sqrt(1 - (n_i / n_t * sine) ** 2)]
        assert np.quantile(np.abs(out[~reflected] - refracted), 0.999) < 1e-4
    assert (bounces == 1).mean() > 0.999


def test_rough_metal_tends_to_the_smooth_one():
    metal = {"inside": {"refractive_index": 0.47, "extinction": [2.83, 1.5, 4.0]}}
    data = lowered("rough", scene_with({"kind": "rough", "roughness": 0.001}, metal))
    met = meet("rough", data, 0.9, 20_000, threshold=0.0)
    expected = [0.5, 0.3, 0.2] * metal_reflectance(math.cos(0.9), 1.0, 0.47, np.array([2.83, 1.5, 4.0]))
    assert met.light.mean(axis=0) == pytest.approx(expected, rel=2e-4)
    assert met.direction.mean(axis=0) == pytest.approx([math.sin(0.9), 0, math.cos(0.9)], abs=1e-3)


def test_light_of_a_metal_is_the_product_of_its_bounces():
    """One bounce: the band's reflectance at the angle between the ray and the normal halfway; then never more."""
    n, k = np.array([0.2, 1.3]), np.array([3.4, 7.5])
    out, bounces, share = np.empty((5000, 3)), np.empty(5000, np.int64), np.empty((5000, 2))
    direction = arriving(50.0)
    metal_walks(*direction, 0.8, n, k, share, np.uint64(3), out, bounces)
    once = bounces == 1
    assert 0.3 < once.mean() < 0.95
    cosine = np.sqrt((1 - out[once] @ direction) / 2)
    assert share[once] == pytest.approx(metal_reflectance(cosine[:, None], 1.0, n, k), abs=1e-9)
    assert (share[bounces == 2].max(axis=0) < 1).all()
    assert share[bounces == 2].mean() < share[once].mean()
    assert (out[:, 2] > 0).all()


# --------------------------------------------------------------------------------------------------- in a scene


def test_ground_glass_in_a_scene(tmp_path):
    """A beam onto a nearly smooth interface is reflected by Fresnel's share. Lambertian light onto a rough one: what
    goes through from inside is 1/n² of what goes through from outside, whatever the roughness, as étendue is conserved.
    """
    direction = unit(np.array([math.sin(1.0), 0.0, -math.cos(1.0)]))
    passed = {}
    for inside, alpha in ((False, 0.6), (True, 0.6), (None, 0.001)):
        lamp = disc(1, 16, up=bool(inside)).moved(0, 0, -0.001 if inside else 0.001)
        block = body(box((-200, -200, -100), (200, 200, 0)), "black", "glass", plus_z="rough")
        source = {"kind": "faces", "flux_w": 1, "body": "Lamp"}
        beam = disc_source(-10 * direction, direction, 0.01)
        h = traced(
            tmp_path / str(inside),
            {"Block": block} | ({} if inside is None else {"Lamp": body(lamp, "black")}),
            rays=100_000,
            sources={"S": beam if inside is None else source},
            media={"glass": {"refractive_index": 1.5}},
            surfaces={"rough": {"kind": "rough", "roughness": alpha}, "black": {"kind": "absorber"}},
        )
        kind = h.kind[h.first + 1]
        assert np.isin(kind, (REFLECTION, REFRACTION)).all()
        if inside is None:
            expected = float(fresnel_reflectance(math.cos(1.0), 1.0, 1.5))
            share_agrees("smooth", (kind == REFLECTION).sum(), h.n_rays, expected)
        else:
            passed[inside] = (kind == REFRACTION).mean()
    stderr = math.sqrt((passed[True] * (1 - passed[True]) * 1.5**4 + passed[False] * (1 - passed[False])) / 100_000)
    agrees("étendue", passed[True] * 1.5**2, stderr, passed[False])
    assert 0.9 < passed[False] < 1
