# SPDX-License-Identifier: LGPL-2.1-or-later
"""Coefficients over the angle of incidence and wavelength: shares, kinds, directions and colours."""

import math

import numpy as np
import pytest

from raymaps.kernels.coefficients import shares_at
from raymaps.kinds import EventKind
from tests.physics.scenes import agrees, body, box, chi_square_agrees, disc_source, follows, traced, unit
from tests.physics.surface_bench import lowered, meet, scene_with, spectrum

KINDS = (
    EventKind.SPECULAR_REFLECTION,
    EventKind.SPECULAR_REFRACTION,
    EventKind.DIFFUSE_REFLECTION,
    EventKind.DIFFUSE_REFRACTION,
)
FOUR = {
    "kind": "coefficients",
    "specular_reflectance": {"angle_deg": [10, 50, 80], "value": [[0.1], [0.2], [0.6]]},
    "specular_transmittance": {"angle_deg": [0, 60], "value": [[0.4], [0.1]]},
    "diffuse_reflectance": [0.2, 0.1, 0.05],
    "diffuse_transmittance": 0.1,
}


def expected_shares(degrees):
    """(4 outcomes, 3 bands) by hand: linear between the angles of each table, constant beyond."""
    return np.stack(
        [
            np.full(3, np.interp(degrees, [10, 50, 80], [0.1, 0.2, 0.6])),
            np.full(3, np.interp(degrees, [0, 60], [0.4, 0.1])),
            np.array([0.2, 0.1, 0.05]),
            np.full(3, 0.1),
        ]
    )


def test_shares_are_linear_between_angles():
    data = lowered("coefficients", scene_with(FOUR))
    assert np.degrees(data.angle_rad) == pytest.approx([0, 10, 50, 60, 80])
    shares = np.empty((4, 3))
    for degrees in (0, 3, 10, 24, 50, 55, 60, 79, 80, 85, 90):
        shares_at(math.radians(degrees), data.angle_rad, data.share, shares)
        assert shares == pytest.approx(expected_shares(degrees), abs=1e-12)


def test_tables_over_angle_and_wavelength_are_averaged_over_each_band():
    """A bilinear table is linear over a band that holds no node, so its mean is its value in the middle."""
    table = {"angle_deg": [0, 90], "wavelength_nm": [400, 600, 700], "value": [[0.0, 0.4, 0.2], [0.2, 0.8, 1.0]]}
    surface = {"kind": "coefficients", "specular_reflectance": table}
    data = lowered("coefficients", scene_with(surface), spectrum(400, 700, 6))
    shares = np.empty((4, 6))
    shares_at(math.radians(45), data.angle_rad, data.share, shares)
    middle = np.arange(425, 700, 50)
    expected = (
        np.interp(middle, [400, 600, 700], [0.0, 0.4, 0.2]) + np.interp(middle, [400, 600, 700], [0.2, 0.8, 1.0])
    ) / 2
    assert shares[0] == pytest.approx(expected, abs=1e-3)
    assert not shares[1:].any()


@pytest.mark.parametrize("threshold", [0.0, 1.0])
@pytest.mark.parametrize("degrees", [0.0, 37.0, 70.0])
def test_outcomes_and_colours(degrees, threshold):
    """Each outcome takes on its share of each band's light, whatever the roulette; specular directions are exact."""
    n = 200_000
    light = np.array([0.5, 0.3, 0.2])
    data = lowered("coefficients", scene_with(FOUR))
    met = meet("coefficients", data, math.radians(degrees), n, threshold=threshold)
    for kind, share in zip(KINDS, expected_shares(degrees), strict=True):
        taken = np.where((met.kind == kind)[:, None], met.light, 0.0)
        agrees(kind.label, taken.mean(axis=0), taken.std(axis=0) / math.sqrt(n), light * share)
    assert met.light.sum(axis=1).max() <= 1 + 1e-6
    gone = met.kind == EventKind.ABSORPTION
    assert not met.light[gone].any()
    assert (gone | np.isin(met.kind, KINDS)).all()
    through = np.isin(met.kind, KINDS[1::2])
    assert (met.side[~gone] == np.where(through, -1, 1)[~gone]).all()
    assert (met.medium[~gone] == through[~gone]).all()
    sine = math.sin(math.radians(degrees))
    assert np.abs(met.direction[met.kind == KINDS[0]] - [sine, 0, math.sqrt(1 - sine**2)]).max() < 1e-12
    refracted = [sine / 1.5, 0, -math.sqrt(1 - (sine / 1.5) ** 2)]
    assert np.abs(met.direction[met.kind == KINDS[1]] - refracted).max() < 1e-12
    for kind, sign in ((KINDS[2], 1), (KINDS[3], -1)):
        out = met.direction[met.kind == kind]
        assert (sign * out[:, 2] > 0).all()
        follows(f"sin², {kind.label}", 1 - out[:, 2] ** 2)
        follows(f"azimuth, {kind.label}", np.arctan2(out[:, 1], out[:, 0]) / (2 * math.pi) + 0.5)


def test_white_surface_loses_nothing():
    white = {f"{how}_{what}": 0.25 for how in ("specular", "diffuse") for what in ("reflectance", "transmittance")}
    data = lowered("coefficients", scene_with({"kind": "coefficients", **white}))
    met = meet("coefficients", data, np.linspace(0, 1.57, 100_000), 100_000)
    chi_square_agrees("outcomes", np.array([(met.kind == k).sum() for k in KINDS]), np.full(4, 25_000.0))
    assert met.light.sum(axis=1) == pytest.approx(1, rel=1e-6)


def test_total_reflection_reflects_what_would_pass_and_metals_let_nothing_in():
    half = {"kind": "coefficients", "specular_reflectance": 0.2, "specular_transmittance": 0.8}
    data = lowered("coefficients", scene_with(half))
    below = meet("coefficients", data, math.asin(1 / 1.5) - 1e-6, 1000, n_near=1.5, n_far=1.0, from_back=True)
    assert (below.kind == KINDS[1]).any()
    beyond = meet("coefficients", data, math.asin(1 / 1.5) + 1e-6, 1000, n_near=1.5, n_far=1.0, from_back=True)
    assert (beyond.kind == KINDS[0]).all()
    assert beyond.light.sum(axis=1) == pytest.approx(1, rel=1e-6)
    metal = {"inside": {"refractive_index": 1.0, "extinction": 5.0}}
    met = meet("coefficients", lowered("coefficients", scene_with(half, metal)), 0.3, 1000, threshold=0.0)
    assert (met.kind == KINDS[0]).all()
    assert met.light.sum(axis=1) == pytest.approx(0.2, rel=1e-6)


def test_a_filter_over_the_angle_in_a_scene(tmp_path):
    """A sheet without a medium lets light straight on; its transmittance falls over the angle."""
    sheet = box((-500, -500, -1), (500, 500, 0))
    sheet = sheet._replace(triangles=sheet.triangles[-2:], faces=(("+z", 2),))
    angles = np.radians([0.0, 30.0, 60.0])
    rgb = np.array([0.5, 0.3, 0.2])
    sources = {}
    for i, angle in enumerate(angles):
        direction = unit(np.array([math.sin(angle), 0.0, -math.cos(angle)]))
        sources[f"S{i}"] = disc_source(-10 * direction, direction, 0.01, rgb=tuple(rgb))
    h = traced(
        tmp_path,
        {"Filter": body(sheet, "filter")},
        rays=90_000,
        sources=sources,
        surfaces={"filter": {**FOUR, "diffuse_transmittance": 0.0}},
    )
    first = h.first + 1
    for i, degrees in enumerate((0.0, 30.0, 60.0)):
        mine = first[h.ray_source == i]
        shares = expected_shares(degrees)
        for kind, share in zip(KINDS[:3], shares[:3], strict=True):
            light = np.where((h.kind[mine] == kind)[:, None], h.light[mine], 0.0)
            stderr = light.std(axis=0) / math.sqrt(len(mine))
            agrees(f"{kind.label} at {degrees:.0f} degrees", light.mean(axis=0), stderr, rgb * share)
        passed = mine[h.kind[mine] == EventKind.SPECULAR_REFRACTION]
        straight = np.array([math.sin(angles[i]), 0, -math.cos(angles[i])])
        assert np.abs(unit(h.way[passed + 1]) - straight).max() < 1e-4
