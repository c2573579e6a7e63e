# SPDX-License-Identifier: LGPL-2.1-or-later
"""Ask a Ray Map: which rays match a criterion, how many, and with how much light."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion.estimate import estimate_flux
from raymaps.criterion.evaluate import Bound, bind, matching_rays
from raymaps.criterion.interval import confidence_interval
from raymaps.criterion.replicates import effective_squares
from raymaps.criterion.text import format_criterion
from raymaps.criterion.tree import Criterion, Everything
from raymaps.errors import CriterionError

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["QueryResult", "decided", "matches", "query", "rays_per_replicate"]


@dataclass(frozen=True)
class QueryResult:
    """Rays that match a criterion.

    Attributes
    ----------
    criterion : str
    rays : int
        Matching rays among the scanned.
    scanned : int
        Rays looked at; all of the map unless enough were found before.
    flux_w, flux_stderr_w : float or None
        Light that the matching rays were emitted with, in W, and its standard error. None where the search stopped
        early: rays that were scanned *until* enough were found are no fair sample.
    interval_w : (low, high) or None
        Limits that contain the true flux with 95 % confidence; see `raymaps.criterion.interval`.
    ids : (n,) int64
        Numbers of the matching rays, ascending; the first ones if a limit was set.
    """

    criterion: str
    rays: int
    scanned: int
    flux_w: float | None
    flux_stderr_w: float | None
    interval_w: tuple[float, float] | None
    ids: NDArray[np.int64]

    def to_dict(self) -> dict[str, Any]:
        """As the command line and the server print it."""
        return {
            "criterion": self.criterion,
            "rays": self.rays,
            "scanned": self.scanned,
            "flux_w": self.flux_w,
            "flux_stderr_w": self.flux_stderr_w,
            "interval_w": None if self.interval_w is None else list(self.interval_w),
            "ids": self.ids.tolist(),
        }


def query(raymap: RayMap, criterion: Criterion | str | None = None, limit: int | None = None) -> QueryResult:
    """Rays of a map that match a criterion.

    Parameters
    ----------
    raymap : RayMap
    criterion : Criterion, its text form, or None for every ray
    limit : int, optional
        How many ray numbers are wanted. Portions are scanned in order, and no further than needed to find so many.

    Raises
    ------
    CriterionError
        If the criterion can't be read or names something that the map does not hold, or the limit is negative.
    """
    if limit is not None and limit < 0:
        raise CriterionError(f"The limit must be 0 or more rays, got {limit}.")
    bound = bind(Everything() if criterion is None else criterion, raymap.names, raymap.scene.detectors)
    n_sources = len(raymap.names.sources)
    ids: list[NDArray[np.int64]] = []
    scanned: list[Portion] = []
    found_of = np.zeros((n_sources, raymap.n_replicates), np.int64)
    for portion, rays in matches(raymap, bound):
        ids.append(portion.first_ray + rays)
        found_of += rays_per_replicate(raymap, portion, rays)
        scanned.append(portion)
        if limit is not None and found_of.sum() >= limit:
            break
    flux_w = stderr_w = interval_w = None
    if len(scanned) == len(raymap.portions):
        found = found_of.sum(axis=1)
        squares = effective_squares(raymap.rays_of_replicate, found_of, found)
        sums = (raymap.source_flux_w, raymap.rays_of_source, found, squares)
        known = decided(bound, raymap.rays_of_source)
        flux_w, stderr_w = (float(value) for value in estimate_flux(*sums, known))
        low, high = confidence_interval(*sums, known)
        interval_w = float(low), float(high)
    return QueryResult(
        criterion=format_criterion(bound.criterion),
        rays=int(found_of.sum()),
        scanned=sum(portion.n_rays for portion in scanned),
        flux_w=flux_w,
        flux_stderr_w=stderr_w,
        interval_w=interval_w,
        ids=_read_only(np.concatenate([np.zeros(0, np.int64), *ids])[:limit]),
    )


def matches(raymap: RayMap, bound: Bound) -> Iterator[tuple[Portion, NDArray[np.int64]]]:
    """Portion by portion, in order, the matching rays as ascending numbers within the portion."""
    for portion in raymap.portions:
        yield portion, matching_rays(portion, bound)


def rays_per_replicate(raymap: RayMap, portion: Portion, rays: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many of some rays of a portion are of each source and replicate: (n_sources, R) int64."""
    n_sources, n_replicates = len(raymap.names.sources), raymap.n_replicates
    if n_replicates > 1:
        group = raymap.group_of_rays(portion)[rays]
        return np.bincount(group, minlength=n_sources * n_replicates).reshape(n_sources, n_replicates)
    signatures = portion.ray_signature if len(rays) == portion.n_rays else portion.ray_signature[rays]
    of_signature = np.bincount(signatures, minlength=len(portion.signatures))
    return np.bincount(portion.signatures.ray_source, of_signature, n_sources).astype(np.int64)[:, None]


def decided(bound: Bound, rays_of_source: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Sources whose flux is known by the criterion's logic alone: none of their rays match, or all that there are."""
    verdicts = bound.on_sources(len(rays_of_source))
    return (verdicts.always & (rays_of_source > 0)) | ~verdicts.maybe


def _read_only(array: NDArray[np.int64]) -> NDArray[np.int64]:
    array.setflags(write=False)
    return array
