# SPDX-License-Identifier: LGPL-2.1-or-later
"""The paths of matching rays as coloured segments, for the 3D view and for pictures."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import Criterion, Everything, bind, matches
from raymaps.errors import CriterionError
from raymaps.results.colours import light_colours
from raymaps.results.files import new_file

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["MAX_RAYS", "MAX_SEGMENTS", "Overlay", "overlay"]

#: What a 3D view redraws without a delay, also where a processor does the drawing.
MAX_RAYS, MAX_SEGMENTS = 10_000, 100_000


@dataclass(frozen=True)
class Overlay:
    """Segments of whole rays, one ray after the other, each from its emission to its end.

    Attributes
    ----------
    segments_mm : (n, 6) float32
        Start and end of each segment: x0, y0, z0, x1, y1, z1.
    light : (n, 3 bands) float32
        Light along each segment as it is drawn: its bands add up to what is left of the ray's emission.
    ray : (n,) int64
        Number of the ray that each segment belongs to.
    rays : int
        Rays shown.
    matching, scanned : int
        Matching rays among those that were looked at to find enough.
    """

    segments_mm: NDArray[np.float32] = field(repr=False)
    light: NDArray[np.float32] = field(repr=False)
    ray: NDArray[np.int64] = field(repr=False)
    rays: int
    matching: int
    scanned: int

    def __post_init__(self) -> None:
        for array in (self.segments_mm, self.light, self.ray):
            array.setflags(write=False)

    @property
    def n_segments(self) -> int:
        """Number of segments."""
        return len(self.ray)

    @property
    def rgba(self) -> NDArray[np.uint32]:
        """Colour of each segment, 0xRRGGBBAA: the hue of its light, brighter the more is left; (n,) uint32."""
        red, green, blue = light_colours(self.light).astype(np.uint32).T
        return (red << 24) | (green << 16) | (blue << 8) | np.uint32(0xFF)

    def write(self, path: str | Path) -> Path:
        """Write all segments as little-endian float32, then all colours as little-endian uint32."""
        with new_file(path) as making, making.open("wb") as stream:
            stream.write(self.segments_mm.astype("<f4").tobytes())
            stream.write(self.rgba.astype("<u4").tobytes())
        return Path(path)

    def to_dict(self) -> dict[str, Any]:
        """The counts, as the server tells them."""
        return {
            "segments": self.n_segments,
            "rays": self.rays,
            "matching": self.matching,
            "scanned": self.scanned,
        }


def overlay(
    raymap: RayMap,
    where: Criterion | str | None = None,
    max_rays: int = MAX_RAYS,
    max_segments: int = MAX_SEGMENTS,
) -> Overlay:
    """Segments of the first rays that match a criterion.

    Parameters
    ----------
    raymap : RayMap
    where : Criterion or str, optional
    max_rays, max_segments : int
        Rays are added whole until the next one would exceed one of the two.

    Raises
    ------
    CriterionError
        If the criterion can't be read or names something that the map does not hold, or a limit is negative.
    """
    if max_rays < 0 or max_segments < 0:
        raise CriterionError(f"At least 0 rays and segments can be shown, got {max_rays} and {max_segments}.")
    bound = bind(Everything() if where is None else where, raymap.names, raymap.scene.detectors)
    chunks: list[tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]] = []
    shown = n_segments = matching = scanned = 0
    for portion, rays in matches(raymap, bound):
        matching += len(rays)
        scanned += portion.n_rays
        lengths = np.diff(portion.event_offsets)[rays] - 1
        fits = int(np.searchsorted(n_segments + np.cumsum(lengths), max_segments, side="right"))
        chosen = rays[: min(fits, max_rays - shown)]
        if len(chosen):
            chunks.append(_segments(portion, chosen))
        shown += len(chosen)
        n_segments += int(lengths[: len(chosen)].sum())
        if shown == max_rays or len(chosen) < len(rays):
            break
    empty = (np.zeros((0, 6), np.float32), np.zeros((0, 3), np.float32), np.zeros(0, np.int64))
    segments_mm, light, ray = (np.concatenate(parts) for parts in zip(empty, *chunks, strict=True))
    return Overlay(segments_mm, light, ray, shown, matching, scanned)


def _segments(
    portion: Portion, rays: NDArray[np.int64]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]:
    """Segments, light and ray numbers of some rays of a portion."""
    first = portion.event_offsets[rays]
    lengths = portion.event_offsets[rays + 1] - first - 1
    before = np.cumsum(lengths) - lengths
    rows = np.repeat(first - before, lengths) + np.arange(lengths.sum())
    segments_mm = np.hstack([portion.position_mm[rows], portion.position_mm[rows + 1]]).astype(np.float32)
    return segments_mm, portion.shown_light[rows], portion.first_ray + np.repeat(rays, lengths)
