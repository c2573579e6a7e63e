# SPDX-License-Identifier: LGPL-2.1-or-later
import json

import numpy as np
import pytest

from raymaps.criterion import (
    MAX_DEPTH,
    And,
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
    format_criterion,
    from_dict,
    parse_criterion,
    to_dict,
)
from raymaps.errors import CriterionError
from raymaps.kinds import CRITERION_KINDS

A, B, C = From("A"), From("B"), From("C")

EVENTS = [
    ("true", Everything(), {"event": "true"}),
    ("from(LED1)", From("LED1"), {"event": "from", "source": "LED1"}),
    ("hit(Lens)", Hit("Lens"), {"event": "hit", "body": "Lens"}),
    (
        "hit(Lens.Face3, fresnel_refraction)",
        Hit("Lens", "Face3", "fresnel_refraction"),
        {"event": "hit", "body": "Lens", "face": "Face3", "kind": "fresnel_refraction"},
    ),
    ("hit(Lens, absorption)", Hit("Lens", None, "absorption"), {"event": "hit", "body": "Lens", "kind": "absorption"}),
    ("surface(black)", OnSurface("black"), {"event": "surface", "surface": "black"}),
    (
        "surface(black, killed)",
        OnSurface("black", "killed"),
        {"event": "surface", "surface": "black", "kind": "killed"},
    ),
    ("event(left)", Happened("left"), {"event": "event", "kind": "left"}),
    (
        "medium(PMMA, absorption)",
        InMedium("PMMA", "absorption"),
        {"event": "medium", "medium": "PMMA", "what": "absorption"},
    ),
    ("detector(Sensor)", Crosses("Sensor"), {"event": "detector", "detector": "Sensor"}),
    (
        "detector(Sensor, rect=(-1,-1,1,0.25))",
        Crosses("Sensor", Rectangle(-1, -1, 1, 0.25)),
        {"event": "detector", "detector": "Sensor", "rect": [-1.0, -1.0, 1.0, 0.25]},
    ),
    (
        "detector(Sensor, ellipse=(0,0,1e-07,3))",
        Crosses("Sensor", Ellipse(0, 0, 1e-7, 3)),
        {"event": "detector", "detector": "Sensor", "ellipse": [0.0, 0.0, 1e-7, 3.0]},
    ),
    ("ended(absorbed)", Ended("absorbed"), {"event": "ended", "how": "absorbed"}),
    (
        "wavelength(486.1, 656.28)",
        Wavelength(486.1, 656.28),
        {"event": "wavelength", "low_nm": 486.1, "high_nm": 656.28},
    ),
]


@pytest.mark.parametrize(("text", "criterion", "data"), EVENTS, ids=[text for text, _, _ in EVENTS])
def test_every_elementary_event_as_text_tree_and_data(text, criterion, data):
    assert parse_criterion(text) == criterion
    assert format_criterion(criterion) == text
    assert to_dict(criterion) == data
    assert from_dict(json.loads(json.dumps(data))) == criterion


@pytest.mark.parametrize(
    ("text", "criterion"),
    [
        ("from(A) & from(B) | from(C)", Or((And((A, B)), C))),
        ("from(A) | from(B) & from(C)", Or((A, And((B, C))))),
        ("from(A) & (from(B) | from(C))", And((A, Or((B, C))))),
        ("~from(A) & from(B)", And((Not(A), B))),
        ("~(from(A) & from(B))", Not(And((A, B)))),
        ("from(A) & from(B) & from(C)", And((A, B, C))),
        ("~~from(A)", Not(Not(A))),
    ],
)
def test_precedence_with_the_fewest_brackets(text, criterion):
    assert parse_criterion(text) == criterion
    assert format_criterion(criterion) == text


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("not from(A) and from(B) or from(C)", "~from(A) & from(B) | from(C)"),
        ("!from(A)", "~from(A)"),
        ("NOT from(A) AND from(B)", "~from(A) & from(B)"),
        ("  from ( A )\n&\tfrom( B )  ", "from(A) & from(B)"),
        ("((from(A)))", "from(A)"),
        ("(from(A) & from(B)) & from(C)", "from(A) & from(B) & from(C)"),
        ("nottrue", None),
        ("not(true)", "~true"),
        ("detector(S,rect=( -1. , +.5,1e1 ,2))", "detector(S, rect=(-1,0.5,10,2))"),
    ],
)
def test_other_ways_to_write_the_same(text, same):
    if same is None:
        with pytest.raises(CriterionError, match="unknown elementary event 'nottrue'"):
            parse_criterion(text)
    else:
        assert format_criterion(parse_criterion(text)) == same


@pytest.mark.parametrize(
    "name", ["and", "true", "1", "Œil_2", "a b", 'say "hi"', "back\\slash", "a.b", "(", "~", " ", "\\"]
)
def test_names_of_any_characters(name):
    for criterion in (From(name), Hit(name, name), OnSurface(name), InMedium(name, "scattering"), Crosses(name)):
        assert parse_criterion(format_criterion(criterion)) == criterion


def test_names_are_quoted_only_where_they_must():
    assert format_criterion(Hit("Lens_01", "Face 3")) == 'hit(Lens_01."Face 3")'
    assert format_criterion(From('a"b\\c')) == r'from("a\"b\\c")'


@pytest.mark.parametrize(
    ("text", "position", "part"),
    [
        ("", None, "empty"),
        ("   ", None, "empty"),
        ("hit(((", 5, "expected the name of a body"),
        ("hit(Lens", 9, r"expected '\)', found the end"),
        ("hit(My Lens)", 8, r"expected '\)', found 'Lens'"),
        ("true true", 6, "expected '&', '|' or the end, found 'true'"),
        ("true &", 7, "found the end"),
        ("& true", 1, "found '&'"),
        ("true & and true", 8, "found 'and'"),
        ("hits(Lens)", 1, "unknown elementary event 'hits'; known: 'true', 'from', 'hit'"),
        ("event(teleportation)", 7, "unknown kind 'teleportation'; known: emission, diffuse_reflection"),
        ("event(crossing)", 7, "unknown kind 'crossing'"),
        ("event()", 7, "expected a kind"),
        ("ended(never)", 7, "unknown ending 'never'; known: absorbed, left, killed"),
        ("medium(PMMA)", 12, "expected ','"),
        ("medium(PMMA, heating)", 14, "unknown medium event 'heating'; known: absorption, scattering"),
        ("detector(S, circle=(0,0,1))", 13, "unknown area 'circle'; known: rect, ellipse"),
        ("detector(S, rect=(0,0,1))", 24, "expected ','"),
        ("detector(S, rect=(0,0,x,1))", 23, "expected a number in mm, found 'x'"),
        ("detector(S, rect=(0,0,0,1))", 18, "needs X0 < X1"),
        ("detector(S, ellipse=(0,0,-1,1))", 21, "needs radii above 0"),
        ("detector(S, ellipse=(0,0,1e999,1))", 21, "up to 1e150"),
        ("wavelength(500)", 15, "expected ','"),
        ("wavelength(a, 600)", 12, "expected a number in nm, found 'a'"),
        ("wavelength(600, 500)", 12, "needs LO <= HI, got"),
        ("wavelength(-1, 500)", 12, "two numbers in nm above 0"),
        ("wavelength(1, 1e999)", 12, "two numbers in nm above 0, got inf"),
        ('from("LED)', 6, "lacks its closing double quote"),
        (r'from("a\n")', 9, "a backslash stands only before"),
        ('from("")', 6, "is empty"),
        ("(true", 6, r"expected '\)', found the end"),
        ("true)", 5, "found '\\)'"),
        ("~" * 100_000 + "true", MAX_DEPTH + 1, "nested more than"),
        ("(" * 100_000 + "true", MAX_DEPTH + 1, "nested more than"),
        ("x" * 100_000, 1, "unknown elementary event"),
        ("from(A\x00)", 7, "expected"),
    ],
)
def test_one_clear_sentence_with_the_position(text, position, part):
    with pytest.raises(CriterionError, match=part) as caught:
        parse_criterion(text)
    message = str(caught.value)
    assert message.endswith(".")
    assert "\n" not in message
    assert len(message) < 550
    if position is not None:
        assert message.startswith(f"Criterion, character {position}: ")


def test_a_hundred_thousand_operands_are_no_problem():
    text = " | ".join(f"from(S{i})" for i in range(100_000))
    criterion = parse_criterion(text)
    assert len(criterion.operands) == 100_000
    assert format_criterion(criterion) == text


def random_name(rng):
    letters = list('abcXYZ019_ .,()"\\&|~!=äµ漢')
    return "".join(rng.choice(letters, int(rng.integers(1, 8))))


def random_criterion(rng, depth):
    """Any tree that can be built, whatever its names."""
    shape = int(rng.integers(13 if depth else 9))
    kind = str(rng.choice(sorted(CRITERION_KINDS))) if rng.random() < 0.5 else None
    if shape == 0:
        return Everything()
    if shape == 1:
        return From(random_name(rng))
    if shape == 2:
        return Hit(random_name(rng), random_name(rng) if rng.random() < 0.5 else None, kind)
    if shape == 3:
        return OnSurface(random_name(rng), kind)
    if shape == 4:
        return Happened(kind or "left")
    if shape == 5:
        return InMedium(random_name(rng), str(rng.choice(["absorption", "scattering"])))
    if shape == 6:
        x, y, *size = (float(value) for value in rng.normal(0, 10.0 ** rng.integers(-6, 7), 4))
        areas = (Rectangle(x, y, x + abs(size[0]), y + abs(size[1])), Ellipse(x, y, abs(size[0]), abs(size[1])), None)
        return Crosses(random_name(rng), areas[int(rng.integers(3))])
    if shape == 7:
        return Ended(str(rng.choice(["absorbed", "left", "killed"])))
    if shape == 8:
        return Wavelength(*sorted(float(nm) for nm in 10 ** rng.uniform(-3, 6, 2)))
    if shape in (9, 10):
        return Not(random_criterion(rng, depth - 1))
    operands = [random_criterion(rng, depth - 1) for _ in range(int(rng.integers(2, 5)))]
    return all_of(operands) if shape == 11 else any_of(operands)


@pytest.mark.parametrize("seed", range(300))
def test_round_trip_of_random_trees(seed):
    criterion = random_criterion(np.random.default_rng(seed), depth=5)
    assert parse_criterion(format_criterion(criterion)) == criterion
    assert from_dict(json.loads(json.dumps(to_dict(criterion)))) == criterion


@pytest.mark.parametrize("seed", range(300))
def test_no_bracket_can_be_left_out(seed):
    criterion = random_criterion(np.random.default_rng(seed), depth=3)
    text = format_criterion(criterion)
    for opening, closing in _grouping_brackets(text):
        bare = text[:opening] + text[opening + 1 : closing] + text[closing + 1 :]
        assert parse_criterion(bare) != criterion


def _grouping_brackets(text):
    """Places of the brackets that group, and not those of events and areas, nor those in names."""
    pairs, stack, quoted, i = [], [], False, 0
    while i < len(text):
        char = text[i]
        if quoted:
            i += char == "\\"
            quoted = char != '"'
        elif char == '"':
            quoted = True
        elif char == "(":
            groups = i == 0 or text[i - 1] in "(~ "
            stack.append((i, groups))
        elif char == ")":
            opening, groups = stack.pop()
            pairs += [(opening, i)] if groups else []
        i += 1
    return pairs


@pytest.mark.parametrize("seed", range(200))
def test_damaged_text_is_read_or_refused_never_a_crash(seed):
    rng = np.random.default_rng(seed)
    text = list(format_criterion(random_criterion(rng, depth=3)))
    for _ in range(int(rng.integers(1, 4))):
        place = int(rng.integers(len(text) + 1))
        text[place : place + int(rng.integers(2))] = str(rng.choice(list('()&|~!",.=\\ a1-\x00')))
    refusal, criterion = "", None
    try:
        criterion = parse_criterion("".join(text))
    except CriterionError as error:
        refusal = str(error)
    if criterion is None:
        assert refusal.endswith(".")
    else:
        assert parse_criterion(format_criterion(criterion)) == criterion
