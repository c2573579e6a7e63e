# SPDX-License-Identifier: LGPL-2.1-or-later
"""A detector's map as a file: picture, table or arrays."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from raymaps.results.files import check_suffix, new_file, write_text
from raymaps.results.regions import cell_centres_mm

if TYPE_CHECKING:
    from raymaps.results.detector import DetectorMap

__all__ = ["write_detector_map"]


def write_detector_map(detector_map: DetectorMap, path: str | Path) -> Path:
    """Write a detector's map in the format that the file's name ends in.

    ``.png``: false colours with axes in mm. ``.csv``: the figures as comments (``# name: value``), then a line a cell.
    ``.npz``: arrays for numpy, with the figures as JSON in ``figures``.

    Raises
    ------
    OutputError
        If the name ends otherwise or the file can't be written.
    MissingPackageError
        If a picture is wanted and matplotlib is not installed.
    """
    _WRITERS[check_suffix(path, tuple(_WRITERS), "A detector's map")](detector_map, Path(path))
    return Path(path)


def _write_png(detector_map: DetectorMap, path: Path) -> None:
    from raymaps.results.detector_picture import draw_detector_map

    figure = draw_detector_map(detector_map)
    with new_file(path) as making:
        figure.savefig(making, dpi=150)


def _write_csv(detector_map: DetectorMap, path: Path) -> None:
    text = io.StringIO()
    for name, value in detector_map.to_dict().items():
        text.write(f"# {name}: {json.dumps(value, ensure_ascii=False)}\r\n")
    table = csv.writer(text)
    table.writerow(
        ["x_mm", "y_mm", "area_mm2", "flux_w", "flux_stderr_w", "irradiance_w_per_mm2", "red_w", "green_w", "blue_w"]
    )
    x_mm, y_mm = np.meshgrid(cell_centres_mm(detector_map.x_edges_mm), cell_centres_mm(detector_map.y_edges_mm))
    columns = (
        x_mm,
        y_mm,
        detector_map.cell_area_mm2,
        detector_map.cell_flux_w,
        detector_map.cell_stderr_w,
        detector_map.irradiance_w_per_mm2,
        *np.moveaxis(detector_map.cell_flux_rgb_w, 2, 0),
    )
    inside = detector_map.cell_area_mm2.ravel() > 0
    table.writerows(zip(*(column.ravel()[inside].tolist() for column in columns), strict=True))
    write_text(path, text.getvalue())


def _write_npz(detector_map: DetectorMap, path: Path) -> None:
    with new_file(path) as making, making.open("wb") as stream:
        np.savez_compressed(
            stream,
            x_edges_mm=detector_map.x_edges_mm,
            y_edges_mm=detector_map.y_edges_mm,
            area_mm2=detector_map.cell_area_mm2,
            flux_w=detector_map.cell_flux_w,
            flux_stderr_w=detector_map.cell_stderr_w,
            flux_rgb_w=detector_map.cell_flux_rgb_w,
            irradiance_w_per_mm2=detector_map.irradiance_w_per_mm2,
            figures=np.array(json.dumps(detector_map.to_dict(), ensure_ascii=False)),
        )


#: Suffix to what writes it.
_WRITERS: dict[str, Callable[[DetectorMap, Path], None]] = {
    ".png": _write_png,
    ".csv": _write_csv,
    ".npz": _write_npz,
}
