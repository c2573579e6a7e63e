# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scattering by a table of measured BRDF and BTDF, with what goes on specularly beside it.

The BSDF is radiance over irradiance, so from light that comes at an angle the share f(i, s) cos(theta_s) dOmega goes on
about the direction s (F. Nicodemus et al.: Geometrical Considerations and Nomenclature for Reflectance, NBS Monograph
160 (1977), eq. 4 and 12). Over a cell of outgoing directions f is constant: the cell takes on f times its projected
solid angle. A ray goes on in one direction with all its bands: the cell is drawn by the light that it takes on in all
bands together, a direction within it uniformly in projected solid angle, and each band keeps its part of the cell's
light. Polarisation is not modelled, nor is reciprocity enforced: a table is taken at its word. What a table transmits
into a metal is absorbed.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import Bands
from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import faces_of_kind
from raymaps.materials import BsdfTable, SpectrumTable, TabulatedBsdf
from raymaps.materials.bsdf import BsdfLobe
from raymaps.materials.bsdf_directions import BsdfCells
from raymaps.scene import Scene

__all__ = ["Data", "bsdf_per_sr", "frame", "lower", "lower_tables", "needed_by", "shares"]

Float = NDArray[np.float64]
Side = Literal["front", "back"]
Way = Literal["reflection", "transmission"]

SIDES: tuple[Side, Side] = ("front", "back")
WAYS: tuple[Way, Way] = ("reflection", "transmission")


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for tables of scattering if a face scatters by one."""
    return faces_of_kind(scene, "bsdf")


class Data(NamedTuple):
    """What the kernel reads; angles in radians, all directions of incidence of all lobes in one row."""

    lobe: NDArray[np.int32]  # (n_surfaces, 2 sides, 2 ways) which lobe is in force, -1 none
    x_axis: Float  # (n_surfaces, 3) where azimuth 0 points to
    is_cells: NDArray[np.bool_]  # (n_lobes,) incoming cells, not angles
    ring_start: NDArray[np.int32]  # (n_lobes + 1,) where its rings of incidence start
    polar: Float  # (n_rings,) polar angle of the ring; of cells: its lower border
    direction_start: NDArray[np.int32]  # (n_rings + 1,) where its directions of incidence start
    azimuth: Float  # (n_directions,) azimuth; of cells: its lower border
    specular: Float  # (n_directions, n_bands) share of light that goes on specularly
    scattered: Float  # (n_directions, n_bands) share of light that scatters
    value_start: NDArray[np.int64]  # (n_directions + 1,) where its outgoing cells start
    cumulated: Float  # (n_values, n_bands or 1) share of light that its cells up to this one take on
    border_start: NDArray[np.int64]  # (n_directions,) where the borders of its outgoing cells start
    border: Float  # (n_borders, 4) lower and upper sin² of the polar angle, lower and upper azimuth
    is_conductor: NDArray[np.bool_]  # (n_media,) metals, which light can't go into


def lower(lowering: Lowering) -> Data:
    """All tables of a scene as arrays."""
    tables = {name: prop.data for name, prop in lowering.scene.surfaces.items() if isinstance(prop, TabulatedBsdf)}
    return lower_tables(tables, lowering.names.surfaces, lowering.bands, lowering.is_conductor)


def lower_tables(
    tables: dict[str, BsdfTable], surfaces: tuple[str, ...], bands: Bands, is_conductor: NDArray[np.bool_]
) -> Data:
    """Tables by the names of their surfaces as arrays.

    Raises
    ------
    SceneError
        If a table says nothing of wavelengths that are simulated.
    """
    lobe = np.full((len(surfaces), 2, 2), -1, np.int32)
    x_axis = np.tile([1.0, 0.0, 0.0], (len(surfaces), 1))
    by_band = any(len(one.value) > 1 for table in tables.values() for one in table.lobes)
    rows = _Rows()
    for name, table in tables.items():
        surface = surfaces.index(name)
        x_axis[surface] = table.x_axis
        placed: dict[int, int] = {}
        for side, way in np.ndindex(2, 2):
            one = table.lobe(SIDES[side], WAYS[way])
            if one is None:
                continue
            if id(one) not in placed:
                placed[id(one)] = rows.add(one, _over_bands(table, one, bands, f"Surface '{name}', data"), by_band)
            lobe[surface, side, way] = placed[id(one)]
    return rows.data(lobe, x_axis, is_conductor, bands.n, bands.n if by_band else 1)


def _over_bands(table: BsdfTable, lobe: BsdfLobe, bands: Bands, where: str) -> Float:
    """(n_bands, n_layers): what part each layer of a lobe has in each band; adds up to 1."""
    n = len(lobe.value)
    if table.wavelength_nm is None:
        if n == 1:
            return np.ones((bands.n, 1))
        units = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
        return np.stack([bands.average(unit, where) for unit in units], axis=1)
    hats = [
        SpectrumTable(
            wavelength_nm=table.wavelength_nm, value=tuple(float(i == k) for i in range(n)), outside=table.outside
        )
        for k in range(n)
    ]
    return np.stack([bands.average(hat, where) for hat in hats], axis=1)


class _Rows:
    """Arrays of `Data` while lobes are added."""

    def __init__(self) -> None:
        self.is_cells: list[bool] = []
        self.ring_start, self.direction_start = [0], [0]
        self.polar: list[float] = []
        self.azimuth: list[float] = []
        self.specular: list[Float] = []
        self.scattered: list[Float] = []
        self.value_start: list[int] = [0]
        self.border_start: list[int] = []
        self.cumulated: list[Float] = []
        self.border: list[Float] = []

    def add(self, lobe: BsdfLobe, over_bands: Float, by_band: bool) -> int:
        """Add a lobe; returns its number."""
        incoming = lobe.incoming
        is_cells = isinstance(incoming, BsdfCells)
        self.is_cells.append(is_cells)
        rings = [row[:-1] for row in incoming.azimuth_deg] if isinstance(incoming, BsdfCells) else incoming.azimuth_deg
        polar = incoming.ring_deg[:-1] if isinstance(incoming, BsdfCells) else incoming.polar_deg
        for angle, azimuths in zip(polar, rings or [(0.0,)] * len(polar), strict=True):
            self.polar.append(float(np.radians(angle)))
            self.azimuth += np.radians(azimuths).tolist()
            self.direction_start.append(len(self.azimuth))
        self.ring_start.append(len(self.polar))
        self.specular.append((over_bands @ lobe.specular_share).T)
        self.scattered.append((over_bands @ lobe.scattered_share).T)
        placed = []
        for cells in lobe.outgoing:
            placed.append(sum(map(len, self.border)))
            low, high, start, end = np.radians(cells.borders_deg).T
            self.border.append(np.stack([np.sin(low) ** 2, np.sin(high) ** 2, start, end], axis=1))
        for i in range(len(incoming)):
            projected = lobe.cells(i).projected_sr
            share = over_bands @ (np.array([layer[i] for layer in lobe.value]) * projected)
            self.cumulated.append(np.cumsum(share if by_band else share[:1], axis=1).T)
            self.value_start.append(self.value_start[-1] + len(projected))
            self.border_start.append(placed[i if len(placed) > 1 else 0])
        return len(self.is_cells) - 1

    def data(
        self, lobe: NDArray[np.int32], x_axis: Float, is_conductor: NDArray[np.bool_], n_bands: int, n_columns: int
    ) -> Data:
        """All arrays, read-only."""
        data = Data(
            lobe,
            np.ascontiguousarray(x_axis, np.float64),
            np.array(self.is_cells, np.bool_),
            np.array(self.ring_start, np.int32),
            np.array(self.polar, np.float64),
            np.array(self.direction_start, np.int32),
            np.array(self.azimuth, np.float64),
            np.concatenate([np.zeros((0, n_bands)), *self.specular]),
            np.concatenate([np.zeros((0, n_bands)), *self.scattered]),
            np.array(self.value_start, np.int64),
            np.concatenate([np.zeros((0, n_columns)), *self.cumulated]),
            np.array(self.border_start, np.int64),
            np.concatenate([np.zeros((0, 4)), *self.border]),
            is_conductor,
        )
        for array in data:
            array.setflags(write=False)
        return data


def frame(normal: Float, x_axis: Float) -> tuple[Float, Float]:
    """Directions on a surface in which azimuths are 0 and 90 degrees.

    Azimuth 0 is the x axis without its part along the normal; if hardly anything is left, the next axis of its cycle
    (x, y, z to z, x, y) takes its place.

    Parameters
    ----------
    normal : (3,) float64, outward unit normal
    x_axis : (3,) float64

    Returns
    -------
    two (3,) float64, unit vectors
    """
    along = x_axis - (x_axis @ normal) * normal
    if along @ along < 1e-6 * (x_axis @ x_axis):
        x_axis = np.roll(x_axis, 1)
        along = x_axis - (x_axis @ normal) * normal
    along = along / np.linalg.norm(along)
    return along, np.cross(normal, along)


def bsdf_per_sr(
    table: BsdfTable,
    side: Side,
    way: Way,
    incoming_deg: tuple[float, float],
    outgoing_deg: tuple[float, float],
    layer: int = 0,
) -> float:
    """BSDF of a table by its definition, in 1/sr, without the specular part.

    Parameters
    ----------
    side : where light comes from
    way : where it goes to
    incoming_deg, outgoing_deg : polar angle and azimuth in which light travels, in degrees
    layer : int
        Which wavelength, or which of red, green and blue.
    """
    lobe = table.lobe(side, way)
    if lobe is None:
        return 0.0
    polar, azimuth = incoming_deg
    turn = 0.0 if isinstance(lobe.incoming, BsdfCells) else azimuth
    values = lobe.value[min(layer, len(lobe.value) - 1)]
    return sum(
        weight * values[i][lobe.cells(i).index(outgoing_deg[0], outgoing_deg[1] - turn)]
        for i, weight in lobe.incoming.weights(polar, azimuth)
    )


def shares(table: BsdfTable, side: Side, incoming_deg: tuple[float, float], layer: int = 0) -> dict[str, float]:
    """Shares of the light that go on, by what happens to it.

    Returns
    -------
    dict with ``specular reflection``, ``diffuse reflection``, ``specular transmission``, ``diffuse transmission``
    """
    result = {}
    for way in WAYS:
        lobe = table.lobe(side, way)
        for name in ("specular", "diffuse"):
            if lobe is None:
                result[f"{name} {way}"] = 0.0
                continue
            share = lobe.specular_share if name == "specular" else lobe.scattered_share
            row = share[min(layer, len(share) - 1)]
            result[f"{name} {way}"] = float(sum(row[i] * w for i, w in lobe.incoming.weights(*incoming_deg)))
    return result
