# SPDX-License-Identifier: LGPL-2.1-or-later
"""How a run to a target went: what was chosen, why so many rays, what was reached. Kept in the map's manifest."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from raymaps.target.aim import Target
from raymaps.units import format_duration, format_with_error

__all__ = ["Course"]


@dataclass(frozen=True)
class Course:
    """How the number of rays of a map was chosen.

    Attributes
    ----------
    target : Target
    most_rays : int
        Upper bound of the number of rays.
    quantity : str
        What is to be known, in words; empty until the pilot has chosen.
    pilot_rays, pilot_hits : int
        Rays of the pilot, which are not in the map, and those of them that counted.
    pilot_error_percent : float or None
        Relative error that the pilot found; None if nothing arrived.
    needed_rays : int or None
        Rays that the target needs, as last predicted; None if not known, 0 before the pilot.
    stages : tuple of int
        Numbers of rays that the run went to; more than one if it was extended.
    flux_w, flux_stderr_w, reached_percent : float or None
        What the map says of it; the last is None where nothing arrived.
    ended : str
        ``target``, ``rays`` (the most that are allowed), ``time`` (limit), ``nothing`` (arrived in the pilot), or empty
        if the run has not ended.
    """

    target: Target
    most_rays: int
    quantity: str = ""
    pilot_rays: int = 0
    pilot_hits: int = 0
    pilot_error_percent: float | None = None
    needed_rays: int | None = 0
    stages: tuple[int, ...] = ()
    flux_w: float | None = None
    flux_stderr_w: float | None = None
    reached_percent: float | None = None
    ended: str = ""

    def to_dict(self) -> dict[str, Any]:
        """As the manifest and ``raymaps info --json`` hold it."""
        own = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "target"}
        return {**self.target.to_dict(), **own, "stages": list(self.stages)}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Course:
        """From what `to_dict` made."""
        own = {field.name: data[field.name] for field in fields(cls) if field.name in data}
        return cls(**{**own, "target": Target.from_dict(data), "stages": tuple(data.get("stages", ()))})

    def plan(self) -> str:
        """What the pilot found, in a sentence."""
        told = f"Target {self.target.percent:g} % of {self.quantity}: "
        if self.needed_rays is None:
            return f"{told}nothing arrived in a pilot of {self.pilot_rays} rays, so no number of rays can be predicted."
        told += f"{self.stages[-1]} rays, by a pilot of {self.pilot_rays} with {self.pilot_hits} hits."
        if self.needed_rays > self.most_rays:
            return f"{told} It needs about {_round(self.needed_rays)}, more than the {self.most_rays} allowed."
        return told

    def verdict(self, n_rays: int, seconds_per_ray: float | None) -> str:
        """What was reached, in a sentence; ``seconds_per_ray`` is for how long the rest would take."""
        asked = f"The target of {self.target.percent:g} % for {self.quantity}"
        if self.reached_percent is None or self.flux_w is None or self.flux_stderr_w is None:
            return (
                f"{asked} was not reached: nothing arrived there in {n_rays} rays"
                f"{f' and a pilot of {self.pilot_rays}' if self.pilot_rays else ''}. "
                "If light should get there, allow more by --rays or look for what blocks it."
            )
        found = (
            f"{self.reached_percent:.3g} % ({format_with_error(self.flux_w, self.flux_stderr_w)}) after {n_rays} rays"
        )
        if self.ended == "target":
            return f"{asked} was reached: {found}."
        why = {"rays": ", the most that are allowed", "time": ", at the time limit"}.get(self.ended, "")
        sentence = f"{asked} was not reached: {found}{why}."
        if not self.needed_rays:
            return sentence
        sentence += f" It needs about {_round(self.needed_rays)} rays"
        if seconds_per_ray is not None:
            sentence += f", {format_duration(max(self.needed_rays - n_rays, 0) * seconds_per_ray)} more"
        is_too_few = self.needed_rays > self.most_rays
        again = "" if self.ended == "time" and not is_too_few else f" --target-error {self.target.percent:g}"
        return f"{sentence}: go on with --resume{again}{' and more --rays' if is_too_few else ''}."


def _round(n_rays: int) -> int:
    """To two digits."""
    step = 10 ** max(0, len(str(n_rays)) - 2)
    return -(-n_rays // step) * step
