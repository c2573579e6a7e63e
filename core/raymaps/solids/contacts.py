# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where bodies come so close that their faces may be one interface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import SceneError
from raymaps.frame import Frame
from raymaps.geometry import BodyMesh
from raymaps.kinds import CONTACT
from raymaps.names import Names
from raymaps.scene import Scene
from raymaps.solids.facets import facet_slack
from raymaps.solids.ranks import rank_solids, reaches_far
from raymaps.solids.sweep import Boxes

__all__ = ["SolidTables", "body_layers", "close_bodies", "lower_solids"]

#: Layers that int8 holds.
MAX_LAYERS = 127


class SolidTables(NamedTuple):
    """What kernels read of solids and contacts. Solids count by rank, lengths in frame units."""

    face_solid: NDArray[np.int32]  # (n_faces,) rank of the face's solid, -1 none
    medium: NDArray[np.int16]  # (n_solids,) medium by rank, -1 none
    reaches_far: NDArray[np.bool_]  # (n_solids,) whether it is all around its triangles
    close: NDArray[np.bool_]  # (n_triangles,) may be within contact distance of a triangle of another body
    layer: NDArray[np.int8]  # (n_triangles,) colour of the body: other than that of bodies close to it; -1 not close
    slack: NDArray[np.float64]  # (n_triangles,) how far the facet may be off the surface that it stands for


def lower_solids(
    scene: Scene,
    meshes: tuple[BodyMesh, ...],
    names: Names,
    frame: Frame,
    exact: NDArray[np.bool_],
    corners: NDArray[np.float64],
    reach: NDArray[np.float64],
) -> SolidTables:
    """Rank the solids of a scene and find where bodies touch.

    Parameters
    ----------
    exact : (n_faces,) bool
        Faces whose crossings are those with an exact surface: they have no slack.
    corners : (n_triangles, 3 corners, 3) float64
        Of the bounding mesh, in frame units.
    reach : (n_triangles,) float64
        How far the exact surface may lie from each triangle, in frame units.

    Raises
    ------
    SceneError
        If more than 127 bodies all touch each other.
    """
    bodies = list(scene.bodies.values())
    n_triangles = [len(mesh.triangles) for mesh in meshes]
    ranked = rank_solids(scene, meshes)
    rank_of_body = {body: rank for rank, body in enumerate(ranked)}
    triangle_face = np.concatenate([np.zeros(0, np.int64), *_faces_counted_through(meshes)])
    slack_mm = np.concatenate([np.zeros(0), *(facet_slack(mesh) for mesh in meshes)])
    slack = np.where(exact[triangle_face], 0.0, slack_mm / frame.unit_mm)

    close = np.zeros(sum(n_triangles), np.bool_)
    boxes = Boxes(corners, reach + slack + CONTACT / 2, n_triangles)
    has_medium = [body.medium is not None for body in bodies]
    layers = body_layers(len(bodies), close_bodies(boxes, has_medium, close))
    return SolidTables(
        face_solid=np.array([rank_of_body.get(body, -1) for body, _ in names.faces], np.int32),
        medium=np.array([names.media.index(name) if (name := bodies[i].medium) else -1 for i in ranked], np.int16),
        reaches_far=np.array([reaches_far(scene, meshes, i) for i in ranked], np.bool_),
        close=close,
        layer=np.where(close, np.repeat(np.array(layers, np.int8), n_triangles), np.int8(-1)),
        slack=slack,
    )


def _faces_counted_through(meshes: tuple[BodyMesh, ...]) -> list[NDArray[np.int64]]:
    """Face of each triangle of each body, faces of all bodies counted in one row."""
    starts = np.cumsum([0, *(len(mesh.face_names) for mesh in meshes)])
    return [mesh.triangle_face + start for mesh, start in zip(meshes, starts[:-1], strict=True)]


def close_bodies(boxes: Boxes, has_medium: list[bool], close: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Pairs of bodies that come within contact distance of each other; bodies without a medium only those with one.

    Parameters
    ----------
    boxes : Boxes
        Of all triangles of all bodies, inflated by half of the distance.
    has_medium : (n_bodies,) list of bool
    close : (n_triangles,) bool, set for the triangles concerned
    """
    found = []
    for a, b in boxes.body_pairs():
        if (has_medium[a] or has_medium[b]) and boxes.mark_close(a, b, close):
            found.append((a, b))
    return found


def body_layers(n_bodies: int, pairs: list[tuple[int, int]]) -> list[int]:
    """A small number for each body, other than those of all bodies that it is paired with.

    Greedy colouring, bodies with many partners first: bodies on one board need two layers, whatever their number.
    """
    partners: list[set[int]] = [set() for _ in range(n_bodies)]
    for a, b in pairs:
        partners[a].add(b)
        partners[b].add(a)
    layers = [-1] * n_bodies
    for body in sorted(range(n_bodies), key=lambda i: -len(partners[i])):
        taken = {layers[other] for other in partners[body]}
        layers[body] = next(layer for layer in range(n_bodies) if layer not in taken)
    if max(layers, default=0) >= MAX_LAYERS:
        raise SceneError(f"More than {MAX_LAYERS} bodies all touch each other: join some of them.")
    return layers
