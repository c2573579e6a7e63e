# SPDX-License-Identifier: LGPL-2.1-or-later
"""The questions that are asked of a map, and what they mean in the columns of its files.

`Step` says which rows of ``signatures.parquet`` an elementary event selects: each named column holds one of the given
numbers. A ray has the event if its signature owns such a row. So any database can answer the same question.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from raymaps.criterion import And, Criterion, Crosses, From, Happened, Hit, Not, OnSurface, Rectangle, parse_criterion
from raymaps.kinds import CRITERION_KINDS, EventKind
from raymaps.names import Names
from raymaps.scene import RectangleDetector, Scene

__all__ = ["QUESTIONS", "AreaQuestion", "Questions", "Step", "area_question", "steps_of"]


@dataclass(frozen=True)
class Questions:
    """About one scene: elementary events that are joined by "and" one after the other, and an area of a detector."""

    events: tuple[str, ...]
    area: str
    detector: str

    def first(self, n_events: int) -> str:
        return " & ".join(self.events[:n_events])


QUESTIONS = {
    "led_collimator": Questions(
        events=(
            "hit(Collimator, fresnel_reflection)", "detector(Target)", "event(diffuse_refraction)",
            "~hit(Board, diffuse_reflection)", "~from(LED_blue)",
        ),
        area="detector(Target, rect=(-20,-20,20,20))",
        detector="Target",
    ),
    "singlet_barrel": Questions(
        events=(
            "hit(Lens, fresnel_refraction)", "detector(SensorPlane)", "~event(diffuse_reflection)",
            "hit(Sensor)", "~surface(black_paint)",
        ),
        area="detector(SensorPlane, rect=(-2,-2,2,2))",
        detector="SensorPlane",
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Step:
    """Rows of ``signatures.parquet`` whose columns hold one of some numbers; a negated one must not be there."""

    columns: tuple[tuple[str, tuple[int, ...]], ...]
    negated: bool = False


#: Kinds of events that `hit` and `surface` mean where they name none.
_ON_SURFACES = tuple(
    int(kind)
    for kind in EventKind
    if kind not in (EventKind.EMISSION, EventKind.LEFT, EventKind.CROSSING)
    and kind not in (EventKind.MEDIUM_ABSORPTION, EventKind.MEDIUM_SCATTERING)
)


def _kinds(kind: str | None) -> tuple[int, ...]:
    return _ON_SURFACES if kind is None else tuple(int(k) for k in CRITERION_KINDS[kind])


_ELEMENTARY: dict[type[Criterion], Callable[[Any, Names], dict[str, tuple[int, ...]]]] = {
    From: lambda event, names: {"source": (names.sources.index(event.source),)},
    Hit: lambda event, names: {"body": (names.bodies.index(event.body),), "kind": _kinds(event.kind)},
    OnSurface: lambda event, names: {"surface": (names.surfaces.index(event.surface),), "kind": _kinds(event.kind)},
    Happened: lambda event, names: {"kind": _kinds(event.kind)},
    Crosses: lambda event, names: {"detector": (names.detectors.index(event.detector),), "registered": (1,)},
}


def steps_of(criterion: str, names: Names) -> tuple[Step, ...]:
    """The steps that a conjunction of elementary events, some negated, asks for."""
    tree = parse_criterion(criterion)
    result = []
    for event in tree.operands if isinstance(tree, And) else (tree,):
        negated = isinstance(event, Not)
        elementary = event.operand if isinstance(event, Not) else event
        result.append(Step(tuple(_ELEMENTARY[type(elementary)](elementary, names).items()), negated))
    return tuple(result)


@dataclass(frozen=True)
class AreaQuestion:
    """Rows of ``crossings.parquet``: on a detector, in a rectangle of it, at angles from and to, in radians."""

    detector: int
    x_mm: tuple[float, float]
    y_mm: tuple[float, float]
    angle_rad: tuple[float, float]


def area_question(criterion: str, names: Names, scene: Scene) -> AreaQuestion:
    """What ``detector(NAME, rect=...)`` means where the detector has one side."""
    event = parse_criterion(criterion)
    assert isinstance(event, Crosses)
    assert isinstance(event.area, Rectangle)
    detector, area = scene.detectors[event.detector], event.area
    assert isinstance(detector, RectangleDetector)
    assert (detector.side, detector.max_angle_deg) == ("front", 90)
    # head-on is 0 and grazing pi / 2, which belongs to neither side; no multiple of the stored step falls on it
    return AreaQuestion(
        names.detectors.index(event.detector), (area.x0_mm, area.x1_mm), (area.y0_mm, area.y1_mm), (0.0, math.pi / 2)
    )
