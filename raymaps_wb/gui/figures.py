# SPDX-License-Identifier: LGPL-2.1-or-later
"""Figures for people, written as the command line writes them."""

import math

PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "\u00b5"), (1e-9, "n"), (1e-12, "p"))


def watts(flux_w, digits=4):
    """A flux with an SI prefix: ``watts(1e-5)`` is ``'10 µW'``."""
    if flux_w == 0 or not math.isfinite(flux_w):
        return f"{flux_w:g} W"
    factor, prefix = _prefix(flux_w)
    return f"{float(f'{flux_w / factor:.{digits}g}'):g} {prefix}W"


def watts_with_error(flux_w, stderr_w):
    """A flux with its standard error, rounded alike: ``'290.5 ± 2.8 mW'``."""
    return with_error(flux_w, stderr_w, "W")


def with_error(value, stderr, unit):
    """A quantity with its standard error, rounded alike, and an SI prefix before its unit."""
    is_known = stderr > 0 and math.isfinite(stderr)
    largest = max(abs(value), abs(stderr)) if is_known else abs(value)
    factor, prefix = _prefix(largest) if largest > 0 else (1.0, "")
    value, stderr = value / factor, stderr / factor
    if not is_known:
        return f"{value:.6g} \u00b1 {stderr:g} {prefix}{unit}"
    decimals = max(0, 1 - math.floor(math.log10(stderr)))
    return f"{value:.{decimals}f} \u00b1 {stderr:.{decimals}f} {prefix}{unit}"


def quantity(value, unit, digits=3):
    """A number and its unit with an SI prefix, as two texts: ``('6.25', 'mW')``."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}", unit
    factor, prefix = _prefix(value)
    return f"{float(f'{value / factor:.{digits}g}'):g}", prefix + unit


def _prefix(value):
    """The largest prefix that leaves at least 1 of a value."""
    return next((pair for pair in PREFIXES if abs(value) >= pair[0] * 0.9999999), PREFIXES[-1])


def count(n):
    """A whole number with narrow blanks between thousands."""
    return f"{int(n):,}".replace(",", "\u202f")


def duration(seconds):
    """A time in seconds, or minutes and seconds."""
    return f"{seconds:.1f} s" if seconds < 60 else f"{int(seconds // 60)} min {int(seconds % 60)} s"


def rough_duration(seconds):
    """A time that is foretold: two digits, in the unit that people would use."""
    for unit_s, unit in ((86_400, "d"), (3600, "h"), (60, "min")):
        if seconds >= 1.5 * unit_s:
            return f"{float(f'{seconds / unit_s:.2g}'):g} {unit}"
    return f"{float(f'{seconds:.2g}'):g} s"
