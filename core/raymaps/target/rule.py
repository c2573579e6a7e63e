# SPDX-License-Identifier: LGPL-2.1-or-later
"""How many rays a target needs: a rule fixed in advance, so that stopping on the data biases no figure.

A run that stops once its error bar looks small stops more readily where luck made the estimate large (rare events) or
the spread small (rare bright rays). To first order, with r the relative error asked for, gamma the skewness of a ray's
light and N the number of rays, it is off by

    bias = (2 r - gamma / sqrt(N)) standard errors:  r of them for a rare event, of which gamma / sqrt(N) = r.

So the rays that decide how many are needed are not those that are counted. A *pilot* of other rays (the same scene,
another seed; they are thrown away) gives a relative error; the rays needed follow from it, as errors fall with
1 / sqrt(N), with a margin for what the pilot does not know. Then exactly so many are traced, rounded up to whole
portions: as if ``--rays`` had named that number, and the mean is unbiased. Only if the error at the end is above the
target after all is the run extended, by prediction, at most twice. The margin makes that rare (a twentieth of the runs
by its construction), and the bias is then

    bias = P(extended) (2 r - gamma / sqrt(N)) standard errors.

Points of a sequence (`raymaps.ray_numbers`) have errors that fall faster, as the pilot tells, and are most even in
powers of two: so many rays are traced. Their error is told by few replicates, and is above the target more often; a run
that is extended has twice as many rays at least. As such a run is short, so is its pilot: r^(-1) hits.

How long the pilot is: with h rays that hit, the number needed is uncertain by 1 / sqrt(h) of itself, which the margin
pays for, and the pilot costs h r² of it. The sum is least near h = r^(-4/3).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import effective_squares, estimate_flux
from raymaps.target.law import law_of_points

__all__ = ["GROUPS", "MAX_EXTENSIONS", "Tally", "pilot_hits", "pilot_seed", "rays_for_error", "rays_needed", "whole"]

Float = NDArray[np.float64]

#: The pilot's rays are in so many groups of equal size: leaving out each in turn tells how uncertain it is.
GROUPS = 16
#: Rays of the pilot's first round; each further round doubles it.
FIRST_PILOT = 64 * GROUPS
#: Hits that the pilot has at least, where so many can be had.
FEWEST_HITS = 32
#: Standard normal quantile: the margin suffices in 95 of 100 runs.
QUANTILE = 1.645
#: How often a run may be extended, and by how much more than predicted.
MAX_EXTENSIONS, EXTENSION_MARGIN = 2, 1.05
#: How the error of points is taken to fall where a run is extended.
EXPONENT = 0.75


@dataclass(frozen=True)
class Tally:
    """Sums over rays of the light that counts: ``X`` is that of a ray relative to its emission.

    Attributes
    ----------
    rays : (n_sources, R) float64
        Rays traced, whether or not they count, by source and replicate (`raymaps.criterion.replicates`).
    total, squares : (n_sources, R) float64
        Sums of ``X`` and ``X²``.
    hits : int
        Rays that count.
    """

    rays: Float
    total: Float
    squares: Float
    hits: int

    @staticmethod
    def none(shape: tuple[int, ...]) -> Tally:
        """No rays yet, of so many sources and replicates."""
        return Tally(np.zeros(shape), np.zeros(shape), np.zeros(shape), 0)

    def __add__(self, other: Tally) -> Tally:
        return Tally(
            self.rays + other.rays, self.total + other.total, self.squares + other.squares, self.hits + other.hits
        )

    @property
    def n_rays(self) -> int:
        """Rays traced."""
        return int(self.rays.sum())

    @property
    def is_even(self) -> bool:
        """Whether rays are points of a sequence, in replicates."""
        return self.rays.shape[1] > 1

    def flux(self, source_flux_w: Float, exact: NDArray[np.bool_]) -> tuple[float, float]:
        """Flux and its standard error, W; ``exact`` as in `estimate_flux`."""
        squares = effective_squares(self.rays, self.total, self.squares.sum(axis=1))
        flux_w, stderr_w = estimate_flux(source_flux_w, self.rays.sum(axis=1), self.total.sum(axis=1), squares, exact)
        return float(flux_w), float(stderr_w)

    def relative_error(self, source_flux_w: Float, exact: NDArray[np.bool_]) -> float:
        """Standard error over flux; infinite where nothing arrived."""
        flux_w, stderr_w = self.flux(source_flux_w, exact)
        return stderr_w / flux_w if flux_w > 0 else math.inf


def pilot_hits(error: float, is_even: bool = False) -> int:
    """Hits that the pilot should have for a target, see above; ``is_even``: of points of a sequence."""
    return max(FEWEST_HITS, math.ceil(error ** (-1 if is_even else -4 / 3)))


def pilot_seed(seed: int) -> int:
    """Seed of the pilot: another one than the run's, that follows from it (a step of SplitMix64)."""
    word = (seed + 0x9E3779B97F4A7C15) % 2**64
    word = (word ^ (word >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
    word = (word ^ (word >> 27)) * 0x94D049BB133111EB % 2**64
    return word ^ (word >> 31)


def rays_needed(groups: Sequence[Tally], error: float, source_flux_w: Float, exact: NDArray[np.bool_]) -> float:
    """Rays that bring the relative error down to ``error`` in 95 of 100 runs, by a pilot in groups of equal size.

    The prediction is ``m (r / error)²`` with r the relative error of the pilot's m rays. Its logarithm is uncertain by
    ``s``, told by the jackknife over the groups; the error that the run will find is by ``s sqrt(m / N)``. Of points of
    a sequence their law tells, by the groups and all of them. Infinite where nothing arrived.
    """
    whole_pilot = sum(groups[1:], groups[0])
    m, r = whole_pilot.n_rays, whole_pilot.relative_error(source_flux_w, exact)
    if r == 0 or math.isinf(r):
        return 0.0 if r == 0 else math.inf
    if whole_pilot.is_even:
        of_groups = np.mean([min(group.relative_error(source_flux_w, exact), 1.0) ** 2 for group in groups])
        return _power_of_two(law_of_points(np.array([m / len(groups), m]), np.array([of_groups, r**2]), m).rays(error))
    n = m * (r / error) ** 2
    without = [_without(whole_pilot, group).relative_error(source_flux_w, exact) for group in groups]
    s = 1.0
    if all(0 < other < math.inf for other in without):
        logarithm = 2 * np.log(without)
        s = min(1.0, math.sqrt((len(groups) - 1) * float(np.mean((logarithm - logarithm.mean()) ** 2))))
    return n * math.exp(QUANTILE * s * math.sqrt(1 + m / n))


def _without(tally: Tally, group: Tally) -> Tally:
    return Tally(
        tally.rays - group.rays, tally.total - group.total, tally.squares - group.squares, tally.hits - group.hits
    )


def rays_for_error(tally: Tally, found: float, error: float) -> float:
    """Rays to which a run must be extended whose error is ``found``."""
    if tally.is_even:
        return _power_of_two(tally.n_rays * (found / error) ** (1 / EXPONENT))
    return tally.n_rays * (found / error) ** 2 * EXTENSION_MARGIN


def _power_of_two(n_rays: float) -> float:
    """The next one."""
    return 2.0 ** math.ceil(math.log2(max(n_rays, 1.0)))


def whole(n_rays: float, portion_rays: int, most: int) -> int:
    """A number of rays rounded up to whole portions, at least one and at most ``most``."""
    if n_rays >= most:
        return most
    return min(most, max(1, math.ceil(n_rays / portion_rays)) * portion_rays)
