# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sums over a thousand million tiny fluxes: order, portions and threads do not change a digit that is shown."""

from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from raymaps import energy_ledger, evaluate_detector
from raymaps.criterion import estimate_flux
from raymaps.kinds import EventKind
from raymaps.results.cells import RaySums
from raymaps.results.cells_kernel import add_rays
from raymaps.run import simulate
from raymaps.store import LedgerEntry
from raymaps.store.numbering import sum_light
from raymaps.units import format_with_error
from tests.physics.scenes import ball, body, box, disc_source, rectangle, write_scene

PORTION = 65_536


def ledger_of(portions):
    """The ledger of a map of one source of 1 W with just these entries."""
    n_rays = len(portions) * PORTION
    return energy_ledger(
        SimpleNamespace(
            names=SimpleNamespace(sources=("Lamp",), bodies=("Body",), media=("Glass",)),
            ray_flux_w=np.array([1 / n_rays]),
            rays_of_source=np.array([n_rays]),
            rays_of_replicate=np.array([[n_rays]]),
            source_flux_w=np.array([1.0]),
            portions=[SimpleNamespace(summary=SimpleNamespace(ledger=entries)) for entries in portions],
        )
    )


def test_the_ledger_of_a_thousand_million_rays():
    """Fifteen thousand portions, in any order, bit by bit the same; and the energy that was emitted, to the last digit.

    Guards: `math.fsum` over the portions.
    """
    rng = np.random.default_rng(1)
    portions = []
    for _ in range(15_259):
        share = rng.dirichlet([5, 1e-3, 2, 1e-6]) * PORTION
        places = (("body", 0), ("medium", 0), ("escaped", 0), ("killed", int(EventKind.KILLED_DEPTH)))
        portions.append(
            [LedgerEntry(0, *place, float(x), float(x) / 2) for place, x in zip(places, share, strict=True)]
        )
    ledger = ledger_of(portions)
    assert ledger.absorbed_w + ledger.escaped_w + ledger.killed_w == pytest.approx(1, abs=1e-15 * 4)
    exact = sum(Fraction(p[2].light) for p in portions) / (len(portions) * PORTION)
    assert ledger.escaped_w == pytest.approx(float(exact), rel=1e-15)
    for order in (portions[::-1], [portions[k] for k in rng.permutation(len(portions))]):
        assert ledger_of(order) == ledger


@pytest.mark.parametrize("value", [0.1, 1e-7, 1.0])
def test_a_hundred_million_samples_of_a_detector(value):
    """Sum and sum of squares of rays that are all alike, to the last digit: their spread is 0, the error that of one.

    Guards: `_add` of Kahan. Added up plainly the sum of squares is off by 1e-9, more than the error of the flux.
    """
    n, times = 1_000_000, 100
    ray, row = np.arange(n), np.zeros(n, np.int64)
    power = float(np.float32(value))
    light = np.array([[power, 0, 0, 0, 0]])
    source = np.zeros(n, np.int16)
    sums, rounded = RaySums(*(np.zeros(1) for _ in range(6))), np.zeros((4, 1))
    for _ in range(times):
        add_rays(ray, row, np.zeros(0, np.int64), light, source, sums, rounded)
    exact = float(Fraction(power) * n * times)
    squares = float(Fraction(power) ** 2 * n * times)
    assert sums.total[0] == pytest.approx(exact, rel=3e-16, abs=0)
    assert sums.squares[0] == pytest.approx(squares, rel=3e-16, abs=0)
    flux, stderr = estimate_flux([1.0], [n * times], sums.total, sums.squares)
    assert flux == pytest.approx(power, rel=1e-15, abs=0)
    assert stderr == pytest.approx(power / (n * times), rel=1e-6, abs=0)


def test_a_portion_adds_up_float32_without_loss():
    """Ten million events whose light float32 knows: their sum, in float64, is exact to 1e-12.

    Guards: `sum_light` adds in float64 (in float32 it would stop growing at 2^24 times its smallest term).
    """
    n = 5_000_000
    rng = np.random.default_rng(2)
    power = rng.random(1_000).astype(np.float32).astype(np.float64)
    light = np.stack([rng.integers(0, 1_000, n), np.zeros(n, np.int64)], axis=1).astype(np.uint32).reshape(-1)
    account = np.tile(np.array([0, -1 - 1], np.int32), n)
    sums, rounded = np.zeros((2, 2, 1, 2))
    sum_light(
        np.zeros(n, np.int16), np.arange(0, 2 * n + 1, 2), light, power, account, sums, rounded, np.zeros(2)
    )  # fmt: skip
    exact = float(
        sum(Fraction(float(p)) * int(c) for p, c in zip(power, np.bincount(light[::2], minlength=1_000), strict=True))
    )
    assert sums[0, 0, 1] == pytest.approx(exact, rel=1e-12, abs=0)


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    """What is shown of one scene, traced with other numbers of threads and of rays in a portion."""
    folder = tmp_path_factory.mktemp("sums")
    scene = write_scene(
        folder,
        {
            "Lens": body(ball(8, 3), "polished", "glass"),
            "Room": body(box((-20, -20, -20), (20, 20, 20)).inside_out, "white"),
        },
        media={"glass": {"refractive_index": 1.5, "absorption_per_mm": [0.02, 0.001, 0]}},
        surfaces={"polished": {"kind": "fresnel"}, "white": {"kind": "lambertian", "reflectance": [0.7, 0.6, 0.5]}},
        sources={
            "Beam": disc_source((0, 0, 15), (0.1, 0, -1), 5),
            "Weak": disc_source((9, 0, 15), (0, 0, -1), 5, 1e-9),
        },
        detectors={"D": rectangle((0, 0, -12), 20, 20, side="both", resolution=[7, 7])},
    )
    found = []
    for threads, portion in ((1, 100_000), (2, 1_000), (4, 7_777)):
        raymap = simulate(scene, folder / f"{portion}.raymap", rays=50_000, threads=threads, portion_rays=portion)
        found.append((energy_ledger(raymap), evaluate_detector(raymap, "D")))
    return found


def test_threads_and_portions_change_no_digit(figures):
    """Fluxes with their errors as they are shown, ledgers to 1e-13, and each cell.

    Guards: rays are added in the order of their numbers, whichever portion and thread they come from.
    """
    (ledger, detector), *others = figures
    for other, map_ in others:
        for name in ("emitted_w", "absorbed_w", "escaped_w", "killed_w"):
            assert getattr(other, name) == pytest.approx(getattr(ledger, name), rel=1e-13, abs=1e-300)
        assert other.absorbed_by_body_w == pytest.approx(ledger.absorbed_by_body_w, rel=1e-13, abs=0)
        ours, theirs = map_.flux_w, detector.flux_w
        assert format_with_error(ours.value, ours.stderr) == format_with_error(theirs.value, theirs.stderr)
        assert ours.value == pytest.approx(theirs.value, rel=1e-14, abs=0)
        assert np.allclose(map_.cell_flux_w, detector.cell_flux_w, rtol=1e-13, atol=0)
