# SPDX-License-Identifier: LGPL-2.1-or-later
"""The 95 % intervals of a thousand runs contain the closed form in 93 to 97 % of them.

The share of a thousand runs is known to sqrt(0.95 0.05 / 1000) = 0.7 %. Counts are whole numbers, so that the true
coverage of one figure may lie a percent off 95 % itself; what is asked for is 95 % within 2 %.
"""

import math
from collections import defaultdict

import numpy as np
import pytest

from raymaps.criterion import confidence_interval, query
from raymaps.results.detector import evaluate_detector
from raymaps.results.ledger import energy_ledger
from tests.accuracy.runs import N_RUNS, runs
from tests.accuracy.scenes import BLACK, LAMP_FLUX_W, LAMP_HEIGHT_MM, slab, slab_flux_w, two_lamps, two_mirrors
from tests.physics.scenes import body, disc, write_scene
from tests.physics.test_view_factors import coaxial_discs

#: One sigma of a coverage of 95 %.
SIGMA = math.sqrt(0.95 * 0.05 / N_RUNS)


class Figures:
    """Estimates of figures over runs, by name: flux, its standard error, low, high."""

    def __init__(self):
        self._found = defaultdict(list)

    def add(self, name, flux, stderr, interval):
        self._found[name].append((flux, stderr, *interval))

    def queried(self, name, found):
        self.add(name, found.flux_w, found.flux_stderr_w, found.interval_w)

    def detected(self, name, found):
        self.add(name, found.flux_w.value, found.flux_w.stderr, found.interval_w)

    def booked(self, name, account):
        self.add(name, account.flux_w, account.stderr_w, account.interval_w)

    def of(self, name):
        """(flux, stderr, low, high), each (n_runs,)."""
        return np.array(self._found[name]).T

    def coverage(self, name, truth):
        _, _, low, high = self.of(name)
        return float(np.mean((low <= truth) & (truth <= high)))


def covers(figures, name, truth):
    """The intervals are right as often as they say, and the figure is right on the average."""
    flux, stderr, _, _ = figures.of(name)
    assert len(flux) == N_RUNS
    assert flux.mean() == pytest.approx(truth, abs=5 * flux.std() / math.sqrt(N_RUNS))
    # the standard error is the spread of the runs, which 1000 of them know to 2.2 %
    assert math.sqrt(np.mean(stderr**2)) == pytest.approx(flux.std(), rel=5 / math.sqrt(2 * N_RUNS))
    coverage = figures.coverage(name, truth)
    print(f"{name}: {100 * coverage:.1f} %")  # pytest -s tests/accuracy
    assert 0.93 <= coverage <= 0.97, f"{name}: {coverage:.3f}"


# ---------------------------------------------------------------------------------------------------------------------
# Two point sources above a detector: regions, criteria, rare events, events that don't happen


RAYS_OF_A = 500
#: Expected rays of A in a region, by its name.
EXPECTED = {"rare": 20.0, "few": 8.0, "three": 2.9, "two": 2.0, "one": 1.0}


def share(source, radius_mm):
    """Of a point's light that meets a circle below it: its solid angle over 4 pi."""
    return (1 - 1 / math.hypot(1, radius_mm / LAMP_HEIGHT_MM[source])) / 2


def radius_of(expected):
    """Of the circle that so many rays of A are expected to meet, in mm."""
    return math.tan(math.acos(1 - 2 * expected / RAYS_OF_A))


@pytest.fixture(scope="module")
def lamps(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lamps")
    scene = two_lamps(folder)
    found = Figures()
    for run in runs(folder, scene, 2 * RAYS_OF_A):
        found.queried("by criterion", query(run, "from(A) & detector(D, ellipse=(0,0,1,1))"))
        found.queried("of two sources", query(run, "detector(D, ellipse=(0,0,1,1))"))
        found.detected("region", evaluate_detector(run, "D", ellipse=(0, 0, 1, 1)))
        found.detected("region of one", evaluate_detector(run, "D", ellipse=(0, 0, 2, 2), where="from(B)"))
        for name, expected in EXPECTED.items():
            radius = radius_of(expected)
            found.queried(name, query(run, f"from(A) & detector(D, ellipse=(0,0,{radius},{radius}))"))
        radius = radius_of(EXPECTED["rare"])
        found.detected("rare of two", evaluate_detector(run, "D", ellipse=(0, 0, radius, radius)))
    return found


@pytest.mark.parametrize(
    ("name", "truth"),
    [
        ("by criterion", share("A", 1)),
        ("of two sources", share("A", 1) + 3 * share("B", 1)),
        ("region", share("A", 1) + 3 * share("B", 1)),
        ("region of one", 3 * share("B", 2)),
        ("rare", EXPECTED["rare"] / RAYS_OF_A),
        ("rare of two", sum(LAMP_FLUX_W[s] * share(s, radius_of(EXPECTED["rare"])) for s in LAMP_FLUX_W)),
    ],
)
def test_regions_criteria_and_rare_events(lamps, name, truth):
    covers(lamps, name, truth)


def test_twice_the_standard_error_is_too_sure_where_rays_are_few(lamps):
    """What the interval is for: value ± 2 errors misses the truth of rare events too often, most of all from below."""
    flux, stderr, low, high = lamps.of("few")
    truth = EXPECTED["few"] / RAYS_OF_A
    below = np.mean(flux + 1.96 * stderr < truth)
    assert below > 0.025 + 3 * SIGMA
    assert np.mean(high < truth) <= 0.025 + 3 * SIGMA
    assert np.mean((low <= truth) & (truth <= high)) > 0.93


@pytest.mark.parametrize("name", ["three", "two", "one"])
def test_what_was_hardly_seen_is_below_its_limit(lamps, name):
    """The upper limit is below a small truth in at most 5 % of the runs, whether or not a ray was seen."""
    truth = EXPECTED[name] / RAYS_OF_A
    flux, stderr, low, high = lamps.of(name)
    assert np.mean(high < truth) <= 0.05
    assert (flux == 0).any()
    assert (stderr > 0).all()
    assert (low[flux == 0] == 0).all()
    assert high[flux == 0] == pytest.approx(math.log(20) / RAYS_OF_A, rel=0.01)


# ---------------------------------------------------------------------------------------------------------------------
# From disc to disc: nearly all rays, and the ledger


@pytest.fixture(scope="module")
def discs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("discs")
    scene = write_scene(
        folder,
        {"Lamp": body(disc(1, 64), "black"), "Target": body(disc(2, 64, up=False).moved(0, 0, 0.5), "black")},
        surfaces={"black": BLACK},
        sources={"S": {"kind": "faces", "flux_w": 2.5, "body": "Lamp"}},
        detectors={"T": {"kind": "face", "body": "Target"}},
    )
    found = Figures()
    for run in runs(folder, scene, 400):
        ledger = energy_ledger(run)
        found.booked("absorbed", ledger.absorbed_by_body["Target"])
        found.booked("escaped", ledger.escaped)
        found.booked("killed", ledger.killed)
        found.detected("detector", evaluate_detector(run, "T", resolution=(1, 1)))
        found.queried("everything", query(run))
    return found


@pytest.mark.parametrize("name", ["absorbed", "detector", "escaped"])
def test_nearly_all_light_of_a_disc_on_a_disc(discs, name):
    on_target = coaxial_discs(1, 2, 0.5)
    assert on_target > 0.9
    covers(discs, name, 2.5 * (1 - on_target if name == "escaped" else on_target))
    assert (discs.of(name)[3] <= 2.5).all()


def test_what_nothing_did_is_at_most_three_rays_and_what_logic_says_is_certain(discs):
    flux, stderr, low, high = discs.of("killed")
    assert (flux == 0).all()
    assert (low == 0).all()
    assert high == pytest.approx(2.5 * math.log(20) / 400, rel=0.01)
    assert stderr == pytest.approx(2.5 / 400, rel=1e-12)
    assert (discs.of("everything") == np.array([[2.5], [0], [2.5], [2.5]])).all()


# ---------------------------------------------------------------------------------------------------------------------
# A beam on two mirrors: dimmed light, and a detector that is crossed twice


REFLECTANCES = (0.9, 0.2)
STRIP_MM = 0.06  # half the width of a strip of the beam, whose radius is 1
IN_STRIP = 2 / math.pi * (math.asin(STRIP_MM) + STRIP_MM * math.sqrt(1 - STRIP_MM**2))
MEAN = sum(REFLECTANCES) / 2
BEAM_RAYS = 400


@pytest.fixture(scope="module")
def mirrors(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mirrors")
    scene = two_mirrors(folder, REFLECTANCES, 0)
    found = Figures()
    strip = (-STRIP_MM, -3, STRIP_MM, 3)
    for run in runs(folder, scene, BEAM_RAYS):
        found.detected("twice", evaluate_detector(run, "Both"))
        found.detected("twice, rare", evaluate_detector(run, "Both", rect=strip))
        found.detected("dimmed", evaluate_detector(run, "Up"))
        found.detected("dimmed, rare", evaluate_detector(run, "Up", rect=strip))
        ledger = energy_ledger(run)
        found.booked("lost to a mirror", ledger.absorbed_by_body["Bright"])
        found.booked("lost", ledger.absorbed)
        found.add("crossings as if they were rays", math.nan, math.nan, of_crossings(run))
    return found


def of_crossings(run):
    """What comes of taking each crossing of the strip for a sample of its own."""
    piece = run.portions[0]
    of_both = piece.crossing_detector == run.names.detectors.index("Both")
    here = of_both & (np.abs(piece.crossing_xy_mm[:, 0]) <= STRIP_MM)
    light = piece.power[piece.crossing_row[here]]
    low, high = confidence_interval([1.0], [BEAM_RAYS], [light.sum()], [np.sum(light**2)], most=2.0)
    return float(low), float(high)


@pytest.mark.parametrize(
    ("name", "truth"),
    [
        ("twice", 1 + MEAN),
        ("twice, rare", IN_STRIP * (1 + MEAN)),
        ("dimmed", MEAN),
        ("dimmed, rare", IN_STRIP * MEAN),
        ("lost to a mirror", (1 - REFLECTANCES[0]) / 2),
        ("lost", 1 - MEAN),
    ],
)
def test_crossed_twice_and_dimmed(mirrors, name, truth):
    covers(mirrors, name, truth)


def test_crossings_are_no_samples(mirrors):
    """The test can fail: with crossings as independent samples the truth is missed far too often."""
    assert mirrors.coverage("crossings as if they were rays", IN_STRIP * (1 + MEAN)) < 0.90


# ---------------------------------------------------------------------------------------------------------------------
# A slab that reflects to and fro and absorbs


@pytest.fixture(scope="module")
def of_slab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("slab")
    scene = slab(folder)
    found = Figures()
    for run in runs(folder, scene, 400):
        ledger = energy_ledger(run)
        found.booked("reflected", ledger.escaped)
        found.booked("absorbed", ledger.absorbed_by_medium["glass"])
        found.queried("transmitted", query(run, "hit(Floor)"))
    return found


@pytest.mark.parametrize("name", ["reflected", "absorbed", "transmitted"])
def test_a_slab(of_slab, name):
    covers(of_slab, name, slab_flux_w()[name])
