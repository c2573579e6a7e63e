# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tables of measured scattering, as `raymaps.formats` reads them from files.

Directions are those in which light travels. Polar angles count from the normal on the side where the light is.
Azimuths count around the outward normal, counter-clockwise as seen from the front, on both sides alike: so light that
is reflected specularly, or goes straight on, keeps its azimuth.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, ValidationInfo, model_validator

from raymaps.formats.bsdf_files import read_bsdf
from raymaps.materials.spectrum import LONGEST_NM, SHORTEST_NM, SpectrumTable, check_ascending
from raymaps.materials.values import NonNegative, Number, Record, Share, Vector, file_content, nonzero

__all__ = ["BsdfAngles", "BsdfCells", "BsdfFile", "BsdfLobe", "BsdfTable", "BsdfTableOrFile"]

#: How far rounding may carry the light that goes on past the light that comes.
ROUNDING = 1e-6

Outside = Literal["refuse", "clamp"]
Direction = Annotated[Vector, AfterValidator(nonzero)]
X_AXIS = (1.0, 0.0, 0.0)


class BsdfFile(Record):
    """A file with a BSDF: own CSV, Klems XML of WINDOW, or ASTM E1392; it becomes a table when the scene is read."""

    file: str = Field(min_length=1, description="CSV, XML or ASTM file, relative to the scene file.")
    spectrum: Literal["visible", "solar"] = Field("visible", description="Which of the integrals of a Klems file.")
    outside: Outside = Field("refuse", description="What holds outside the wavelengths of the table.")
    x_axis: Direction = Field(X_AXIS, description="Where azimuth 0 of an anisotropic table points to.")


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
        ring = min(max(int(np.searchsorted(self.ring_deg, polar_deg, side="right")) - 1, 0), len(self.azimuth_deg) - 1)
        borders = self.azimuth_deg[ring]
        around = borders[0] + (azimuth_deg - borders[0]) % 360
        sector = min(int(np.searchsorted(borders, around, side="right")) - 1, len(borders) - 2)
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
        upper = min(max(int(np.searchsorted(polar, polar_deg)), 1), len(polar) - 1) if len(polar) > 1 else 0
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
        after = int(np.searchsorted(azimuths, azimuth_deg % 360, side="right")) % len(azimuths)
        before = after - 1 if after else len(azimuths) - 1
        part = ((azimuth_deg - azimuths[before]) % 360) / ((azimuths[after] - azimuths[before]) % 360)
        return [(first + before, 1 - part), (first + after, part)]

    def samples_deg(self) -> tuple[list[float], list[float]]:
        """Polar angles and azimuths at which something may change."""
        return list(self.polar_deg), sorted({azimuth for ring in self.azimuth_deg or () for azimuth in ring})


def _form(value: Any) -> str:
    return "table" if isinstance(value, BsdfCells) or (isinstance(value, dict) and "ring_deg" in value) else "angles"


class BsdfLobe(Record):
    """Light that comes from one side and goes on to one side: a specular share, and a table of the diffuse BSDF.

    The BSDF is constant over cells of outgoing directions. It is given for incoming *angles*, between which is
    interpolated linearly (then azimuths of outgoing directions count from that of the incoming one, so 0 is where
    specular light goes on to), or for incoming *cells*, over which it is constant (then all azimuths count from the
    x axis of the table).
    """

    comes_from: Literal["front", "back"]
    goes_to: Literal["reflection", "transmission"]
    incoming: Annotated[Annotated[BsdfAngles, Tag("angles")] | Annotated[BsdfCells, Tag("table")], Discriminator(_form)]
    outgoing: tuple[BsdfCells, ...] = Field(
        min_length=1, description="Cells for each incoming direction, or one set of cells for all of them."
    )
    value: tuple[tuple[tuple[NonNegative, ...], ...], ...] = Field(
        min_length=1,
        description="BSDF in 1/sr: for each wavelength, each of red, green and blue, or once for all light; then for "
        "each incoming direction; then for each of its outgoing cells.",
    )
    specular: tuple[tuple[Share, ...], ...] | None = Field(
        None,
        description="Share of light that goes on specularly beside: rows as of value, for each incoming direction.",
    )

    @model_validator(mode="after")
    def _is_a_table(self) -> BsdfLobe:
        n = len(self.incoming)
        if len(self.outgoing) not in (1, n):
            raise ValueError(f"{n} incoming directions need 1 or {n} sets of outgoing cells, got {len(self.outgoing)}")
        for layer in self.value:
            if len(layer) != n:
                raise ValueError(f"{n} incoming directions need as many rows of value, got {len(layer)}")
            for i, row in enumerate(layer):
                if len(row) != len(self.cells(i)):
                    raise ValueError(
                        f"value of incoming direction {i + 1}: {len(self.cells(i))} outgoing cells need as many "
                        f"numbers, got {len(row)}"
                    )
        if self.specular is not None and (
            len(self.specular) != len(self.value) or any(len(row) != n for row in self.specular)
        ):
            raise ValueError(f"specular must hold {len(self.value)} row(s) of {n} shares, as value does")
        return self

    def cells(self, incoming: int) -> BsdfCells:
        """Outgoing cells of an incoming direction."""
        return self.outgoing[incoming if len(self.outgoing) > 1 else 0]

    @property
    def is_isotropic(self) -> bool:
        """Whether the azimuth of incoming light does not matter."""
        return isinstance(self.incoming, BsdfAngles) and self.incoming.azimuth_deg is None

    @property
    def specular_share(self) -> NDArray[np.float64]:
        """Share of the light that goes on specularly, (n_layers, n_incoming)."""
        return np.zeros((len(self.value), len(self.incoming))) if self.specular is None else np.array(self.specular)

    @property
    def scattered_share(self) -> NDArray[np.float64]:
        """Share of the light that scatters, (n_layers, n_incoming): the integral of BSDF times cosine.

        F. Nicodemus et al.: Geometrical Considerations and Nomenclature for Reflectance, NBS Monograph 160 (1977),
        table 2: directional-hemispherical reflectance.
        """
        projected = [cells.projected_sr for cells in self.outgoing]
        return np.array(
            [
                [float(np.dot(row, projected[i if len(projected) > 1 else 0])) for i, row in enumerate(layer)]
                for layer in self.value
            ]
        )


class BsdfTable(Record):
    """All that a surface does with light, as a table; what goes nowhere is absorbed.

    A table that says nothing of light from one of the sides acts alike on both, as a sheet does that is symmetric about
    its middle plane. A table that speaks of both sides absorbs what it does not speak of.
    """

    lobes: tuple[BsdfLobe, ...] = Field(min_length=1, max_length=4)
    wavelength_nm: tuple[Number, ...] | None = Field(
        None, min_length=1, description="Wavelengths of the tables; null: the same at all, or red, green and blue."
    )
    outside: Outside = Field("refuse", description="What holds outside the wavelengths: refuse it, or clamp.")
    x_axis: Direction = Field(X_AXIS, description="Where azimuth 0 of an anisotropic table points to.")
    reference: str | None = Field(None, description="Where the figures come from.")

    @model_validator(mode="after")
    def _is_a_table(self) -> BsdfTable:
        names = [(lobe.comes_from, lobe.goes_to) for lobe in self.lobes]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{name[1]} of light from the {name[0]} is given twice")
        if self.wavelength_nm is not None:
            SpectrumTable(wavelength_nm=self.wavelength_nm, value=(0.0,) * len(self.wavelength_nm))
        allowed = (1, 3) if self.wavelength_nm is None else (len(self.wavelength_nm),)
        for lobe in self.lobes:
            if len(lobe.value) not in allowed:
                raise ValueError(
                    f"{lobe.goes_to} of light from the {lobe.comes_from}: value must hold "
                    + (
                        "1 layer, or 3 for red, green and blue"
                        if len(allowed) > 1
                        else f"{allowed[0]} layer(s), one for each wavelength"
                    )
                    + f", got {len(lobe.value)}"
                )
        for side in ("front", "back"):
            forms = {type(lobe.incoming) for lobe in self.lobes if lobe.comes_from == side}
            if len(forms) > 1:
                raise ValueError(f"light from the {side} must be given for angles or for cells, not for both")
            self._check_energy(side)
        return self

    def lobe(self, side: Literal["front", "back"], goes_to: Literal["reflection", "transmission"]) -> BsdfLobe | None:
        """What is in force for light from a side, also where the table only speaks of the other; None if nothing."""
        if not any(lobe.comes_from == side for lobe in self.lobes):
            side = "back" if side == "front" else "front"
        for lobe in self.lobes:
            if (lobe.comes_from, lobe.goes_to) == (side, goes_to):
                return lobe
        return None

    @property
    def is_spectral(self) -> bool:
        """Whether it depends on wavelength."""
        return self.wavelength_nm is not None

    @property
    def range_nm(self) -> tuple[float, float]:
        """First and last wavelength that the table speaks of."""
        if self.outside == "clamp" or self.wavelength_nm is None:
            return SHORTEST_NM, LONGEST_NM
        return self.wavelength_nm[0], self.wavelength_nm[-1]

    def _check_energy(self, side: str) -> None:
        """Refuse a table that creates light, with the place where it does so most.

        Shares are linear, or constant, between the angles at which something changes, so these are enough.
        """
        lobes = [lobe for lobe in self.lobes if lobe.comes_from == side]
        if not lobes:
            return
        layers = max(len(lobe.value) for lobe in lobes)
        shares = [
            np.broadcast_to(lobe.scattered_share + lobe.specular_share, (layers, len(lobe.incoming))) for lobe in lobes
        ]
        worst, place = 1.0, (0.0, 0.0, 0)
        for polar, azimuth in _places(lobes):
            total = sum(
                (share[:, i] * weight for lobe, share in zip(lobes, shares, strict=True)
                 for i, weight in lobe.incoming.weights(polar, azimuth)),
                start=np.zeros(layers),
            )  # fmt: skip
            if total.max() > worst:
                worst, place = float(total.max()), (polar, azimuth, int(total.argmax()))
        if worst > 1 + ROUNDING:
            polar, azimuth, layer = place
            where = f"from the {side} at {polar:.4g} degrees"
            if not all(lobe.is_isotropic for lobe in lobes):
                where += f", azimuth {azimuth:.4g} degrees"
            if self.wavelength_nm is not None:
                where += f", {self.wavelength_nm[layer]:g} nm"
            elif layers == 3:
                where += f", band {'rgb'[layer]}"
            parts = " + ".join(
                f"{sum(share[layer, i] * w for i, w in lobe.incoming.weights(polar, azimuth)):.6g} {lobe.goes_to}"
                for lobe, share in zip(lobes, shares, strict=True)
            )
            raise ValueError(
                f"the table creates light: of light {where}, {worst:.6g} times as much goes on ({parts}); a BSDF is in "
                "1/sr, without the cosine: check its unit or scale it down"
            )


def _places(lobes: list[BsdfLobe]) -> list[tuple[float, float]]:
    """Directions of incidence (polar angle, azimuth) in degrees that tell all that a sum of lobes can be."""
    polar = sorted({angle for lobe in lobes for angle in lobe.incoming.samples_deg()[0]})
    azimuth = sorted({angle for lobe in lobes for angle in lobe.incoming.samples_deg()[1]})
    if isinstance(lobes[0].incoming, BsdfCells):  # constant in between
        polar = [(a + b) / 2 for a, b in zip(polar, polar[1:], strict=False)]
        azimuth = [(a + b) / 2 for a, b in zip(azimuth, [*azimuth[1:], azimuth[0] + 360], strict=True)]
    return [(p, a) for p in polar for a in (azimuth or [0.0])]


def _table_of_file(value: Any, info: ValidationInfo) -> Any:
    """The table that a reference to a file stands for; everything else as it is."""
    if not (isinstance(value, dict) and "file" in value):
        return value
    given = BsdfFile.model_validate(value)
    data = file_content(given.file, info, lambda path: read_bsdf(path, given.spectrum))
    return {**data, "outside": given.outside, "x_axis": given.x_axis}


BsdfTableOrFile = Annotated[BsdfTable, BeforeValidator(_table_of_file, json_schema_input_type=BsdfTable | BsdfFile)]
