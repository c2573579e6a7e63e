# SPDX-License-Identifier: LGPL-2.1-or-later
"""Options of ``raymaps trace`` for a target and a time limit: what they are called, and how their texts are read."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from raymaps.target import Target

__all__ = [
    "TargetDetector",
    "TargetEllipse",
    "TargetError",
    "TargetRect",
    "TargetWhere",
    "TimeLimit",
    "duration_s",
    "flux_asked",
    "four",
    "target_asked",
]

TargetError = Annotated[
    str | None,
    typer.Option(
        metavar="PERCENT",
        help="Trace until a flux is known so well: standard error over flux, as in 1% or 0.5. By default that of the "
        "detector that is least certain; without detectors that of the light absorbed.",
    ),
]
TargetDetector = Annotated[
    str | None, typer.Option("--target", metavar="NAME", help="Detector whose flux is meant by --target-error.")
]
TargetRect = Annotated[
    str | None, typer.Option(metavar="X0,Y0,X1,Y1", help="Only in this region of the target detector, in mm.")
]
TargetEllipse = Annotated[
    str | None, typer.Option(metavar="CX,CY,RX,RY", help="Only in this region of the target detector, in mm.")
]
TargetWhere = Annotated[
    str | None,
    typer.Option(
        metavar="CRITERION", help="Only rays that match; without --target the flux that they were emitted with."
    ),
]
TimeLimit = Annotated[
    str | None, typer.Option(metavar="TIME", help="Begin no portion later, as in 90s, 5min or 2h; a number is seconds.")
]

_SECONDS = {"": 1.0, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0}
_NUMBER = r"\s*((?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*"


def target_asked(
    percent: str | None,
    detector: str | None,
    rect: tuple[float, ...] | None,
    ellipse: tuple[float, ...] | None,
    where: str | None,
) -> Target | None:
    """The target that the options mean."""
    if percent is None:
        given = {"--target": detector, "--target-rect": rect, "--target-ellipse": ellipse, "--target-where": where}
        for option, said in given.items():
            if said is not None:
                raise typer.BadParameter("it says what --target-error is of: give that too", param_hint=option)
        return None
    matched = re.fullmatch(_NUMBER + "%?", percent.strip(), re.IGNORECASE)
    if not matched:
        raise typer.BadParameter(f"a percentage as in 1% is wanted, got '{percent}'", param_hint="--target-error")
    from raymaps.target.aim import LARGEST_PERCENT, SMALLEST_PERCENT

    value = float(matched[1])
    if not SMALLEST_PERCENT <= value <= LARGEST_PERCENT:
        raise typer.BadParameter(
            f"from {SMALLEST_PERCENT:g}% to {LARGEST_PERCENT:g}% can be asked for, got '{percent}'",
            param_hint="--target-error",
        )
    return flux_asked(detector, rect, ellipse, where, value)


def flux_asked(
    detector: str | None,
    rect: tuple[float, ...] | None,
    ellipse: tuple[float, ...] | None,
    where: str | None,
    percent: float = 1.0,
) -> Target:
    """The flux that the options mean."""
    from raymaps.target.aim import Target

    if rect is not None and ellipse is not None:
        raise typer.BadParameter("a region is a rectangle or an ellipse, not both", param_hint="--target-ellipse")
    return Target(percent, detector, rect, ellipse, where)


def duration_s(text: str | None) -> float | None:
    """Seconds of a text as in ``90s``, ``1.5 min``, ``2h``."""
    if text is None:
        return None
    matched = re.fullmatch(_NUMBER + "(s|m|min|h)?", text.strip(), re.IGNORECASE)
    seconds = float(matched[1]) * _SECONDS[(matched[2] or "").lower()] if matched else 0.0
    if not 0 < seconds < math.inf:
        raise typer.BadParameter(f"a time as in 90s, 5min or 2h is wanted, got '{text}'", param_hint="--time-limit")
    return seconds


def four(text: str | None, option: str) -> tuple[float, float, float, float] | None:
    """Four numbers in mm with commas between them."""
    if text is None:
        return None
    try:
        a, b, c, d = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(
            f"four numbers in mm as in -1,-1,1,1 are wanted, got '{text}'", param_hint=option
        ) from None
    return a, b, c, d
