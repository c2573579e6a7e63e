# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where a ray goes that Embree's hits can't tell: decided in float64 over all faces.

Few rays need it: next to edges that float32 can't tell from the ray's start, between an exact surface and its facets,
within a rounding of an edge or a corner.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raymaps.boundary import Boundary
from raymaps.compile import Tables
from raymaps.kernels import transport
from raymaps.wave import Found, Wave

__all__ = ["MAX_SEARCHES", "SlowSearch"]

#: How often a search may be taken up again behind a hit that is no crossing.
MAX_SEARCHES = 16
#: Triangles that are looked at for a ray: one that runs along a rod has all of its strips around it.
MAX_PROPOSED = 1024
#: Rays that are looked at in one go, for the sake of memory.
BATCH = 1024


class SlowSearch:
    """Searches the faces of one scene; may be used by several threads at once.

    Parameters
    ----------
    tables : Tables
    boundary : Boundary
    """

    def __init__(self, tables: Tables, boundary: Boundary):
        self._tables, self._boundary = tables, boundary
        solid = boundary.solid[tables.triangle_face]
        self._triangles = [np.flatnonzero(solid == rank) for rank in range(len(boundary.solid_medium))]

    def decide(self, rays: NDArray[np.int32], wave: Wave) -> None:
        """Let rays arrive somewhere or leave; kill those for which nothing agrees with the solids that they are in."""
        for first in range(0, len(rays), BATCH):
            self._decide(rays[first : first + BATCH], wave)

    def _decide(self, rays: NDArray[np.int32], wave: Wave) -> None:
        tables, boundary = self._tables, self._boundary
        shape = len(rays), MAX_PROPOSED
        hits, ways, guesses = np.empty(shape, np.int32), np.empty(shape, np.int8), np.empty(shape)
        transport.propose(rays, wave, tables, boundary, hits, ways, guesses)
        going = np.flatnonzero(wave.n_short[rays] < transport.MAX_SHORT)
        for _ in range(MAX_SEARCHES):
            found, searched = Found.allocate(len(going), MAX_PROPOSED), np.zeros(len(going))
            transport.locate(
                rays[going], wave, tables, boundary, searched, hits[going], ways[going], guesses[going], found, True
            )
            going = going[wave.state[rays[going]] == transport.SEARCHING]  # past surfaces that change nothing
            if not len(going):
                break
        open_ = np.flatnonzero(np.isin(wave.state[rays], (transport.SEARCHING, transport.DOUBTFUL)))
        if len(open_):
            self._classify(rays[open_], wave, hits[open_], ways[open_], guesses[open_])

    def _classify(
        self,
        rays: NDArray[np.int32],
        wave: Wave,
        hits: NDArray[np.int32],
        ways: NDArray[np.int8],
        guesses: NDArray[np.float64],
    ) -> None:
        """Decide by the solids that are around the clear places of each ray's line."""
        from raymaps.kernels import membership

        tables, boundary = self._tables, self._boundary
        found, chosen = Found.allocate(*hits.shape), Found.allocate(*hits.shape)
        count, verdict = np.empty(len(rays), np.int64), np.empty(len(rays), np.int8)
        clear = np.full((len(rays), hits.shape[1] + 1), np.nan)
        membership.gather(rays, wave, tables, boundary, hits, ways, guesses, found, count, clear)
        k, place = np.nonzero(np.isfinite(clear))
        points = wave.position[rays[k]] + clear[k, place, None] * wave.direction[rays[k]]
        inside = np.zeros((*clear.shape, wave.inside.shape[1]), np.uint64)
        known = np.zeros_like(inside)
        inside[k, place], known[k, place] = self._solids_around(points)
        membership.classify(rays, wave, tables, boundary, found, count, clear, inside, known, chosen, verdict)
        wave.state[rays[verdict > 0]] = transport.PENDING
        transport.leave(rays[verdict == 0], wave, tables, boundary)
        transport.lose(rays[verdict < 0], wave)

    def _solids_around(self, points: NDArray[np.float64]) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
        """Solids that points are in, (n, n_words) bits, and those of which that is certain."""
        from raymaps.kernels.membership import mark_clear
        from raymaps.solids.mesh_kernel import winding_numbers

        boundary = self._boundary
        inside = np.zeros((len(points), len(boundary.far)), np.uint64)
        known = np.zeros_like(inside)
        winding, clear = np.empty(len(points)), np.empty(len(points), np.bool_)
        for rank, triangles in enumerate(self._triangles):
            word, bit = rank // 64, np.uint64(1 << rank % 64)
            corners = boundary.corners[triangles]
            winding_numbers(corners, points, winding)
            mark_clear(points, corners, boundary.reach[triangles], clear)
            reaches_far = bool(boundary.far[word] & bit)
            inside[winding > (-0.5 if reaches_far else 0.5), word] |= bit
            known[clear, word] |= bit
        return inside, known
