# SPDX-License-Identifier: LGPL-2.1-or-later
"""Units of the whole program: mm, nm, W, sr; degrees where people read, radians in code."""

from __future__ import annotations

import math

__all__ = ["format_bytes", "format_duration", "format_estimate", "format_quantity", "format_with_error", "prefix_of"]

#: Standard error over value above which an interval is told beside: of about 25 rays that count.
UNEVEN = 0.2
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"))


def format_quantity(value: float, unit: str, digits: int = 4) -> str:
    """A value with an SI prefix for people: ``format_quantity(0.00123, 'W')`` is ``'1.23 mW'``."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g} {unit}"
    factor, prefix = prefix_of(value)
    text = f"{value / factor:.{digits}g}"
    if "e" in text and abs(float(text)) >= 1000:  # 999,999 B to three digits is 1 MB
        factor, prefix = prefix_of(float(text) * factor)
        text = f"{value / factor:.{digits}g}"
    return f"{float(text):.0f} {prefix}{unit}" if "e" in text else f"{text} {prefix}{unit}"


def prefix_of(value: float) -> tuple[float, str]:
    """Factor and letter of the largest SI prefix that leaves at least 1 of a value; none for 0, NaN and infinity."""
    if value == 0 or not math.isfinite(value):
        return 1.0, ""
    return next((pair for pair in _PREFIXES if abs(value) >= pair[0] * 0.9999999), _PREFIXES[-1])


def format_with_error(value: float, stderr: float, unit: str = "W") -> str:
    """A value with its standard error for people, rounded alike: ``12.34 ± 0.14 mW``."""
    is_known = stderr > 0 and math.isfinite(stderr)
    largest = max(abs(value), abs(stderr)) if is_known else abs(value)
    factor, prefix = prefix_of(largest)
    value, stderr = value / factor, stderr / factor
    if not is_known:
        return f"{value:.6g} ± {stderr:g} {prefix}{unit}"
    decimals = max(0, 1 - math.floor(math.log10(stderr)))
    return f"{value:.{decimals}f} ± {stderr:.{decimals}f} {prefix}{unit}"


def format_estimate(value: float, stderr: float, interval: tuple[float, float], unit: str = "W") -> str:
    """A value with its standard error for people; where nothing counted, below what it is: ``0 W, below 30 µW (95 %)``.

    Where little counted it lies unevenly in its interval, that of `raymaps.criterion.confidence_interval`, which is
    told too.
    """
    if value == 0 and interval[1] > 0:
        return f"0 {unit}, below {format_quantity(interval[1], unit, 2)} (95 %)"
    told = format_with_error(value, stderr, unit)
    if not stderr > UNEVEN * value:
        return told
    factor, prefix = prefix_of(interval[1])
    low, high = (float(f"{end / factor:.2g}") for end in interval)
    return f"{told}, {low:g} to {high:g} {prefix}{unit} (95 %)"


def format_bytes(n_bytes: int) -> str:
    """A size for people, for instance ``12.3 MB``."""
    return format_quantity(float(n_bytes), "B", 3)


def format_duration(seconds: float) -> str:
    """A duration for people: ``0.4 s``, ``3 min 20 s``, ``2 h 5 min``."""
    if round(seconds, 1) < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest} s"
    minutes = round(seconds / 60)
    return f"{minutes // 60} h {minutes % 60} min"
