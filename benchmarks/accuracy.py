# SPDX-License-Identifier: LGPL-2.1-or-later
"""Work and precision: what an error costs in time, by sampling, surfaces and bands; how well that is foretold.

Errors are against known answers, over runs with seeds of their own; times are those of tracing on one thread.
"""

from __future__ import annotations

import itertools
import json
import math
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from benchmarks.answers import PIECES, ROUGH, SMOOTH, Answer, Choice, Runs, answers
from benchmarks.scenes import bench_scenes, in_wavelengths
from benchmarks.timing import Timing, alternate
from raymaps.accuracy import forecast
from raymaps.compile import CompiledScene, compile_scene
from raymaps.run import new_map
from raymaps.scene import Scene
from raymaps.store import MapWriter, RayMap
from raymaps.store.columns import pack_columns, read_columns
from raymaps.trace import Tracer
from raymaps.traced import FaceIndex
from tests.accuracy.forecast_scenes import SCENES, real_run

__all__ = ["SAMPLING", "Foretold", "Gain", "Precision", "StoreCost", "WorkPrecision", "measure_accuracy"]

Float = NDArray[np.float64]

SAMPLING = ("random", "sobol")
#: Numbers of rays, all of which Sobol' points fill evenly.
RAYS = tuple(256 * 4**k for k in range(7))
FEWEST_SEEDS, MOST_SEEDS = 6, 64
#: No run is begun whose seeds would take more than so many budgets.
MOST_BUDGETS = 6
#: Runs of fewer rays do not tell how long a ray takes.
FEWEST_TIMED = 4096
#: Error whose time is told, and rays of a run where the sampling makes little difference.
ERROR, ROUGH_RAYS = 1e-3, 4096
#: Scenes whose rays are stored in each way.
STORED = ("ball_in_box", "led_collimator")
#: Exponents that errors of a sequence may have.
EXPONENTS = (0.5, 1.5)


@dataclass(frozen=True)
class Precision:
    """Error and time of runs with so many rays."""

    scene: str
    choice: str
    sampling: str
    rays: int
    seeds: int
    error: float  # root mean square over seeds, relative to the known flux
    error_stderr: float
    run_s: float  # median


@dataclass(frozen=True)
class Gain:
    """Time with Sobol' points over that with independent rays, to the same error."""

    scene: str
    is_smooth: bool
    random_s: float  # to `ERROR`
    sobol_s: float
    ratio: float
    ratio_stderr: float


@dataclass(frozen=True)
class Foretold:
    """Rays and time of tracing that a pilot foretold for an error, and what they were."""

    scene: str
    choice: str
    error: float
    foretold_rays: float
    rays: float
    foretold_s: float
    tracing_s: float


@dataclass(frozen=True)
class StoreCost:
    """What it takes to keep the same rays in one way; files raw and compressed hold the same columns."""

    scene: str
    light: str  # simulated, and stored
    bands: int
    rays: int
    segments: int
    trace: Timing
    store: Timing  # trace, and store as maps are stored
    raw_write: Timing
    raw_bytes: int
    write: Timing
    bytes: int


@dataclass(frozen=True)
class WorkPrecision:
    """All of it."""

    precisions: tuple[Precision, ...]
    gains: tuple[Gain, ...]
    foretold: tuple[Foretold, ...]
    stores: tuple[StoreCost, ...]


def measure_accuracy(folder: Path, *, quick: bool = False) -> WorkPrecision:
    """Error against time of all scenes and choices; gains of Sobol' points; forecasts; ways to store."""
    known = answers(folder / "answers")
    precisions = [
        precision
        for answer in known.values()
        for choice, sampling in itertools.product(answer.choices, SAMPLING)
        for precision in _precisions(answer, choice, sampling, 0.1 if quick else 0.35)
    ]
    gains = [_smooth_gain(known[name], precisions) for name in SMOOTH]
    gains += [_rough_gain(known[name], 2.0 if quick else 16.0) for name in ROUGH]
    foretold = [
        one
        for name in SCENES
        for one in _foretold(name, folder / "foretold", 0.2 if quick else 1.0, 2.0 if quick else 6.0)
    ]
    stores = measure_stores(folder / "stores", 5_000 if quick else 50_000, 1 if quick else 5)
    return WorkPrecision(tuple(precisions), tuple(gains), tuple(foretold), stores)


# ----------------------------------------------------------------------------------------------------------------------
# Error against time


def _precisions(answer: Answer, choice: Choice, sampling: str, budget_s: float) -> list[Precision]:
    """Runs of more and more rays, until so few seeds as are needed take too long."""
    runs, found = Runs(answer, choice, sampling), []
    runs.trace(RAYS[0], 0)  # compiles, and fills caches
    run_s = 0.0
    for rays in RAYS:
        if 4 * run_s * FEWEST_SEEDS > MOST_BUDGETS * budget_s:  # a run is about to be four times as long
            break
        errors, seconds = [], []
        for seed in range(1, MOST_SEEDS + 1):
            started = time.perf_counter()
            portions = runs.trace(rays, seed)
            seconds.append(time.perf_counter() - started)
            errors.append(runs.errors(portions))
            if seed >= FEWEST_SEEDS and sum(seconds) > budget_s:
                break
        run_s = float(np.median(seconds))
        rms, stderr = _root_mean_square(np.array(errors))
        found.append(Precision(answer.name, choice.words, sampling, rays, len(errors), rms, stderr, run_s))
    return found


def _root_mean_square(errors: Float) -> tuple[float, float]:
    """Of runs, with its standard error, by the errors of their independent pieces, (seeds, PIECES).

    Pieces tell the variance of a run much better than runs do, all runs together whether they are off on the average:
    error² = (1 - 1 / seeds) variance + mean², as of the mean that much of the square is chance already.
    """
    seeds, variance, mean = len(errors), errors.var(ddof=1) / PIECES, errors.mean()
    square = (1 - 1 / seeds) * variance + mean**2
    of_mean = variance / seeds
    uncertain = (1 - 1 / seeds) ** 2 * variance**2 * 2 / (errors.size - 1) + 2 * of_mean**2 + 4 * mean**2 * of_mean
    return math.sqrt(square), math.sqrt(uncertain / square) / 2


# ----------------------------------------------------------------------------------------------------------------------
# What Sobol' points gain


def _smooth_gain(answer: Answer, precisions: list[Precision]) -> Gain:
    """Times to `ERROR` by laws through the errors of the finest choice."""
    choice = "exact" if answer.choices[0].words == "exact" else answer.choices[-1].words
    times = {}
    for sampling in SAMPLING:
        points = [p for p in precisions if (p.scene, p.choice, p.sampling) == (answer.name, choice, sampling)]
        log_rays, uncertainty = _log_rays_to(ERROR, points, sampling)
        ray_s = float(np.median([p.run_s / p.rays for p in points if p.rays >= FEWEST_TIMED]))
        times[sampling] = (math.exp(log_rays) * ray_s, uncertainty)
    (random_s, a), (sobol_s, b) = times["random"], times["sobol"]
    ratio = sobol_s / random_s
    return Gain(answer.name, True, random_s, sobol_s, ratio, ratio * math.hypot(a, b))


def _log_rays_to(error: float, points: list[Precision], sampling: str) -> tuple[float, float]:
    """Logarithm of the rays that have an error, by a weighted fit of a power of n, and its standard error."""
    x = np.log([p.rays for p in points])
    y = np.log([p.error for p in points])
    weight = np.array([(p.error / p.error_stderr) ** 2 for p in points])
    at = np.average(x, weights=weight)
    level = np.average(y, weights=weight)
    exponent, slope_variance = EXPONENTS[0], 0.0
    if sampling == "sobol":
        spread = (weight * (x - at) ** 2).sum()
        exponent = float(np.clip(-(weight * (x - at) * (y - level)).sum() / spread, *EXPONENTS))
        slope_variance = 1 / spread
    log_rays = at + (level - math.log(error)) / exponent
    variance = 1 / weight.sum() + slope_variance * (log_rays - at) ** 2
    return float(log_rays), math.sqrt(variance) / exponent


def _rough_gain(answer: Answer, budget_s: float) -> Gain:
    """Variances of runs that take turns, by the spread of rays, and of the independent pieces of a sequence."""
    runs = {sampling: Runs(answer, answer.choices[0], sampling) for sampling in SAMPLING}
    for one in runs.values():
        one.trace(ROUGH_RAYS, 0)
    seconds: dict[str, list[float]] = {sampling: [] for sampling in SAMPLING}
    light, pieces = [], []
    began = time.perf_counter()
    for seed in itertools.count(1):
        if seed > 4 and time.perf_counter() - began > budget_s:
            break
        for sampling in SAMPLING if seed % 2 else SAMPLING[::-1]:
            started = time.perf_counter()
            portions = runs[sampling].trace(ROUGH_RAYS, seed)
            seconds[sampling].append(time.perf_counter() - started)
            if sampling == "random":
                light.append(runs[sampling].light(portions) - 1)
            else:
                pieces.append(runs[sampling].errors(portions))
    # the same number of rays: variance of a run
    of_rays, of_pieces = np.concatenate(light) ** 2 / ROUGH_RAYS, np.concatenate(pieces) ** 2 / PIECES
    random, sobol = of_rays.mean(), of_pieces.mean()
    slower = Timing(tuple(seconds["sobol"])).over(Timing(tuple(seconds["random"])))
    parts = [of_rays.std() / math.sqrt(len(of_rays)) / random, of_pieces.std() / math.sqrt(len(of_pieces)) / sobol]
    parts.append(slower.standard_error / slower.median)
    ratio = float(sobol / random * slower.median)
    random_s = float(np.median(seconds["random"]) * random / ERROR**2)
    return Gain(answer.name, False, random_s, random_s * ratio, ratio, ratio * math.hypot(*parts))


# ----------------------------------------------------------------------------------------------------------------------
# Forecasts


def _foretold(name: str, folder: Path, run_s: float, pilot_s: float) -> list[Foretold]:
    """Of independent rays and of Sobol' points, for runs of about so long."""
    own = folder / name.replace(" ", "-")
    own.mkdir(parents=True)
    scene, target = SCENES[name](own)
    found = []
    for one in forecast(scene, target, seconds=pilot_s).of[:2]:
        rays = max(1024, 1 << int(run_s / one.ray_s).bit_length() - 1)
        assert one.noise is not None
        real = real_run(scene, target, one, rays, own)
        found.append(
            Foretold(name, one.words, one.noise.error(rays), rays, real.rays, rays * one.ray_s, real.tracing_s)
        )
    return found


# ----------------------------------------------------------------------------------------------------------------------
# What it takes to keep rays


def measure_stores(folder: Path, rays: int, repeats: int) -> tuple[StoreCost, ...]:
    """RGB or spectral light, stored as colours or as spectra, raw or compressed: time and bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    found = []
    for name in STORED:
        scene = in_wavelengths(bench_scenes(folder / "scenes")[name])
        own = scene.settings
        ways = {
            "RGB": own.model_copy(update={"without": (*own.without, "spectral"), "store": "rgb"}),
            "spectral, stored as RGB": own.model_copy(update={"store": "rgb"}),
            "spectral": own,
        }
        for words, settings in ways.items():
            found.append(_store_cost(words, scene.model_copy(update={"settings": settings}), rays, repeats, folder))
    return tuple(found)


def _store_cost(words: str, scene: Scene, rays: int, repeats: int, folder: Path) -> StoreCost:
    compiled = compile_scene(scene)
    tracer, path = Tracer(compiled, 1), folder / "kept.raymap"

    def trace_and_store() -> RayMap:
        writer = _writer(path, scene, compiled)
        writer.write(tracer.trace_portion(0, rays), scene.settings.store)
        return RayMap.open(path)

    timings, results = alternate(
        {"trace": lambda: tracer.trace_portion(0, rays).first_ray, "store": trace_and_store},
        repeats, prepare=lambda: shutil.rmtree(path, ignore_errors=True), budget_s=8.0,
    )  # fmt: skip
    if not path.exists():  # the other one came last
        trace_and_store()
    raymap = results["store"]
    (portion,) = raymap.portions
    tables = {file.stem: read_columns(file) for file in sorted(portion.folder.glob("*.parquet"))}
    writes, n_bytes = alternate(
        {"raw": partial(_write, tables, folder, raw=True), "compressed": partial(_write, tables, folder, raw=False)},
        repeats, budget_s=4.0,
    )  # fmt: skip
    segments, n_bands = raymap.n_events - raymap.n_rays, raymap.bands.n
    return StoreCost(
        scene.name, words, n_bands, rays, segments, timings["trace"], timings["store"], writes["raw"], n_bytes["raw"],
        writes["compressed"], n_bytes["compressed"],
    )  # fmt: skip


def _writer(path: Path, scene: Scene, compiled: CompiledScene) -> MapWriter:
    new_map(path, scene, compiled, rays=1, seed=1)
    tables = compiled.tables
    return MapWriter(path, FaceIndex(tables.triangle_face, tables.face_body, tables.face_surface))


def _write(tables: dict[str, dict[str, NDArray]], folder: Path, *, raw: bool) -> int:
    """Columns to files, as numbers of full width or as maps are written; the bytes."""
    written = 0
    for name, columns in tables.items():
        file = folder / f"{name}.written"
        if raw:
            pq.write_table(pa.table(columns), file, compression="none", use_dictionary=False)
        else:
            file.write_bytes(pack_columns(name, columns))
        written += file.stat().st_size
    return written


def main() -> None:
    """Only this: ``python -m benchmarks.accuracy [--quick] FILE.json``."""
    from benchmarks.tables import plain, work_sections

    *options, file = sys.argv[1:]
    started = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        measured = measure_accuracy(Path(folder), quick="--quick" in options)
    print("\n\n".join(section.to_markdown() for section in work_sections(measured)))
    Path(file).write_text(json.dumps({"work_precision": plain(measured)}, indent=1) + "\n", encoding="utf-8")
    print(f"\n{file}, after {time.monotonic() - started:.0f} s")


if __name__ == "__main__":
    main()
