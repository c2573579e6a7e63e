# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which solids touch, overlap or stand in each other, told from their facets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from raymaps.frame import Frame
from raymaps.geometry import BodyMesh
from raymaps.kinds import CONTACT
from raymaps.scene import Scene
from raymaps.solids.facets import facet_slack
from raymaps.solids.ranks import rank_solids
from raymaps.solids.sweep import Boxes

__all__ = ["Overlap", "overlaps"]

#: Places of a solid that are looked at: of those of its triangles that are near the other solid.
PLACES = 256
#: Share of these places that lie in the other solid if it holds this one: some near sharp edges may not.
WHOLE = 0.95


@dataclass(frozen=True)
class Overlap:
    """Two solids that have faces or a part of space in common.

    Attributes
    ----------
    first, second : int
        Indices of the bodies. ``inside``: the first stands in the second. Else in the order of the scene.
    kind : str
        ``touch``: only their faces meet; ``overlap``; ``inside``.
    ruling : int
        The body whose medium fills what they have in common.
    faces : tuple of two tuples of str
        Faces of the first and of the second that meet.
    depth_mm : float
        How far one reaches into the other, about; 0 if they touch.
    within_mm : float
        Distance that the facets can't tell from a contact.
    """

    first: int
    second: int
    kind: Literal["touch", "overlap", "inside"]
    ruling: int
    faces: tuple[tuple[str, ...], tuple[str, ...]]
    depth_mm: float
    within_mm: float


def overlaps(scene: Scene, meshes: tuple[BodyMesh, ...], frame: Frame) -> Iterator[Overlap]:
    """Pairs of solids that touch, overlap or stand in each other, in the order of the scene.

    Facets of curved faces stand off the true surface, so whatever is nearer than that counts as a touch.
    """
    bodies = list(scene.bodies.values())
    ranked = [i for i in rank_solids(scene, meshes) if bodies[i].medium is not None]
    rank = {body: rank for rank, body in enumerate(ranked)}
    bodies = list(scene.bodies.values())
    solids = sorted(body for body in ranked if bodies[body].medium is not None)
    corners = [frame.to_units(meshes[i].corners_mm) for i in solids]
    slack = [facet_slack(meshes[i]) / frame.unit_mm for i in solids]
    if not solids:
        return
    boxes = Boxes(np.concatenate(corners), np.concatenate(slack) + CONTACT / 2, [len(part) for part in corners])
    for a, b in boxes.body_pairs():
        first, second = solids[a], solids[b]
        ruling = min(first, second, key=rank.__getitem__)
        pair = _Pair(boxes, (a, b))
        if pair.kind is None:
            continue
        faces = tuple(
            tuple(meshes[body].face_names[i] for i in np.unique(meshes[body].triangle_face[rows]))
            for body, rows in zip((first, second), pair.touching, strict=True)
        )
        depth_mm, within_mm = pair.depth * frame.unit_mm, pair.within * frame.unit_mm
        if pair.kind == "contains":
            yield Overlap(second, first, "inside", ruling, (faces[1], faces[0]), depth_mm, within_mm)
        else:
            yield Overlap(first, second, pair.kind, ruling, (faces[0], faces[1]), depth_mm, within_mm)


class _Pair:
    """Two bodies with overlapping boxes; ``kind`` is None if they are clear of each other."""

    def __init__(self, boxes: Boxes, bodies: tuple[int, int]):
        from raymaps.solids.mesh_kernel import crossing_depth, mark_close

        a, b = bodies
        rows = boxes.rows_near(a, b), boxes.rows_near(b, a)
        self.within = self.depth = 0.0
        self.touching = tuple(row[:0] for row in rows)
        self.kind: Literal["touch", "overlap", "inside", "contains"] | None = None
        if not len(rows[0]) and not len(rows[1]):
            return
        close = np.zeros(len(boxes.radius), np.bool_)
        is_close = False
        for pairs in boxes.pairs(*rows):
            is_close = bool(mark_close(pairs, boxes.corners, boxes.radius, is_close, close))
            self.depth = max(self.depth, float(crossing_depth(pairs, boxes.corners, boxes.radius)))
        self.touching = tuple(row[close[row]] - boxes.starts[body] for row, body in zip(rows, bodies, strict=True))
        self.within = sum(float(boxes.radius[row].max(initial=0.0)) for row in rows)

        depths = [_depths(boxes, rows[k], (bodies[k], bodies[1 - k]), 2 * self.within) for k in (0, 1)]
        n_triangles = [boxes.starts[body + 1] - boxes.starts[body] for body in bodies]
        whole = [
            len(rows[k]) == n_triangles[k] and np.count_nonzero(depths[k]) > WHOLE * len(depths[k]) for k in (0, 1)
        ]
        crosses = self.depth > 0
        self.depth = max(self.depth, *(float(part.max(initial=0.0)) for part in depths))
        if whole[0] != whole[1] and not crosses:
            self.kind = "inside" if whole[0] else "contains"
        elif self.depth > 0:
            self.kind = "overlap"
        elif is_close:
            self.kind, self.depth = "touch", 0.0


def _depths(boxes: Boxes, rows: NDArray[np.int64], bodies: tuple[int, int], below: float) -> NDArray[np.float64]:
    """How deep places just below triangles of the first body lie in the second, (n_places,); 0 outside."""
    from raymaps.solids.mesh_kernel import distances_to

    points = _places(boxes.corners[rows], below)
    own, other = (boxes.corners[boxes.starts[body] : boxes.starts[body + 1]] for body in bodies)
    points = points[_lie_in(own, points)]  # not beyond the far side of a foil
    inside = _lie_in(other, points)
    distance = np.empty(int(inside.sum()))
    distances_to(other, points[inside], distance)
    depth = np.zeros(len(points))
    depth[inside] = distance
    return depth


def _lie_in(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether points are inside a closed mesh."""
    from raymaps.solids.mesh_kernel import winding_numbers

    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    near = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
    winding = np.empty(len(near))
    winding_numbers(corners, points[near], winding)
    inside = np.zeros(len(points), np.bool_)
    inside[near] = winding > 0.5
    return inside


def _places(corners: NDArray[np.float64], below: float) -> NDArray[np.float64]:
    """Evenly spread places of triangles, (n, 3): some that share their area, and middles of some, moved inward."""
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(area, axis=1)
    sound = np.flatnonzero(size > 0)
    if not len(sound):
        return np.zeros((0, 3))
    some = sound[np.unique(np.linspace(0, len(sound) - 1, PLACES // 2).astype(np.int64))]
    step = np.arange(PLACES // 2) + 0.5
    at = np.minimum(np.searchsorted(np.cumsum(size), step / len(step) * size.sum()), len(size) - 1)
    # additive recurrence with the plastic number: low discrepancy in two dimensions
    u, v = np.modf(step * 0.7548776662466927)[0], np.modf(step * 0.5698402909980532)[0]
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = np.moveaxis(corners[at], 1, 0)
    spread = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    rows = np.concatenate([at, some])
    points = np.concatenate([spread, corners[some].mean(axis=1)])
    return points - below * area[rows] / size[rows][:, None]
