# SPDX-License-Identifier: LGPL-2.1-or-later
"""Ray files IES TM-25 of 2013 (.TM25RAY), binary, little-endian: places in mm, directions, and flux of rays.

A header of 256 bytes, eight flags that say what is known of rays, nine texts, spectra, labels and a text come first,
then the rays, each a run of float32 in the order: place, direction, radiant flux, wavelength, luminous flux (the
tristimulus value Y), three Stokes parameters and three numbers of the polarisation ellipse, tristimulus values X and Z,
number of the spectrum, and whatever the maker adds. Polarisation and additions are passed over.

References
----------
IES TM-25-13: Ray File Format for the Description of the Emission Properties of Light Sources, section 4.7.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError
from raymaps.formats.ray_set import RaySet, Spectrum

__all__ = ["HEADER", "MAGIC", "read_tm25"]

MAGIC = b"TM25"
VERSION = 2013
#: Sections 4.7.1 and 4.7.2, and the nine texts of 1000 characters of 4 bytes of section 4.7.3.
HEADER = np.dtype(
    [
        ("magic", "S4"), ("version", "<i4"), ("creation", "<i4"), ("luminous_flux", "<f4"), ("radiant_flux", "<f4"),
        ("rays", "<u8"), ("date", "S28"), ("start_position", "<i4"), ("spectral_kind", "<i4"), ("wavelength_nm", "<f4"),
        ("shortest_nm", "<f4"), ("longest_nm", "<f4"), ("spectra", "<i4"), ("additional", "<i4"), ("text_bytes", "<i4"),
        ("reserved", "V168"), ("flags", "<i4", 8), ("texts", "V36000"),
    ]
)  # fmt: skip
#: Bytes of the label of an additional item, and the multiple that spectra fill up to.
_LABEL_BYTES, _BLOCK_BYTES = 512, 32
MOST_SPECTRA, MOST_POINTS, MOST_ADDITIONAL = 100_000, 1_000_000, 1000
#: Linear sRGB of CIE XYZ (IEC 61966-2-1:1999).
_RGB_OF_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])


def read_tm25(path: Path) -> RaySet:
    """Read a TM-25 ray file; raises `FormatError`."""
    size = os.path.getsize(path)
    if size < HEADER.itemsize:
        raise FormatError(f"TM-25 file '{path}' is cut short: {size} bytes do not hold its header.")
    with open(path, "rb") as file:
        header = np.fromfile(file, HEADER, 1)[0]
        _check_header(header, path)
        spectra = _read_spectra(file, int(header["spectra"]), path)
        start = file.tell()
    start += _LABEL_BYTES * int(header["additional"]) + int(header["text_bytes"])
    columns = _columns(header)
    n, width = int(header["rays"]), len(columns) + int(header["additional"])
    if start + 4 * width * n != size:
        what = "cut short" if start + 4 * width * n > size else "longer than its rays"
        raise FormatError(
            f"TM-25 file '{path}' is {what}: {n} rays of {4 * width} bytes from byte {start} on make "
            f"{start + 4 * width * n} bytes, it has {size}."
        )
    rays = np.fromfile(path, "<f4", offset=start).reshape(n, width)
    return _ray_set({name: rays[:, i] for i, name in enumerate(columns)}, header, spectra, path)


def _check_header(header: Any, path: Path) -> None:
    """Refuse what is not TM-25, not of 2013, or contradicts itself."""

    def refuse(what: str) -> None:
        raise FormatError(f"TM-25 file '{path}': {what}.")

    if header["magic"] != MAGIC:
        refuse("it does not begin with TM25")
    if header["version"] != VERSION:
        refuse(f"its version is {header['version']}; version {VERSION} is read")
    limits = {"spectra": MOST_SPECTRA, "additional": MOST_ADDITIONAL, "text_bytes": 2**30, "spectral_kind": 4}
    for name, most in limits.items():
        if not 0 <= header[name] <= most:
            refuse(f"header field {name} must be from 0 to {most}, got {header[name]}")
    if not 0 < header["rays"] < 2**40:
        refuse(f"its number of rays must be above 0 and below 2^40, got {header['rays']}")
    flags = header["flags"]
    if not np.isin(flags, (0, 1)).all() or not flags[:2].all():
        refuse(f"its flags of what is known must be 0 or 1, those of place and direction 1, got {flags.tolist()}")
    if not (flags[2] or flags[4]):
        refuse("it tells neither the radiant nor the luminous flux of its rays")
    kind = header["spectral_kind"]
    if kind == 2 and not flags[3]:
        refuse("its rays are to have wavelengths of their own, but its flags say that none are known")
    if kind == 1 and not header["wavelength_nm"] > 0:
        refuse(f"its single wavelength must be above 0 nm, got {header['wavelength_nm']:g}")
    if (kind == 4) != bool(flags[7]) or (kind in (3, 4) and header["spectra"] < 1):
        refuse(f"its {header['spectra']} spectra and its flags do not fit its kind {kind} of spectral data")
    if flags[6] and not flags[4]:
        refuse("it has tristimulus values X and Z without luminous flux")


def _read_spectra(file: Any, n: int, path: Path) -> tuple[Spectrum, ...]:
    """The spectra that follow the header, padding passed over."""
    spectra = []
    at = file.tell()
    for i in range(1, n + 1):
        count = np.fromfile(file, "<i4", 1)
        if not len(count) or not 1 <= count[0] <= MOST_POINTS:
            raise FormatError(
                f"TM-25 file '{path}', spectrum {i}: its number of points must be from 1 to {MOST_POINTS}, got "
                f"{count[0] if len(count) else 'the end of the file'}."
            )
        pairs = np.fromfile(file, "<f4", 2 * int(count[0]))
        if len(pairs) < 2 * count[0]:
            raise FormatError(f"TM-25 file '{path}' is cut short in its spectrum {i}.")
        nm, value = pairs[::2].astype(np.float64), pairs[1::2].astype(np.float64)
        spectra.append((tuple(nm.tolist()), tuple(value.tolist())))
    file.seek(-(file.tell() - at) % _BLOCK_BYTES, os.SEEK_CUR)
    return tuple(spectra)


def _columns(header: Any) -> list[str]:
    """Names of the float32 of a ray, without additional ones."""
    _, _, radiant, wavelength, luminous, stokes, tristimulus, spectrum = (bool(flag) for flag in header["flags"])
    return [
        *("x", "y", "z", "kx", "ky", "kz"),
        *(["radiant_flux"] if radiant else []),
        *(["wavelength_nm"] if wavelength else []),
        *(["luminous_flux"] if luminous else []),
        *(["s1", "s2", "s3", "ellipse_x", "ellipse_y", "ellipse_z"] if stokes else []),
        *(["tristimulus_x", "tristimulus_z"] if tristimulus else []),
        *(["spectrum"] if spectrum else []),
    ]


def _ray_set(rays: dict[str, NDArray[np.float32]], header: Any, spectra: tuple[Spectrum, ...], path: Path) -> RaySet:
    power = rays["radiant_flux"] if "radiant_flux" in rays else rays["luminous_flux"]
    kind = int(header["spectral_kind"])
    colour: dict[str, Any] = {}
    if kind == 1:
        colour["wavelength_nm"] = np.full(len(power), header["wavelength_nm"], np.float32)
    elif kind == 2:
        colour["wavelength_nm"] = rays["wavelength_nm"].copy()
    elif kind == 3:
        colour |= {"spectrum": np.zeros(len(power), np.int32), "spectra": spectra[:1]}
    elif kind == 4:
        number = rays["spectrum"]
        sound = (number >= 1) & (number <= len(spectra)) & (number == np.round(number))
        if not sound.all():
            first = int(np.argmin(sound))
            raise FormatError(
                f"TM-25 file '{path}', ray {first + 1}: its spectrum must be a whole number from 1 to {len(spectra)}, "
                f"got {number[first]:g}."
            )
        colour |= {"spectrum": number.astype(np.int32) - 1, "spectra": spectra}
    elif "tristimulus_x" in rays:
        xyz = np.stack([rays["tristimulus_x"], rays["luminous_flux"], rays["tristimulus_z"]], axis=1)
        colour["light"] = np.maximum(xyz @ _RGB_OF_XYZ.T, 0.0).astype(np.float32)
        if "radiant_flux" not in rays:  # colours and their sum stand for the flux, as everywhere without spectra
            power = np.where(np.isfinite(xyz).all(axis=1), colour["light"].sum(axis=1), np.nan)
    return RaySet(
        np.stack([rays["x"], rays["y"], rays["z"]], axis=1),
        np.stack([rays["kx"], rays["ky"], rays["kz"]], axis=1),
        np.array(power, np.float32),
        **colour,
        where=f"TM-25 file '{path}'",
    )
