# SPDX-License-Identifier: LGPL-2.1-or-later
"""Gaussian beams, the sun, faces of any emission, and luminaires: each sampler against its density by chi-square."""

import math

import numpy as np
import pytest

from raymaps.formats.luminaire_files import read_luminaire
from raymaps.results.detector import evaluate_detector
from tests.physics.emission import emitted, frame_around, independent, one_minus_cos
from tests.physics.scenes import (
    agrees,
    ball,
    body,
    chi_square_agrees,
    disc,
    follows,
    rectangle,
    share_agrees,
    traced,
    unit,
)

BLACK = {"black": {"kind": "absorber"}}
AXES = [(0, 0, -1), (0.3, -2, 0.9)]
N = 100_000


def azimuth(vectors, x, y):
    return np.arctan2(vectors @ y, vectors @ x) / (2 * math.pi) + 0.5


# ----------------------------------------------------------------------------------------------- Gaussian beam


def beam(axis, divergence_deg, waist=0.7):
    return {
        "kind": "gaussian_beam", "flux_w": 1, "position_mm": [1, 2, 3], "direction": list(axis),
        "waist_radius_mm": waist, "divergence_deg": divergence_deg,
    }  # fmt: skip


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("divergence_deg", [0.05, 8, 45])
def test_gaussian_beam(tmp_path, axis, divergence_deg):
    """Irradiance exp(-2 r²/w²) has the share 1 - exp(-2 r²/w²) within r (Siegman: Lasers, 1986, section 17.1)."""
    e = emitted(tmp_path, {}, N, sources={"S": beam(axis, divergence_deg)})
    x, y, z = frame_around(axis)
    at = e.position - [1, 2, 3]
    assert np.abs(at @ z).max() < 1e-12
    place = 1 - np.exp(-2 * (at**2).sum(axis=1) / 0.7**2)
    follows("radius", place)
    agrees("mean of r²", (at**2).sum(axis=1).mean(), 0.7**2 / 2 / math.sqrt(N), 0.7**2 / 2)
    follows("azimuth of the place", azimuth(at, x, y))
    below = one_minus_cos(e.direction, z)
    widest = 1 - math.cos(math.radians(divergence_deg))
    angle = (1 - np.exp(-2 * below / widest)) / (1 - math.exp(-2 / widest))
    follows("angle", angle)
    follows("azimuth of the direction", azimuth(e.direction, x, y))
    assert (e.direction @ z >= 0).all()
    independent("place and direction", place, angle)
    independent("azimuths", azimuth(at, x, y), azimuth(e.direction, x, y))


def test_narrow_gaussian_beam_has_a_gaussian_intensity_over_the_angle(tmp_path):
    """exp(-2 θ²/θ0²), and so exp(-2) of it at the half angle: the flux within θ0 is 1 - exp(-2) of all."""
    e = emitted(tmp_path, {}, N, sources={"S": beam((0, 0, 1), 0.5)})
    theta = np.arctan2(np.hypot(e.direction[:, 0], e.direction[:, 1]), e.direction[:, 2])
    follows("angle", 1 - np.exp(-2 * (theta / math.radians(0.5)) ** 2))
    share_agrees("within the half angle", (theta < math.radians(0.5)).sum(), N, 1 - math.exp(-2))


def test_gaussian_beam_without_divergence_is_collimated(tmp_path):
    e = emitted(tmp_path, {}, 1000, sources={"S": beam((0.3, -2, 0.9), 0)})
    assert np.abs(e.direction - unit(np.array([0.3, -2, 0.9]))).max() < 1e-15


def test_gaussian_beam_on_a_detector(tmp_path):
    """Flux within a square of half width a: erf(√2 a/w)² (product of two normal distributions)."""
    half = 0.5
    h = traced(
        tmp_path, {}, rays=60_000, sources={"S": beam((0, 0, 1), 0) | {"flux_w": 3}},
        detectors={"D": rectangle((1, 2, 5), 2 * half, 2 * half, normal=[0, 0, -1])},
    )  # fmt: skip
    expected = 3 * math.erf(math.sqrt(2) * half / 0.7) ** 2
    agrees("flux", *h.flux_w(h.crossings_per_ray(h.through("D"))), expected, rounding=1e-3)


# ---------------------------------------------------------------------------------------------------- the sun


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("radius_deg", [0.2665, 30, 89.9])
def test_sun(tmp_path, axis, radius_deg):
    """Flux of constant radiance through a plane from a cap of angular radius β: π L sin² β per area (Boyd: Radiometry,
    1983, section 2.4).
    """
    source = {
        "kind": "sun", "flux_w": 1, "position_mm": [1, 2, 3], "direction": list(axis), "radius_mm": 4,
        "angular_radius_deg": radius_deg,
    }  # fmt: skip
    e = emitted(tmp_path, {}, N, sources={"S": source})
    x, y, z = frame_around(axis)
    at = e.position - [1, 2, 3]
    assert np.abs(at @ z).max() < 1e-12
    place = (at**2).sum(axis=1) / 4**2
    follows("squared radius", place)
    below = one_minus_cos(e.direction, z)
    cap = below * (2 - below) / math.sin(math.radians(radius_deg)) ** 2
    follows("sin²", cap)
    follows("azimuth of the place", azimuth(at, x, y))
    follows("azimuth of the direction", azimuth(e.direction, x, y))
    independent("place and direction", place, cap)
    independent("azimuths", azimuth(at, x, y), azimuth(e.direction, x, y))


def test_sun_without_size_is_a_disc(tmp_path):
    source = {
        "kind": "sun", "flux_w": 1, "position_mm": [0, 0, 0], "direction": [1, 0, -1], "radius_mm": 4,
        "angular_radius_deg": 0,
    }  # fmt: skip
    e = emitted(tmp_path, {}, 1000, sources={"S": source})
    assert np.abs(e.direction - unit(np.array([1, 0, -1.0]))).max() < 1e-15


# ------------------------------------------------------------------------------------------------------- faces


def from_faces(tmp_path, emission, shape=None, n=N):
    """Rays of a body's faces, with the outward normal where each starts."""
    shape = shape or ball(10, 1)
    e = emitted(
        tmp_path, {"Lamp": body(shape, "black")}, n, surfaces=BLACK,
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Lamp", "emission": emission}},
    )  # fmt: skip
    a, b, c = np.moveaxis(shape.vertices[shape.triangles][e.triangle], 1, 0)
    return e, unit(np.cross(b - a, c - a)), unit(b - a)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 3.5, 80.0, 1e5])
def test_faces_with_a_power_of_the_cosine(tmp_path, exponent):
    """Intensity cosⁿ θ has the share 1 - cosⁿ⁺¹ θ within θ."""
    e, normal, along = from_faces(tmp_path, {"kind": "cosine_power", "exponent": exponent})
    below = one_minus_cos(e.direction, normal)
    assert below.max() <= 1
    follows("angle", np.exp((exponent + 1) * np.log1p(-np.minimum(below, 1 - 1e-15))))
    y = np.cross(normal, along)
    turn = np.arctan2((e.direction * y).sum(axis=1), (e.direction * along).sum(axis=1)) / (2 * math.pi) + 0.5
    follows("azimuth", turn)
    counts = np.bincount(e.triangle, minlength=80)
    areas = ball(10, 1).areas
    chi_square_agrees("triangles", counts, areas / areas.sum() * N)


def test_faces_with_cosine_power_one_are_lambertian(tmp_path):
    e, normal, _ = from_faces(tmp_path, {"kind": "cosine_power", "exponent": 1.0})
    follows("sin²", 1 - ((e.direction * normal).sum(axis=1)) ** 2)


TABLES = {
    "uneven": ((0, 20, 40, 90), (1, 0, 3, 0.5)),
    "ring": ((0, 30, 30.5, 31, 90), (0, 0, 1, 0, 0)),
    "narrow": ((0, 0.1, 0.2), (5, 3, 0)),
    "one cell": ((0, 90), (0, 1)),
}


@pytest.mark.parametrize("name", TABLES)
def test_faces_with_tabulated_emission(tmp_path, name):
    """The share within θ is the integral of the table's intensity times sin θ, here by fine sums."""
    angle_deg, value = TABLES[name]
    e, normal, along = from_faces(
        tmp_path, {"kind": "table", "angle_deg": list(map(float, angle_deg)), "value": list(map(float, value))}
    )
    theta = 2 * np.arcsin(np.sqrt(one_minus_cos(e.direction, normal) / 2))
    edges = np.radians(np.linspace(0, angle_deg[-1], 2_000_001))
    middle = (edges[1:] + edges[:-1]) / 2
    light = np.interp(np.degrees(middle), angle_deg, value) * np.sin(middle)
    share = np.concatenate([[0], np.cumsum(light)]) / light.sum()
    assert theta.max() <= edges[-1] * (1 + 1e-9)
    follows("angle", np.interp(theta, edges, share), 100)
    y = np.cross(normal, along)
    turn = np.arctan2((e.direction * y).sum(axis=1), (e.direction * along).sum(axis=1)) / (2 * math.pi) + 0.5
    independent("angle and azimuth", np.clip(np.interp(theta, edges, share), 0, 1 - 1e-12), turn)


def test_irradiance_of_a_lamp_with_a_cosine_power(tmp_path):
    """Far away from a small lamp of flux F the intensity on its axis is F (n + 1) / (2 π) for cosⁿ."""
    exponent, distance, side = 30.0, 1000.0, 20.0
    h = traced(
        tmp_path, {"Lamp": body(disc(0.5), "black")}, rays=200_000, surfaces=BLACK,
        sources={
            "S": {
                "kind": "faces", "flux_w": 1000, "body": "Lamp",
                "emission": {"kind": "cosine_power", "exponent": exponent},
            }
        },
        detectors={"D": rectangle((0, 0, distance), side, side, normal=[0, 0, -1])},
    )  # fmt: skip
    expected = 1000 * (exponent + 1) / (2 * math.pi) * (side / distance) ** 2
    # over the square cos³ θ of the solid angle and cosⁿ θ of the intensity are less by (n + 3) (side / distance)² / 12
    agrees("flux", *h.flux_w(h.crossings_per_ray(h.through("D"))), expected, rounding=33 * (side / distance) ** 2 / 6)


# -------------------------------------------------------------------------------------------------- luminaires

C = (0.0, 50.0, 60.0, 180.0, 300.0, 360.0)
GAMMA = (0.0, 10.0, 60.0, 100.0, 180.0)
CANDELA = ((5, 7, 0, 1, 2), (5, 9, 30, 0, 2), (5, 1, 20, 4, 2), (5, 0, 0, 0, 2), (5, 40, 3, 0, 2), (5, 7, 0, 1, 2))


def luminaire(intensity, **more):
    return {"kind": "luminaire", "flux_w": 1, "position_mm": [1, 2, 3], "intensity": intensity, **more}


def table(c=C, gamma=GAMMA, candela=CANDELA):
    return {"c_deg": list(c), "gamma_deg": list(gamma), "candela": [[float(v) for v in row] for row in candela]}


def bilinear(c_deg, gamma_deg):
    """The table at directions, from its definition."""
    i = np.clip(np.searchsorted(C, c_deg, side="right") - 1, 0, len(C) - 2)
    rows = np.array([np.interp(gamma_deg, GAMMA, row) for row in CANDELA])
    first, second = np.take_along_axis(rows, i[None], 0)[0], np.take_along_axis(rows, i[None] + 1, 0)[0]
    t = (c_deg - np.array(C)[i]) / np.diff(C)[i]
    return (1 - t) * first + t * second


@pytest.mark.parametrize("aim", [((0, 0, -1), (1, 0, 0)), ((1, 2, 2), (0, 1, 5))])
def test_luminaire_follows_its_table(tmp_path, aim):
    """Counts over C and gamma, finer than the table, against the bilinear table times sin(gamma) by fine sums."""
    direction, c0 = aim
    n = 400_000
    e = emitted(tmp_path, {}, n, sources={"S": luminaire(table(), direction=list(direction), c0_direction=list(c0))})
    z = unit(np.array(direction, float))
    x = unit(np.array(c0, float) - (np.array(c0) @ z) * z)
    y = np.cross(z, x)
    assert np.abs(e.position - [1, 2, 3]).max() < 1e-12
    assert np.abs(np.linalg.norm(e.direction, axis=1) - 1).max() < 1e-12
    gamma = np.degrees(np.arccos(np.clip(e.direction @ z, -1, 1)))
    c = np.degrees(np.arctan2(e.direction @ y, e.direction @ x)) % 360
    bins, fine = (72, 36), 40
    counts = np.histogram2d(c, gamma, bins, ((0, 360), (0, 180)))[0]
    c_mid = (np.arange(bins[0] * fine) + 0.5) * 360 / (bins[0] * fine)
    g_mid = (np.arange(bins[1] * fine) + 0.5) * 180 / (bins[1] * fine)
    density = np.stack([bilinear(np.full(len(g_mid), one), g_mid) for one in c_mid]) * np.sin(np.radians(g_mid))
    expected = density.reshape(bins[0], fine, bins[1], fine).sum(axis=(1, 3))
    expected *= n / expected.sum()
    many = expected >= 10
    rare = counts[~many].sum(), expected[~many].sum()
    chi_square_agrees("C and gamma", np.append(counts[many], rare[0]), np.append(expected[many], max(rare[1], 1e-9)))
    assert (counts[expected < 1e-6] == 0).all()


def test_c_turns_as_a_right_handed_screw_along_the_direction(tmp_path):
    """A spot at C = 90, gamma = 60 of a luminaire that points down, C = 0 along x: clockwise as seen from above."""
    spot = table((0, 89, 90, 91, 360), (0, 59, 60, 61, 180), ([0] * 5, [0] * 5, [0, 0, 1, 0, 0], [0] * 5, [0] * 5))
    e = emitted(tmp_path, {}, 1000, sources={"S": luminaire(spot)})
    towards = [0, -math.sin(math.radians(60)), -math.cos(math.radians(60))]
    assert (e.direction @ towards).min() > math.cos(math.radians(1.5))


def test_luminaire_with_light_below_only(tmp_path):
    """Constant intensity from gamma 0 to 90 is even over the lower half space."""
    e = emitted(tmp_path, {}, N, sources={"S": luminaire(table((0, 360), (0, 90), [[3, 3], [3, 3]]))})
    follows("cos", -e.direction[:, 2])
    follows("azimuth", azimuth(e.direction, np.array([1.0, 0, 0]), np.array([0, 1.0, 0])))


def test_light_of_a_luminaires_file_on_a_detector(tmp_path):
    """An IES file of intensity I0 cos(gamma), a Lambertian disc: on a small detector below it E = I0 / h², and I0 is
    flux / π. The bilinear table in steps of 5 degrees is less by (5 degrees)² / 12 between its points at most.
    """
    gamma = np.arange(0, 91, 5.0)
    candela = np.maximum(np.cos(np.radians(gamma)), 0) * 321
    numbers = [*gamma, 0, *candela]
    text = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 19 1 1 2 0 0 0\n1 1 10\n" + "\n".join(f"{v:.9g}" for v in numbers)
    (tmp_path / "lamp.ies").write_text(text)
    assert read_luminaire(tmp_path / "lamp.ies")["c_deg"] == (0, 360)
    h = traced(
        tmp_path, {}, rays=200_000,
        sources={"S": luminaire({"file": "lamp.ies"}) | {"flux_w": 100}},
        detectors={"D": rectangle((1, 2, -17), 2, 2)},
    )  # fmt: skip
    expected = 100 / math.pi * 4 / 20**2
    agrees("flux", *h.flux_w(h.crossings_per_ray(h.through("D"))), expected, rounding=4e-3)


@pytest.mark.parametrize("suffix", [".ies", ".ldt"])
def test_a_luminaire_comes_back_from_the_far_field(tmp_path, suffix):
    """Table to rays to far field to file to table: the same C and gamma, within the noise of the cells."""
    far_field = {"kind": "far_field", "axis": [1, 2, 2], "x_axis": [0, 1, 5], "resolution": [6, 18]}
    c, gamma = (0, 60, 120, 180, 240, 300, 360), (0, 40, 90, 180)
    candela = [[9, 9, 1, 0], [9, 30, 5, 0], [9, 2, 1, 0], [9, 7, 20, 0], [9, 9, 1, 0], [9, 1, 1, 0], [9, 9, 1, 0]]
    aim = {"direction": [1, 2, 2], "c0_direction": [0, 1, 5]}
    other = {"kind": "illuminant", "name": "D65"}
    h = traced(
        tmp_path, {}, rays=200_000, detectors={"Sky": far_field},
        sources={"S": luminaire(table(c, gamma, candela), spectrum=other, **aim)},
    )  # fmt: skip
    evaluate_detector(h.raymap, "Sky").write(tmp_path / f"lamp{suffix}")
    data = read_luminaire(tmp_path / f"lamp{suffix}")
    assert data["c_deg"] == pytest.approx(c)
    again = np.array(data["candela"])
    gamma_deg = np.array(data["gamma_deg"])
    inner = (gamma_deg > 15) & (gamma_deg < 165)
    expected = np.stack([np.interp(gamma_deg, gamma, row) for row in candela])
    # each cell is a mean over 60 degrees of C: of the neighbours an eighth each counts, and three quarters of its own
    ring = expected[:-1]
    expected[:-1] = 0.75 * ring + 0.125 * (np.roll(ring, 1, axis=0) + np.roll(ring, -1, axis=0))
    expected[-1] = expected[0]
    scale = again[:, inner].sum() / expected[:, inner].sum()
    assert np.abs(again / scale - expected)[:, inner].max() < 0.05 * expected.max()
