# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a detector registered as a file: picture, table, arrays, and the far field as a luminaire."""

from __future__ import annotations

import csv
import datetime
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import OutputError
from raymaps.results.figures import Spectrum
from raymaps.results.files import check_suffix, new_file, write_text
from raymaps.results.regions import cell_centres_mm

if TYPE_CHECKING:
    from raymaps.formats.photometry_out import Photometry
    from raymaps.results.detector_map import DetectorMap
    from raymaps.results.face_detector import FaceMap
    from raymaps.results.far_field import FarFieldMap

__all__ = ["photometry_of", "write_detector_map", "write_face_map", "write_far_field"]

Float = NDArray[np.float64]

_SUFFIXES = (".png", ".csv", ".npz")
#: Lumens that files of relative photometry are scaled to.
_RELATIVE_LM = 1000.0


def write_detector_map(detector_map: DetectorMap, path: str | Path) -> Path:
    """Write a rectangle's map in the format that the file's name ends in.

    ``.png``: false colours with axes in mm. ``.csv``: the figures as comments (``# name: value``), then a line a cell.
    ``.npz``: arrays for numpy, with the figures as JSON in ``figures``.

    Raises
    ------
    OutputError
        If the name ends otherwise or the file can't be written.
    MissingPackageError
        If a picture is wanted and matplotlib is not installed.
    """
    suffix, path, of = check_suffix(path, _SUFFIXES, "A detector's map"), Path(path), detector_map
    if suffix == ".png":
        from raymaps.results.detector_picture import draw_detector_map

        _save(draw_detector_map(of), path)
    elif suffix == ".csv":
        x_mm, y_mm = np.meshgrid(cell_centres_mm(of.x_edges_mm), cell_centres_mm(of.y_edges_mm))
        red, green, blue = np.moveaxis(of.cell_flux_rgb_w, 2, 0)
        columns = {
            "x_mm": x_mm, "y_mm": y_mm, "area_mm2": of.cell_area_mm2, "flux_w": of.cell_flux_w,
            "flux_stderr_w": of.cell_stderr_w, "irradiance_w_per_mm2": of.irradiance_w_per_mm2,
            "red_w": red, "green_w": green, "blue_w": blue,
        }  # fmt: skip
        lumens = {"flux_lm": of.cell_flux_lm, "flux_stderr_lm": of.cell_stderr_lm, "illuminance_lx": of.illuminance_lx}
        columns |= {name: values for name, values in lumens.items() if values is not None}
        inside = of.cell_area_mm2.ravel() > 0
        _write_csv(path, of.to_dict(), {name: values.ravel()[inside] for name, values in columns.items()})
    else:
        arrays = {
            "x_edges_mm": of.x_edges_mm, "y_edges_mm": of.y_edges_mm, "area_mm2": of.cell_area_mm2,
            "flux_w": of.cell_flux_w, "flux_stderr_w": of.cell_stderr_w, "flux_rgb_w": of.cell_flux_rgb_w,
            "irradiance_w_per_mm2": of.irradiance_w_per_mm2, "flux_lm": of.cell_flux_lm,
            "flux_stderr_lm": of.cell_stderr_lm, "illuminance_lx": of.illuminance_lx,
        }  # fmt: skip
        _write_npz(path, of.to_dict(), arrays, of.spectrum)
    return path


def write_face_map(face_map: FaceMap, path: str | Path) -> Path:
    """Write what faces registered: ``.png`` the faces in false colours, ``.csv`` a line a cell, ``.npz`` arrays.

    Raises as `write_detector_map`; a picture needs pyvista.
    """
    suffix, path, of = check_suffix(path, _SUFFIXES, "A detector's map"), Path(path), face_map
    centre = of.cells.corners_mm.mean(axis=1)
    lumens = {} if of.cell_flux_lm is None else {"flux_lm": of.cell_flux_lm, "flux_stderr_lm": of.cell_stderr_lm}
    if suffix == ".png":
        from raymaps.results.face_picture import draw_face_map

        _save(draw_face_map(of), path)
    elif suffix == ".csv":
        columns: dict[str, Any] = {
            "face": of.cell_face, "triangle": of.cells.triangle, "x_mm": centre[:, 0], "y_mm": centre[:, 1],
            "z_mm": centre[:, 2], "area_mm2": of.cells.area_mm2, "flux_w": of.cell_flux_w,
            "flux_stderr_w": of.cell_stderr_w, "irradiance_w_per_mm2": of.irradiance_w_per_mm2,
            "patch": of.cells.patch, **lumens,
        }  # fmt: skip
        _write_csv(path, of.to_dict(), columns)
    else:
        arrays = {
            "triangle": of.cells.triangle, "corners_mm": of.cells.corners_mm, "area_mm2": of.cells.area_mm2,
            "patch": of.cells.patch, "flux_w": of.cell_flux_w, "flux_stderr_w": of.cell_stderr_w,
            "flux_rgb_w": of.cell_flux_rgb_w, "irradiance_w_per_mm2": of.irradiance_w_per_mm2, **lumens,
        }  # fmt: skip
        _write_npz(path, of.to_dict(), arrays, of.spectrum)
    return path


def write_far_field(far_field: FarFieldMap, path: str | Path) -> Path:
    """Write a far field: ``.png`` a polar diagram and a map, ``.csv`` a line a direction, ``.npz`` arrays, ``.ies``
    LM-63-2002, ``.ldt`` EULUMDAT.

    The two formats of luminaires hold candela: absolute ones of a spectral simulation; of one in red, green and blue
    relative ones, for 1000 lm emitted, as if every watt were worth the same lumens; a remark in the file says so.

    Raises as `write_detector_map`; `OutputError` also for a luminaire without light.
    """
    suffix = check_suffix(path, (*_SUFFIXES, ".ies", ".ldt"), "A far field")
    path, of = Path(path), far_field
    c_deg, gamma_deg = np.meshgrid(of.c_deg, of.gamma_deg, indexing="ij")
    values = {
        "solid_angle_sr": of.solid_angle_sr, "flux_w": of.flux_of_cell_w, "flux_stderr_w": of.stderr_of_cell_w,
        "intensity_w_per_sr": of.intensity_w_per_sr, "intensity_stderr_w_per_sr": of.intensity_stderr_w_per_sr,
        "intensity_cd": of.intensity_cd, "intensity_stderr_cd": of.intensity_stderr_cd,
    }  # fmt: skip
    if suffix == ".png":
        from raymaps.results.far_field_picture import draw_far_field

        _save(draw_far_field(of), path)
    elif suffix == ".csv":
        told = {name: array.ravel() for name, array in values.items() if array is not None}
        _write_csv(path, of.to_dict(), {"c_deg": c_deg.ravel(), "gamma_deg": gamma_deg.ravel(), **told})
    elif suffix == ".npz":
        _write_npz(path, of.to_dict(), {"c_deg": of.c_deg, "gamma_deg": of.gamma_deg, **values}, of.spectrum)
    else:
        from raymaps.formats.photometry_out import eulumdat_text, ies_text

        write_text(path, (ies_text if suffix == ".ies" else eulumdat_text)(photometry_of(of)))
    return path


def photometry_of(of: FarFieldMap) -> Photometry:
    """A far field as what files of luminaires hold; raises `OutputError` if nothing shines."""
    from raymaps.formats.photometry_out import Photometry

    if not (of.max_w_per_sr.value > 0 and of.emitted_w > 0):
        raise OutputError(f"Far field '{of.detector}': no light left in any direction: there is no luminaire to write.")
    conditions = [f"Ray Maps: {', '.join(of.conditions())}"] if of.conditions() else []
    conditions += [f"simulated without {', '.join(of.without)}"] if of.without else []
    date = datetime.date.today().isoformat()
    if of.flux_lm is not None and of.intensity_cd is not None:
        if not of.flux_lm.value > 0:
            raise OutputError(
                f"Far field '{of.detector}': the light that left is invisible: there are no lumens to write."
            )
        remarks = (f"absolute photometry of {of.rays} rays", *conditions)
        candela = np.maximum(np.nan_to_num(of.intensity_cd), 0.0)
        return Photometry(of.detector, candela, of.flux_lm.value, None, date, remarks)
    scale = _RELATIVE_LM / of.emitted_w
    remark = f"relative photometry of {of.rays} rays: {of.emitted_w:.6g} W emitted count as {_RELATIVE_LM:g} lm"
    candela = np.maximum(np.nan_to_num(of.intensity_w_per_sr), 0.0) * scale
    return Photometry(of.detector, candela, of.flux_w.value * scale, _RELATIVE_LM, date, (remark, *conditions))


def _save(figure: Any, path: Path) -> None:
    with new_file(path) as making:
        figure.savefig(making, dpi=150)


def _write_csv(path: Path, figures: dict[str, Any], columns: dict[str, Sequence[Any] | NDArray[Any]]) -> None:
    text = io.StringIO()
    for name, value in figures.items():
        text.write(f"# {name}: {json.dumps(value, ensure_ascii=False)}\r\n")
    table = csv.writer(text)
    table.writerow(columns)
    rows = (values.tolist() if isinstance(values, np.ndarray) else values for values in columns.values())
    table.writerows(zip(*rows, strict=True))
    write_text(path, text.getvalue())


def _write_npz(path: Path, figures: dict[str, Any], arrays: dict[str, Any], spectrum: Spectrum | None) -> None:
    told = {name: values for name, values in arrays.items() if values is not None}
    if spectrum is not None:
        told |= {
            "spectrum_low_nm": spectrum.low_nm, "spectrum_high_nm": spectrum.high_nm,
            "spectrum_flux_w": spectrum.flux_w, "spectrum_flux_stderr_w": spectrum.stderr_w,
        }  # fmt: skip
    with new_file(path) as making, making.open("wb") as stream:
        np.savez_compressed(stream, figures=np.array(json.dumps(figures, ensure_ascii=False)), **told)
