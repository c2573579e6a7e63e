# SPDX-License-Identifier: LGPL-2.1-or-later
"""Criteria: a frozen expression tree of elementary events with not, and, or (paper, section 3).

A criterion is a question about one ray that is answered with yes or no. What each elementary event means, exactly:

======================  ==============================================================================================
`Everything`            every ray
`From`                  the ray was emitted by the source
`Hit`                   some event took place on a surface of the body (or on the face): the ray was reflected,
                        refracted, absorbed or killed there. Being emitted there is no hit. With a kind, that same
                        event has the kind
`OnSurface`             some event took place on a surface with the property; with a kind, that same event has the kind
`Happened`              some event has the kind
`InMedium`              the ray was absorbed, or scattered, inside the medium
`Crosses`               the detector registered the ray: a segment crosses it from the detector's side within its
                        acceptance angle. With an area, some registered crossing lies in the area (borders included).
                        A detector on faces registers events on them, one of the far field the rays that left
`Ended`                 the ray's last event is an absorption, the ray left the scene, or it was killed
`Wavelength`            the ray was narrowed to one wavelength, which lies in the range (borders included)
======================  ==============================================================================================

Trees are combined with ``&``, ``|`` and ``~``; an `And` never holds an `And` directly, nor an `Or` an `Or`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, ClassVar

from raymaps.errors import CriterionError, shortened, unknown_name
from raymaps.kinds import CRITERION_KINDS, ENDINGS

__all__ = [
    "ELEMENTARY_EVENTS",
    "MAX_DEPTH",
    "MEDIUM_EVENTS",
    "And",
    "Area",
    "Criterion",
    "Crosses",
    "Ellipse",
    "Ended",
    "Everything",
    "From",
    "Happened",
    "Hit",
    "InMedium",
    "Not",
    "OnSurface",
    "Or",
    "Rectangle",
    "Wavelength",
    "all_of",
    "any_of",
    "from_dict",
    "to_dict",
]

#: How deeply a criterion may be nested.
MAX_DEPTH = 100

#: What may happen inside a medium, and the kind of event that it is.
MEDIUM_EVENTS: dict[str, str] = {"absorption": "medium_absorption", "scattering": "medium_scattering"}


class Criterion:
    """Base of all nodes of a criterion."""

    #: How deeply the node is nested.
    depth: int = 1
    #: What the node is called in text and in plain data.
    word: ClassVar[str]

    def __and__(self, other: Criterion) -> Criterion:
        return all_of((self, other))

    def __or__(self, other: Criterion) -> Criterion:
        return any_of((self, other))

    def __invert__(self) -> Criterion:
        return Not(self)


# ---------------------------------------------------------------------------------------------------- areas


class _Area:
    word: ClassVar[str]

    @property
    def numbers(self) -> tuple[float, ...]:
        """The numbers of the area in the order of the text form, in mm."""
        return tuple(getattr(self, f.name) for f in fields(self))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Rectangle(_Area):
    """Rectangle in mm in a detector's local coordinates (origin at its centre); its borders belong to it."""

    x0_mm: float
    y0_mm: float
    x1_mm: float
    y1_mm: float
    word: ClassVar[str] = "rect"

    def __post_init__(self) -> None:
        _make_finite(self)
        if not (self.x0_mm < self.x1_mm and self.y0_mm < self.y1_mm):
            raise CriterionError(
                f"rect=(X0,Y0,X1,Y1) in mm needs X0 < X1 and Y0 < Y1, got "
                f"({self.x0_mm:g}, {self.y0_mm:g}, {self.x1_mm:g}, {self.y1_mm:g})."
            )


@dataclass(frozen=True)
class Ellipse(_Area):
    """Ellipse in mm in a detector's local coordinates: centre and radii along x and y; its border belongs to it."""

    cx_mm: float
    cy_mm: float
    rx_mm: float
    ry_mm: float
    word: ClassVar[str] = "ellipse"

    def __post_init__(self) -> None:
        _make_finite(self)
        if not (self.rx_mm > 0 and self.ry_mm > 0):
            raise CriterionError(
                f"ellipse=(CX,CY,RX,RY) in mm needs radii above 0, got RX={self.rx_mm:g} and RY={self.ry_mm:g}."
            )


Area = Rectangle | Ellipse

_AREAS: dict[str, type[Rectangle] | type[Ellipse]] = {"rect": Rectangle, "ellipse": Ellipse}


# ---------------------------------------------------------------------------------------------------- elementary events


@dataclass(frozen=True)
class Everything(Criterion):
    """Every ray: ``true``."""

    word: ClassVar[str] = "true"


@dataclass(frozen=True)
class From(Criterion):
    """Emitted by a source: ``from(SOURCE)``."""

    source: str
    word: ClassVar[str] = "from"

    def __post_init__(self) -> None:
        _check_name("source", self.source)


@dataclass(frozen=True)
class Hit(Criterion):
    """An event on a surface of a body or on one face, of any kind or of one: ``hit(BODY.FACE, KIND)``."""

    body: str
    face: str | None = None
    kind: str | None = None
    word: ClassVar[str] = "hit"

    def __post_init__(self) -> None:
        _check_name("body", self.body)
        if self.face is not None:
            _check_name("face", self.face)
        _check_kind(self.kind)


@dataclass(frozen=True)
class OnSurface(Criterion):
    """An event on any surface with a property, of any kind or of one: ``surface(PROPERTY, KIND)``."""

    surface: str
    kind: str | None = None
    word: ClassVar[str] = "surface"

    def __post_init__(self) -> None:
        _check_name("surface property", self.surface)
        _check_kind(self.kind)


@dataclass(frozen=True)
class Happened(Criterion):
    """An event of a kind, wherever: ``event(KIND)``."""

    kind: str
    word: ClassVar[str] = "event"

    def __post_init__(self) -> None:
        _check_one_of("kind", self.kind, CRITERION_KINDS)


@dataclass(frozen=True)
class InMedium(Criterion):
    """Absorbed or scattered inside a medium: ``medium(NAME, absorption|scattering)``."""

    medium: str
    what: str
    word: ClassVar[str] = "medium"

    def __post_init__(self) -> None:
        _check_name("medium", self.medium)
        _check_one_of("medium event", self.what, MEDIUM_EVENTS)


@dataclass(frozen=True)
class Crosses(Criterion):
    """Registered by a detector, or in an area of it: ``detector(NAME, rect=(X0,Y0,X1,Y1))``."""

    detector: str
    area: Area | None = None
    word: ClassVar[str] = "detector"

    def __post_init__(self) -> None:
        _check_name("detector", self.detector)
        if not (self.area is None or isinstance(self.area, Rectangle | Ellipse)):
            raise CriterionError(f"The area of a detector must be a rectangle or an ellipse, got {_short(self.area)}.")


@dataclass(frozen=True)
class Ended(Criterion):
    """How the ray ended: ``ended(absorbed|left|killed)``."""

    how: str
    word: ClassVar[str] = "ended"

    def __post_init__(self) -> None:
        _check_one_of("ending", self.how, ENDINGS)


@dataclass(frozen=True)
class Wavelength(Criterion):
    """Narrowed to one wavelength in a range: ``wavelength(LO, HI)`` in nm."""

    low_nm: float
    high_nm: float
    word: ClassVar[str] = "wavelength"

    def __post_init__(self) -> None:
        for name in ("low_nm", "high_nm"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value <= _LONGEST_NM:
                raise CriterionError(f"wavelength(LO, HI) takes two numbers in nm above 0, got {_short(value)}.")
            object.__setattr__(self, name, float(value))
        if self.low_nm > self.high_nm:
            raise CriterionError(f"wavelength(LO, HI) in nm needs LO <= HI, got ({self.low_nm:g}, {self.high_nm:g}).")


#: Every elementary event by its word in the text form.
ELEMENTARY_EVENTS: dict[str, type[Criterion]] = {
    event.word: event for event in (Everything, From, Hit, OnSurface, Happened, InMedium, Crosses, Ended, Wavelength)
}


# ---------------------------------------------------------------------------------------------------- logic


@dataclass(frozen=True)
class Not(Criterion):
    """Rays that don't match the operand."""

    operand: Criterion
    depth: int = field(init=False, repr=False, compare=False)
    word: ClassVar[str] = "not"

    def __post_init__(self) -> None:
        object.__setattr__(self, "depth", _depth_above((self.operand,)))


@dataclass(frozen=True)
class _Junction(Criterion):
    operands: tuple[Criterion, ...]
    depth: int = field(init=False, repr=False, compare=False)
    word: ClassVar[str]

    def __post_init__(self) -> None:
        operands: list[Criterion] = []
        for operand in self.operands:
            operands.extend(operand.operands if isinstance(operand, type(self)) else (operand,))
        if len(operands) < 2:
            raise CriterionError(f"'{self.word}' needs at least two operands, got {len(operands)}.")
        object.__setattr__(self, "operands", tuple(operands))
        object.__setattr__(self, "depth", _depth_above(operands))


@dataclass(frozen=True)
class And(_Junction):
    """Rays that match all operands, two or more."""

    word: ClassVar[str] = "and"


@dataclass(frozen=True)
class Or(_Junction):
    """Rays that match at least one of the operands, two or more."""

    word: ClassVar[str] = "or"


def all_of(operands: Iterable[Criterion]) -> Criterion:
    """Conjunction of any number of operands; of none it is `Everything`."""
    operands = tuple(operands)
    return Everything() if not operands else operands[0] if len(operands) == 1 else And(operands)


def any_of(operands: Iterable[Criterion]) -> Criterion:
    """Disjunction of any number of operands; of none it matches nothing."""
    operands = tuple(operands)
    return Not(Everything()) if not operands else operands[0] if len(operands) == 1 else Or(operands)


# ---------------------------------------------------------------------------------------------------- plain data


def to_dict(criterion: Criterion) -> dict[str, Any]:
    """A criterion as plain data that JSON can hold; the key ``event`` says which node it is.

    ``hit(Lens.Face3) & ~from(LED)`` is ``{"event": "and", "operands": [{"event": "hit", "body": "Lens", "face":
    "Face3"}, {"event": "not", "operand": {"event": "from", "source": "LED"}}]}``.
    """
    if isinstance(criterion, Not):
        return {"event": "not", "operand": to_dict(criterion.operand)}
    if isinstance(criterion, _Junction):
        return {"event": criterion.word, "operands": [to_dict(operand) for operand in criterion.operands]}
    data: dict[str, Any] = {"event": criterion.word}
    for name in _keys(type(criterion)):
        value = getattr(criterion, name)
        if isinstance(value, Rectangle | Ellipse):
            data[value.word] = list(value.numbers)
        elif value is not None:
            data[name] = value
    return data


def from_dict(data: Any) -> Criterion:
    """The criterion that `to_dict` described.

    Raises
    ------
    CriterionError
        If the data is not a criterion: one sentence on the first fault.
    """
    return _from_dict(data, MAX_DEPTH)


def _from_dict(data: Any, depth_left: int) -> Criterion:
    if not depth_left:
        raise CriterionError(_TOO_DEEP)
    if not isinstance(data, dict) or not isinstance(data.get("event"), str):
        raise CriterionError(f"A criterion must be an object with the key 'event', got {_short(data)}.")
    word, values = data["event"], {key: value for key, value in data.items() if key != "event"}
    if word == "not":
        _check_keys(word, values, {"operand"})
        return Not(_from_dict(values.get("operand"), depth_left - 1))
    if word in ("and", "or"):
        _check_keys(word, values, {"operands"})
        if not isinstance(values.get("operands"), list):
            raise CriterionError(f"'{word}' needs a list 'operands', got {_short(values.get('operands'))}.")
        operands = tuple(_from_dict(operand, depth_left - 1) for operand in values["operands"])
        return And(operands) if word == "and" else Or(operands)
    if word not in ELEMENTARY_EVENTS:
        raise CriterionError(unknown_name("elementary event", _short(word), (*ELEMENTARY_EVENTS, "not", "and", "or")))
    if word == Crosses.word:
        values = _with_area(values)
    event = ELEMENTARY_EVENTS[word]
    _check_keys(word, values, set(_keys(event)))
    missing = [f.name for f in fields(event) if f.default is MISSING and f.name not in values]  # type: ignore[arg-type]
    if missing:
        raise CriterionError(f"'{word}' lacks the key '{missing[0]}'.")
    return event(**values)


def _with_area(values: dict[str, Any]) -> dict[str, Any]:
    """The values of a `Crosses` with the numbers of ``rect`` or ``ellipse`` made into an area."""
    given = [word for word in _AREAS if word in values]
    if len(given) > 1:
        raise CriterionError("A detector takes either 'rect' or 'ellipse', not both.")
    if not given:
        return values
    numbers = values[given[0]]
    if not isinstance(numbers, list) or len(numbers) != 4:
        raise CriterionError(f"'{given[0]}' of a detector needs a list of four numbers in mm, got {_short(numbers)}.")
    return {key: value for key, value in values.items() if key != given[0]} | {"area": _AREAS[given[0]](*numbers)}


# ---------------------------------------------------------------------------------------------------- checks

#: Numbers of an area beyond this would overflow when squared.
_LARGEST_MM = 1e150
#: No light that is traced has a longer wavelength.
_LONGEST_NM = 1e9

_TOO_DEEP = f"The criterion is nested more than {MAX_DEPTH} deep: write it with fewer brackets and negations."


def _depth_above(operands: Iterable[Criterion]) -> int:
    for operand in operands:
        if not isinstance(operand, Criterion):
            raise CriterionError(f"An operand of a criterion must be a criterion, got {_short(operand)}.")
    depth = 1 + max(operand.depth for operand in operands)
    if depth > MAX_DEPTH:
        raise CriterionError(_TOO_DEEP)
    return depth


def _keys(event: type[Criterion]) -> tuple[str, ...]:
    return tuple(f.name for f in fields(event))  # type: ignore[arg-type]


def _check_keys(word: str, values: dict[str, Any], known: set[str]) -> None:
    for key in values:
        if key not in known:
            raise CriterionError(unknown_name(f"key of '{word}'", _short(key), sorted(known)))


def _check_name(what: str, name: Any) -> None:
    if not isinstance(name, str) or not name or any(ord(c) < 32 or ord(c) == 127 for c in name):
        raise CriterionError(f"The name of a {what} must be a text without control characters, got {_short(name)}.")


def _check_kind(kind: Any) -> None:
    if kind is not None:
        _check_one_of("kind", kind, CRITERION_KINDS)


def _check_one_of(what: str, word: Any, known: Iterable[str]) -> None:
    known = tuple(known)
    if not isinstance(word, str) or word not in known:
        shown = _short(word).strip("'")
        raise CriterionError(f"Unknown {what} '{shown}'; known: {', '.join(known)}.")


def _make_finite(area: Rectangle | Ellipse) -> None:
    for name in (f.name for f in fields(area)):
        value = getattr(area, name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _LARGEST_MM:
            raise CriterionError(f"{area.word}=(...) takes four numbers in mm up to 1e150, got {_short(value)}.")
        object.__setattr__(area, name, float(value))


def _short(value: Any) -> str:
    text = repr(value) if not isinstance(value, dict | list | tuple) else f"a {type(value).__name__}"
    return shortened(text, 60)
