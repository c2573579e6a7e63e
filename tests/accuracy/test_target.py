# SPDX-License-Identifier: LGPL-2.1-or-later
"""A target in place of a number of rays: the figure is not biased by how the number was chosen, and the map is normal.

The scene has closed forms: an isotropic lamp in the middle of a black cubic room, and detectors that each take the
light of a cone around +z. Of its 4 pi, a square of side 2 a at distance d sees 4 asin(a² / (a² + d²)).
"""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

import raymaps
from raymaps.compile import compile_scene
from raymaps.errors import CriterionError, Interrupted, TraceError
from raymaps.runner import Progress
from raymaps.scene import load_scene
from raymaps.target import Course, Tally, Target
from raymaps.target.rule import (
    FIRST_PILOT,
    GROUPS,
    MAX_EXTENSIONS,
    pilot_hits,
    pilot_seed,
    rays_for_error,
    rays_needed,
    whole,
)
from raymaps.trace import Tracer
from tests.store.small_scenes import box, geometry, write_scene

SEEDS = 1000
PORTION = 4096
#: Rays to which the number is rounded up here: the fewer, the more freely it follows the data.
STEP = 64
ONE_W, NOT_EXACT = np.ones(1), np.zeros(1, bool)
#: Half sides of the detectors at 1 mm from the lamp: a fifth of the light, and one ray in 120.
HALF_MM = {"Common": 1.2, "Rare": 0.165}


def share(name: str) -> float:
    """Share of the light that meets a detector."""
    a2 = HALF_MM[name] ** 2
    return 4 * math.asin(a2 / (a2 + 1)) / (4 * math.pi)


def black_room(folder) -> dict:
    detector = {"kind": "rectangle", "center_mm": [0, 0, 1], "normal": [0, 0, -1], "x_axis": [1, 0, 0]}
    return {
        "format": "raymaps-scene", "version": 1, "name": "black room",
        "surfaces": {"black": {"kind": "lambertian", "reflectance": 0.0}},
        "bodies": {"Room": {"geometry": geometry(folder, box("Room", (0, 0, 0), 10)), "surface": "black"}},
        "sources": {"Lamp": {"kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 0]}},
        "detectors": {n: {**detector, "width_mm": 2 * a, "height_mm": 2 * a} for n, a in HALF_MM.items()},
        "settings": {"rays": 20000, "seed": 3},
    }  # fmt: skip


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    folder = tmp_path_factory.mktemp("black_room")
    return load_scene(write_scene(folder, black_room(folder)))


# ---------------------------------------------------------------------------------------------------------------------
# Bias, over 1,000 seeds


def tally(hits: NDArray[np.bool_]) -> Tally:
    n = float(hits.sum())
    return Tally(np.array([[float(len(hits))]]), np.array([[n]]), np.array([[n]]), int(n))


def by_the_rule(hits: Callable, seed: int, error: float, index: int) -> Tally:
    """What `simulate` does, on hits alone."""
    other, size, done = pilot_seed(seed), FIRST_PILOT // GROUPS, 0
    groups = [Tally.none((1, 1))] * GROUPS
    while sum(group.hits for group in groups) < pilot_hits(error):
        new = np.split(hits(other, index, done + GROUPS * size)[done:], GROUPS)
        groups = [group + tally(part) for group, part in zip(groups, new, strict=True)]
        done += GROUPS * size
        size = done // GROUPS
    n = whole(rays_needed(groups, error, ONE_W, NOT_EXACT), STEP, 10**9)
    for _ in range(MAX_EXTENSIONS + 1):
        counted = tally(hits(seed, index, n))
        found = counted.relative_error(ONE_W, NOT_EXACT)
        if found <= error:
            break
        n = whole(rays_for_error(counted, found, error), STEP, 10**9)
    return counted


def naive(hits: Callable, seed: int, error: float, index: int) -> Tally:
    """Look after every 64 rays, and stop as soon as the error bar is small."""
    n = 4 * PORTION
    while True:
        met = hits(seed, index, n)
        so_far, rays = np.cumsum(met)[STEP - 1 :: STEP], np.arange(STEP, n + 1, STEP)
        small = np.flatnonzero((so_far > 1) & (rays - so_far <= error**2 * rays * so_far))
        if len(small):
            return tally(met[: rays[small[0]]])
        n *= 2


@dataclass(frozen=True)
class Bias:
    """Mean deviation from the truth in standard errors of a run, and how uncertain it is."""

    value: float
    stderr: float


def bias_of(run: Callable, hits: Callable, error: float, name: str) -> Bias:
    """By Wald's identity: at any stopping time N the sum of (hit - p) has mean 0, so a constant multiple may be taken
    off the deviation, which leaves only what the choice of N does: E[(S - N p)(1 / N - 1 / n)]."""
    p = share(name)
    tallies = [run(hits, seed, error, list(HALF_MM).index(name)) for seed in range(SEEDS)]
    rays, met = np.array([(t.n_rays, t.hits) for t in tallies], float).T
    off = (met - rays * p) * (1 / rays - 1 / rays.mean()) / (error * p)
    return Bias(float(off.mean()), float(off.std(ddof=1) / math.sqrt(SEEDS)))


@pytest.fixture(scope="module")
def hits(scene) -> Callable:
    """Which of the first rays of a seed met a detector, traced as far as was asked for."""
    compiled = compile_scene(scene)
    tracer = Tracer(compiled, 0)

    @functools.lru_cache(maxsize=4)
    def traced(seed: int, portion: int) -> NDArray[np.bool_]:
        tracer.seed = seed
        history = tracer.trace_portion(portion * PORTION, PORTION)
        ray = np.searchsorted(history.event_offsets, history.crossing_row, side="right") - 1
        met = np.zeros((PORTION, len(HALF_MM)), bool)
        met[ray, history.crossing_detector] = history.crossing_registered
        return met

    def first(seed: int, index: int, n: int) -> NDArray[np.bool_]:
        return np.concatenate([traced(seed, k)[:, index] for k in range(-(-n // PORTION))])[:n]

    return first


def test_the_detectors_see_their_share(hits):
    for index, name in enumerate(HALF_MM):
        met, p = hits(7, index, 16 * PORTION), share(name)
        assert abs(met.mean() - p) < 5 * math.sqrt(p * (1 - p) / len(met))


@pytest.mark.parametrize(("name", "error"), [("Common", 0.02), ("Rare", 0.2)])
def test_the_rule_biases_no_figure(hits, name, error):
    """Below a twentieth of the standard error, with three of its own errors to spare."""
    bias = bias_of(by_the_rule, hits, error, name)
    assert abs(bias.value) + 3 * bias.stderr < 1 / 20, bias


def test_stopping_once_the_error_is_small_biases_rare_events(hits):
    """By ``error`` standard errors to first order: that the test can see a bias."""
    bias = bias_of(naive, hits, 0.2, "Rare")
    assert bias.value - 3 * bias.stderr > 1 / 20, bias
    assert bias.value == pytest.approx(0.2, abs=0.1)


# ---------------------------------------------------------------------------------------------------------------------
# The rule


def drawn(p: float, n: int, seed: int) -> list[Tally]:
    return [tally(part) for part in np.split(np.random.default_rng(seed).random(n) < p, GROUPS)]


@pytest.mark.parametrize(("p", "n"), [(0.5, 2048), (0.01, 8192)])
def test_the_rays_predicted_suffice_in_most_runs_and_are_not_many_more(p, n):
    error = 0.03
    exactly = (1 - p) / p / error**2
    needed = np.array([rays_needed(drawn(p, n, seed), error, ONE_W, NOT_EXACT) for seed in range(300)])
    assert np.mean(needed >= exactly) > 0.85
    assert np.median(needed) < 2 * exactly


def test_the_rays_predicted_grow_with_the_square_of_the_target():
    groups = drawn(0.2, 65536, 1)
    one, ten = (rays_needed(groups, error, ONE_W, NOT_EXACT) for error in (0.001, 0.01))
    assert one / ten == pytest.approx(100, rel=0.1)


def test_where_nothing_arrives_no_number_suffices_and_where_all_is_known_none_is_needed():
    nothing = [Tally(np.array([[64.0]]), np.zeros((1, 1)), np.zeros((1, 1)), 0)] * GROUPS
    assert rays_needed(nothing, 0.01, ONE_W, NOT_EXACT) == math.inf
    everything = [tally(np.ones(64, bool))] * GROUPS
    assert rays_needed(everything, 0.01, ONE_W, ~NOT_EXACT) == 0


def test_rays_are_rounded_up_to_whole_portions_and_never_above_the_most():
    assert [whole(n, 100, 950) for n in (0, 1, 100, 101, 899, 901, math.inf)] == [100, 100, 100, 200, 900, 950, 950]


def test_the_pilot_has_another_seed():
    seeds = [0, 1, 2, 2**63, 2**64 - 1]
    others = [pilot_seed(seed) for seed in seeds]
    assert len({*seeds, *others}) == 2 * len(seeds)
    assert all(0 <= other < 2**64 for other in others)


# ---------------------------------------------------------------------------------------------------------------------
# Runs


def course_of(raymap) -> Course:
    return Course.from_dict(raymap.manifest.target)


@pytest.mark.parametrize(
    ("target", "flux_w"),
    [
        (Target(2, "Common"), share("Common")),
        (Target(10, "Rare"), share("Rare")),
        (Target(3, where="detector(Common)"), share("Common")),
        (Target(10, "Common", rect=(-0.165, -0.165, 0.165, 0.165)), share("Rare")),
        (Target(10, "Common", where="detector(Rare)"), share("Rare")),
        (Target(10), share("Rare")),  # the one that is least certain
    ],
)
def test_a_run_reaches_its_target(scene, tmp_path, target, flux_w):
    raymap = raymaps.simulate(scene, tmp_path / "m.raymap", target=target)
    course = course_of(raymap)
    assert course.ended == "target"
    assert course.reached_percent <= target.percent
    assert course.reached_percent == pytest.approx(100 * course.flux_stderr_w / course.flux_w)
    assert abs(course.flux_w - flux_w) < 5 * course.flux_stderr_w
    assert raymap.n_rays == course.stages[-1] == raymap.manifest.rays_asked
    assert course.pilot_hits >= pilot_hits(target.error)


def test_points_of_a_sequence_reach_it_with_fewer_rays(scene, tmp_path):
    """Independent rays that count with the chance p have the relative error sqrt((1 - p) / (p n))."""
    even = scene.model_copy(update={"settings": scene.settings.model_copy(update={"sampling": "sobol"})})
    raymap = raymaps.simulate(even, tmp_path / "m.raymap", target=Target(0.3, "Common"))
    course, p = course_of(raymap), share("Common")
    assert course.ended == "target"
    assert course.reached_percent <= 0.3
    assert raymap.n_rays == 1 << raymap.n_rays.bit_length() - 1
    assert raymap.n_rays < (1 - p) / p / 0.003**2 / 4
    assert abs(course.flux_w - p) < 5 * course.flux_stderr_w


def test_the_error_is_the_one_that_the_detector_tells(scene, tmp_path):
    region = {"rect": (0.0, 0.0, 1.0, 0.5), "where": "~detector(Rare)"}
    raymap = raymaps.simulate(scene, tmp_path / "m.raymap", target=Target(5, "Common", **region))
    told, course = raymaps.evaluate_detector(raymap, "Common", **region).flux_w, course_of(raymap)
    assert (course.flux_w, course.flux_stderr_w) == pytest.approx((told.value, told.stderr), rel=1e-12)


def test_the_error_of_a_criterion_is_the_one_that_a_query_tells(scene, tmp_path):
    raymap = raymaps.simulate(scene, tmp_path / "m.raymap", target=Target(5, where="detector(Rare)"))
    told, course = raymaps.query(raymap, "detector(Rare)"), course_of(raymap)
    assert (course.flux_w, course.flux_stderr_w) == pytest.approx((told.flux_w, told.flux_stderr_w), rel=1e-12)


def test_without_detectors_it_is_the_light_absorbed(tmp_path):
    data = black_room(tmp_path)
    del data["detectors"]
    data["surfaces"]["black"] = {"kind": "lambertian", "reflectance": 0.0, "transmittance": 0.5}
    raymap = raymaps.simulate(write_scene(tmp_path, data), tmp_path / "m.raymap", target=Target(2))
    course = course_of(raymap)
    assert course.quantity == "the light that is absorbed"
    assert course.flux_w == pytest.approx(raymaps.energy_ledger(raymap).absorbed_w, rel=1e-5)
    assert abs(course.flux_w - 0.5) < 5 * course.flux_stderr_w


def test_other_kinds_of_detectors(tmp_path):
    data = black_room(tmp_path)
    data["surfaces"]["black"] = {"kind": "lambertian", "reflectance": 0.0, "transmittance": 0.5}
    data["detectors"] = {
        "Walls": {"kind": "face", "body": "Room", "faces": ["top"], "measure": "absorbed"},
        "Sky": {"kind": "far_field"},
    }
    scene = load_scene(write_scene(tmp_path, data))
    for name, flux_w in (("Walls", 0.5 / 6), ("Sky", 0.5)):
        raymap = raymaps.simulate(scene, tmp_path / f"{name}.raymap", target=Target(5, name))
        told, course = raymaps.evaluate_detector(raymap, name).flux_w, course_of(raymap)
        assert (course.flux_w, course.flux_stderr_w) == pytest.approx((told.value, told.stderr), rel=1e-9)
        assert abs(told.value - flux_w) < 5 * told.stderr


def test_the_map_is_that_of_a_plain_run_whatever_the_threads(scene, tmp_path):
    runs = [
        raymaps.simulate(scene, tmp_path / f"{threads}.raymap", target=Target(10, "Rare"), threads=threads)
        for threads in (1, 3)
    ]
    plain = raymaps.simulate(scene, tmp_path / "plain.raymap", rays=runs[0].n_rays)
    assert plain.manifest.target is None
    assert {raymap.content_hash for raymap in runs} == {plain.content_hash}
    assert runs[0].manifest.target == runs[1].manifest.target


def test_a_run_that_was_stopped_goes_on_to_its_target(scene, tmp_path):
    whole_run = raymaps.simulate(scene, tmp_path / "whole.raymap", target=Target(5, "Rare"))
    for at in (0, 3 * PORTION):  # in the pilot, and later
        path, stop = tmp_path / f"{at}.raymap", threading.Event()

        def watch(progress, at=at, stop=stop):
            if progress.rays >= at:
                stop.set()

        with pytest.raises(Interrupted, match="--resume"):
            raymaps.simulate(scene, path, target=Target(5, "Rare"), threads=1, on_progress=watch, stop=stop)
        resumed = raymaps.simulate(scene, path, resume=True)
        assert resumed.content_hash == whole_run.content_hash
        assert resumed.manifest.target == whole_run.manifest.target


def test_rays_added_by_number_end_the_record(scene, tmp_path):
    path = tmp_path / "m.raymap"
    n = raymaps.simulate(scene, path, target=Target(10, "Common")).n_rays
    more = raymaps.simulate(scene, path, rays=n + 500, resume=True)
    assert (more.n_rays, more.manifest.target) == (n + 500, None)


def test_a_target_can_follow_a_run(scene, tmp_path):
    path = tmp_path / "m.raymap"
    raymaps.simulate(scene, path, rays=3000)
    raymap = raymaps.simulate(scene, path, target=Target(10, "Rare"), resume=True)
    assert course_of(raymap).ended == "target"
    plain = raymaps.simulate(scene, tmp_path / "plain.raymap", rays=raymap.n_rays)
    assert plain.content_hash == raymap.content_hash


def test_what_the_most_rays_don_t_reach_is_told(scene, tmp_path):
    notes: list[str] = []
    raymap = raymaps.simulate(scene, tmp_path / "m.raymap", rays=9000, target=Target(0.1, "Rare"), on_note=notes.append)
    course = course_of(raymap)
    assert (raymap.n_rays, course.ended) == (9000, "rays")
    exactly = (1 - share("Rare")) / share("Rare") * 1e6
    assert exactly / 2 < course.needed_rays < 2 * exactly
    assert "was not reached" in notes[-1]
    assert "more --rays" in notes[-1]


def test_the_time_limit_ends_a_run_with_a_valid_map(scene, tmp_path):
    notes: list[str] = []
    raymap = raymaps.simulate(
        scene, tmp_path / "m.raymap", target=Target(0.05, "Rare"), time_limit_s=1e-3, on_note=notes.append, threads=1
    )
    assert 0 < raymap.n_rays < raymap.manifest.rays_asked
    assert course_of(raymap).ended == "time"
    assert "time limit" in notes[-1]
    plain = raymaps.simulate(scene, tmp_path / "plain.raymap", rays=raymap.n_rays)
    assert plain.content_hash == raymap.content_hash
    without = raymaps.simulate(
        scene, tmp_path / "w.raymap", rays=10**6, time_limit_s=1e-3, on_note=notes.append, threads=1
    )
    assert 0 < without.n_rays < 10**6
    assert "time limit" in notes[-1]


def test_where_nothing_arrives_the_map_has_the_scene_s_rays(scene, tmp_path):
    notes: list[str] = []
    where = "detector(Common) & ~detector(Common)"
    raymap = raymaps.simulate(
        scene, tmp_path / "m.raymap", rays=50_000, target=Target(1, where=where), on_note=notes.append
    )
    course = course_of(raymap)
    assert (course.ended, course.needed_rays, course.reached_percent) == ("nothing", None, None)
    assert raymap.n_rays <= 5 * PORTION
    assert "nothing arrived" in notes[-1]


def test_progress_tells_the_error(scene, tmp_path):
    seen: list[Progress] = []
    raymaps.simulate(scene, tmp_path / "m.raymap", target=Target(3, "Rare"), on_progress=seen.append)
    pilot = [at for at in seen if at.pilot_rays is not None]
    run = seen[len(pilot) :]
    assert pilot
    assert all(at.pilot_rays is None for at in run)
    assert run[-1].error <= 0.03 < run[1].error
    assert run[-1].remaining_s == 0


@pytest.mark.parametrize("percent", [0, -1, 51, math.nan, math.inf])
def test_percentages_out_of_range(percent):
    with pytest.raises(TraceError, match=r"from 0\.001 to 50 %"):
        Target(percent)


@pytest.mark.parametrize(
    ("target", "said"),
    [
        (Target(1, "Nowhere"), "Unknown detector 'Nowhere'; known: 'Common', 'Rare'"),
        (Target(1, "Rare", rect=(5, 5, 6, 6)), "outside detector 'Rare'"),
        (Target(1, "Rare", rect=(0, 0, 1)), "four numbers"),
        (Target(1, rect=(0, 0, 1, 1)), "name it"),
        (Target(1, where="hit(Nobody)"), "Nobody"),
    ],
)
def test_what_the_scene_has_not_is_told_before_anything_is_made(scene, tmp_path, target, said):
    with pytest.raises(CriterionError, match=said):
        raymaps.simulate(scene, tmp_path / "m.raymap", target=target)
    assert not (tmp_path / "m.raymap").exists()


def test_a_course_survives_the_manifest():
    course = Course(Target(1, "Rare", rect=(0, 1, 2, 3)), 100, "detector 'Rare'", 64, 3, 12.5, 900, (100,), 1.0, 0.1)
    assert Course.from_dict(course.to_dict()) == course
