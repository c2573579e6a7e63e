# SPDX-License-Identifier: LGPL-2.1-or-later
"""A run to a target: pilot, plan, the rays that it asks for, and what they tell; see `raymaps.target.rule`."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from raymaps.store import Portion, RayMap
from raymaps.target.course import Course
from raymaps.target.quantities import Quantity, quantities
from raymaps.target.rule import (
    FIRST_PILOT,
    GROUPS,
    MAX_EXTENSIONS,
    Tally,
    pilot_hits,
    pilot_seed,
    rays_for_error,
    rays_needed,
    whole,
)

if TYPE_CHECKING:
    from raymaps.runner import Runner

__all__ = ["reach"]

#: Share of the most rays, and of the time limit, that the pilot may take.
PILOT_RAYS, PILOT_TIME = 0.1, 0.2
#: Rays that the pilot traces in one piece, at most.
LARGEST_PIECE = 65_536


def reach(runner: Runner, course: Course, usual_rays: int, portion_rays: Callable[[int], int]) -> RayMap:
    """Trace a map until its target is reached, or the most rays, or the time limit.

    Parameters
    ----------
    runner : Runner
    course : Course
        As it stands: of a run that goes on the pilot is over.
    usual_rays : int
        The scene's number of rays: how many are traced where the pilot met nothing, and how many the pilot spends on a
        detector that nothing meets while others wait.
    portion_rays : function of the number of rays to the size of the map's portions
    """
    raymap = RayMap.open(runner.path)
    candidates = quantities(raymap, course.target)
    if not course.stages:
        course, n_portion = _planned(runner, raymap, course, candidates, usual_rays, portion_rays)
        _keep(raymap, course, n_portion)
        runner.note(course.plan())
    else:
        n_portion = raymap.manifest.portion_rays
    quantity = next(one for one in candidates if one.words == course.quantity)
    watch = _Sum(raymap, quantity)
    while True:
        raymap = runner.to(course.stages[-1], watch)
        course = _judged(course, watch.in_all(), raymap, quantity)
        if course.ended or len(course.stages) > MAX_EXTENSIONS:
            break
        if raymap.n_rays < course.stages[-1] and runner.is_late:
            course = replace(course, ended="time")
            break
        more = whole(float(course.needed_rays or 0), n_portion, course.most_rays)
        course = replace(course, stages=(*course.stages, more))
        _keep(raymap, course, n_portion)
        runner.note(f"The error is {course.reached_percent:.3g} % after {raymap.n_rays} rays: going on to {more}.")
    _keep(raymap, course, n_portion)
    if course.ended != "target":
        runner.note(course.verdict(raymap.n_rays, runner.seconds_per_ray))
    return RayMap.open(runner.path)


def _keep(raymap: RayMap, course: Course, portion_rays: int) -> None:
    """Note in the map's manifest how it stands."""
    asked = max(course.stages[-1], RayMap.open(raymap.path).n_rays)
    replace(raymap.manifest, target=course.to_dict(), rays_asked=asked, portion_rays=portion_rays).write(raymap.path)


def _planned(
    runner: Runner,
    raymap: RayMap,
    course: Course,
    candidates: tuple[Quantity, ...],
    usual_rays: int,
    portion_rays: Callable[[int], int],
) -> tuple[Course, int]:
    """Which quantity is meant and how many rays it needs, by a pilot; and the size of portions."""
    error, flux_w = course.target.error, raymap.source_flux_w
    groups = _pilot(runner, raymap, course, candidates, usual_rays)
    sums = [sum(of_one[1:], of_one[0]) for of_one in groups]
    errors = [tally.relative_error(flux_w, one.exact) for tally, one in zip(sums, candidates, strict=True)]
    hit = [i for i, found in enumerate(errors) if found < math.inf]
    chosen = max(hit, key=lambda i: errors[i], default=0)
    silent = [one.words for one, found in zip(candidates, errors, strict=True) if found == math.inf]
    if hit and silent:
        runner.note(f"Nothing arrived at {', '.join(silent)} in a pilot of {sums[0].n_rays} rays: passed over.")
    needed = rays_needed(groups[chosen], error, flux_w, candidates[chosen].exact)
    wanted = needed if hit else usual_rays
    size = portion_rays(math.ceil(min(wanted, course.most_rays)))
    course = replace(
        course,
        quantity=candidates[chosen].words,
        pilot_rays=sums[chosen].n_rays,
        pilot_hits=sums[chosen].hits,
        pilot_error_percent=100 * errors[chosen] if hit else None,
        needed_rays=math.ceil(needed) if hit else None,
        stages=(whole(wanted, size, course.most_rays),),
    )
    return course, size


def _pilot(
    runner: Runner, raymap: RayMap, course: Course, candidates: tuple[Quantity, ...], usual_rays: int
) -> list[list[Tally]]:
    """Tallies of each candidate in groups of equal size, of rays that are not the map's.

    The pilot doubles until each candidate was hit often enough, or not at all, however long one waits.
    """
    most = max(GROUPS, min(course.most_rays, max(FIRST_PILOT, int(course.most_rays * PILOT_RAYS))))
    patience = most if len(candidates) == 1 else min(most, usual_rays)
    shape = raymap.rays_of_replicate.shape
    wanted, seed = pilot_hits(course.target.error, shape[1] > 1), pilot_seed(raymap.manifest.seed)
    groups = [[Tally.none(shape) for _ in range(GROUPS)] for _ in candidates]
    began_s, done, size = runner.elapsed_s, 0, min(FIRST_PILOT, most) // GROUPS

    def see(portion: Portion) -> list[Tally]:
        return [one.tally(portion) for one in candidates]

    while size > 0:
        pieces = [(group, *piece) for group in range(GROUPS) for piece in _pieces(done + group * size, size)]
        found = runner.apart(((first, n) for _, first, n in pieces), seed, see)
        for (group, _, _), tallies in zip(pieces, found, strict=True):
            for of_one, seen in zip(groups, tallies, strict=True):
                of_one[group] = of_one[group] + seen
        done += size * GROUPS
        hits = [sum(tally.hits for tally in of_one) for of_one in groups]
        worst = max(range(len(candidates)), key=lambda i: (hits[i] > 0, -hits[i]))
        tally = sum(groups[worst][1:], groups[worst][0])
        error = tally.relative_error(raymap.source_flux_w, candidates[worst].exact)
        runner.tell_pilot(done, hits[worst], error if error < math.inf else None, course.most_rays)
        if all(n >= wanted or (n == 0 and done >= patience) for n in hits):
            break
        if runner.time_limit_s is not None and 2 * (runner.elapsed_s - began_s) > PILOT_TIME * runner.time_limit_s:
            break
        size = min(done, most - done) // GROUPS
    return groups


def _pieces(first_ray: int, n_rays: int) -> Iterator[tuple[int, int]]:
    for at in range(0, n_rays, LARGEST_PIECE):
        yield first_ray + at, min(LARGEST_PIECE, n_rays - at)


def _judged(course: Course, tally: Tally, raymap: RayMap, quantity: Quantity) -> Course:
    """What the map tells, whether it is enough, and if not how many rays would be."""
    flux_w, stderr_w = tally.flux(raymap.source_flux_w, quantity.exact)
    found = tally.relative_error(raymap.source_flux_w, quantity.exact)
    error = course.target.error
    if found == math.inf:
        return replace(course, flux_w=flux_w, flux_stderr_w=stderr_w, ended="nothing")
    needed = course.needed_rays if found <= error else math.ceil(rays_for_error(tally, found, error))
    ended = "target" if found <= error else "nothing" if course.needed_rays is None else ""
    if not ended and raymap.n_rays >= course.most_rays:
        ended = "rays"
    return replace(
        course, flux_w=flux_w, flux_stderr_w=stderr_w, reached_percent=100 * found, needed_rays=needed, ended=ended
    )


class _Sum:
    """Adds up what the portions of a map tell of a quantity, as they come; see `raymaps.runner.Watch`."""

    def __init__(self, raymap: RayMap, quantity: Quantity):
        self._quantity, self._flux_w = quantity, raymap.source_flux_w
        self._tallies: dict[int, Tally] = {}
        self._lock = threading.Lock()
        self._none = self._so_far = Tally.none(raymap.rays_of_replicate.shape)
        for portion in raymap.portions:
            self.see(portion)
            portion.forget()

    def see(self, portion: Portion) -> None:
        """Add a portion."""
        tally = self._quantity.tally(portion)
        with self._lock:
            self._tallies[portion.first_ray] = tally
            self._so_far = self._so_far + tally

    def error(self) -> float | None:
        """Relative error so far; None where nothing has arrived."""
        error = self._so_far.relative_error(self._flux_w, self._quantity.exact)
        return error if error < math.inf else None

    def in_all(self) -> Tally:
        """The sum in the order of the rays, so that it is the same whatever the threads."""
        return sum((self._tallies[first] for first in sorted(self._tallies)), self._none)
