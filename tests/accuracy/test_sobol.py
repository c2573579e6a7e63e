# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sampling "sobol": a thousand runs are right on the average, as sure as they say, and surer than independent rays.

As in `tests.accuracy.test_coverage`, with the same kinds of figures: totals, regions, filtered ones, rare events, the
ledger; on scenes that are smooth for the points (few decisions) and rough (many bounces).
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from raymaps.criterion import estimate_flux, query
from raymaps.results.detector import evaluate_detector
from raymaps.results.ledger import energy_ledger
from tests.accuracy.runs import N_RUNS, runs
from tests.accuracy.scenes import (
    BLACK,
    LAMP_FLUX_W,
    LAMP_HEIGHT_MM,
    SLAB_FLUX_W,
    slab,
    slab_flux_w,
    two_lamps,
    two_mirrors,
)
from tests.accuracy.test_coverage import Figures
from tests.physics.scenes import body, box, disc_source, rectangle, write_scene
from tests.physics.test_integrating_sphere import sphere_with_port

#: Student's quantile at 97.5 % of 15 degrees of freedom over the normal one: how much wider errors are told.
WIDER = 2.13145 / 1.95996
#: One sigma of a spread that so many runs tell, relative.
SIGMA_OF_SPREAD = 1 / math.sqrt(2 * N_RUNS)
SOBOL = {"sampling": "sobol"}


def covers(figures, name, truth):
    """As of `tests.accuracy.test_coverage`; the standard error is widened."""
    flux, stderr, _, _ = figures.of(name)
    assert len(flux) == N_RUNS
    assert flux.mean() == pytest.approx(truth, abs=5 * flux.std() / math.sqrt(N_RUNS))
    assert math.sqrt(np.mean(stderr**2)) == pytest.approx(WIDER * flux.std(), rel=5 * SIGMA_OF_SPREAD)
    coverage = figures.coverage(name, truth)
    print(f"{name}: {100 * coverage:.1f} %")  # pytest -s tests/accuracy
    assert 0.93 <= coverage <= 0.97, f"{name}: {coverage:.3f}"


def gain(figures, name, flux_w, n_rays):
    """By what a run's variance is less than that of independent rays of which each counts or does not."""
    flux = figures.of(name)[0] / flux_w
    found = flux.mean() * (1 - flux.mean()) / n_rays / flux.var(ddof=1)
    print(f"{name}: variance less by {found:.1f}")  # pytest -s tests/accuracy
    return found


# ---------------------------------------------------------------------------------------------------------------------
# Two point sources above a detector


RAYS_OF_A = 500
REGION = (-0.4, 0.1, 1.1, 0.9)


def share(source, x0, y0, x1, y1):
    """Of a point's light that meets a rectangle below it: its solid angle over 4 pi."""

    def corner(x, y):
        h = LAMP_HEIGHT_MM[source]
        return math.atan(x * y / (h * math.sqrt(x * x + y * y + h * h)))

    return (corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)) / (4 * math.pi)


def square(expected):
    """A square beside the foot of A that so many of its rays are expected to meet."""

    def around(half):
        return 0.5 - half, 0.3 - half, 0.5 + half, 0.3 + half

    return around(brentq(lambda half: RAYS_OF_A * share("A", *around(half)) - expected, 1e-3, 5))


RARE = square(20)


@pytest.fixture(scope="module")
def lamps(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lamps")
    scene = two_lamps(folder, **SOBOL)
    found = Figures()
    region, rare = (",".join(str(x) for x in rect) for rect in (REGION, RARE))
    for run in runs(folder, scene, 2 * RAYS_OF_A):
        found.queried("of two sources", query(run, f"detector(D, rect=({region}))"))
        found.detected("total", evaluate_detector(run, "D"))
        found.detected("region", evaluate_detector(run, "D", rect=REGION))
        found.detected("filtered", evaluate_detector(run, "D", rect=REGION, where="from(A)"))
        found.queried("rare", query(run, f"from(A) & detector(D, rect=({rare}))"))
        found.detected("rare of two", evaluate_detector(run, "D", rect=RARE))
        found.add("as if independent", *independent(run))
    return found


def independent(run):
    """What comes of taking the rays for independent: flux, standard error, and no interval."""
    rays, seen = run.rays_of_source, query(run, "detector(D)").ids
    hits = np.bincount(run.portions[0].signatures.ray_source[run.portions[0].ray_signature[seen]], minlength=2)
    flux_w, stderr_w = estimate_flux(run.source_flux_w, rays, hits, hits)
    return float(flux_w), float(stderr_w), (math.nan, math.nan)


@pytest.mark.parametrize(
    ("name", "truth"),
    [
        ("total", sum(LAMP_FLUX_W[s] * share(s, -10, -10, 10, 10) for s in LAMP_FLUX_W)),
        ("of two sources", sum(LAMP_FLUX_W[s] * share(s, *REGION) for s in LAMP_FLUX_W)),
        ("region", sum(LAMP_FLUX_W[s] * share(s, *REGION) for s in LAMP_FLUX_W)),
        ("filtered", share("A", *REGION)),
        ("rare", 20 / RAYS_OF_A),
        ("rare of two", sum(LAMP_FLUX_W[s] * share(s, *RARE) for s in LAMP_FLUX_W)),
    ],
)
def test_regions_criteria_and_rare_events(lamps, name, truth):
    covers(lamps, name, truth)


def test_a_figure_of_independent_rays_would_be_far_too_unsure(lamps):
    """The test can fail: the spread of the rays is not that of the runs."""
    flux, stderr, _, _ = lamps.of("as if independent")
    assert math.sqrt(np.mean(stderr**2)) > 2 * flux.std()


def test_light_of_a_point_gains(lamps):
    assert gain(lamps, "filtered", 1.0, RAYS_OF_A) > 2


# ---------------------------------------------------------------------------------------------------------------------
# A slab that reflects to and fro and absorbs; mirrors that dim light that is counted twice


@pytest.fixture(scope="module")
def of_slab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("slab")
    scene = slab(folder, **SOBOL)
    found = Figures()
    for run in runs(folder, scene, 400):
        ledger = energy_ledger(run)
        found.booked("reflected", ledger.escaped)
        found.booked("absorbed", ledger.absorbed_by_medium["glass"])
        found.booked("absorbed by all", ledger.absorbed)
        found.queried("transmitted", query(run, "hit(Floor)"))
    return found


@pytest.mark.parametrize("name", ["reflected", "absorbed", "absorbed by all", "transmitted"])
def test_a_slab(of_slab, name):
    covers(of_slab, name, slab_flux_w()[name])


def test_what_happens_at_the_first_events_gains(of_slab):
    assert gain(of_slab, "absorbed", SLAB_FLUX_W, 400) > 3


#: Of two mirrors, and where they meet under a beam of radius 1 mm.
REFLECTANCES = 0.9, 0.3
EDGE_MM = 0.3


@pytest.fixture(scope="module")
def mirrors(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mirrors")
    scene = two_mirrors(folder, REFLECTANCES, EDGE_MM, **SOBOL)
    found = Figures()
    for run in runs(folder, scene, 800):
        found.detected("twice", evaluate_detector(run, "Both"))
        found.detected("strip", evaluate_detector(run, "Both", rect=(-0.2, -3, 0.2, 3)))
        found.booked("lost", energy_ledger(run).absorbed)
    return found


@pytest.mark.parametrize("name", ["twice", "strip", "lost"])
def test_crossed_twice_and_dimmed(mirrors, name):

    def between_0_and(x):  # share of the unit disc
        return (x * math.sqrt(1 - x**2) + math.asin(x)) / math.pi

    bright, dull = 0.5 + between_0_and(EDGE_MM), 0.5 - between_0_and(EDGE_MM)
    mean = bright * REFLECTANCES[0] + dull * REFLECTANCES[1]
    in_strip = 2 * between_0_and(0.2) * (1 + REFLECTANCES[0])
    covers(mirrors, name, {"twice": 1 + mean, "strip": in_strip, "lost": 1 - mean}[name])


# ---------------------------------------------------------------------------------------------------------------------
# Rough scenes: many bounces, of which the points know the first four


@pytest.fixture(scope="module")
def rough(tmp_path_factory):
    found = Figures()
    folder = tmp_path_factory.mktemp("sphere")
    shape, _ = sphere_with_port()
    scene = write_scene(
        folder,
        {"Sphere": body(shape, "white", Port="black")},
        surfaces={"white": {"kind": "lambertian", "reflectance": 0.9}, "black": BLACK},
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}},
        settings={"roulette_threshold": 1, **SOBOL},
    )
    for run in runs(folder, scene, 300):
        found.queried("sphere", query(run, "hit(Sphere.Port)"))
    folder = tmp_path_factory.mktemp("fog")
    scene = write_scene(
        folder,
        {"Fog": body(box((-500, -500, 0), (500, 500, 1)), "clear", "fog")},
        media={"fog": {"refractive_index": 1.0, "scattering": [{"coefficient_per_mm": 5.0}]}},
        surfaces={"clear": {"kind": "fresnel"}},
        sources={"S": disc_source((0, 0, 3), (0, 0, -1), 1)},
        detectors={"Below": rectangle((0, 0, -1), 1000, 1000)},
        settings=SOBOL,
    )
    for run in runs(folder, scene, 300):
        found.queried("fog", query(run, "detector(Below)"))
    return found


def test_light_in_a_sphere(rough):
    """Each bounce may end in the port, with the share f of the area, or on the wall; p = f + (1 - f) rho p."""
    _, f = sphere_with_port()
    covers(rough, "sphere", f / (1 - 0.9 * (1 - f)))


@pytest.mark.parametrize("name", ["sphere", "fog"])
def test_where_light_bounces_often_nothing_is_lost(rough, name):
    """Not less sure than independent rays: 5 sigma of a variance that a thousand runs tell are 22 %."""
    assert gain(rough, name, 1.0, 300) > 1 - 10 * SIGMA_OF_SPREAD
