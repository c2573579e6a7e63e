# SPDX-License-Identifier: LGPL-2.1-or-later
"""Short runs of each choice, of rays that are thrown away; what they cost, how they spread, where they lead."""

from __future__ import annotations

import math
import os
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from raymaps.accuracy.choices import Choice, choices, finer_facets, shared_by_need
from raymaps.accuracy.outlook import Outlook, Outlooks, Present
from raymaps.compile import CompiledScene, compile_scene
from raymaps.run import new_map, notes_at_start
from raymaps.runner import Runner
from raymaps.scene import Scene, load_scene
from raymaps.store import RayMap
from raymaps.target import Law, Quantity, Tally, Target, check_target, law_of_points, pilot_seed, quantities

__all__ = ["forecast"]

#: Rays are in so many groups of equal size, one piece of each in each round. The second round is as large as the first,
#: all others twice the one before: so each piece, each round, and all of them are even parts of a sequence.
GROUPS, FIRST_SIZE = 16, 64
#: If the first rays take longer, loops were compiled.
COMPILED_S = 5.0
#: The first round compiles, and fills caches: its time is none of its rays'.
WARM_ROUNDS = 1
#: Last rounds whose pieces are fitted, and last ones that are fitted as a whole.
PIECES, ROUNDS = 1, 3
#: Sharing rays by need is a choice where it saves so many of them.
SAVED = 0.05
#: Share of the time that pieces take at least by which rays are timed.
TIMED = 0.1
#: Rays that a piece has at most.
LARGEST_PIECE = 65_536


Float = NDArray[np.float64]


@dataclass(frozen=True)
class _Round:
    """Pieces of equal size, one a group."""

    size: int
    seconds: float
    tallies: tuple[Tally, ...]


class _Trial:
    """Rounds of one choice."""

    def __init__(
        self, choice: Choice, compiled: CompiledScene, target: Target, folder: Path, threads: int,
        stop: threading.Event, began: float,
    ):  # fmt: skip
        self.choice = choice
        path = Path(tempfile.mkdtemp(dir=folder)) / "pilot.raymap"
        manifest = new_map(path, choice.scene, compiled)
        self.runner = Runner(
            compiled, path, manifest.seed, threads=threads, store=lambda: choice.scene.settings.store, stop=stop,
            started=began,
        )  # fmt: skip
        self.threads = threads
        self.raymap = RayMap.open(path)
        self.seed = pilot_seed(manifest.seed)
        self.candidates = quantities(self.raymap, target)
        self.chosen = 0
        self.rounds: list[_Round] = []
        self.ray_s = math.nan
        self.start_s = time.perf_counter() - began

    @property
    def quantity(self) -> Quantity:
        """What is meant."""
        return self.candidates[self.chosen]

    def choose(self) -> float:
        """Choose which quantity is meant: of those that are met at all the least certain one.

        Returns the time that loading took. Machine code is loaded with the first rays; where it had to be compiled,
        which later runs need not, more rays tell.
        """
        n_rays, taken_s, errors = GROUPS * FIRST_SIZE, 0.0, list[float]()
        flux_w = self.raymap.source_flux_w
        for _ in range(2):
            began = time.perf_counter()
            (tallies,) = self.runner.apart(
                [(0, n_rays)], self.seed, lambda portion: [one.tally(portion) for one in self.candidates]
            )
            taken_s = time.perf_counter() - began
            errors = [
                tally.relative_error(flux_w, one.exact) for tally, one in zip(tallies, self.candidates, strict=True)
            ]
            if taken_s < COMPILED_S:
                break
        self.chosen = max(range(len(errors)), key=lambda i: errors[i] if errors[i] < math.inf else -1.0)
        return taken_s

    def run(self) -> None:
        """One round more."""
        size = FIRST_SIZE << max(len(self.rounds) - 1, 0)
        first = GROUPS * size if self.rounds else 0
        pieces = ((first + group * size, size) for group in range(GROUPS))
        began = time.perf_counter()
        tallies = self.runner.apart(pieces, self.seed, self.quantity.tally)
        self.rounds.append(_Round(size, time.perf_counter() - began, tuple(tallies)))

    def can_grow(self, seconds: float) -> bool:
        """Whether another round is likely to end in time."""
        if len(self.rounds) <= WARM_ROUNDS:
            return True
        spent = sum(one.seconds for one in self.rounds[WARM_ROUNDS:])
        return spent + 2 * self.rounds[-1].seconds < seconds and 2 * self.rounds[-1].size <= LARGEST_PIECE

    @property
    def is_even(self) -> bool:
        """Whether rays are points of a sequence."""
        return self.choice.scene.settings.sampling == "sobol"

    @property
    def total(self) -> Tally:
        """All rays."""
        return _sum([tally for one in self.rounds for tally in one.tallies])

    def group_flux_w(self, group: int, n_rounds: int) -> float:
        """Flux by the first rounds of a group."""
        tally = _sum([one.tallies[group] for one in self.rounds[:n_rounds]])
        return tally.flux(self.raymap.source_flux_w, self.quantity.exact)[0]

    def time_rays(self, seconds: float) -> None:
        """Find what a ray takes: trace and store a piece a thread, larger ones, then more, until they take so long.

        Portions of a run are as large, and take a time of their own beside that of their rays.
        """
        size, first, n_pieces = self.rounds[-1].size, GROUPS * (self.rounds[-1].size << 1), self.threads
        while True:
            began = time.perf_counter()
            pieces = [(first + k * size, size) for k in range(n_pieces)]
            self.runner.apart(iter(pieces), self.seed, lambda portion: None)
            taken_s = time.perf_counter() - began
            if taken_s > seconds:
                break
            if size < LARGEST_PIECE:
                size = min(4 * size, LARGEST_PIECE)
            else:
                n_pieces *= 4
        self.ray_s = taken_s / (n_pieces * size)

    def need(self) -> Float | None:
        """What sources add to the error, see `shared_by_need`; None where shares as they are do nearly as well.

        Of points of a sequence it is not known.
        """
        if self.is_even:
            return None
        total, flux_w = self.total, self.raymap.source_flux_w
        rays, light, squares = (values.sum(axis=1) for values in (total.rays, total.total, total.squares))
        rays = np.maximum(rays, 1.0)
        spread = np.maximum(squares / rays - (light / rays) ** 2, 0.0)
        need = np.asarray(flux_w * np.sqrt(np.where(self.quantity.exact, 0.0, spread)))
        if not need.sum() > 0 or len(need) < 2:
            return None
        as_it_is = float(np.sum(need**2 / rays) * rays.sum())
        return need if need.sum() ** 2 < (1 - SAVED) * as_it_is else None

    def noise(self) -> Law | None:
        """How the error falls with the number of rays."""
        flux_w, exact, total = self.raymap.source_flux_w, self.quantity.exact, self.total
        mean_w, stderr_w = total.flux(flux_w, exact)
        if not mean_w > 0:
            return None
        if not self.is_even:
            return Law(stderr_w / mean_w * math.sqrt(total.n_rays))
        # the error of pieces is known well, that of many rays tells how it goes on
        found = [(one.size, [tally.flux(flux_w, exact)[1] for tally in one.tallies]) for one in self.rounds[-PIECES:]]
        found += [
            (GROUPS * one.size, [_sum(list(one.tallies)).flux(flux_w, exact)[1]]) for one in self.rounds[-ROUNDS:]
        ]
        found.append((total.n_rays, [stderr_w]))
        rays = np.array([n for n, _ in found], np.float64)
        variance = np.array([np.mean(np.square(errors)) for _, errors in found]) / mean_w**2
        return law_of_points(rays, variance, total.n_rays)


def forecast(
    what: Scene | str | Path,
    target: Target,
    *,
    seconds: float = 8.0,
    threads: int | None = None,
    on_choice: Callable[[int, int, str], None] | None = None,
    on_note: Callable[[str], None] | None = None,
    stop: threading.Event | None = None,
) -> Outlooks:
    """Find by short runs what accuracy costs.

    Parameters
    ----------
    what : Scene, or path of a scene file or a Ray Map
    target : Target
        The flux whose error is meant; its percentage is not looked at.
    seconds : float
        About how long to trace, for all choices together.
    threads : int, optional
        As of `raymaps.run.simulate`.
    on_choice : function, optional
        Called with the number of the choice that is being tried, how many there are, and what it is.
    on_note : function, optional
        Called with a sentence where something takes long.
    stop : threading.Event, optional
        Once set, nothing further is begun.

    Raises
    ------
    SceneError, MapError, CriterionError
        If the scene can't be read or simulated, or the target names what it has not.
    Interrupted
        If ``stop`` was set.
    """
    began = time.perf_counter()
    threads, stop = threads or os.cpu_count() or 1, stop or threading.Event()
    raymap = RayMap.open(what) if not isinstance(what, Scene) and Path(what).is_dir() else None
    scene = raymap.scene if raymap is not None else what if isinstance(what, Scene) else load_scene(what)
    compiled = compile_scene(scene)
    check_target(target, compiled.names, scene.detectors)
    for text in notes_at_start(compiled):
        if on_note:
            on_note(text)
    given = list(choices(scene, compiled))
    trials: list[_Trial] = []
    loading_s = 0.0
    with tempfile.TemporaryDirectory(prefix="raymaps-accuracy-") as folder:
        for after, choice in enumerate(given, 1):
            if choice.is_faceted and choice.has_own_bias:
                given[after:after] = finer_facets(choice, compiled, Path(folder) / "finer")
                break
        for number, choice in enumerate(given, 1):
            if on_choice:
                on_choice(number, len(given), choice.words)
            started = time.perf_counter() if trials else began
            trial = _Trial(choice, compile_scene(choice.scene) if trials else compiled, target, Path(folder), threads,
                           stop, started)  # fmt: skip
            if trials:
                trial.chosen = trials[0].chosen
            else:
                loading_s = trial.choose()
            share_s = seconds / len(given)
            while trial.can_grow((1 - TIMED) * share_s):
                trial.run()
            trial.time_rays(TIMED * share_s)
            if not trials and (need := trial.need()) is not None:
                given.insert(2, shared_by_need(choice, need))
            trials.append(trial)
        found = tuple(_outlook(trial, trials, loading_s) for trial in trials)
        present = None if raymap is None else _present(raymap, quantities(raymap, target)[trials[0].chosen])
    return Outlooks(trials[0].quantity.words, threads, time.perf_counter() - began, found, present)


def _present(raymap: RayMap, quantity: Quantity) -> Present:
    tally = _sum([quantity.tally(portion) for portion in raymap.portions])
    error = tally.relative_error(raymap.source_flux_w, quantity.exact)
    return Present(raymap.n_rays, error if error < math.inf else None)


def _outlook(trial: _Trial, trials: list[_Trial], loading_s: float) -> Outlook:
    total = trial.total
    flux_w, stderr_w = total.flux(trial.raymap.source_flux_w, trial.quantity.exact)
    finest = next(one for one in trials if one.choice.is_finest)
    like = trial if trial.choice.has_own_bias else trials[0]
    bias, bias_stderr = (None, None) if like is finest else _bias(like, finest)
    return Outlook(
        trial.choice.words, trial.choice.is_scene, total.n_rays, flux_w, stderr_w, trial.noise(), bias, bias_stderr,
        max(trial.start_s, trials[0].start_s) + loading_s, trial.ray_s, trial.choice.settings, trial.choice.ray_share,
        trial.choice.finer,
    )  # fmt: skip


def _bias(trial: _Trial, finest: _Trial) -> tuple[float | None, float | None]:
    """Difference of the fluxes that the same rays tell, over the flux, and its standard error; by groups."""
    n_rounds = min(len(trial.rounds), len(finest.rounds))
    mine, true = (np.array([one.group_flux_w(group, n_rounds) for group in range(GROUPS)]) for one in (trial, finest))
    flux_w = true.mean()
    if not flux_w > 0:
        return None, None
    difference = (mine - true) / flux_w
    return float(difference.mean()), float(difference.std(ddof=1) / math.sqrt(GROUPS))


def _sum(tallies: list[Tally]) -> Tally:
    return sum(tallies[1:], tallies[0])
