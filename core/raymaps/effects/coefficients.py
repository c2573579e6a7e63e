# SPDX-License-Identifier: LGPL-2.1-or-later
"""Specular and diffuse reflection and transmission by given shares over the angle of incidence and wavelength.

Shares are averages over each band and linear between the angles that a table gives. What is transmitted specularly is
refracted by Snell's law, and goes straight on through a body without a medium; under total reflection it is reflected.
What is diffuse follows Lambert's law. The rest is absorbed.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import Bands
from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import faces_of_kind
from raymaps.materials import AngularTable, Coefficients
from raymaps.scene import Scene

__all__ = ["SHARES", "Data", "lower", "needed_by", "shares_over_angle"]

#: In the order of the kernel's outcomes.
SHARES = ("specular_reflectance", "specular_transmittance", "diffuse_reflectance", "diffuse_transmittance")


class Data(NamedTuple):
    """What the kernel reads."""

    start: NDArray[np.int32]  # (n_surfaces + 1,) a surface's part of the next two; empty for other kinds
    angle_rad: NDArray[np.float64]  # angles of incidence, ascending for each surface
    share: NDArray[np.float64]  # (n_angles of all, 4 shares, n_bands)
    is_conductor: NDArray[np.bool_]  # (n_media,)


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for coefficients if a face has them."""
    return faces_of_kind(scene, "coefficients")


def lower(lowering: Lowering) -> Data:
    """The shares of each surface at all angles that one of its tables names, by band."""
    start, angles, shares = [0], [np.zeros(0)], [np.zeros((0, len(SHARES), lowering.bands.n))]
    for name, prop in lowering.scene.surfaces.items():
        if isinstance(prop, Coefficients):
            angle_deg, share = shares_over_angle(prop, lowering.bands, f"Surface '{name}'")
            angles.append(np.radians(angle_deg))
            shares.append(share)
        start.append(sum(map(len, angles)))
    return Data(np.array(start, np.int32), np.concatenate(angles), np.concatenate(shares), lowering.is_conductor)


def shares_over_angle(prop: Coefficients, bands: Bands, where: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angles of incidence and the shares there.

    Returns
    -------
    angle_deg : (n_angles,) float64
        All angles that a table names; between them shares are linear, beyond them constant.
    share : (n_angles, 4, n_bands) float64
    """
    values: dict[str, Any] = {name: getattr(prop, name) for name in SHARES}
    named = {angle for value in values.values() if isinstance(value, AngularTable) for angle in value.angle_deg}
    angle_deg = np.array(sorted(named or {0.0}))
    share = np.empty((len(angle_deg), len(SHARES), bands.n))
    for column, (name, value) in enumerate(values.items()):
        if isinstance(value, AngularTable):
            rows = np.stack([_by_band(row, bands, f"{where}, {name}") for row in value.at_angles(value.angle_deg)])
            for band in range(bands.n):
                share[:, column, band] = np.interp(angle_deg, value.angle_deg, rows[:, band])
        else:
            share[:, column] = bands.average(value, f"{where}, {name}")
    return angle_deg, share


def _by_band(row: Any, bands: Bands, where: str) -> NDArray[np.float64]:
    """A row of an angular table, a number or a table over wavelength, by band."""
    return np.full(bands.n, row) if isinstance(row, float) else bands.average(row, where)
