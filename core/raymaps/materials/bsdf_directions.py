# SPDX-License-Identifier: LGPL-2.1-or-later
"""Directions for which a table of scattering is given: cells of the hemisphere, or angles to interpolate between."""

from __future__ import annotations

from bisect import bisect_left, bisect_right

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from raymaps.materials.spectrum import check_ascending
from raymaps.materials.values import Number, Record

__all__ = ["BsdfAngles", "BsdfCells"]


class BsdfCells(Record):
    """Cells of directions: rings between polar angles, each cut into sectors between azimuths."""

    ring_deg: tuple[Number, ...] = Field(min_length=2, description="Borders of the rings, from 0 to 90 degrees.")
    azimuth_deg: tuple[tuple[Number, ...], ...] = Field(
        min_length=1, description="For each ring the borders of its sectors, once around: the last is the first + 360."
    )

    @model_validator(mode="after")
    def _cover_the_hemisphere(self) -> BsdfCells:
        check_ascending(self.ring_deg, "ring_deg")
        if self.ring_deg[0] != 0 or self.ring_deg[-1] != 90:
            raise ValueError(f"ring_deg must be from 0 to 90, got {self.ring_deg[0]:g} to {self.ring_deg[-1]:g}")
        if len(self.azimuth_deg) != len(self.ring_deg) - 1:
            raise ValueError(
                f"{len(self.ring_deg) - 1} rings need as many rows of azimuths, got {len(self.azimuth_deg)}"
            )
        for ring, azimuths in enumerate(self.azimuth_deg):
            check_ascending(azimuths, f"azimuth_deg of ring {ring + 1}")
            if len(azimuths) < 2 or abs(azimuths[-1] - azimuths[0] - 360) > 1e-6 or not -360 <= azimuths[0] <= 360:
                raise ValueError(f"azimuth_deg of ring {ring + 1} must go once around, from a border to that + 360")
        return self

    def __len__(self) -> int:
        return sum(len(azimuths) - 1 for azimuths in self.azimuth_deg)

    @property
    def borders_deg(self) -> NDArray[np.float64]:
        """(n_cells, 4): lower and upper polar angle, lower and upper azimuth of each cell, ring by ring."""
        return np.array(
            [
                (low, high, start, end)
                for low, high, azimuths in zip(self.ring_deg, self.ring_deg[1:], self.azimuth_deg, strict=False)
                for start, end in zip(azimuths, azimuths[1:], strict=False)
            ]
        )

    @property
    def projected_sr(self) -> NDArray[np.float64]:
        """Projected solid angle of each cell, (n_cells,): the integral of the cosine over it; pi together."""
        low, high, start, end = np.radians(self.borders_deg).T
        return (end - start) / 2 * (np.sin(high) ** 2 - np.sin(low) ** 2)

    def index(self, polar_deg: float, azimuth_deg: float) -> int:
        """The cell that holds a direction."""
        ring = min(max(bisect_right(self.ring_deg, polar_deg) - 1, 0), len(self.azimuth_deg) - 1)
        borders = self.azimuth_deg[ring]
        around = borders[0] + (azimuth_deg - borders[0]) % 360
        sector = min(bisect_right(borders, around) - 1, len(borders) - 2)
        return sum(len(azimuths) - 1 for azimuths in self.azimuth_deg[:ring]) + sector

    def weights(self, polar_deg: float, azimuth_deg: float) -> list[tuple[int, float]]:
        """The cell that holds a direction, with weight 1."""
        return [(self.index(polar_deg, azimuth_deg), 1.0)]

    def samples_deg(self) -> tuple[list[float], list[float]]:
        """Polar angles and azimuths at which something may change: those between borders."""
        return list(self.ring_deg), sorted({azimuth % 360 for ring in self.azimuth_deg for azimuth in ring})


class BsdfAngles(Record):
    """Directions between which is interpolated linearly, first in azimuth, then in polar angle; no further outside."""

    polar_deg: tuple[Number, ...] = Field(min_length=1, description="Polar angles, 0 along the normal, ascending.")
    azimuth_deg: tuple[tuple[Number, ...], ...] | None = Field(
        None, description="For each polar angle its azimuths from 0 to 360, ascending; null: azimuth does not matter."
    )

    @model_validator(mode="after")
    def _are_directions(self) -> BsdfAngles:
        check_ascending(self.polar_deg, "polar_deg")
        if self.polar_deg[0] < 0 or self.polar_deg[-1] > 90:
            raise ValueError(
                f"polar_deg must be from 0 to 90 degrees, got {self.polar_deg[0]:g} to {self.polar_deg[-1]:g}"
            )
        if self.azimuth_deg is not None:
            if len(self.azimuth_deg) != len(self.polar_deg):
                raise ValueError(
                    f"{len(self.polar_deg)} polar angles need as many rows of azimuths, got {len(self.azimuth_deg)}"
                )
            for polar, azimuths in zip(self.polar_deg, self.azimuth_deg, strict=True):
                check_ascending(azimuths, f"azimuth_deg at {polar:g} degrees")
                if not azimuths or azimuths[0] < 0 or azimuths[-1] >= 360:
                    raise ValueError(f"azimuth_deg at {polar:g} degrees must be from 0 to below 360")
        return self

    def __len__(self) -> int:
        return len(self.polar_deg) if self.azimuth_deg is None else sum(map(len, self.azimuth_deg))

    def weights(self, polar_deg: float, azimuth_deg: float) -> list[tuple[int, float]]:
        """Up to four of the directions, with weights that add up to 1."""
        polar = self.polar_deg
        upper = min(max(bisect_left(polar, polar_deg), 1), len(polar) - 1) if len(polar) > 1 else 0
        lower = max(upper - 1, 0)
        part = 0.0 if upper == lower else (polar_deg - polar[lower]) / (polar[upper] - polar[lower])
        part = min(max(part, 0.0), 1.0)
        found = [(lower, 1 - part), (upper, part)]
        if self.azimuth_deg is not None:
            found = [(i, w * v) for ring, w in found for i, v in self._around(ring, azimuth_deg)]
        return [(index, weight) for index, weight in found if weight > 0]

    def _around(self, ring: int, azimuth_deg: float) -> list[tuple[int, float]]:
        assert self.azimuth_deg is not None
        first, azimuths = sum(map(len, self.azimuth_deg[:ring])), self.azimuth_deg[ring]
        if len(azimuths) == 1:
            return [(first, 1.0)]
        after = bisect_right(azimuths, azimuth_deg % 360) % len(azimuths)
        before = after - 1 if after else len(azimuths) - 1
        part = ((azimuth_deg - azimuths[before]) % 360) / ((azimuths[after] - azimuths[before]) % 360)
        return [(first + before, 1 - part), (first + after, part)]

    def samples_deg(self) -> tuple[list[float], list[float]]:
        """Polar angles and azimuths at which something may change."""
        return list(self.polar_deg), sorted({azimuth for ring in self.azimuth_deg or () for azimuth in ring})
