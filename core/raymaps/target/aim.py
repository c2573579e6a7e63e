# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is to be known, and how well."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from raymaps.errors import TraceError

__all__ = ["LARGEST_PERCENT", "SMALLEST_PERCENT", "Target"]

#: An error below is beyond any number of rays; one above says nothing of the figure.
SMALLEST_PERCENT, LARGEST_PERCENT = 0.001, 50.0


@dataclass(frozen=True)
class Target:
    """A relative standard error that a flux shall have.

    Attributes
    ----------
    percent : float
        Standard error over flux, in percent: two runs in three are off by less.
    detector : str, optional
        The flux is what this detector registers.
    rect, ellipse : four float, optional
        Only in this region of the detector, as in `evaluate_detector`; a scene with one detector needs no name.
    where : str, optional
        Criterion: only rays that match. Without a detector, the flux that these rays were emitted with.

    Of a target that names neither detector nor criterion the pilot chooses the detector that is least certain; in a
    scene without detectors it is the light that is absorbed.

    Raises
    ------
    TraceError
        If the percentage is out of range.
    """

    percent: float
    detector: str | None = None
    rect: tuple[float, ...] | None = None
    ellipse: tuple[float, ...] | None = None
    where: str | None = None

    def __post_init__(self) -> None:
        if not SMALLEST_PERCENT <= self.percent <= LARGEST_PERCENT:
            raise TraceError(
                f"The target error must be from {SMALLEST_PERCENT:g} to {LARGEST_PERCENT:g} %, got {self.percent:g} %."
            )
        for name in ("rect", "ellipse"):
            numbers = getattr(self, name)
            object.__setattr__(self, name, None if numbers is None else tuple(float(x) for x in numbers))

    @property
    def error(self) -> float:
        """The relative standard error."""
        return self.percent / 100

    def to_dict(self) -> dict[str, Any]:
        """As the manifest holds it; what was not asked is left out."""
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in given.items()
            if value is not None
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Target:
        """From what `to_dict` made; other keys are passed over."""
        return cls(**{field.name: data[field.name] for field in fields(cls) if field.name in data})
