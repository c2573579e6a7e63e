# SPDX-License-Identifier: LGPL-2.1-or-later
"""Measure everything, one after the other: ``python -m benchmarks [--quick] [--rays N] [-o FILE.md]``."""

from __future__ import annotations

import argparse
import functools
import json
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.machine import describe_machine, processors

if TYPE_CHECKING:
    from benchmarks.targets import Measured

HERE = Path(__file__).parent


def main() -> None:
    arguments = _arguments()
    threads = processors()
    os.environ["POLARS_MAX_THREADS"] = str(threads)  # read when Polars is imported, which is below
    from benchmarks.tables import plain, sections

    started = time.monotonic()
    machine = describe_machine()
    scratch = HERE.parent / "out"
    scratch.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="bench-", dir=scratch) as folder:
        measured = _measure(Path(folder), arguments, threads)
    machine["took"] = f"{time.monotonic() - started:.0f} s"
    machine["rays"] = f"{arguments.rays} in the maps that are asked, {arguments.rays // 4} where speed is measured"
    tables = "\n\n".join(section.to_markdown() for section in sections(measured))
    print(f"\n{tables}\n")
    output = arguments.output or (None if arguments.quick else HERE / "RESULTS.md")
    if output is None:
        print("Tried quickly, so nothing was written; -o FILE.md writes all the same.")
        return
    head = "# Measured\n\nWritten by `make bench`." + (
        " A quick try: too few rays and repeats for figures to trust.\n\n" if arguments.quick else "\n\n"
    )
    facts = "\n".join(f"- {name}: {text}" for name, text in machine.items())
    output.write_text(f"{head}{facts}\n\n{tables}\n", encoding="utf-8")
    data = output.with_name(f"{output.stem.lower()}.json")
    data.write_text(json.dumps({"machine": machine, **plain(measured)}, indent=1) + "\n", encoding="utf-8")
    print(f"{output}\n{data}")
    if arguments.output is None:
        from docs.drawing.accuracy import draw

        draw(data)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--rays", type=int, metavar="N", help="rays of the maps; speed is measured with N/4")
    parser.add_argument("--quick", action="store_true", help="for trying; writes nothing without -o")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.md", help="in place of benchmarks/RESULTS.md")
    arguments = parser.parse_args()
    arguments.rays = arguments.rays or (40_000 if arguments.quick else 1_000_000)
    if arguments.rays < 1000:
        parser.error(f"--rays must be 1000 or more, got {arguments.rays}")
    return arguments


def _measure(folder: Path, arguments: argparse.Namespace, threads: int) -> Measured:
    from benchmarks.accuracy import measure_accuracy
    from benchmarks.asking import measure_answers, measure_opening
    from benchmarks.effects import measure_effect_costs, measure_unused_effects
    from benchmarks.exact import measure_exact
    from benchmarks.files import measure_size, size_of
    from benchmarks.questions import QUESTIONS
    from benchmarks.results import measure_results
    from benchmarks.scenes import bench_scenes, in_wavelengths, without_detectors
    from benchmarks.simulating import measure_speed
    from benchmarks.targets import Measured
    from raymaps.run import simulate

    repeats, n_timed = 1 if arguments.quick else 5, arguments.rays // 4
    tell = functools.partial(_tell, time.monotonic())
    speeds, sizes, openings, answers, results = [], [], [], [], []
    for name, scene in bench_scenes(folder / "scenes").items():
        tell(f"{name}: simulating")
        speeds += measure_speed(scene, n_timed, tuple(sorted({1, threads})), repeats, folder)
        bare = without_detectors(scene)
        sizes.append(measure_size(in_wavelengths(scene), n_timed, folder / f"{name}-spectral"))
        if name not in QUESTIONS:
            sizes += [measure_size(s, n_timed, folder / f"{name}-{len(s.detectors)}") for s in (scene, bare)]
            continue
        raymap = simulate(scene, folder / f"{name}.raymap", rays=arguments.rays)
        sizes += [size_of(raymap), measure_size(bare, n_timed, folder / f"{name}-bare")]
        tell(f"{name}: asking")
        openings.append(measure_opening(raymap, repeats))
        answers += measure_answers(raymap, threads, 2 * repeats - 1)
        tell(f"{name}: results")
        results += measure_results(raymap, repeats, folder)
    tell("effects that are not used")
    unused = measure_unused_effects(folder / "unused", min(arguments.rays // 20, 20_000), 6 * repeats)
    tell("what effects cost")
    effects = measure_effect_costs(folder / "effects", min(arguments.rays // 20, 50_000), repeats)
    tell("exact surfaces")
    focus_errors, exact_costs = measure_exact(
        folder / "exact", min(arguments.rays // 20, 50_000), repeats, 1 if arguments.quick else 12
    )
    tell("error against time")
    work_precision = measure_accuracy(folder / "accuracy", quick=arguments.quick)
    return Measured(
        tuple(speeds), tuple(sizes), tuple(openings), tuple(answers), tuple(results), tuple(unused), tuple(effects),
        tuple(focus_errors), tuple(exact_costs), work_precision,
    )  # fmt: skip


def _tell(started: float, what: str) -> None:
    print(f"{time.monotonic() - started:5.0f} s  {what}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
