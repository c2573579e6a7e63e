# SPDX-License-Identifier: LGPL-2.1-or-later
"""Time against error, as a short run foretells it: laws, and tables of them.

The noise of n rays is a power of n. Independent rays have the exponent 1/2; points of a sequence have up to 3/2, which
the pilot finds from pieces of several sizes, and trusts for some times its own rays. A choice that simulates something
else (facets in place of the surface, fewer bands) leaves a bias that no number of rays makes smaller:

    error² = (a n^-p)² + bias²,        time = start + n (time of a ray).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from raymaps.target import Law
from raymaps.units import format_duration

__all__ = ["ERRORS_PERCENT", "Outlook", "Outlooks", "Present"]

#: Errors whose times are told.
ERRORS_PERCENT = (10.0, 1.0, 0.1)
#: A bias below so many of its standard errors may be none.
SEEN = 2.0
#: A choice that saves less time than this is not worth it.
WORTH_IT = 1.05
#: No run has fewer rays.
FEWEST_RAYS = 1000


@dataclass(frozen=True)
class Outlook:
    """What the pilot tells of a choice.

    Attributes
    ----------
    words : str
    is_scene : bool
        Whether the scene is simulated so unless something else is said.
    pilot_rays : int
    flux_w, flux_stderr_w : float
        What the pilot found.
    noise : Law or None
        None where nothing arrived.
    bias, bias_stderr : float or None
        Relative to the flux of the finest choice, from the same rays; None of the finest itself.
    start_s, ray_s : float
        Time before the first ray, and of a ray, in all threads together.
    settings : dict
        What is chosen, as a scene has it: sampling, roulette threshold, surfaces, bands.
    ray_share : dict or None
        The sources' shares of the rays, where they are not as the scene says.
    finer : int
        How many triangles stand for each of the scene's.
    """

    words: str
    is_scene: bool
    pilot_rays: int
    flux_w: float
    flux_stderr_w: float
    noise: Law | None
    bias: float | None
    bias_stderr: float | None
    start_s: float
    ray_s: float
    settings: dict[str, Any]
    ray_share: dict[str, float] | None = None
    finer: int = 1

    @property
    def is_even(self) -> bool:
        """Whether rays are points of a sequence, which are most even in powers of two: only these are foretold."""
        return bool(self.settings["sampling"] == "sobol")

    @property
    def least_error(self) -> float:
        """The bias, if it is seen: what is left with any number of rays."""
        if self.bias is None or self.bias_stderr is None or abs(self.bias) < SEEN * self.bias_stderr:
            return 0.0
        return abs(self.bias)

    @property
    def most_bias(self) -> float:
        """What the bias is below, as far as the pilot knows."""
        return 0.0 if self.bias is None or self.bias_stderr is None else abs(self.bias) + SEEN * self.bias_stderr

    def rays(self, error: float) -> int | None:
        """Rays that bring noise and bias together down to a relative error; None if none do."""
        if self.noise is None or error <= self.least_error:
            return None
        rays = max(FEWEST_RAYS, math.ceil(self.noise.rays(math.sqrt(error**2 - self.least_error**2))))
        return 1 << (rays - 1).bit_length() if self.is_even else rays

    def time_s(self, error: float) -> float | None:
        """Time of a run with `rays`."""
        rays = self.rays(error)
        return None if rays is None else self.start_s + rays * self.ray_s

    def error(self, time_s: float) -> float | None:
        """Relative error of a run that takes so long; None where it has not begun to trace, or nothing arrived."""
        rays = int((time_s - self.start_s) / self.ray_s)
        if self.noise is None or rays < FEWEST_RAYS:
            return None
        rays = 1 << rays.bit_length() - 1 if self.is_even else rays
        return math.hypot(self.noise.error(rays), self.least_error)

    def to_dict(self) -> dict[str, Any]:
        """As the command line prints it; times and rays by the error in percent."""
        return {
            "choice": self.words,
            "settings": self.settings,
            "scene": self.is_scene,
            "ray_share": self.ray_share,
            "finer": self.finer,
            "pilot_rays": self.pilot_rays,
            "flux_w": self.flux_w,
            "flux_stderr_w": self.flux_stderr_w,
            "error_at_one_ray": self.noise.at_one if self.noise else None,
            "exponent": self.noise.exponent if self.noise else None,
            "exponent_to_rays": self.noise.to_rays if self.noise and self.noise.to_rays < math.inf else None,
            "bias_percent": None if self.bias is None else 100 * self.bias,
            "bias_stderr_percent": None if self.bias_stderr is None else 100 * self.bias_stderr,
            "start_s": self.start_s,
            "s_per_million_rays": 1e6 * self.ray_s,
            "rays": {f"{percent:g}": self.rays(percent / 100) for percent in ERRORS_PERCENT},
            "time_s": {f"{percent:g}": self.time_s(percent / 100) for percent in ERRORS_PERCENT},
        }


@dataclass(frozen=True)
class Present:
    """A map: its rays, and the relative error (None where nothing arrived)."""

    rays: int
    error: float | None


@dataclass(frozen=True)
class Outlooks:
    """All choices of a scene.

    Attributes
    ----------
    quantity : str
        The flux whose error is meant.
    threads : int
    pilot_s : float
        How long the pilot took.
    of : tuple of Outlook
        First the scene's own settings.
    present : Present or None
        What there is already.
    """

    quantity: str
    threads: int
    pilot_s: float
    of: tuple[Outlook, ...]
    present: Present | None = None

    def cheapest(self, error: float) -> Outlook | None:
        """The choice that reaches a relative error first, of those whose bias is known to be less.

        The scene's own where others save next to nothing.
        """
        times = [math.inf if (time := one.time_s(error)) is None or one.most_bias > error else time for one in self.of]
        least = min(times)
        if math.isinf(least):
            return None
        return self.of[0] if times[0] <= WORTH_IT * least else self.of[times.index(least)]

    def to_dict(self) -> dict[str, Any]:
        """As the command line prints it."""
        cheapest = {f"{percent:g}": self.cheapest(percent / 100) for percent in ERRORS_PERCENT}
        return {
            "quantity": self.quantity,
            "threads": self.threads,
            "pilot_s": self.pilot_s,
            "choices": [one.to_dict() for one in self.of],
            "cheapest": {percent: one.words if one else None for percent, one in cheapest.items()},
            "map": None if self.present is None else {"rays": self.present.rays, "error_percent": self._present()},
        }

    def _present(self) -> float | None:
        error = self.present.error if self.present else None
        return None if error is None else 100 * error

    def to_text(self) -> str:
        """A table: a line for each choice, a column for each error."""
        told = f"Error of {self.quantity} and how long it takes, by a pilot of {format_duration(self.pilot_s)}"
        lines = [f"{told} ({self.threads} {'thread' if self.threads == 1 else 'threads'})", ""]
        width = max(len(one.words) for one in self.of) + 2
        heads = [f"{percent:g} %" for percent in ERRORS_PERCENT]
        is_doubtful = False
        lines.append(
            f"{'':{width}}{'rays a second':>14}" + "".join(f"{head:>14}" for head in heads) + "  always off by"
        )
        for one in self.of:
            times = [_time(one, percent / 100) for percent in ERRORS_PERCENT]
            is_doubtful |= any(time.startswith("?") for time in times)
            mark = "* " if one.is_scene else "  "
            lines.append(
                f"{mark}{one.words:{width - 2}}{1 / one.ray_s:>14,.0f}"
                + "".join(f"{time:>14}" for time in times)
                + f"  {_bias(one)}"
            )
        lines += ["", *self._summary(heads)]
        lines.append("*          as the scene says; errors are standard errors over the flux, what it is off included")
        if is_doubtful:
            lines.append("?          if it is always off by less than that, which so short a pilot can't tell")
        return "\n".join(lines)

    def _summary(self, heads: list[str]) -> list[str]:
        """Lines below the table: the cheapest choice for each error, how to share rays, what a map has already."""
        best = [(head, p, self.cheapest(p / 100)) for head, p in zip(heads, ERRORS_PERCENT, strict=True)]
        cheapest = [(head, percent, one) for head, percent, one in best if one is not None]
        lines = [
            f"{'Cheapest' if i == 0 else '':<11}{head:>5}: {one.words}, {one.rays(percent / 100)} rays"
            for i, (head, percent, one) in enumerate(cheapest)
        ]
        own = self.of[0].noise
        for one in self.of:
            if one.ray_share is not None and one.noise and own and one.noise.at_one < own.at_one:
                shares = ", ".join(f"{name} {share:.2f}" for name, share in one.ray_share.items())
                lines.append(f"By need    ray_share {shares}")
        if self.present is not None:
            error = self._present()
            known = "nothing arrived" if error is None else f"{error:.2g} %"
            lines.append(f"This map   {self.present.rays} rays: {known}")
        return lines


def _time(one: Outlook, error: float) -> str:
    seconds = one.time_s(error)
    if seconds is None:
        return "never"
    return f"{'? ' if one.most_bias > error else ''}{format_duration(seconds)}"


def _bias(one: Outlook) -> str:
    if one.noise is None:
        return "nothing arrived"
    if one.bias is None or one.bias_stderr is None:
        return "-"
    if one.least_error == 0:
        return f"below {100 * one.most_bias:.2g} %"
    return f"{100 * one.bias:+.2g} ± {100 * one.bias_stderr:.1g} %"
