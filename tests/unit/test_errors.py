# SPDX-License-Identifier: LGPL-2.1-or-later
from __future__ import annotations

import re

import pytest

from raymaps import errors


def test_all_errors_that_are_told_to_the_user_have_one_root():
    classes = [value for name in errors.__all__ if isinstance(value := getattr(errors, name), type)]
    assert {c for c in classes if not issubclass(c, errors.RayMapsError)} == {errors.Interrupted}


def test_the_tree_in_the_module_names_every_class():
    drawn = set(re.findall(r"^[\s│]+(?:[├└]── )?(\w+)  +", errors.__doc__, re.MULTILINE))
    assert drawn == {name for name in errors.__all__ if isinstance(getattr(errors, name), type)}


def test_interrupted_is_no_error_of_the_user():
    assert not issubclass(errors.Interrupted, errors.RayMapsError)


@pytest.mark.parametrize(
    ("known", "sentence"),
    [
        ((), "Unknown body 'Lid': there is none here."),
        (("Lens",), "Unknown body 'Lid'; known: 'Lens'."),
        (("Lens", "Barrel"), "Unknown body 'Lid'; known: 'Lens', 'Barrel'."),
    ],
)
def test_unknown_name_lists_the_known_ones(known, sentence):
    assert errors.unknown_name("body", "Lid", known) == sentence


def test_unknown_name_lists_at_most_twelve():
    sentence = errors.unknown_name("body", "Lid", (f"B{i}" for i in range(20)))
    assert sentence.endswith("'B11' and 8 more.")
    assert "'B12'" not in sentence
    assert "more" not in errors.unknown_name("body", "Lid", [f"B{i}" for i in range(12)])


def test_missing_package_tells_the_command():
    error = errors.MissingPackageError("pyvista", "pictures", "A picture of the scene")
    assert str(error) == (
        "A picture of the scene needs the package 'pyvista', which is not installed: run  make environment  in the "
        "source tree, or install raymaps with its extra 'pictures'."
    )
    assert isinstance(error, errors.RayMapsError)
