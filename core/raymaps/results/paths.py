# SPDX-License-Identifier: LGPL-2.1-or-later
"""The distinct paths of light through a scene, each with its rays, flux and error.

Two rays took the same path if the same things happened to them at the same faces, and the same detectors lay on the
way; which of its faces a source shone from makes no difference. It is the table that designers of stray-light systems
ask for; it comes from the signatures, without any event.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import (
    Criterion,
    Everything,
    bind,
    confidence_interval,
    effective_squares,
    estimate_flux,
    format_criterion,
    matches,
)
from raymaps.kinds import IN_MEDIUM, OFF_SURFACE, EventKind
from raymaps.names import Names
from raymaps.store.signatures import NONE, SignatureTable
from raymaps.units import format_with_error

if TYPE_CHECKING:
    from raymaps.store import RayMap

__all__ = ["DistinctPath", "PathTable", "distinct_paths"]

_WITHOUT_PLACE = (EventKind.EMISSION, *OFF_SURFACE)


@dataclass(frozen=True)
class DistinctPath:
    """Rays that took the same path.

    Attributes
    ----------
    signature : str
        For instance ``LED > Lens.Face1 fresnel_refraction > [Sensor] > Floor.Face6 absorption``. A detector that lies
        on the way stands in square brackets if it registered the light, else in round ones.
    source : str
    rays : int
    flux_w, flux_stderr_w : float
        Light that these rays were emitted with, in W, and its standard error.
    interval_w : (low, high)
        Limits that contain the true flux with 95 % confidence.
    """

    signature: str
    source: str
    rays: int
    flux_w: float
    flux_stderr_w: float
    interval_w: tuple[float, float]

    def to_dict(self) -> dict[str, Any]:
        """As the command line and the server print it."""
        return {
            "signature": self.signature,
            "source": self.source,
            "rays": self.rays,
            "flux_w": self.flux_w,
            "flux_stderr_w": self.flux_stderr_w,
            "interval_w": list(self.interval_w),
        }


@dataclass(frozen=True)
class PathTable:
    """Distinct paths, those with the largest flux first.

    Attributes
    ----------
    criterion : str or None
    n_paths : int
        Number of distinct paths, of which ``paths`` holds the first.
    rays : int
        Rays of all of them.
    paths : tuple of DistinctPath
    """

    criterion: str | None
    n_paths: int
    rays: int
    paths: tuple[DistinctPath, ...]

    def to_dict(self) -> dict[str, Any]:
        """As the command line and the server print it."""
        return {
            "criterion": self.criterion,
            "distinct": self.n_paths,
            "rays": self.rays,
            "paths": [path.to_dict() for path in self.paths],
        }

    def to_text(self) -> str:
        """A table for people."""
        where = f" where {self.criterion}" if self.criterion is not None else ""
        lines = [f"{self.n_paths} distinct paths of {self.rays} rays{where}"]
        for path in self.paths:
            flux = format_with_error(path.flux_w, path.flux_stderr_w)
            lines.append(f"{path.rays:>10} rays  {flux:<24} {path.signature}")
        if self.n_paths > len(self.paths):
            lines.append(f"and {self.n_paths - len(self.paths)} more with less flux")
        return "\n".join(lines)


def distinct_paths(raymap: RayMap, where: Criterion | str | None = None, limit: int | None = None) -> PathTable:
    """Distinct paths of a map's rays, merged over its portions.

    Parameters
    ----------
    raymap : RayMap
    where : Criterion or str, optional
        Only rays that match.
    limit : int, optional
        Only the paths with the largest flux.
    """
    bound = bind(Everything() if where is None else where, raymap.names, raymap.scene.detectors)
    counts: dict[bytes, NDArray[np.int64]] = {}
    n_replicates = raymap.n_replicates
    for portion, rays in matches(raymap, bound):
        table = portion.signatures
        place = portion.ray_signature[rays]
        if n_replicates > 1:
            place = place * np.int64(n_replicates) + raymap.group_of_rays(portion)[rays] % n_replicates
        of_signature = np.bincount(place, minlength=len(table) * n_replicates).reshape(-1, n_replicates)
        steps = _path_steps(table)
        for index in np.flatnonzero(of_signature.any(axis=1)):
            key = steps[table.offsets[index] : table.offsets[index + 1]].tobytes()
            counts[key] = counts.get(key, 0) + of_signature[index]
    keys = list(counts)
    source = np.array([_steps_of(key)[0]["source"] for key in keys], np.int64)
    of_replicate = np.array([counts[key] for key in keys], np.int64).reshape(-1, n_replicates)
    n_rays = of_replicate.sum(axis=1)
    squares = effective_squares(raymap.rays_of_replicate[source], of_replicate, n_rays)
    # every path belongs to one source, of which it is a share of the rays
    sums = (raymap.source_flux_w[source][None], raymap.rays_of_source[source][None], n_rays[None], squares[None])
    flux_w, stderr_w = estimate_flux(*sums)
    low_w, high_w = confidence_interval(*sums)
    order = sorted(range(len(keys)), key=lambda i: (-flux_w[i], -n_rays[i], keys[i]))
    names, words = raymap.names, dict[bytes, str]()
    return PathTable(
        criterion=None if where is None else format_criterion(bound.criterion),
        n_paths=len(keys),
        rays=int(n_rays.sum()),
        paths=tuple(
            DistinctPath(
                signature=_signature_text(keys[i], names, words),
                source=names.sources[source[i]],
                rays=int(n_rays[i]),
                flux_w=float(flux_w[i]),
                flux_stderr_w=float(stderr_w[i]),
                interval_w=(float(low_w[i]), float(high_w[i])),
            )
            for i in order[:limit]
        ),
    )


#: What makes a path: kind, source of the emission, place, medium of an event inside one, detector.
_STEP = np.dtype(
    [("kind", "<i4"), ("source", "<i4"), ("face", "<i4"), ("medium", "<i4"), ("detector", "<i4"), ("registered", "<i4")]
)


def _path_steps(table: SignatureTable) -> NDArray[np.void]:
    """The columns of a signature table that make a path, (n_steps,) of `_STEP`."""
    steps = np.full(len(table.kind), NONE, [(name, "<i4") for name in _STEP.names or ()])
    steps["kind"] = table.kind
    steps["source"] = table.source
    steps["detector"] = table.detector
    steps["registered"] = table.registered
    in_medium = np.isin(table.kind, IN_MEDIUM)
    steps["face"] = np.where(np.isin(table.kind, _WITHOUT_PLACE), NONE, table.face)
    events = np.flatnonzero(table.kind != EventKind.CROSSING)
    here = np.flatnonzero(in_medium[events])
    steps["medium"][events[here]] = table.medium[events[here - 1]]
    return steps


def _steps_of(key: bytes) -> NDArray[np.void]:
    return np.frombuffer(key, _STEP)


def _signature_text(key: bytes, names: Names, words: dict[bytes, str]) -> str:
    """A path in words that a reader of criteria knows; ``words`` keeps those of the steps met so far."""
    steps = [key[at : at + _STEP.itemsize] for at in range(0, len(key), _STEP.itemsize)]
    for step in set(steps) - words.keys():
        words[step] = _describe(_steps_of(step)[0], names)
    return " > ".join(words[step] for step in steps)


def _describe(step: np.void, names: Names) -> str:
    kind = EventKind(step["kind"])
    if kind is EventKind.EMISSION:
        return names.sources[step["source"]]
    if kind is EventKind.CROSSING:
        detector = names.detectors[step["detector"]]
        return f"[{detector}]" if step["registered"] == 1 else f"({detector})"
    if kind in IN_MEDIUM:
        return f"{names.media[step['medium']]} {kind.label}"
    if step["face"] != NONE:
        return f"{names.face_label(step['face'])} {kind.label}"
    return kind.label
