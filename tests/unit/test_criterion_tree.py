# SPDX-License-Identifier: LGPL-2.1-or-later
from dataclasses import FrozenInstanceError

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
    all_of,
    any_of,
    bind,
    format_criterion,
    from_dict,
    parse_criterion,
    to_dict,
)
from raymaps.errors import CriterionError
from tests.criterion_maps import NAMES, scene

A, B, C, D = (From(name) for name in "ABCD")


def test_operators_build_trees():
    assert And((A, B)) == (A & B)
    assert Or((A, B)) == (A | B)
    assert Not(A) == ~A
    assert And((A, B, C)) == (A & B & C)
    assert Or((A, B, C, D)) == ((A | B) | (C | D))
    assert And((A, Or((B, C)))) == (A & (B | C))


def test_any_number_of_operands():
    assert all_of([]) == Everything()
    assert any_of([]) == Not(Everything())
    assert all_of([A]) == any_of([A]) == A
    assert all_of([A, B]) == And((A, B))
    with pytest.raises(CriterionError, match="at least two operands, got 1"):
        And((A,))


def test_criteria_are_values():
    assert len({A & B, A & B, B & A}) == 2
    with pytest.raises(FrozenInstanceError):
        A.source = "B"


def test_depth_is_limited_in_every_form():
    deepest = A
    for _ in range(MAX_DEPTH - 1):
        deepest = Not(deepest)
    assert parse_criterion(format_criterion(deepest)) == deepest
    assert from_dict(to_dict(deepest)) == deepest
    with pytest.raises(CriterionError, match="nested more than 100 deep"):
        Not(deepest)
    with pytest.raises(CriterionError, match="nested more than 100 deep"):
        from_dict({"event": "not", "operand": to_dict(deepest)})


@pytest.mark.parametrize(
    ("make", "part"),
    [
        (lambda: From(""), "name of a source"),
        (lambda: From("a\nb"), "control characters"),
        (lambda: From(3), "must be a text"),
        (lambda: Hit("Lens", ""), "name of a face"),
        (lambda: Hit("Lens", None, "teleportation"), "Unknown kind 'teleportation'; known: emission"),
        (lambda: OnSurface("black", "crossing"), "Unknown kind 'crossing'"),
        (lambda: Happened(None), "Unknown kind"),
        (lambda: InMedium("PMMA", "medium_absorption"), "known: absorption, scattering"),
        (lambda: Ended("lost"), "known: absorbed, left, killed"),
        (lambda: Crosses("S", (0, 0, 1, 1)), "must be a rectangle or an ellipse"),
        (lambda: Rectangle(0, 0, 0, 1), "needs X0 < X1"),
        (lambda: Rectangle(0, 0, float("nan"), 1), "four numbers"),
        (lambda: Ellipse(0, 0, 0, 1), "radii above 0"),
        (lambda: Ellipse(0, 0, True, 1), "four numbers"),
        (lambda: Not("true"), "operand of a criterion must be a criterion"),
        (lambda: And((A, None)), "operand of a criterion must be a criterion"),
    ],
)
def test_nothing_wrong_can_be_built(make, part):
    with pytest.raises(CriterionError, match=part) as caught:
        make()
    assert str(caught.value).endswith(".")


@pytest.mark.parametrize(
    ("data", "part"),
    [
        (None, "must be an object with the key 'event'"),
        ([], "must be an object"),
        ({}, "must be an object with the key 'event'"),
        ({"event": 3}, "must be an object with the key 'event'"),
        ({"event": "hits"}, "Unknown elementary event"),
        ({"event": "from"}, "'from' lacks the key 'source'"),
        ({"event": "from", "source": "A", "kind": "left"}, "Unknown key of 'from'"),
        ({"event": "true", "depth": 1}, "Unknown key of 'true'"),
        ({"event": "not"}, "must be an object"),
        ({"event": "not", "operands": []}, "Unknown key of 'not'"),
        ({"event": "and", "operands": {}}, "needs a list 'operands'"),
        ({"event": "or", "operands": [{"event": "true"}]}, "at least two operands"),
        ({"event": "detector", "detector": "S", "rect": [0, 0, 1]}, "list of four numbers"),
        ({"event": "detector", "detector": "S", "rect": [0, 0, 1, "1"]}, "four numbers in mm"),
        ({"event": "detector", "detector": "S", "rect": [0, 0, 1, 1], "ellipse": [0, 0, 1, 1]}, "not both"),
        ({"event": "wavelength", "low_nm": 500}, "lacks the key 'high_nm'"),
        ({"event": "wavelength", "low_nm": 500, "high_nm": True}, "two numbers in nm above 0, got True"),
        ({"event": "wavelength", "low_nm": 0, "high_nm": 5}, "two numbers in nm above 0, got 0"),
    ],
)
def test_data_is_validated(data, part):
    with pytest.raises(CriterionError, match=part) as caught:
        from_dict(data)
    assert str(caught.value).endswith(".")


def test_data_nested_deeper_than_python_can_go():
    data = {"event": "true"}
    for _ in range(100_000):
        data = {"event": "not", "operand": data}
    with pytest.raises(CriterionError, match="nested more than"):
        from_dict(data)


@pytest.mark.parametrize("area", ["rect=(-1,-1,1,1)", "ellipse=(0,0,1,1)"])
@pytest.mark.parametrize(("detector", "what"), [("Skin", "one of faces"), ("Sky", "one of the far field")])
def test_areas_are_cut_out_of_rectangles_alone(detector, what, area):
    with pytest.raises(CriterionError, match=f"Detector '{detector}' is {what}: .* leave it out."):
        bind(f"true & ~detector({detector}, {area})", NAMES, scene().detectors)
    bind(f"detector({detector})", NAMES, scene().detectors)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("from(Sun)", "Unknown source 'Sun'; known: 'LED', 'Lamp 2', 'Beam'."),
        ("hit(Lamp)", "Unknown body 'Lamp'; known: 'Lens', 'Barrel', 'Plate'."),
        ("hit(Barrel.Face2)", "Unknown face of body 'Barrel' 'Face2'; known: 'Face1'."),
        ("surface(gold)", "Unknown surface property 'gold'"),
        ("medium(water, absorption)", "Unknown medium 'water'; known: 'air', 'glass'."),
        ("detector(Eye)", "Unknown detector 'Eye'; known: 'Sensor', 'Wall', 'Skin', 'Sky'."),
        ("true | ~(true & from(Sun))", "Unknown source 'Sun'"),
    ],
)
def test_unknown_names_list_the_known_ones(text, part):
    with pytest.raises(CriterionError) as caught:
        bind(text, NAMES)
    assert part in str(caught.value)
