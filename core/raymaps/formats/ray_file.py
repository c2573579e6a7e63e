# SPDX-License-Identifier: LGPL-2.1-or-later
"""Ray files: those of others, told apart by what they hold, and our own.

Our own is a Parquet file with a row a ray: ``x_mm y_mm z_mm kx ky kz power``, and ``wavelength_nm``, ``spectrum``, or
``light_0 light_1 ...`` where their colour is known. Spectra and bands stand in its metadata.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError, OutputError
from raymaps.formats.ray_set import RaySet
from raymaps.formats.tm25 import MAGIC as TM25_MAGIC
from raymaps.formats.tm25 import read_tm25
from raymaps.formats.zemax_dat import IDENTIFIERS, read_zemax_dat, read_zemax_text

__all__ = ["keeps_spectra", "read_rays", "write_rays"]

_FORMAT, _VERSION = "raymaps-rays", 1
_PARQUET_MAGIC = b"PAR1"
_PLACE, _DIRECTION = ("x_mm", "y_mm", "z_mm"), ("kx", "ky", "kz")


def read_rays(path: Path) -> RaySet:
    """Read a ray file: IES TM-25, Zemax source file, or our own.

    Raises
    ------
    FormatError
        If the file can't be read, is damaged, or is of another format.
    """
    try:
        with open(path, "rb") as file:
            start = file.read(4)
        if not start:
            raise FormatError(f"Ray file '{path}' is empty.")
        if start == TM25_MAGIC:
            return read_tm25(path)
        if start == _PARQUET_MAGIC:
            return _read_own(path)
        if int.from_bytes(start, "little") in IDENTIFIERS:
            return read_zemax_dat(path)
        return read_zemax_text(path)
    except FileNotFoundError:
        raise FormatError(f"Ray file '{path}': there is no such file.") from None
    except OSError as error:
        raise FormatError(f"Ray file '{path}' can't be read: {(error.strerror or str(error)).lower()}.") from error
    except MemoryError:
        raise FormatError(f"Ray file '{path}' is larger than this machine's memory.") from None


def keeps_spectra(path: Path) -> bool:
    """Whether a file is one of our own whose rays have spectra; False of a file that can't be read."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with open(path, "rb") as file:
            if file.read(4) != _PARQUET_MAGIC:
                return False
        about = json.loads((pq.read_schema(path).metadata or {}).get(_FORMAT.encode(), b"null"))
    except (pa.ArrowException, OSError, ValueError):
        return False
    return isinstance(about, dict) and about.get("bands_nm") is not None


def write_rays(path: Path, rays: RaySet) -> None:
    """Write rays in our own form, exactly; raises `OutputError`."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns: dict[str, NDArray[Any]] = {name: rays.position_mm[:, i] for i, name in enumerate(_PLACE)}
    columns |= {name: rays.direction[:, i] for i, name in enumerate(_DIRECTION)}
    columns["power"] = rays.power
    if rays.wavelength_nm is not None:
        columns["wavelength_nm"] = rays.wavelength_nm
    if rays.spectrum is not None:
        columns["spectrum"] = rays.spectrum
    if rays.light is not None:
        columns |= {f"light_{i}": rays.light[:, i] for i in range(rays.light.shape[1])}
    about = {
        "format": _FORMAT, "version": _VERSION, "spectra": rays.spectra,
        "bands_nm": None if rays.bands_nm is None else rays.bands_nm.tolist(),
    }  # fmt: skip
    table = pa.table({name: pa.array(np.ascontiguousarray(values)) for name, values in columns.items()})
    table = table.replace_schema_metadata({_FORMAT: json.dumps(about)})
    split = {name: "BYTE_STREAM_SPLIT" for name in columns if name != "spectrum"}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(
            table, path, compression="zstd", compression_level=1, use_dictionary=["spectrum"], column_encoding=split,
            write_page_checksum=True,
        )  # fmt: skip
    except OSError as error:
        raise OutputError(f"Ray file '{path}' can't be written: {(error.strerror or str(error)).lower()}.") from error


def _read_own(path: Path) -> RaySet:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path, page_checksum_verification=True)
        about = json.loads((table.schema.metadata or {}).get(_FORMAT.encode(), b"null"))
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = (str(error).splitlines() or ["unreadable"])[0][:120]
        raise FormatError(f"Ray file '{path}' is damaged ({reason}).") from error
    if not isinstance(about, dict) or about.get("format") != _FORMAT:
        raise FormatError(f"Ray file '{path}' is a Parquet file, but not one of rays.")
    if about.get("version") != _VERSION:
        raise FormatError(
            f"Ray file '{path}' has version {str(about.get('version'))[:20]}, this program reads version {_VERSION}: "
            "update Ray Maps."
        )
    columns = {name: table.column(name) for name in table.column_names}
    light_names = [f"light_{i}" for i in range(sum(name.startswith("light_") for name in columns))]
    try:
        for name, column in columns.items():
            if column.null_count or not (pa.types.is_floating(column.type) or name == "spectrum"):
                raise FormatError(f"Ray file '{path}': its column {name} must hold numbers.")
        arrays = {name: column.to_numpy() for name, column in columns.items()}
        bands = about["bands_nm"]
        return RaySet(
            np.stack([arrays[name] for name in _PLACE], axis=1),
            np.stack([arrays[name] for name in _DIRECTION], axis=1),
            arrays["power"].copy(),
            wavelength_nm=arrays["wavelength_nm"].copy() if "wavelength_nm" in arrays else None,
            light=np.stack([arrays[name] for name in light_names], axis=1) if light_names else None,
            bands_nm=None if bands is None else np.array(bands, np.float64).reshape(-1, 2),
            spectrum=arrays["spectrum"].astype(np.int32) if "spectrum" in arrays else None,
            spectra=tuple((tuple(map(float, nm)), tuple(map(float, value))) for nm, value in about["spectra"]),
            where=f"Ray file '{path}'",
        )
    except KeyError as error:
        raise FormatError(f"Ray file '{path}' has no {error}.") from None
    except (TypeError, ValueError) as error:
        raise FormatError(f"Ray file '{path}' has damaged metadata or columns.") from error
