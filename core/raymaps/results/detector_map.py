# SPDX-License-Identifier: LGPL-2.1-or-later
"""The light that a rectangle registered, cell by cell."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import Area
from raymaps.results.detector_result import AreaResult
from raymaps.results.regions import cell_edges_mm

__all__ = ["DetectorMap"]

Float = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class DetectorMap(AreaResult):
    """What a rectangle registered; cells are ``(n_y, n_x)``, the first row is the lowest y.

    Irradiance is that of the region. Of the extremes those cells count whose centre lies in the region (all that
    overlap it if it holds no centre), and of each the part in the region. The extremes of many noisy cells lie below
    and above the true ones; a coarser resolution shows how much.

    Attributes
    ----------
    side : str
    width_mm, height_mm : float
        Of the whole detector.
    resolution : (n_x, n_y)
    area : Rectangle, Ellipse or None
        Region of the detector that counts, in mm from its centre.
    cell_area_mm2 : (n_y, n_x) float64
        Area of each cell in the region.
    """

    side: str
    width_mm: float
    height_mm: float
    resolution: tuple[int, int]
    area: Area | None
    cell_area_mm2: Float = field(repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.cell_area_mm2.setflags(write=False)

    @property
    def x_edges_mm(self) -> Float:
        """Borders of the cells along x, (n_x + 1,)."""
        return cell_edges_mm(self.width_mm, self.resolution[0])

    @property
    def y_edges_mm(self) -> Float:
        """Borders of the cells along y, (n_y + 1,)."""
        return cell_edges_mm(self.height_mm, self.resolution[1])

    @property
    def irradiance_w_per_mm2(self) -> Float:
        """Irradiance of each cell, (n_y, n_x); NaN outside the region."""
        return _over(self.cell_flux_w, self.cell_area_mm2)

    @property
    def illuminance_lx(self) -> Float | None:
        """Illuminance of each cell, (n_y, n_x), NaN outside the region; None of an RGB simulation."""
        return None if self.cell_flux_lm is None else _over(self.cell_flux_lm, self.cell_area_mm2) * self.units.scale

    def to_dict(self) -> dict[str, Any]:
        """The figures, as the command line and the server print them; arrays are left to `write`."""
        return {
            "detector": self.detector,
            "side": self.side,
            "resolution": list(self.resolution),
            **self.asked_keys(),
            "area": None if self.area is None else {self.area.word: list(self.area.numbers)},
            **self.radiant_keys(),
            **self.further_keys(),
        }

    def to_text(self) -> str:
        """The figures for people, a line each."""
        region = "all of it"
        if self.area is not None:
            region = f"{self.area.word} {', '.join(f'{n:g}' for n in self.area.numbers)} mm"
        n_x, n_y = self.resolution
        title = [self.detector, f"{self.side} side up to {self.max_angle_deg:g}°", *self.conditions()]
        return self.as_text(
            title,
            [
                ("region", f"{region}, {self.area_mm2:.6g} mm² in {n_x} x {n_y} cells"),
                self.flux_row(),
                ("crossings", f"{self.crossings} by {self.rays} rays"),
                *self.density_rows(),
            ],
        )

    def write(self, path: str | Path) -> Path:
        """Write a picture (``.png``), a table (``.csv``) or arrays (``.npz``); see `raymaps.results.detector_files`."""
        from raymaps.results.detector_files import write_detector_map

        return write_detector_map(self, path)


def _over(values: Float, areas_mm2: Float) -> Float:
    return np.divide(values, areas_mm2, np.full_like(values, np.nan), where=areas_mm2 > 0)
