# SPDX-License-Identifier: LGPL-2.1-or-later
r"""The text form of a criterion: ``from(LED) & hit(Lens.Face3, fresnel_refraction) & ~detector(Sensor)``.

    criterion   = conjunction { ("|" | "or") conjunction }
    conjunction = term { ("&" | "and") term }
    term        = ("~" | "!" | "not") term | "(" criterion ")" | event
    event       = "true" | "from(" NAME ")" | "hit(" NAME [ "." NAME ] [ "," KIND ] ")"
                | "surface(" NAME [ "," KIND ] ")" | "event(" KIND ")" | "medium(" NAME "," MEDIUM_EVENT ")"
                | "detector(" NAME [ "," ("rect"|"ellipse") "=(" number "," number "," number "," number ")" ] ")"
                | "ended(" ("absorbed"|"left"|"killed") ")" | "wavelength(" number "," number ")"

A KIND is one of `raymaps.kinds.CRITERION_KINDS`, a MEDIUM_EVENT is ``absorption`` or ``scattering``. A NAME of letters,
digits and ``_`` stands as it is, any other in double quotes, where ``\"`` is a quote and ``\\`` a backslash. ``~``
binds tighter than ``&``, and ``&`` tighter than ``|``; blanks between words mean nothing.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from raymaps.criterion.tree import (
    ELEMENTARY_EVENTS,
    MAX_DEPTH,
    MEDIUM_EVENTS,
    And,
    Area,
    Criterion,
    Crosses,
    Ellipse,
    Ended,
    Everything,
    From,
    Happened,
    Hit,
    InMedium,
    Not,
    OnSurface,
    Or,
    Rectangle,
    Wavelength,
    all_of,
    any_of,
)
from raymaps.errors import CriterionError, decapitalised, shortened, unknown_name
from raymaps.kinds import CRITERION_KINDS, ENDINGS

__all__ = ["format_criterion", "format_name", "parse_criterion"]

_BLANKS = re.compile(r"\s*")
_WORD = re.compile(r"\w+")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_OPERATORS = {"and": "&", "or": "|", "not": "~"}


def parse_criterion(text: str) -> Criterion:
    """Read the text form of a criterion.

    Parameters
    ----------
    text : str

    Returns
    -------
    Criterion; names are not looked up yet (see `raymaps.criterion.bind`).

    Raises
    ------
    CriterionError
        If the text is not a criterion: one sentence with the character where it stops making sense.
    """
    parser = _Parser(text)
    if parser.at_end():
        raise CriterionError("The criterion is empty: write 'true' to match every ray.")
    criterion = parser.criterion(0)
    if not parser.at_end():
        raise parser.expected("'&', '|' or the end")
    return criterion


class _Parser:
    """Recursive descent over the text; ``position`` is the next character to be read."""

    def __init__(self, text: str):
        self.text = text
        self.position = 0

    # --- the grammar

    def criterion(self, depth: int) -> Criterion:
        operands = [self.conjunction(depth)]
        while self.takes_operator("|"):
            operands.append(self.conjunction(depth))
        return any_of(operands)

    def conjunction(self, depth: int) -> Criterion:
        operands = [self.term(depth)]
        while self.takes_operator("&"):
            operands.append(self.term(depth))
        return all_of(operands)

    def term(self, depth: int) -> Criterion:
        if depth >= MAX_DEPTH:
            raise self.error(f"brackets and negations are nested more than {MAX_DEPTH} deep; write it with fewer")
        if self.takes_operator("~"):
            return Not(self.term(depth + 1))
        if self.takes("("):
            inner = self.criterion(depth + 1)
            self.expect(")")
            return inner
        return self.event()

    def event(self) -> Criterion:
        start = self.position
        word = self.word()
        if word is None or word in _OPERATORS:
            self.position = start
            raise self.expected("an elementary event such as hit(BODY), '~' or '('")
        if word not in ELEMENTARY_EVENTS:
            self.position = start
            raise self.error(decapitalised(unknown_name("elementary event", shortened(word, 40), ELEMENTARY_EVENTS)))
        if word == Everything.word:
            return Everything()
        self.expect("(")
        event = _ARGUMENTS[word](self)
        self.expect(")")
        return event

    # --- what stands between the brackets of an event

    def name(self, what: str) -> str:
        if self.peek() == '"':
            return self.quoted_name(what)
        word = self.word()
        if word is None:
            raise self.expected(
                f"the name of a {what} (in double quotes if it holds other characters than letters, digits and _)"
            )
        return word

    def quoted_name(self, what: str) -> str:
        start = self.position
        name: list[str] = []
        self.position += 1
        while self.position < len(self.text):
            char = self.text[self.position]
            if char == "\\":
                self.position += 1
                char = self.text[self.position : self.position + 1]
                if char not in ('"', "\\"):
                    raise self.error("in a quoted name a backslash stands only before a double quote or a backslash")
            elif char == '"':
                self.position += 1
                if not name:
                    self.position = start
                    raise self.error(f"the name of a {what} is empty")
                return "".join(name)
            name.append(char)
            self.position += 1
        self.position = start
        raise self.error(f"the name of a {what} lacks its closing double quote")

    def one_of(self, what: str, known: tuple[str, ...]) -> str:
        self.peek()
        start = self.position
        word = self.word()
        if word not in known:
            self.position = start
            if word is None:
                raise self.expected(f"a {what} (one of {', '.join(known)})")
            raise self.error(f"unknown {what} '{shortened(word, 40)}'; known: {', '.join(known)}")
        return word

    def optional_kind(self) -> str | None:
        return self.one_of("kind", tuple(CRITERION_KINDS)) if self.takes(",") else None

    def optional_area(self) -> Area | None:
        if not self.takes(","):
            return None
        shape = self.one_of("area", ("rect", "ellipse"))
        self.expect("=")
        start = self.position
        self.expect("(")
        numbers = [self.number()]
        for _ in range(3):
            self.expect(",")
            numbers.append(self.number())
        self.expect(")")
        try:
            return Rectangle(*numbers) if shape == Rectangle.word else Ellipse(*numbers)
        except CriterionError as error:
            self.position = start
            raise self.error(str(error).rstrip(".")) from None

    def number(self, unit: str = "mm") -> float:
        self.peek()
        match = _NUMBER.match(self.text, self.position)
        if not match:
            raise self.expected(f"a number in {unit}")
        self.position = match.end()
        return float(match[0])

    # --- characters

    def peek(self) -> str:
        """The next character that is no blank, or nothing at the end."""
        match = _BLANKS.match(self.text, self.position)
        self.position = match.end() if match else self.position
        return self.text[self.position : self.position + 1]

    def at_end(self) -> bool:
        return not self.peek()

    def word(self) -> str | None:
        self.peek()
        match = _WORD.match(self.text, self.position)
        if not match:
            return None
        self.position = match.end()
        return match[0]

    def takes(self, char: str) -> bool:
        if self.peek() != char:
            return False
        self.position += 1
        return True

    def takes_operator(self, sign: str) -> bool:
        """Whether an operator stands next, as a sign or as a word; it is read then."""
        if self.takes(sign) or (sign == "~" and self.takes("!")):
            return True
        start = self.position
        if _OPERATORS.get((self.word() or "").lower()) == sign:
            return True
        self.position = start
        return False

    def expect(self, char: str) -> None:
        if not self.takes(char):
            raise self.expected(f"'{char}'")

    # --- errors

    def expected(self, what: str) -> CriterionError:
        self.peek()
        match = _WORD.match(self.text, self.position)
        found = shortened(match[0] if match else self.peek(), 40)
        return self.error(f"expected {what}, found {repr(found) if found else 'the end'}")

    def error(self, what: str) -> CriterionError:
        return CriterionError(f"Criterion, character {self.position + 1}: {what}.")


def _hit(parser: _Parser) -> Criterion:
    body = parser.name("body")
    face = parser.name("face") if parser.takes(".") else None
    return Hit(body, face, parser.optional_kind())


def _medium(parser: _Parser) -> Criterion:
    name = parser.name("medium")
    parser.expect(",")
    return InMedium(name, parser.one_of("medium event", tuple(MEDIUM_EVENTS)))


def _wavelength(parser: _Parser) -> Criterion:
    parser.peek()
    start = parser.position
    low_nm = parser.number("nm")
    parser.expect(",")
    high_nm = parser.number("nm")
    try:
        return Wavelength(low_nm, high_nm)
    except CriterionError as error:
        parser.position = start
        raise parser.error(str(error).rstrip(".")) from None


#: How the arguments of each elementary event are read.
_ARGUMENTS: dict[str, Callable[[_Parser], Criterion]] = {
    "from": lambda parser: From(parser.name("source")),
    "hit": _hit,
    "surface": lambda parser: OnSurface(parser.name("surface property"), parser.optional_kind()),
    "event": lambda parser: Happened(parser.one_of("kind", tuple(CRITERION_KINDS))),
    "medium": _medium,
    "detector": lambda parser: Crosses(parser.name("detector"), parser.optional_area()),
    "ended": lambda parser: Ended(parser.one_of("ending", tuple(ENDINGS))),
    "wavelength": _wavelength,
}


def format_criterion(criterion: Criterion) -> str:
    """The text form of a criterion, with no more brackets than needed; `parse_criterion` gives the same tree back."""
    if isinstance(criterion, Or):
        return " | ".join(format_criterion(operand) for operand in criterion.operands)
    if isinstance(criterion, And):
        return " & ".join(_bracketed(operand, Or) for operand in criterion.operands)
    if isinstance(criterion, Not):
        return "~" + _bracketed(criterion.operand, Or, And)
    if isinstance(criterion, Everything):
        return criterion.word
    return f"{criterion.word}({', '.join(_format_arguments(criterion))})"


def format_name(name: str) -> str:
    """A name as it stands in a criterion: quoted if it holds other characters than letters, digits and ``_``."""
    if _WORD.fullmatch(name):
        return name
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _bracketed(criterion: Criterion, *looser: type[Criterion]) -> str:
    text = format_criterion(criterion)
    return f"({text})" if isinstance(criterion, looser) else text


def _format_arguments(criterion: Criterion) -> list[str]:
    match criterion:
        case From(source):
            return [format_name(source)]
        case Hit(body, face, kind):
            place = format_name(body) + (f".{format_name(face)}" if face is not None else "")
            return [place, kind] if kind else [place]
        case OnSurface(surface, kind):
            return [format_name(surface), kind] if kind else [format_name(surface)]
        case Happened(kind):
            return [kind]
        case InMedium(medium, what):
            return [format_name(medium), what]
        case Crosses(detector, area):
            return [format_name(detector), *([_format_area(area)] if area else [])]
        case Ended(how):
            return [how]
        case Wavelength(low_nm, high_nm):
            return [_format_number(low_nm), _format_number(high_nm)]
    raise CriterionError(f"'{type(criterion).__name__}' is not a part of a criterion.")


def _format_area(area: Area) -> str:
    return f"{area.word}=({','.join(_format_number(number) for number in area.numbers)})"


def _format_number(number: float) -> str:
    short = f"{number:g}"
    return short if float(short) == number else repr(number)
