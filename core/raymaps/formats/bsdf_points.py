# SPDX-License-Identifier: LGPL-2.1-or-later
"""From a BSDF at single directions, as instruments measure it, to cells of directions.

For each direction of incidence the scattered directions are rings of a few polar angles. Each value stands for the cell
of directions that are nearest to it: borders lie midway between neighbours, the innermost ring reaches the normal and
the outermost the horizon. Directions that form no rings are taken to a fixed set of cells about 5 degrees wide, each
with the value of the nearest direction. A table without incident azimuth whose scattered azimuths all lie on one side
of the plane of incidence is mirrored at that plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError

__all__ = ["Points", "lobe_of_points"]

Float = NDArray[np.float64]

#: Scattered light must be told at least up to this polar angle, or nothing says how much there is.
_REACH_DEG = 70.0
#: Beside the plane of incidence, azimuths further apart than this leave out what matters.
_WIDEST_GAP_DEG = 120.0
#: Directions without order must leave no gap wider than this.
_FURTHEST_DEG = 20.0
#: Angles are the same if they differ by less; instruments write them with this many decimals at most.
_DECIMALS = 4
#: Sine of the azimuth below which a direction lies in the plane of incidence.
_IN_PLANE = 1e-3
_LARGEST = 5_000_000


@dataclass(frozen=True)
class Points:
    """A BSDF at single directions, in degrees; azimuths are those in which light travels (see
    `raymaps.materials.bsdf`).

    Attributes
    ----------
    theta_i : (n,) polar angle of incidence
    phi_i : (n,) azimuth of incoming light, or None where it does not matter; then phi_s counts from it
    theta_s : (n,) polar angle of scattered light; a negative one is on the other side of the normal
    phi_s : (n,) azimuth of scattered light, or None: scattered light is the same all around the normal
    value : (n, n_layers) BSDF in 1/sr
    specular : {(theta_i, phi_i or 0): (n_layers,) shares}
    """

    theta_i: Float
    phi_i: Float | None
    theta_s: Float
    phi_s: Float | None
    value: Float
    specular: dict[tuple[float, float], tuple[float, ...]]


@dataclass(frozen=True)
class _Whole:
    """Points with both azimuths, from 0 to below 360, which count from one direction; polar angles from 0 to 90."""

    theta_i: Float
    phi_i: Float
    theta_s: Float
    phi_s: Float
    value: Float
    specular: dict[tuple[float, float], tuple[float, ...]]


def lobe_of_points(points: Points, comes_from: str, goes_to: str, where: str) -> dict[str, Any]:
    """Data of a `raymaps.materials.BsdfLobe`.

    Parameters
    ----------
    where : str
        What the table is called in errors.

    Raises
    ------
    FormatError
        If directions are impossible or stand twice, or do not tell enough of the hemisphere.
    """
    whole = _normalised(points, where)
    n_layers = whole.value.shape[1]
    keys = sorted({*zip(whole.theta_i.tolist(), whole.phi_i.tolist(), strict=True), *whole.specular})
    cells: list[dict[str, Any]] = []
    rows: list[Float] = []
    specular: list[tuple[float, ...]] = []
    of_key = _rows_by_key(whole)
    for theta_i, phi_i in keys:
        here = of_key.get((theta_i, phi_i), np.zeros(0, np.intp))
        place = f"{where}, incidence at {theta_i:g} degrees" + (
            f", azimuth {phi_i:g}" if len({k[1] for k in keys}) > 1 else ""
        )
        if len(here):
            ring_cells, row = _cells(theta_i, whole.theta_s[here], whole.phi_s[here] - phi_i, whole.value[here], place)
        else:
            ring_cells, row = {"ring_deg": (0.0, 90.0), "azimuth_deg": ((0.0, 360.0),)}, np.zeros((1, n_layers))
        cells.append(ring_cells)
        rows.append(row)
        specular.append(whole.specular.get((theta_i, phi_i), (0.0,) * n_layers))
    if whole.specular and len(whole.specular) != len(keys):
        missing = next(key for key in keys if key not in whole.specular)
        raise FormatError(
            f"{where}: the specular share is given for some angles of incidence, but not for {missing[0]:g} degrees."
        )
    polar = tuple(dict.fromkeys(key[0] for key in keys))
    azimuth = tuple(tuple(key[1] for key in keys if key[0] == angle) for angle in polar)
    alike = all(one == cells[0] for one in cells)
    return {
        "comes_from": comes_from,
        "goes_to": goes_to,
        "incoming": {"polar_deg": polar, "azimuth_deg": None if all(row == (0.0,) for row in azimuth) else azimuth},
        "outgoing": tuple(cells[:1] if alike else cells),
        "value": tuple(tuple(tuple(row[:, layer].tolist()) for row in rows) for layer in range(n_layers)),
        "specular": tuple(tuple(share[layer] for share in specular) for layer in range(n_layers))
        if whole.specular
        else None,
    }


def _rows_by_key(points: _Whole) -> dict[tuple[float, float], NDArray[np.intp]]:
    """Rows of each direction of incidence."""
    order = np.lexsort((points.phi_i, points.theta_i))
    theta_i, phi_i = points.theta_i[order], points.phi_i[order]
    new = np.flatnonzero((np.diff(theta_i) != 0) | (np.diff(phi_i) != 0)) + 1
    groups = np.split(order, new) if len(order) else []
    return {(float(points.theta_i[rows[0]]), float(points.phi_i[rows[0]])): rows for rows in groups}


def _normalised(points: Points, where: str) -> _Whole:
    """The same points with polar angles from 0 to 90, azimuths from 0 to below 360, both azimuths there; checked."""
    if points.value.size > _LARGEST:
        raise FormatError(f"{where}: a table of more than {_LARGEST} values is more than can be used.")
    for name, angle, low in (("theta_i", points.theta_i, 0), ("theta_s", points.theta_s, -90)):
        wrong = (angle < low) | (angle > 90)
        if wrong.any():
            raise FormatError(
                f"{where}: {name} must be from {low} to 90 degrees from the normal, got {angle[wrong][0]:g}."
            )
    phi_i = np.zeros_like(points.theta_i) if points.phi_i is None else points.phi_i
    phi_s = phi_i if points.phi_s is None else points.phi_s + np.where(points.theta_s < 0, 180.0, 0.0)
    specular = points.specular
    oblique = [phi for theta, phi in specular if theta > 0]
    azimuths = np.unique(_around(np.append(phi_i[points.theta_i > 0], oblique)))
    isotropic = points.phi_i is None or len(azimuths) <= 1
    if isotropic:
        phi_i, phi_s = np.zeros_like(phi_i), phi_s - (azimuths[0] if len(azimuths) else phi_i)
        specular = {(theta, 0.0): share for (theta, _), share in specular.items()}
    whole = _Whole(
        np.round(points.theta_i, _DECIMALS),
        _around(phi_i),
        np.asarray(np.round(np.abs(points.theta_s), _DECIMALS), np.float64),
        _around(phi_s),
        points.value,
        {(round(theta, _DECIMALS), float(_around(phi))): share for (theta, phi), share in specular.items()},
    )
    return _mirrored(whole) if isotropic else _with_normal(whole)


def _around(azimuth_deg: Any) -> Float:
    """Azimuths from 0 to below 360, rounded."""
    return np.asarray(np.round(np.asarray(azimuth_deg, float) % 360, _DECIMALS) % 360, np.float64)


def _mirrored(points: _Whole) -> _Whole:
    """Points on one side of the plane of incidence, and their mirror images; others as they are."""
    sides = np.sin(np.radians(points.phi_s))
    if (sides > _IN_PLANE).any() and (sides < -_IN_PLANE).any():
        return points
    beside = (np.abs(sides) > _IN_PLANE) & (points.theta_s > 0)
    return _Whole(
        np.append(points.theta_i, points.theta_i[beside]),
        np.append(points.phi_i, points.phi_i[beside]),
        np.append(points.theta_s, points.theta_s[beside]),
        np.append(points.phi_s, _around(-points.phi_s[beside])),
        np.concatenate([points.value, points.value[beside]]),
        points.specular,
    )


def _with_normal(points: _Whole) -> _Whole:
    """The same with light along the normal, which has no azimuth, given for all azimuths of incidence."""
    normal, oblique = points.theta_i == 0, points.theta_i > 0
    azimuths = sorted({*points.phi_i[oblique].tolist(), *(phi for theta, phi in points.specular if theta > 0)})
    if normal.any():
        normal &= points.phi_i == points.phi_i[normal][0]
    copies = [points.phi_i[oblique], *(np.full(int(normal.sum()), azimuth) for azimuth in azimuths)]
    theta_i, theta_s, phi_s, value = (
        np.concatenate([given[oblique], *[given[normal]] * len(azimuths)])
        for given in (points.theta_i, points.theta_s, points.phi_s, points.value)
    )
    specular = {key: share for key, share in points.specular.items() if key[0] > 0}
    for share in [share for key, share in points.specular.items() if key[0] == 0][:1]:
        specular.update({(0.0, azimuth): share for azimuth in azimuths})
    return _Whole(theta_i, np.concatenate(copies), theta_s, phi_s, value, specular)


def _cells(theta_i: float, theta_s: Float, around: Float, value: Float, where: str) -> tuple[dict[str, Any], Float]:
    """Outgoing cells of one incoming direction, and the values in them, (n_cells, n_layers)."""
    around = np.round(around % 360, _DECIMALS) % 360
    around[theta_s == 0] = 0.0
    order = np.lexsort((around, theta_s))
    theta_s, around, value = theta_s[order], around[order], value[order]
    same = (np.diff(theta_s) == 0) & (np.diff(around) == 0)
    if (same & (value[1:] != value[:-1]).any(axis=1)).any():
        at = int(np.flatnonzero(same)[0])
        raise FormatError(
            f"{where}: two values stand for the same direction, {theta_s[at]:g} degrees, azimuth {around[at]:g}."
        )
    keep = np.append(True, ~same)
    theta_s, around, value = theta_s[keep], around[keep], value[keep]
    if theta_s[-1] < _REACH_DEG:
        raise FormatError(
            f"{where}: scattered light is told only up to {theta_s[-1]:g} degrees from the normal, at least "
            f"{_REACH_DEG:g} are needed; "
            + ("angles are in degrees, not radians." if theta_s[-1] < 2 else "add rows, with 0 where nothing scatters.")
        )
    rings = np.unique(theta_s)
    counts = np.array([(theta_s == ring).sum() for ring in rings])
    if (counts[rings > 0] == 1).any() and (counts > 1).any():
        return _fixed_cells(theta_s, around, value, where)
    borders = np.concatenate([[0.0], (rings[1:] + rings[:-1]) / 2, [90.0]])
    azimuths = tuple(_sectors(around[theta_s == ring]) for ring in rings)
    if theta_i > 0:
        for ring, row in zip(rings, azimuths, strict=True):
            gap = _widest_gap(around[theta_s == ring])
            if ring > 0 and len(row) > 2 and gap > _WIDEST_GAP_DEG:
                raise FormatError(
                    f"{where}: at {ring:g} degrees the azimuths leave a gap of {gap:g} degrees, at most "
                    f"{_WIDEST_GAP_DEG:g} are allowed; a scan in one plane does not tell where light goes beside it."
                )
    return {"ring_deg": tuple(borders.tolist()), "azimuth_deg": azimuths}, value


def _widest_gap(around: Float) -> float:
    return float(np.diff(np.append(around, around[0] + 360)).max())


def _sectors(around: Float) -> tuple[float, ...]:
    """Borders midway between ascending azimuths, once around."""
    if len(around) == 1:
        return (0.0, 360.0)
    midway = (around + np.append(around[1:], around[0] + 360)) / 2
    return (float(midway[-1] - 360), *midway[:-1].tolist(), float(midway[-1]))


def _fixed_cells(theta_s: Float, around: Float, value: Float, where: str) -> tuple[dict[str, Any], Float]:
    """Rings of 5 degrees, with sectors about as wide as high; each takes the value of the direction nearest to it."""
    rings = np.arange(0.0, 95.0, 5.0)
    middle = (rings[1:] + rings[:-1]) / 2
    sectors = [max(4, round(360 * np.sin(np.radians(angle)) / 5)) for angle in middle]
    azimuths = tuple(tuple(((np.arange(n + 1) - 0.5) * 360 / n).tolist()) for n in sectors)
    polar = np.repeat(middle, sectors)
    azimuth = np.concatenate([np.arange(n) * 360 / n for n in sectors])
    directions = _unit(theta_s, around).T
    nearest, cosine = np.empty(len(polar), np.intp), np.empty(len(polar))
    for k, direction in enumerate(_unit(polar, azimuth)):
        along = direction @ directions
        nearest[k] = along.argmax()
        cosine[k] = along[nearest[k]]
    furthest = cosine.argmin()
    gap = float(np.degrees(np.arccos(min(1.0, cosine[furthest]))))
    if gap > _FURTHEST_DEG:
        raise FormatError(
            f"{where}: no scattered direction is nearer than {gap:.3g} degrees to polar angle {polar[furthest]:g}, "
            f"azimuth {azimuth[furthest]:.4g}; gaps of {_FURTHEST_DEG:g} degrees at most are allowed."
        )
    return {"ring_deg": tuple(rings.tolist()), "azimuth_deg": azimuths}, value[nearest]


def _unit(polar_deg: Float, azimuth_deg: Float) -> Float:
    polar, azimuth = np.radians(polar_deg), np.radians(azimuth_deg)
    return np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=1)
