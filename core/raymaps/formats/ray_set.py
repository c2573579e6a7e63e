# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays of a source as arrays, as ray files hold them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError

__all__ = ["RaySet", "Spectrum"]

#: How far the length of a direction may be from 1: files hold single precision, or a few digits.
LENGTH_TOLERANCE = 1e-3
FARTHEST_MM = 1e9
#: Wavelengths that sources of light have, in nm; others are a mistake of unit.
SHORTEST_NM, LONGEST_NM = 100.0, 20_000.0

#: Wavelengths in nm, climbing, and relative flux per nm.
Spectrum = tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True, eq=False)
class RaySet:
    """Rays of a source. Their colour is told by at most one of wavelength, light, and spectrum.

    Attributes
    ----------
    position_mm : (n, 3) float32 or float64
    direction : (n, 3) float32 or float64
        Unit vectors to within a thousandth.
    power : (n,) float32 or float64
        Relative flux; 0 or more, above 0 somewhere.
    wavelength_nm : (n,) float32 or float64, optional
    light : (n, n_bands) float32, optional
        Relative flux in each of ``bands_nm``, or in red, green and blue.
    bands_nm : (n_bands, 2) float64, optional
        Borders of the bands of ``light``.
    spectrum : (n,) int32, optional
        Which of ``spectra`` each ray has.
    spectra : tuple of Spectrum

    Raises
    ------
    FormatError
        If the arrays do not fit each other or hold what rays can't have.
    """

    position_mm: NDArray[np.floating]
    direction: NDArray[np.floating]
    power: NDArray[np.floating]
    wavelength_nm: NDArray[np.floating] | None = None
    light: NDArray[np.float32] | None = None
    bands_nm: NDArray[np.float64] | None = None
    spectrum: NDArray[np.int32] | None = None
    spectra: tuple[Spectrum, ...] = ()
    where: str = field(default="Ray set", repr=False)

    def __post_init__(self) -> None:
        n = len(self.position_mm)
        if not n:
            raise FormatError(f"{self.where} holds no ray.")
        bands = 3 if self.bands_nm is None else len(self.bands_nm)
        shapes = {
            "position_mm": (n, 3), "direction": (n, 3), "power": (n,), "wavelength_nm": (n,), "light": (n, bands),
            "spectrum": (n,),
        }  # fmt: skip
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array is not None and array.shape != shape:
                raise FormatError(f"{self.where}: {name} has the shape {array.shape}, not {shape}.")
        if sum(value is not None for value in (self.wavelength_nm, self.light, self.spectrum)) > 1:
            raise FormatError(f"{self.where} tells the colour of its rays twice.")
        self._check_rays()
        self._check_colours()
        for name in (*shapes, "bands_nm"):
            if (array := getattr(self, name)) is not None:
                array.setflags(write=False)

    def _refuse(self, bad: NDArray[np.bool_], what: str, values: NDArray[Any]) -> None:
        """Raise `FormatError` about the first ray that is bad."""
        if bad.any():
            ray = int(np.argmax(bad))
            given = ", ".join(f"{value:g}" for value in np.atleast_1d(values[ray]))
            raise FormatError(f"{self.where}, ray {ray + 1}: {what}, got {given}.")

    def _check_rays(self) -> None:
        far = ~(np.abs(self.position_mm) <= FARTHEST_MM).all(axis=1)
        self._refuse(far, f"its place must be finite and within {FARTHEST_MM:g} mm", self.position_mm)
        length = np.sqrt(np.einsum("ij,ij->i", self.direction, self.direction))
        self._refuse(~(np.abs(length - 1) <= LENGTH_TOLERANCE), "its direction must be of length 1", self.direction)
        self._refuse(~((self.power >= 0) & (self.power < 1e30)), "its flux must be finite and 0 or more", self.power)
        if not self.power.any():
            raise FormatError(f"{self.where}: no ray has a flux above 0.")

    def _check_colours(self) -> None:
        if self.wavelength_nm is not None:
            fine = (self.wavelength_nm >= SHORTEST_NM) & (self.wavelength_nm <= LONGEST_NM)
            what = f"its wavelength must be from {SHORTEST_NM:g} to {LONGEST_NM:g} nm"
            self._refuse(~fine, what, self.wavelength_nm)
        if self.light is not None:
            fine = ((self.light >= 0) & (self.light < 1e30)).all(axis=1) & (self.light.any(axis=1) | (self.power == 0))
            self._refuse(~fine, "its light by band must be finite, 0 or more, and above 0 somewhere", self.light)
        if self.bands_nm is not None and not (
            self.light is not None and (self.bands_nm[:, 0] <= self.bands_nm[:, 1]).all() and (self.bands_nm > 0).all()
        ):
            raise FormatError(f"{self.where}: its bands of wavelengths are no bands.")
        if self.spectrum is not None:
            unknown = (self.spectrum < 0) | (self.spectrum >= len(self.spectra))
            self._refuse(unknown, f"its spectrum must be one of {len(self.spectra)}, counted from 0", self.spectrum)
        for i, (nm, value) in enumerate(self.spectra, 1):
            sound = len(nm) == len(value) >= 2 and bool((np.diff(nm) > 0).all())
            sound = sound and nm[0] >= SHORTEST_NM and nm[-1] <= LONGEST_NM
            if not (sound and np.isfinite(value).all() and min(value) >= 0 and max(value) > 0):
                raise FormatError(
                    f"{self.where}, spectrum {i}: two or more climbing wavelengths from {SHORTEST_NM:g} to "
                    f"{LONGEST_NM:g} nm with values of 0 or more are needed."
                )

    def __len__(self) -> int:
        return len(self.position_mm)

    @property
    def is_coloured(self) -> bool:
        """Whether the rays say which colour they have."""
        return self.wavelength_nm is not None or self.light is not None or self.spectrum is not None

    @cached_property
    def box_mm(self) -> NDArray[np.float64]:
        """Lowest and highest coordinates of all places, (2, 3)."""
        return np.stack([self.position_mm.min(axis=0), self.position_mm.max(axis=0)]).astype(np.float64)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything that the rays are."""
        digest = hashlib.sha256()
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                little = np.ascontiguousarray(value, value.dtype.newbyteorder("<"))
                digest.update(f"{item.name} {little.dtype.str} {little.shape}".encode())
                digest.update(little.data)
            elif item.name == "spectra":
                digest.update(repr(value).encode())
        return digest.hexdigest()
