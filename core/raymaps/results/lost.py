# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays that lost their way, by place: how many, with how much light, where, and the criterion that shows them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import (
    Happened,
    Hit,
    by_source,
    confidence_interval,
    effective_squares,
    estimate_flux,
    format_criterion,
)
from raymaps.kinds import KILL_REASONS, EventKind
from raymaps.store.signatures import NONE
from raymaps.units import format_quantity, format_with_error

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["LOST", "MAX_PLACES", "Lost", "lost_lines", "lost_rays", "lost_words"]

Float = NDArray[np.float64]

#: How rays end that were not followed though there was somewhere to go.
LOST = (EventKind.KILLED_NUMERICAL, EventKind.KILLED_MEDIUM_MISMATCH)
#: How many places a text tells.
MAX_PLACES = 10


@dataclass(frozen=True)
class Lost:
    """Rays that were lost at a place.

    Attributes
    ----------
    body, face : str or None
        Where; None off all faces.
    reason : str
        As in the energy ledger: ``numerical``, or ``medium_mismatch`` in older maps.
    rays : int
    flux_w, flux_stderr_w : float
        Light that they had left, and its standard error.
    interval_w : (low, high)
        Limits that contain the true flux with 95 % confidence.
    share : float
        Of all emitted light.
    point_mm : (x, y, z)
        Where the first of them was lost.
    criterion : str
        Matches them; off all faces also those that were lost at faces.
    """

    body: str | None
    face: str | None
    reason: str
    rays: int
    flux_w: float
    flux_stderr_w: float
    interval_w: tuple[float, float]
    share: float
    point_mm: tuple[float, float, float]
    criterion: str

    @property
    def place(self) -> str:
        """``Body.Face``, or that it is none."""
        return "off all faces" if self.body is None else f"{self.body}.{self.face}"

    @property
    def point(self) -> str:
        """Where the first was lost, for people."""
        return f"({', '.join(f'{value:.6g}' for value in self.point_mm)}) mm"

    def to_dict(self) -> dict[str, Any]:
        """As in ``raymaps info --json``."""
        return {**self.__dict__, "interval_w": list(self.interval_w), "point_mm": list(self.point_mm)}

    def sentence(self) -> str:
        """What ``raymaps check`` says."""
        how = "to rounding" if self.reason == "numerical" else "where bodies overlap or touch,"
        where = self.place if self.body is None else f"at {self.place}"
        return (
            f"{lost_words([self])}, got lost {how} {where}, the first at {self.point}: look at them by the criterion  "
            f"{self.criterion}"
        )


@dataclass
class _Sums:
    """Sums over the rays that were lost at a place; by source and replicate (n_sources * R,)."""

    point_mm: tuple[float, float, float]
    total: Float = field(repr=False)
    squares: Float = field(repr=False)
    rays: int = 0


def lost_rays(raymap: RayMap) -> tuple[Lost, ...]:
    """Places where rays were lost, those with the most rays first; portions that lost none are not read."""
    n_groups = len(raymap.names.sources) * raymap.n_replicates
    sums: dict[tuple[int, int], _Sums] = {}
    for portion in raymap.portions:
        if not any(entry.what == "killed" and entry.index in LOST for entry in portion.summary.ledger):
            continue
        for key, group, power, point_mm in _lost_of(portion, raymap.group_of_rays(portion)):
            of_place = sums.setdefault(key, _Sums(point_mm, np.zeros(n_groups), np.zeros(n_groups)))
            of_place.total += np.bincount(group, power, n_groups)
            of_place.squares += np.bincount(group, power**2, n_groups)
            of_place.rays += len(group)
    found = [_lost(raymap, key, of_place) for key, of_place in sums.items()]
    return tuple(sorted(found, key=lambda lost: (-lost.rays, -lost.flux_w, lost.reason, lost.place)))


def _lost_of(
    portion: Portion, group: NDArray[np.integer]
) -> Iterator[tuple[tuple[int, int], NDArray[np.integer], Float, tuple[float, float, float]]]:
    """Kind and face, then group and light of the rays that a portion lost there, and where the first one was."""
    table = portion.signatures
    ray = np.flatnonzero(np.isin(table.ending, LOST)[portion.ray_signature])
    signature = portion.ray_signature[ray]
    face = table.face[table.offsets[signature + 1] - 1]
    places, first, at = np.unique(
        np.stack([table.ending[signature], face], axis=1), axis=0, return_index=True, return_inverse=True
    )
    row = portion.event_offsets[ray + 1] - 1
    power, group = portion.power[row], group[ray]
    for index, (kind, of_face) in enumerate(places.tolist()):
        x, y, z = portion.position_mm[row[first[index]]].tolist()
        here = at.ravel() == index
        yield (kind, of_face), group[here], power[here], (x, y, z)


def _lost(raymap: RayMap, key: tuple[int, int], sums: _Sums) -> Lost:
    names, kind = raymap.names, EventKind(key[0])
    body, face = (names.bodies[names.faces[key[1]][0]], names.faces[key[1]][1]) if key[1] != NONE else (None, None)
    shown = Happened(kind.label) if body is None else Hit(body, face, kind.label)
    rays = raymap.rays_of_replicate
    total, squares = (by_source(values, len(rays)) for values in (sums.total, sums.squares))
    squares = effective_squares(rays, sums.total.reshape(rays.shape), squares)
    of_sources = (raymap.source_flux_w, raymap.rays_of_source, total, squares)
    (flux_w, stderr_w), (low_w, high_w) = estimate_flux(*of_sources), confidence_interval(*of_sources)
    emitted_w = float(raymap.source_flux_w[raymap.rays_of_source > 0].sum())
    return Lost(
        body=body,
        face=face,
        reason=KILL_REASONS[kind],
        rays=sums.rays,
        flux_w=float(flux_w),
        flux_stderr_w=float(stderr_w),
        interval_w=(float(low_w), float(high_w)),
        share=float(flux_w) / (emitted_w or 1.0),
        point_mm=sums.point_mm,
        criterion=format_criterion(shown),
    )


def lost_words(lost: Sequence[Lost]) -> str:
    """How much was lost in all, for instance ``3 rays with 60 µW, 0.002 % of the light``."""
    flux_w, share = (math.fsum(getattr(one, name) for one in lost) for name in ("flux_w", "share"))
    rays = _rays(sum(one.rays for one in lost))
    return f"{rays} with {format_quantity(flux_w, 'W')}, {100 * share:.2g} % of the light"


def lost_lines(lost: Sequence[Lost]) -> list[str]:
    """A table for people, a line a place."""
    shown = lost[:MAX_PLACES]
    width = max((len(one.place) for one in shown), default=0)
    lines = [
        f"{_rays(one.rays):>10}  {format_with_error(one.flux_w, one.flux_stderr_w):<18} {one.reason:<15} "
        f"{one.place:<{width}}  first at {one.point}   {one.criterion}"
        for one in shown
    ]
    more = len(lost) - len(shown)
    return lines + ([f"and at {more} more places"] if more else [])


def _rays(n: int) -> str:
    return "1 ray" if n == 1 else f"{n} rays"
