# SPDX-License-Identifier: LGPL-2.1-or-later
"""Spectra and observers of the CIE, from colour-science; imported only where light is spectral."""

from __future__ import annotations

import warnings
from functools import lru_cache
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import SceneError, unknown_name

__all__ = [
    "basis_functions",
    "black_body",
    "check_illuminant",
    "illuminant",
    "illuminant_wavelengths",
    "luminous_efficacy",
    "srgb_of_wavelengths",
]

Float = NDArray[np.float64]

#: Radiation constants of Planck's law, exact since 2019 (BIPM: The International System of Units, 9th edition).
_C2_NM_K = 1.438776877e7
#: Luminous efficacy of light of 540 THz, BIPM.
_KM_LM_PER_W = 683.0
_OBSERVERS = {
    "cie_1931_2deg": "CIE 1931 2 Degree Standard Observer",
    "cie_1964_10deg": "CIE 1964 10 Degree Standard Observer",
}


@lru_cache(maxsize=1)
def _colour() -> ModuleType:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns of optional packages that are missing
        import colour
    return colour


@lru_cache(maxsize=8)
def _table(what: str, name: str) -> tuple[Float, Float]:
    """Wavelengths (n,) and values (n, n_columns) of a table of colour-science."""
    colour = _colour()
    tables = {
        "observer": colour.MSDS_CMFS,
        "illuminant": colour.SDS_ILLUMINANTS,
        "luminosity": colour.SDS_LEFS,
        "basis": {"sRGB": colour.recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019},
    }[what]
    table = tables[name]
    return np.array(table.wavelengths, np.float64), np.array(table.values, np.float64).reshape(
        len(table.wavelengths), -1
    )


def _at(nm: Float, what: str, name: str, *, clamp: bool = False) -> Float:
    """(n_columns, n) a table between its wavelengths, linear; outside zero, or its border values."""
    known_nm, values = _table(what, name)
    outside = None if clamp else 0.0
    return np.stack([np.interp(nm, known_nm, column, left=outside, right=outside) for column in values.T])


def basis_functions(nm: Float) -> Float:
    """Basis functions of red, green and blue at wavelengths, (3, n), adding up to 1; the border values outside."""
    basis = _at(np.asarray(nm, np.float64), "basis", "sRGB", clamp=True)
    return basis / basis.sum(axis=0)


def black_body(nm: Float, temperature_k: float) -> Float:
    """Relative spectral flux per nm of a black body, (n,), 1 at its largest among the wavelengths (Planck's law)."""
    exponent = _C2_NM_K / (nm * temperature_k)
    logarithm = -5 * np.log(nm) - exponent - np.log1p(-np.exp(-exponent))
    return np.exp(logarithm - logarithm.max())


def illuminant(nm: Float, name: str) -> Float:
    """Relative spectral flux per nm of a CIE illuminant (see `check_illuminant`), (n,); zero outside its table."""
    return _at(nm, "illuminant", name)[0]


def illuminant_wavelengths(name: str) -> Float:
    """Wavelengths in nm of the table of a CIE illuminant, (n,); raises `SceneError` if the name is unknown."""
    return _table("illuminant", name)[0]


def check_illuminant(name: str, where: str) -> None:
    """Refuse an illuminant that is unknown; raises `SceneError`."""
    known = _colour().SDS_ILLUMINANTS
    if name not in known:
        raise SceneError(f"{where}: {unknown_name('illuminant', name, known)}")


def luminous_efficacy(nm: Float) -> Float:
    """Luminous efficacy in lm/W at wavelengths, (n,): 683 V(lambda), photopic, CIE 1924."""
    return _KM_LM_PER_W * _at(nm, "luminosity", "CIE 1924 Photopic Standard Observer")[0]


def srgb_of_wavelengths(nm: Float, observer: str) -> Float:
    """Linear sRGB of 1 W at each wavelength, (n, 3), scaled so that a Y of the observer of 1 is one.

    Negative where a wavelength is more saturated than a primary.
    """
    xyz = _at(np.asarray(nm, np.float64), "observer", _OBSERVERS[observer])
    return np.asarray(_colour().models.RGB_COLOURSPACE_sRGB.matrix_XYZ_to_RGB @ xyz).T
