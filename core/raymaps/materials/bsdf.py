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
from raymaps.materials.bsdf_directions import BsdfAngles, BsdfCells
from raymaps.materials.spectrum import LONGEST_NM, SHORTEST_NM, SpectrumTable
from raymaps.materials.values import NonNegative, Number, Record, Share, Vector, file_content, nonzero

__all__ = ["BsdfAngles", "BsdfCells", "BsdfFile", "BsdfLobe", "BsdfTable", "BsdfTableOrFile"]

#: How far rounding may carry the light that goes on past the light that comes.
ROUNDING = 1e-6
#: Combinations of polar angle and azimuth of incidence that the check of energy looks at.
MOST_PLACES = 50_000

Outside = Literal["refuse", "clamp"]
Direction = Annotated[Vector, AfterValidator(nonzero)]
X_AXIS = (1.0, 0.0, 0.0)


class BsdfFile(Record):
    """A file with a BSDF: own CSV, Klems XML of WINDOW, or ASTM E1392; it becomes a table when the scene is read."""

    file: str = Field(min_length=1, description="CSV, XML or ASTM file, relative to the scene file.")
    spectrum: Literal["visible", "solar"] = Field("visible", description="Which of the integrals of a Klems file.")
    outside: Outside = Field("refuse", description="What holds outside the wavelengths of the table.")
    x_axis: Direction = Field(X_AXIS, description="Where azimuth 0 of an anisotropic table points to.")


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
        places = _places(lobes)
        if len(places) > MOST_PLACES:
            raise ValueError(
                f"light from the {side} is given for too many polar angles and azimuths: {len(places)} combinations, "
                f"at most {MOST_PLACES} can be used"
            )
        worst, place = 1.0, (0.0, 0.0, 0)
        for polar, azimuth in places:
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
                f"the table creates light: of light {where}, {worst:.7g} times as much goes on ({parts}); a BSDF is in "
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
