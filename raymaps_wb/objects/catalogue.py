# SPDX-License-Identifier: LGPL-2.1-or-later
"""The catalogue of media that comes with Ray Maps, as its files have it: each medium with the source of its figures."""

import json
import math
import os
from functools import lru_cache

from raymaps_wb.paths import MATERIAL_FOLDER

#: Yellow helium line, at which the index is told.
D_LINE_NM = 587.5618


@lru_cache(maxsize=1)
def catalogue():
    """All media by group: a dict of group, such as "Glasses", to dict of name to data as in a scene."""
    groups: dict[str, dict[str, dict]] = {}
    if not os.path.isdir(MATERIAL_FOLDER):
        return groups
    for file_name in sorted(os.listdir(MATERIAL_FOLDER)):
        if file_name.endswith(".json"):
            with open(os.path.join(MATERIAL_FOLDER, file_name), encoding="utf-8") as file:
                media = json.load(file)["media"]
            groups[os.path.splitext(file_name)[0].lstrip("0123456789_").replace("_", " ").capitalize()] = media
    return groups


def catalogue_names():
    """Names of all media, in the order of the files."""
    return tuple(name for media in catalogue().values() for name in media)


def catalogue_medium(name):
    """Data of one medium as in a scene; None if the catalogue has none of this name."""
    return next((media[name] for media in catalogue().values() if name in media), None)


def told(data):
    """What people want to know of a medium: index at the d line, what else it does, and where its figures are from."""
    nm = _near_d_line(data["refractive_index"])
    index, k = _index(data["refractive_index"], nm), _value(data.get("extinction", 0.0), nm)
    parts = []
    if index is not None:
        parts.append((f"n = {index:.3g} + {k:.3g} i" if k else f"n = {index:.4f}") + f" at {nm:.0f} nm")
    if k:
        parts.append("metal")
    if _is_above_zero(data.get("absorption_per_mm")):
        parts.append("absorbs")
    if data.get("scattering"):
        parts.append("scatters")
    return ", ".join(parts) + (f". {data['reference']}" if data.get("reference") else "")


def _is_above_zero(value):
    if isinstance(value, dict):
        return any(value.get("value", ()))
    return any(value) if isinstance(value, list) else bool(value)


def _near_d_line(index):
    """The wavelength nearest to the d line at which the index is known."""
    low, high = 0.0, math.inf
    if isinstance(index, dict) and "n" in index:
        low, high = index["wavelength_nm"][0], index["wavelength_nm"][-1]
    elif isinstance(index, dict):
        low, high = index.get("from_nm") or low, index.get("to_nm") or high
    return min(max(D_LINE_NM, low), high)


def _index(index, nm):
    """Refractive index at a wavelength; None where this can't be told. For people: the tracer has its own."""
    if not isinstance(index, dict):
        return index
    if "n" in index:
        return _interpolated(nm, index["wavelength_nm"], index["n"])
    formula = _FORMULAS.get(index["formula"])
    try:
        return formula(nm / 1000, index["coefficients"]) if formula is not None else None
    except (ValueError, ZeroDivisionError, IndexError, OverflowError):
        return None


_FORMULAS = {
    "sellmeier": lambda w, c: math.sqrt(1 + sum(b * w**2 / (w**2 - d) for b, d in zip(c[0::2], c[1::2], strict=True))),
    "schott": lambda w, c: math.sqrt(c[0] + c[1] * w**2 + sum(a * w ** (-2 * (i + 1)) for i, a in enumerate(c[2:]))),
    "cauchy": lambda w, c: sum(a * w ** (-2 * i) for i, a in enumerate(c)),
    "conrady": lambda w, c: c[0] + c[1] / w + c[2] / w**3.5,
    "power_series": lambda w, c: c[0] + sum(a * w**e for a, e in zip(c[1::2], c[2::2], strict=True)),
    "power_series_squared": lambda w, c: math.sqrt(c[0] + sum(a * w**e for a, e in zip(c[1::2], c[2::2], strict=True))),
    "gases": lambda w, c: 1 + c[0] + sum(b / (d - w**-2) for b, d in zip(c[1::2], c[2::2], strict=True)),
}


def _value(value, nm):
    """A spectral value at a wavelength; of red, green and blue the middle one."""
    if isinstance(value, dict):
        return _interpolated(nm, value["wavelength_nm"], value["value"])
    return value[1] if isinstance(value, list) else value


def _interpolated(x, xs, ys):
    if x <= xs[0] or x >= xs[-1]:
        return ys[0] if x <= xs[0] else ys[-1]
    i = next(i for i, value in enumerate(xs) if value >= x)
    return ys[i - 1] + (ys[i] - ys[i - 1]) * (x - xs[i - 1]) / (xs[i] - xs[i - 1])
