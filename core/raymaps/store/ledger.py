# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where the light of a portion's rays went, account by account: sums over rays, and of their squares."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from raymaps.kinds import KILL_REASONS, EventKind
from raymaps.ray_numbers import REPLICATES
from raymaps.store.summary import LedgerEntry

if TYPE_CHECKING:
    from raymaps.store.portion import Portion

__all__ = ["ROUNDING", "ledger_of", "sum_ledger"]

#: Events at which only metals and absorbing films take light.
_MOSTLY_LOSSLESS = (EventKind.FRESNEL_REFLECTION, EventKind.FRESNEL_REFRACTION, EventKind.MEDIUM_SCATTERING)
#: Share of the light that is lost by rounding in float32, at most.
ROUNDING = 1e-5


def ledger_of(portion: Portion) -> tuple[LedgerEntry, ...]:
    """The ledger of a portion that is stored: as it is, or with its squares from the events where it has none."""
    stored = portion.summary.ledger
    if all(entry.squares is not None for entry in stored):
        return stored
    table, step = portion.signatures, portion.event_step
    summed = sum_ledger(
        table.ray_source[portion.ray_signature], len(portion.names.sources), portion.event_offsets,
        table.kind[step], table.face[step], table.medium[step], portion.event_light, portion.lights.power,
        np.array([body for body, _ in portion.names.faces], np.int32),
    )  # fmt: skip
    squares = {(entry.source, entry.what, entry.index): entry.squares for entry in summed}
    places = ((entry, squares.get((entry.source, entry.what, entry.index), 0.0)) for entry in stored)
    return tuple(LedgerEntry(entry.source, entry.what, entry.index, entry.light, found) for entry, found in places)


def sum_ledger(
    source: NDArray[np.int16],
    n_sources: int,
    event_offsets: NDArray[np.int64],
    kind: NDArray[np.uint8],
    face: NDArray[np.int32],
    medium: NDArray[np.int16],
    light: NDArray[np.uint32],
    light_power: NDArray[np.float64],
    face_body: NDArray[np.int32],
    replicate: NDArray[np.uint8] | None = None,
) -> tuple[LedgerEntry, ...]:
    """Where each source's light went, summed over the rays of a portion.

    Parameters
    ----------
    source : (n_rays,)
    event_offsets : (n_rays + 1,)
    kind, face, medium : (n_events,)
        Face -1 for none; medium after the event.
    light : (n_events,)
        Row in ``light_power``, (n_lights,), of the light after each event.
    face_body : (n_faces,)
    replicate : (n_rays,), optional
        Which of the independent sets of its source's rays each is in; None or empty where each ray is independent.
    """
    from raymaps.store.numbering import sum_light  # compiled: only where it is needed

    n_bodies = int(face_body.max()) + 1 if len(face_body) else 0
    n_media = int(medium.max()) + 1
    accounts = [
        *(("body", index) for index in range(n_bodies)),
        *(("medium", index) for index in range(n_media)),
        ("escaped", 0),
        *(("killed", int(end)) for end in KILL_REASONS),
    ]
    # an event's account follows from its kind: light is lost to a body or a medium, or ends outside or killed
    by_body, by_medium, at_end = np.zeros(256, bool), np.zeros(256, bool), np.zeros(256, np.int32)
    by_body[list(EventKind)] = True
    by_body[EventKind.MEDIUM_ABSORPTION] = False
    by_medium[EventKind.MEDIUM_ABSORPTION] = True
    for index, (what, of_kind) in enumerate(accounts):
        if what in ("escaped", "killed"):
            end = EventKind.LEFT if what == "escaped" else of_kind
            by_body[end], at_end[end] = False, -1 - index
    account = at_end[kind]
    on_body = by_body[kind] & (face >= 0)
    account[on_body] = face_body[face[on_body]]
    # where an interface takes no light, what is lost on the way to it is the medium's (rounding of its recolouring)
    rows = np.flatnonzero(np.isin(kind, _MOSTLY_LOSSLESS))
    before, after = light_power[light[rows - 1]], light_power[light[rows]]
    lossless = rows[before - after <= ROUNDING * before]
    account[lossless] = n_bodies + medium[lossless - 1]
    in_medium = by_medium[kind]
    account[in_medium] = n_bodies + medium[in_medium]
    n_replicates, group = 1, source.astype(np.int64)
    if replicate is not None and len(replicate):
        n_replicates, group = REPLICATES, group * REPLICATES + replicate
    of_group, rounded = np.zeros((2, 2, n_sources * n_replicates, len(accounts)))
    sum_light(group, event_offsets, light, light_power, account, of_group, rounded, np.zeros(len(accounts)))
    by_replicate = of_group.reshape(2, n_sources, n_replicates, -1)
    sums = by_replicate.sum(axis=2)
    return tuple(
        LedgerEntry(
            int(of), accounts[index][0], accounts[index][1], float(sums[0, of, index]), float(sums[1, of, index]),
            tuple(by_replicate[0, of, :, index].tolist()) if n_replicates > 1 else (),
        )
        for of, index in zip(*np.nonzero(sums[0]), strict=True)
    )  # fmt: skip
