# SPDX-License-Identifier: LGPL-2.1-or-later
"""Phase functions: their densities, and the samplers of the kernels against them.

L. Henyey, J. Greenstein: Diffuse radiation in the galaxy, Astrophys. J. 93 (1941), p. 70; its mean cosine is g and its
Legendre moments are g^k.
"""

import math
from decimal import Decimal, getcontext

import numpy as np
import pytest
from numpy.polynomial import legendre

from raymaps.effects.medium_scattering import _table, phase_cumulated, phase_density
from raymaps.jit import allocating_kernel, kernel
from raymaps.kernels.directions import around
from raymaps.kernels.phase import henyey_greenstein, tabulated
from raymaps.kinds import EventKind
from raymaps.materials import HenyeyGreenstein, IsotropicPhase, TabulatedPhase
from tests.physics.scenes import agrees, ball, body, chi_square_agrees, follows, traced, unit

ASYMMETRIES = [-0.9, -0.5, -1e-9, 0.0, 1e-6, 0.3, 0.75, 0.9, 0.99]
#: A narrow peak ahead, a dark ring, and a step of slope: like a large droplet.
DROPLET = TabulatedPhase(
    angle_deg=(0, 0.2, 1, 5, 20, 60, 100, 101, 140, 145, 180), value=(5e4, 4e4, 900, 60, 8, 0.5, 0, 0, 0.2, 1.5, 0.6)
)
SMOOTH = TabulatedPhase(angle_deg=(0, 90, 180), value=(1, 2, 1))
PHASES = [IsotropicPhase(), *(HenyeyGreenstein(g=g) for g in ASYMMETRIES), DROPLET, SMOOTH]
N_DRAWS = 400_000


def name_of(phase):
    return f"g={phase.g:g}" if isinstance(phase, HenyeyGreenstein) else f"{phase.kind}"


@allocating_kernel
def drawn_by_asymmetry(g, uniform):
    """(n, 2) cosine and sine."""
    out = np.empty((len(uniform), 2))
    for k in range(len(uniform)):
        out[k] = henyey_greenstein(g, uniform[k])
    return out


@allocating_kernel
def drawn_by_table(angle_rad, value, cumulated, uniform):
    """(n, 2) cosine and sine."""
    out = np.empty((len(uniform), 2))
    for k in range(len(uniform)):
        out[k] = tabulated(angle_rad, value, cumulated, uniform[k])
    return out


def drawn(phase, uniform):
    """Cosine and sine of scattering angles as the kernel draws them."""
    if isinstance(phase, TabulatedPhase):
        return drawn_by_table(*_table(phase), uniform).T
    return drawn_by_asymmetry(getattr(phase, "g", 0.0), uniform).T


def angles_of(phase):
    """Quadrature over the angle, dense where the phase function is steep: angles, weights of solid angle."""
    if isinstance(phase, TabulatedPhase):
        edges = np.radians(phase.angle_deg)
    else:  # dense near 0 and pi
        steep = np.geomspace(1e-12, 1, 80)
        edges = np.concatenate([[0], math.pi / 2 * steep, math.pi - math.pi / 2 * steep[-2::-1], [math.pi]])
    x, w = np.polynomial.legendre.leggauss(24)
    half = np.diff(edges) / 2
    angle = (edges[:-1] + half)[:, None] + half[:, None] * x
    return angle.ravel(), (2 * math.pi * np.sin(angle) * half[:, None] * w).ravel()


@pytest.mark.parametrize("phase", PHASES, ids=name_of)
def test_densities_are_normalised(phase):
    angle, solid_angle = angles_of(phase)
    assert (phase_density(phase, np.cos(angle)) * solid_angle).sum() == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("g", ASYMMETRIES)
def test_legendre_moments_of_henyey_greenstein(g):
    angle, solid_angle = angles_of(HenyeyGreenstein(g=g))
    light = phase_density(HenyeyGreenstein(g=g), np.cos(angle)) * solid_angle
    moments = legendre.legvander(np.cos(angle), 8).T @ light
    assert moments == pytest.approx(g ** np.arange(9), abs=1e-8)


@pytest.mark.parametrize("phase", PHASES, ids=name_of)
def test_cumulated_density(phase):
    """The closed forms against a quadrature of the density."""
    angle, solid_angle = angles_of(phase)
    light = phase_density(phase, np.cos(angle)) * solid_angle
    ends = np.arange(24, len(angle), 24)  # between two cells of the quadrature
    if isinstance(phase, TabulatedPhase):
        borders = np.radians(phase.angle_deg[1:-1])
    else:
        steep = np.geomspace(1e-12, 1, 80)
        borders = np.concatenate([math.pi / 2 * steep, math.pi - math.pi / 2 * steep[-2::-1]])
    ahead = np.add.accumulate(light)[ends - 1]
    assert phase_cumulated(phase, np.cos(borders)) == pytest.approx(1 - ahead, abs=1e-9)


@pytest.mark.parametrize("phase", PHASES, ids=name_of)
def test_drawn_angles_follow_the_density(phase):
    """Chi-square over cells of equal probability, and over the steep ends."""
    uniform = np.random.default_rng(7).random(N_DRAWS)
    cosine, sine = drawn(phase, uniform)
    assert cosine**2 + sine**2 == pytest.approx(1, abs=1e-14)
    follows(f"angles of {name_of(phase)}", phase_cumulated(phase, cosine), bins=100)
    angle = np.arctan2(sine, cosine)
    edges = np.quantile(angle, [0, 0.01, 0.1, 0.4, 0.7, 0.95, 1])  # any edges will do
    edges[0], edges[-1] = 0, math.pi
    expected = -np.diff(phase_cumulated(phase, np.cos(edges))) * N_DRAWS
    chi_square_agrees(f"cells of {name_of(phase)}", np.histogram(angle, edges)[0], expected)


@pytest.mark.parametrize("g", ASYMMETRIES)
def test_mean_cosine_is_g(g):
    cosine, _ = drawn(HenyeyGreenstein(g=g), np.random.default_rng(3).random(N_DRAWS))
    agrees(f"mean cosine for g = {g}", cosine.mean(), cosine.std() / math.sqrt(N_DRAWS), g, rounding=0)


@pytest.mark.parametrize("g", [-1 + 1e-12, -0.999999, -0.9, -1e-9, 0.0, 1e-300, 1e-12, 0.3, 0.99, 1 - 1e-12])
def test_henyey_greenstein_is_inverted_to_the_last_digits(g):
    """Against the textbook's inversion (Wang, Jacques, Zheng 1995) in 400 decimal digits."""
    getcontext().prec = 400
    for u in (2.0**-33, 1e-6, 0.1, 0.5, 0.9, 1 - 2.0**-33):
        cosine, sine = drawn_by_asymmetry(g, np.array([u]))[0]
        big_g, big_u = Decimal(g), Decimal(u)
        ratio = (1 - big_g**2) / (1 - big_g + 2 * big_g * big_u)
        exact = (1 + big_g**2 - ratio**2) / (2 * big_g) if g else 2 * big_u - 1
        assert abs(float(exact - Decimal(cosine))) < 3e-16
        assert float(Decimal(sine) / (1 - exact**2).sqrt()) == pytest.approx(1, abs=2e-15)


@pytest.mark.parametrize("phase", [DROPLET, SMOOTH], ids=["droplet", "smooth"])
def test_tables_are_inverted_exactly(phase):
    uniform = np.concatenate([np.geomspace(1e-9, 0.5, 500), 1 - np.geomspace(1e-9, 0.5, 500)])
    cosine, sine = drawn(phase, uniform)
    angle = np.arctan2(sine, cosine)
    angle_rad, value, cumulated = _table(phase)
    # the integral of p sin by parts, cell by cell, in plain form
    slope = np.diff(value) / np.diff(angle_rad)
    cell = np.clip(np.searchsorted(angle_rad, angle, side="right") - 1, 0, len(slope) - 1)
    a, p, s = angle_rad[cell], value[cell], slope[cell]
    density = p + s * (angle - a)
    within = p * np.cos(a) - density * np.cos(angle) + s * (np.sin(angle) - np.sin(a))
    cells = value[:-1] * np.cos(angle_rad[:-1]) - value[1:] * np.cos(angle_rad[1:]) + slope * np.diff(np.sin(angle_rad))
    assert cumulated == pytest.approx(np.append(0, np.cumsum(cells)) / cells.sum(), abs=1e-12)
    assert cumulated[cell] + within / cells.sum() == pytest.approx(uniform, abs=1e-11)
    dark = (phase_density(phase, cosine) == 0).sum()
    assert dark == 0


def test_a_table_of_a_linear_density_has_its_closed_form():
    """p = 1 - theta / pi: the integral of p sin is 1, that of p sin cos, so the mean cosine, 1/4."""
    phase = TabulatedPhase(angle_deg=(0, 180), value=(1, 0))
    cosine, _ = drawn(phase, np.random.default_rng(5).random(N_DRAWS))
    agrees("mean cosine", cosine.mean(), cosine.std() / math.sqrt(N_DRAWS), 0.25, rounding=0)


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e300])
def test_the_scale_of_a_table_does_not_matter(scale):
    phase = TabulatedPhase(angle_deg=(0, 45, 180), value=(3 * scale, scale, 2 * scale))
    plain = TabulatedPhase(angle_deg=(0, 45, 180), value=(3, 1, 2))
    uniform = np.random.default_rng(5).random(1000)
    assert drawn(phase, uniform)[0] == pytest.approx(drawn(plain, uniform)[0], abs=1e-12)


def test_directions_stay_unit_vectors():
    """After a hundred thousand turns."""

    @kernel
    def turned(n):
        x, y, z = 0.6, 0.0, 0.8
        for k in range(n):
            cosine, sine = henyey_greenstein(0.5, (k * 0.6180339887498949) % 1.0)
            x, y, z = around(x, y, z, cosine, sine, 2 * math.pi * ((k * 0.7548776662466927) % 1.0))
        return x, y, z

    assert math.hypot(*turned(100_000)) == pytest.approx(1, abs=1e-13)


@pytest.mark.parametrize(
    ("phase", "mean"),
    [
        ({"kind": "isotropic"}, 0.0),
        ({"kind": "henyey_greenstein", "g": 0.8}, 0.8),
        ({"kind": "henyey_greenstein", "g": -0.6}, -0.6),
        ({"kind": "table", "angle_deg": [0, 180], "value": [1, 0]}, 0.25),
    ],
    ids=["isotropic", "forward", "backward", "table"],
)
def test_angles_of_traced_rays(tmp_path, phase, mean):
    """Angles between the ways before and after a scattering inside a ball; azimuths are even."""
    milk = {
        "refractive_index": 1.0,
        "absorption_per_mm": 0.2,
        "scattering": [{"coefficient_per_mm": 1, "phase": phase}],
    }
    h = traced(
        tmp_path,
        {"Ball": body(ball(10, 2), "polished", "milk")},
        rays=20_000,
        media={"milk": milk},
        surfaces={"polished": {"kind": "fresnel"}},
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}},
    )
    at = np.flatnonzero(h.kind == EventKind.MEDIUM_SCATTERING)
    before, after = h.way[at], h.way[at + 1]
    long = (np.linalg.norm(before, axis=1) > 0.03) & (np.linalg.norm(after, axis=1) > 0.03)  # far above the grid
    before, after = unit(before[long]), unit(after[long])
    cosine = np.clip((before * after).sum(axis=1), -1, 1)
    agrees("mean cosine", cosine.mean(), cosine.std() / math.sqrt(len(cosine)), mean, rounding=1e-5)
    model = {"isotropic": IsotropicPhase, "henyey_greenstein": HenyeyGreenstein, "table": TabulatedPhase}[phase["kind"]]
    follows("angles", phase_cumulated(model.model_validate(phase), cosine), slack=1e-4)
    across = np.stack([np.cross(before, [0.0, 0.0, 1.0]), np.cross(before, np.cross(before, [0.0, 0.0, 1.0]))])
    azimuth = np.arctan2((after * across[1]).sum(axis=1), (after * across[0]).sum(axis=1))
    follows("azimuths", azimuth / (2 * math.pi) + 0.5)
