# SPDX-License-Identifier: LGPL-2.1-or-later
"""Fluxes whose errors a run can be asked for, added up portion by portion as detectors and criteria do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import bind, decided, format_criterion, matching_rays, parse_criterion, rays_per_replicate
from raymaps.errors import CriterionError, unknown_name
from raymaps.kinds import ENDINGS
from raymaps.names import Names
from raymaps.results.cells import Samples, sum_samples
from raymaps.results.detector import checked_region, crossing_samples
from raymaps.results.face_detector import face_samples
from raymaps.results.far_field import far_field_samples
from raymaps.results.figures import asked_rays
from raymaps.scene import Detector, FaceDetector, FarFieldDetector
from raymaps.target.aim import Target
from raymaps.target.rule import Tally

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["Quantity", "check_target", "quantities"]


@dataclass(frozen=True)
class Quantity:
    """A flux.

    Attributes
    ----------
    words : str
        What it is, for people.
    tally : function of a portion to its sums
    exact : (n_sources,) bool
        Sources that have no error, as they alone decide.
    """

    words: str
    tally: Callable[[Portion], Tally]
    exact: NDArray[np.bool_]


def check_target(target: Target, names: Names, detectors: Mapping[str, Detector]) -> None:
    """Raise `CriterionError` if a scene has not what a target names."""
    if target.where is not None:
        bind(target.where, names, detectors)
    name = _detector(target, names)
    if name is not None:
        checked_region(name, detectors[name], target.rect, target.ellipse)


def _detector(target: Target, names: Names) -> str | None:
    """Name of the detector that is meant; None if none is."""
    if target.detector is not None and target.detector not in names.detectors:
        raise CriterionError(unknown_name("detector", target.detector, names.detectors))
    if target.detector is None and (target.rect is not None or target.ellipse is not None):
        if len(names.detectors) != 1:
            raise CriterionError(
                f"A region of the target is one of a detector, and the scene has {len(names.detectors)}: name it."
            )
        return names.detectors[0]
    return target.detector


def quantities(raymap: RayMap, target: Target) -> tuple[Quantity, ...]:
    """What a target may mean; where there are several, the least certain one is meant."""
    name = _detector(target, raymap.names)
    if name is not None:
        return (_of_detector(raymap, name, target),)
    if target.where is not None:
        return (_of_criterion(raymap, target.where),)
    if raymap.names.detectors:
        return tuple(_of_detector(raymap, name, target) for name in raymap.names.detectors)
    return (_of_absorbed(raymap),)


def _of_detector(raymap: RayMap, name: str, target: Target) -> Quantity:
    detector = raymap.scene.detectors[name]
    asked = asked_rays(raymap, None, target.where)
    n_cells: tuple[int, ...] = ()
    samples_of: Callable[[Portion], Samples | None]
    if isinstance(detector, FaceDetector):
        samples_of = face_samples(raymap, name, detector, asked)
    elif isinstance(detector, FarFieldDetector):
        samples_of = far_field_samples(asked)
    else:
        area = checked_region(name, detector, target.rect, target.ellipse)
        samples_of, n_cells = crossing_samples(raymap, name, detector, asked, area=area), (1,)

    def tally(portion: Portion) -> Tally:
        piece = raymap.of_portions([portion])
        sums, rays = sum_samples(piece, samples_of, n_cells), piece.rays_of_replicate
        return Tally(
            rays.astype(np.float64), sums.groups.total.reshape(rays.shape), sums.groups.squares.reshape(rays.shape),
            sums.n_rays,
        )  # fmt: skip

    words = f"detector '{name}'"
    words += " in a region" if target.rect is not None or target.ellipse is not None else ""
    words += f" where {asked.criterion}" if asked.criterion is not None else ""
    return Quantity(words, tally, asked.impossible)


def _of_criterion(raymap: RayMap, where: str) -> Quantity:
    bound = bind(where, raymap.names, raymap.scene.detectors)
    n_sources = len(raymap.names.sources)

    def tally(portion: Portion) -> Tally:
        piece = raymap.of_portions([portion])
        found = rays_per_replicate(piece, portion, matching_rays(portion, bound)).astype(np.float64)
        return Tally(piece.rays_of_replicate.astype(np.float64), found, found, int(found.sum()))

    words = f"rays where {format_criterion(parse_criterion(where))}"
    return Quantity(words, tally, decided(bound, np.ones(n_sources, np.int64)))


def _of_absorbed(raymap: RayMap) -> Quantity:
    """What of each ray's light bodies and media took: all of it but for what left or was killed."""

    def tally(portion: Portion) -> Tally:
        table, power, piece = portion.signatures, portion.power, raymap.of_portions([portion])
        remains = np.isin(table.ending, [*ENDINGS["left"], *ENDINGS["killed"]])[portion.ray_signature]
        light = power[portion.event_offsets[:-1]] - np.where(remains, power[portion.event_offsets[1:] - 1], 0.0)
        light = np.where(light > 1e-6, light, 0.0)  # rounding
        group, rays = piece.group_of_rays(portion), piece.rays_of_replicate
        total, squares = np.zeros(rays.size), np.zeros(rays.size)
        np.add.at(total, group, light)
        np.add.at(squares, group, light**2)
        return Tally(
            rays.astype(np.float64), total.reshape(rays.shape), squares.reshape(rays.shape), int((light > 0).sum())
        )

    return Quantity("the light that is absorbed", tally, np.zeros(len(raymap.names.sources), bool))
