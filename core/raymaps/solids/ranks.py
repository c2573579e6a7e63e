# SPDX-License-Identifier: LGPL-2.1-or-later
"""Priority among solids, and which of them contain a point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.geometry import BodyMesh
from raymaps.scene import Scene

__all__ = ["SAME_VOLUME", "medium_at", "medium_of", "rank_solids", "solids_at", "why_it_rules"]

#: Volumes that differ by less, relative to each other, are equal: moving or turning a scene changes their last digits.
SAME_VOLUME = 1e-9
#: Solids a word of bits.
WORD = 64


def rank_solids(scene: Scene, meshes: tuple[BodyMesh, ...]) -> tuple[int, ...]:
    """Index of the body of each solid, by rank.

    Bodies with a medium: the highest priority first, then the smaller volume, then the later. Last the bodies without
    one that part space: rays know on which side of their surfaces they are.
    """
    solids = [i for i, body in enumerate(scene.bodies.values()) if body.medium is not None]
    priority = [body.priority for body in scene.bodies.values()]
    size = dict(zip(solids, _size_classes([meshes[i].volume_mm3 for i in solids]), strict=True))
    shells = [i for i, body in enumerate(scene.bodies.values()) if body.medium is None and meshes[i].parts_space]
    return (*sorted(solids, key=lambda i: (-priority[i], size[i], -i)), *shells)


def why_it_rules(scene: Scene, meshes: tuple[BodyMesh, ...], ruling: int, other: int) -> str:
    """Reason in words why one body rules where it has space in common with another."""
    bodies = list(scene.bodies.values())
    if bodies[ruling].priority != bodies[other].priority:
        return "its priority is higher"
    small, large = _size_classes([meshes[ruling].volume_mm3, meshes[other].volume_mm3])
    return "it is smaller" if small != large else "it is later in the scene"


def _size_classes(volumes: list[float]) -> list[int]:
    """Volumes as integers in the same order, equal for equal volumes."""
    classes = [0] * len(volumes)
    smallest, current = 0.0, 0
    for k in sorted(range(len(volumes)), key=volumes.__getitem__):
        if volumes[k] > smallest * (1 + SAME_VOLUME):
            smallest, current = volumes[k], current + 1
        classes[k] = current
    return classes


def solids_at(scene: Scene, meshes: tuple[BodyMesh, ...], points_mm: NDArray[np.float64]) -> NDArray[np.uint64]:
    """Which solids contain each point, by the winding number of their triangles.

    Parameters
    ----------
    points_mm : (n_points, 3) float64
        Points on a face count as before it.

    Returns
    -------
    (n_points, n_words) uint64; bit ``rank % 64`` of word ``rank // 64`` is set for each solid that contains the point:
    for each whose triangles the point is behind.
    """
    from raymaps.solids.mesh_kernel import winding_numbers

    points_mm = np.ascontiguousarray(points_mm, np.float64)
    ranked = rank_solids(scene, meshes)
    bits = np.zeros((len(points_mm), max(1, -(-len(ranked) // WORD))), np.uint64)
    for rank, i in enumerate(ranked):
        low, high = meshes[i].vertices_mm.min(axis=0), meshes[i].vertices_mm.max(axis=0)
        winding = np.zeros(len(points_mm))
        near = np.flatnonzero(((points_mm >= low) & (points_mm <= high)).all(axis=1))
        if len(near):
            found = np.empty(len(near))
            winding_numbers(np.ascontiguousarray(meshes[i].corners_mm), points_mm[near], found)
            winding[near] = found
        behind = winding > (-0.1 if reaches_far(scene, meshes, i) else 0.9)  # on a face light starts before it
        bits[behind, rank // WORD] |= np.uint64(1 << rank % WORD)
    return bits


def reaches_far(scene: Scene, meshes: tuple[BodyMesh, ...], body: int) -> bool:
    """Whether what is behind a body's triangles is all around it: a room whose walls look inwards."""
    return tuple(scene.bodies.values())[body].medium is None and meshes[body].parts_space < 0


def medium_of(solids: NDArray[np.uint64], medium: NDArray[np.int16], ambient: int) -> NDArray[np.int16]:
    """Medium where a set of solids is.

    Parameters
    ----------
    solids : (n_points, n_words) uint64
        As of `solids_at`.
    medium : (n_solids,) int16
        Medium of each solid, by rank; -1 for none.
    ambient : int
        Medium where there is no solid.

    Returns
    -------
    (n_points,) int16
    """
    found = np.full(len(solids), ambient, np.int16)
    for rank in reversed(np.flatnonzero(medium >= 0).tolist()):
        found[(solids[:, rank // WORD] >> np.uint64(rank % WORD)) & np.uint64(1) == 1] = medium[rank]
    return found


def medium_at(
    scene: Scene,
    meshes: tuple[BodyMesh, ...],
    media: tuple[str, ...],
    ambient: int,
    points_mm: NDArray[np.float64],
) -> NDArray[np.int16]:
    """Medium at each point, (n_points,) int16, an index into ``media``; ``ambient`` outside of all solids."""
    bodies = list(scene.bodies.values())
    medium = np.array(
        [media.index(name) if (name := bodies[i].medium) else -1 for i in rank_solids(scene, meshes)], np.int16
    )
    return medium_of(solids_at(scene, meshes, points_mm), medium, ambient)
