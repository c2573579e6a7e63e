# SPDX-License-Identifier: LGPL-2.1-or-later
"""The files of a portion: every column declared once, with its type, its meaning and how it is packed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from raymaps.errors import MapError, shortened
from raymaps.store.signatures import STEP_COLUMNS

__all__ = ["COLUMNS", "Column", "pack_columns", "read_columns"]

#: How a column is packed before zstd: PLAIN_DICTIONARY for few distinct values, BYTE_STREAM_SPLIT for numbers whose
#: bytes behave alike, DELTA_BINARY_PACKED for counts that climb.
_DICTIONARY, _SPLIT, _DELTA = "dictionary", "BYTE_STREAM_SPLIT", "DELTA_BINARY_PACKED"
COMPRESSION_LEVEL = 1


@dataclass(frozen=True)
class Column:
    """One column: type, packing and meaning. Type None: float32 or float64, as the map's grid needs."""

    dtype: type[np.generic] | None
    packing: str
    meaning: str


#: Most bands of wavelengths that spectra can be stored in.
MOST_BANDS = 2000

#: File name (without ``.parquet``) to its columns.
COLUMNS: dict[str, dict[str, Column]] = {
    "rays": {
        "ray": Column(np.int64, _DELTA, "ray number"),
        "signature": Column(np.uint32, _DICTIONARY, "signature, counted within the portion"),
        "wavelength_nm": Column(
            np.float32, _DICTIONARY, "wavelength that dispersion narrowed the ray to, 0 if none; only of spectral light"
        ),
    },
    "signatures": {
        "signature": Column(np.uint32, _DELTA, "signature, counted within the portion"),
        **{name: Column(dtype, _DICTIONARY, f"{name} of the step, -1 none") for name, dtype in STEP_COLUMNS.items()},
    },
    "events": {
        "ray": Column(np.int64, _DELTA, "ray number"),
        "triangle": Column(np.int32, _DICTIONARY, "triangle among those of all bodies in their order, -1 none"),
        "x_mm": Column(None, _SPLIT, "place of the event, on the map's grid"),
        "y_mm": Column(None, _SPLIT, "place of the event, on the map's grid"),
        "z_mm": Column(None, _SPLIT, "place of the event, on the map's grid"),
        "light": Column(np.uint32, _DICTIONARY, "light after the event: its row in the lights of the portion"),
    },
    "lights": {
        "light": Column(np.uint32, _DELTA, "row, counted within the portion"),
        "power": Column(np.float32, _SPLIT, "light, all bands together, relative to the ray's emission; not in RGB"),
        "lumen_per_w": Column(np.float32, _SPLIT, "luminous flux in lm per W of the emission; not in RGB"),
        "r": Column(np.float32, _SPLIT, "red: of RGB light a share of the emission, else linear sRGB"),
        "g": Column(np.float32, _SPLIT, "green"),
        "b": Column(np.float32, _SPLIT, "blue"),
        **{
            f"band_{band}": Column(np.float32, _SPLIT, f"light in band {band}, relative to the ray's emission")
            for band in range(MOST_BANDS)
        },
    },
    "crossings": {
        "ray": Column(np.int64, _DELTA, "ray number"),
        "event": Column(np.int32, _DICTIONARY, "event of the ray, counted from 0, that starts the crossing segment"),
        "detector": Column(np.int16, _DICTIONARY, "detector"),
        "x_mm": Column(np.float32, _SPLIT, "place in the detector's axes, 0 at its centre"),
        "y_mm": Column(np.float32, _SPLIT, "place in the detector's axes, 0 at its centre"),
        "angle_rad": Column(np.float32, _SPLIT, "angle to the normal: 0 head-on at the front, pi at the back"),
    },
}


def pack_columns(table: str, columns: dict[str, NDArray[Any]]) -> bytes:
    """One file of a portion, as it stands on disk; columns may be left out, their order may not change."""
    declared = {name: column for name, column in COLUMNS[table].items() if name in columns}
    assert list(columns) == list(declared)
    arrays = []
    for name, column in declared.items():
        values = columns[name] if column.dtype is None else columns[name].astype(column.dtype, copy=False)
        arrays.append(pa.array(np.ascontiguousarray(values)))
    file = pa.BufferOutputStream()
    pq.write_table(
        pa.table(arrays, names=list(declared)),
        file,
        compression="zstd",
        compression_level=COMPRESSION_LEVEL,
        use_dictionary=[name for name, column in declared.items() if column.packing == _DICTIONARY],
        column_encoding={name: c.packing for name, c in declared.items() if c.packing != _DICTIONARY},
        write_page_checksum=True,
        row_group_size=max(1, len(arrays[0])),
    )
    return file.getvalue().to_pybytes()


def read_columns(path: Path, names: tuple[str, ...] | None = None) -> dict[str, NDArray[Any]]:
    """Read columns of one file of a portion, by default all, checksums verified; the arrays are read-only.

    Raises
    ------
    MapError
        If the file is missing, cut short or damaged.
    """
    wanted = None if names is None else list(names)
    try:
        read = pq.read_table(path, columns=wanted, page_checksum_verification=True, use_threads=False)
        arrays = {name: read.column(name).to_numpy() for name in wanted or read.column_names}
    except FileNotFoundError:
        raise MapError(f"Ray Map file '{path}' is missing; {REMEDY}.") from None
    except (pa.ArrowException, OSError, KeyError, ValueError) as error:
        raise MapError(f"Ray Map file '{path}' is damaged ({_first_line(error)}); {REMEDY}.") from error
    for array in arrays.values():
        array.setflags(write=False)
    return arrays


REMEDY = "delete the folder of this portion and trace with --resume to make it anew"


def _first_line(error: Exception) -> str:
    return shortened((str(error).splitlines() or [type(error).__name__])[0], 120)
