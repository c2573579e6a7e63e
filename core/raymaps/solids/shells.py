# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is odd about the triangles of one body: open or branching edges, double triangles, faces through each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import listed
from raymaps.geometry import BodyMesh
from raymaps.solids.sweep import Boxes

__all__ = ["crossing_triangles", "double_triangles", "oddities"]

#: Triangles that go through each other by less than this share of the body's size may do so by rounding.
ROUNDING = 1e-7


def oddities(mesh: BodyMesh) -> Iterator[str]:
    """What is worth knowing about a body's triangles, a sentence each."""

    def faces(triangles: NDArray[np.int64]) -> str:
        return listed([mesh.face_names[i] for i in np.unique(mesh.triangle_face[triangles])])

    body = f"Body '{mesh.name}'"
    if mesh.degenerate.any():
        first = int(np.flatnonzero(mesh.degenerate)[0])
        face = mesh.face_names[mesh.triangle_face[first]]
        yield (
            f"{body}: {int(mesh.degenerate.sum())} of {len(mesh.triangles)} triangles have no area, the first is "
            f"number {first} in face '{face}'; no light can hit them, so they are passed over."
        )
    double = double_triangles(mesh)
    if len(double):
        yield (
            f"{body}: {len(double)} triangles have the corners of an earlier one (faces {faces(double)}); light can't "
            "tell which it meets: delete them."
        )
    branching = np.flatnonzero((mesh.edge_uses > 2).any(axis=1))
    if len(branching):
        yield (
            f"{body}: {len(branching)} triangles have an edge that more than two share (faces {faces(branching)}); "
            "where the body touches itself, light may pass unseen."
        )
    if not mesh.is_closed:
        if mesh.is_closed_but_for_turns:
            yield (
                f"{body}: its triangles do not agree which side is outside (faces {faces(mesh.open_edges)}); sources "
                "on these faces and detectors of one side may look the wrong way."
            )
        else:
            yield f"{body} is an open shell: its surface acts on both sides."
    elif mesh.volume_mm3 < 0:
        yield f"{body} is inside out: the fronts of its faces look inward, and so does what they emit."
    crossing = crossing_triangles(mesh)
    if len(crossing):
        where = ", ".join(f"{x:.4g}" for x in mesh.corners_mm[crossing[0]].mean(axis=0))
        yield (
            f"{body} goes through itself: {len(crossing)} triangles cross others (faces {faces(crossing)}; one is near "
            f"{where} mm); repair the model, or cut thin walls into smaller triangles."
        )


def double_triangles(mesh: BodyMesh) -> NDArray[np.int64]:
    """Triangles with an area whose three corners are those of an earlier triangle."""
    sound = np.flatnonzero(~mesh.degenerate)
    corner = np.sort(mesh.corner_places[sound], axis=1)
    _, first = np.unique(corner, axis=0, return_index=True)
    return np.delete(sound, first)


def crossing_triangles(mesh: BodyMesh) -> NDArray[np.int64]:
    """Triangles that go through others of the same body with which they share no corner."""
    from raymaps.solids.mesh_kernel import mark_crossing

    size = float(np.ptp(mesh.vertices_mm, axis=0).max())
    boxes = Boxes((mesh.corners_mm - mesh.vertices_mm.mean(axis=0)) / size, np.zeros(len(mesh.triangles)), [])
    crossing = np.zeros(len(mesh.triangles), np.bool_)
    for pairs in boxes.pairs(np.flatnonzero(~mesh.degenerate)):
        mark_crossing(pairs, boxes.corners, mesh.corner_places, ROUNDING, crossing)
    return np.flatnonzero(crossing)
