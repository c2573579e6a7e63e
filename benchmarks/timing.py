# SPDX-License-Identifier: LGPL-2.1-or-later
"""Contestants take turns, so that whatever else the machine does meets them alike."""

from __future__ import annotations

import gc
import math
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

__all__ = ["Timing", "alternate", "paired", "repeat", "summary"]


@dataclass(frozen=True)
class Timing:
    """Seconds (or ratios) of several repeats."""

    values: tuple[float, ...]

    @property
    def median(self) -> float:
        return statistics.median(self.values)

    @property
    def standard_error(self) -> float:
        """Standard error of the median, as of normally distributed values; 0 for a single one."""
        n = len(self.values)
        return math.sqrt(math.pi / 2 / n) * statistics.stdev(self.values) if n > 1 else 0.0

    def over(self, other: Timing) -> Timing:
        """Ratio round by round: both were measured in the same rounds."""
        return Timing(tuple(a / b for a, b in zip(self.values, other.values, strict=True)))

    def scaled(self, factor: float) -> Timing:
        return Timing(tuple(factor * value for value in self.values))

    def rate(self, amount: float) -> Timing:
        """Amount a second."""
        return Timing(tuple(amount / value for value in self.values))

    def to_dict(self) -> dict[str, Any]:
        return {"median": self.median, "min": min(self.values), "max": max(self.values), "repeats": len(self.values)}


def alternate(
    contestants: Mapping[str, Callable[[], Any]],
    repeats: int,
    *,
    prepare: Callable[[], Any] | None = None,
    budget_s: float = 20.0,
) -> tuple[dict[str, Timing], dict[str, Any]]:
    """Time each contestant once a round, the first place rotating; returns timings and their last results.

    ``prepare`` runs before each contestant outside of the time that is taken; the first round warms up and does not
    count. Past ``budget_s`` no further round is begun once one has counted.
    """
    seconds: dict[str, list[float]] = {name: [] for name in contestants}
    results: dict[str, Any] = {}
    names = list(contestants)
    started_all = time.perf_counter()
    for turn in range(-1, repeats):
        if turn >= 1 and time.perf_counter() - started_all > budget_s:
            break
        gc.collect()
        at = max(turn, 0) % len(names)
        for name in names[at:] + names[:at]:
            if prepare is not None:
                prepare()
            results.pop(name, None)
            gc.disable()  # a collection of everybody's garbage would meet whoever comes last
            started = time.perf_counter()
            result = contestants[name]()
            took = time.perf_counter() - started
            gc.enable()
            results[name] = result
            if turn >= 0:
                seconds[name].append(took)
    return {name: Timing(tuple(values)) for name, values in seconds.items()}, results


def paired(
    base: Callable[[], Any], contestants: Mapping[str, Callable[[], Any]], rounds: int, *, budget_s: float
) -> dict[str, Timing]:
    """CPU time of each contestant on this thread over that of ``base``, for differences of a percent.

    A round takes each contestant twice between two of the base, so that a machine that slowly gets faster or slower
    meets both alike. Past ``budget_s`` no further round is begun.
    """
    for work in (base, *contestants.values()):
        work()
    ratios: dict[str, list[float]] = {name: [] for name in contestants}
    started = time.perf_counter()
    for turn in range(rounds):
        if turn and time.perf_counter() - started > budget_s:
            break
        gc.collect()
        gc.disable()
        for name, work in contestants.items():
            before, first, second, after = (_cpu_seconds(w) for w in (base, work, work, base))
            ratios[name].append((first + second) / (before + after))
        gc.enable()
    return {name: Timing(tuple(values)) for name, values in ratios.items()}


def _cpu_seconds(work: Callable[[], Any]) -> float:
    started = time.thread_time()
    work()
    return time.thread_time() - started


def repeat(work: Callable[[], Any], repeats: int) -> tuple[Timing, Any]:
    """Time one piece of work on its own, after one that does not count; see `alternate`."""
    timings, results = alternate({"work": work}, repeats, budget_s=5.0)
    return timings["work"], results["work"]


def summary(timing: Timing, factor: float = 1.0, digits: int = 3) -> str:
    """``median (min - max)`` for people."""
    low, high = min(timing.values) * factor, max(timing.values) * factor
    return f"{number(timing.median * factor, digits)} ({number(low, digits)} to {number(high, digits)})"


def number(value: float, digits: int = 3) -> str:
    """A number with so many significant digits, never in powers of ten."""
    if value == 0 or abs(value) >= 10 ** (digits - 1):
        return f"{value:,.0f}".replace(",", " ")
    return f"{value:#.{digits}g}".rstrip(".")
