# SPDX-License-Identifier: LGPL-2.1-or-later
from __future__ import annotations

import math

import pytest

from raymaps.units import format_bytes, format_duration, format_quantity, format_with_error


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0 W"), (1.0, "1 W"), (0.00123, "1.23 mW"), (-0.00123, "-1.23 mW"), (12345.0, "12.35 kW"), (4e6, "4 MW"),
        (7.5e9, "7.5 GW"), (2.5e-6, "2.5 µW"), (3e-9, "3 nW"), (3e-12, "3 pW"), (0.001, "1 mW"), (1000.0, "1 kW"),
        (999.99, "1000 W"), (math.nan, "nan W"),
    ],
)  # fmt: skip
def test_quantity(value, text):
    assert format_quantity(value, "W") == text


def test_quantity_below_the_smallest_prefix_stays_right():
    text = format_quantity(2.5e-15, "W")
    number, unit = text.split(" ")
    assert float(number) * {"W": 1, "pW": 1e-12, "fW": 1e-15}[unit] == pytest.approx(2.5e-15)


def test_digits():
    assert format_quantity(1234.567, "W", 2) == "1.2 kW"


@pytest.mark.parametrize(
    ("flux_w", "stderr_w", "text"),
    [
        (0.0123, 0.00014, "12.30 ± 0.14 mW"),
        (1.0, 0.1234, "1.00 ± 0.12 W"),
        (1.0, 0.0, "1 ± 0 W"),
        (0.0, 0.0, "0 ± 0 W"),
        (0.0, 2.5e-6, "0.0 ± 2.5 µW"),
        (1234.0, 150.0, "1.23 ± 0.15 kW"),
        (250.0, 37.0, "250 ± 37 W"),
        (1.0, math.inf, "1 ± inf W"),
        (math.nan, math.nan, "nan ± nan W"),
    ],
)
def test_flux_and_its_error_have_one_unit_and_are_rounded_alike(flux_w, stderr_w, text):
    assert format_with_error(flux_w, stderr_w) == text


@pytest.mark.parametrize("value", [1.37e-4, 0.137, 137.0, 99.9e3, 0.0995])
@pytest.mark.parametrize("digits", [2, 3, 4])
def test_quantities_are_never_shown_with_an_exponent(value, digits):
    assert "e" not in format_quantity(value, "W", digits)


@pytest.mark.parametrize(
    ("n", "text"), [(0, "0 B"), (999, "999 B"), (1536, "1.54 kB"), (999_999, "1 MB"), (12_300_000, "12.3 MB")]
)
def test_bytes(n, text):
    assert format_bytes(n) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0, "0.0 s"), (0.42, "0.4 s"), (59.9, "59.9 s"), (60, "1 min 0 s"), (200, "3 min 20 s"), (7500, "2 h 5 min"),
     (3599.7, "1 h 0 min"), (3600, "1 h 0 min")],
)  # fmt: skip
def test_duration(seconds, text):
    assert format_duration(seconds) == text


def test_duration_never_shows_sixty_seconds():
    assert all("60" not in format_duration(59.9 + i / 100) for i in range(20))
