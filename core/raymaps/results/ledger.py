# SPDX-License-Identifier: LGPL-2.1-or-later
"""The energy ledger: where all emitted light went."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from raymaps.kinds import KILL_REASONS
from raymaps.store import LedgerEntry, RayMap

__all__ = ["Ledger", "energy_ledger"]


@dataclass(frozen=True)
class Ledger:
    """Radiant fluxes in W; emitted = absorbed + escaped + killed, but for rounding.

    ``absorbed_w`` is the sum over bodies and media; ``killed_w`` that over the reasons.
    """

    emitted_w: float
    absorbed_w: float
    escaped_w: float
    killed_w: float
    absorbed_by_body_w: dict[str, float]
    absorbed_by_medium_w: dict[str, float]
    killed_by_reason_w: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """As in ``raymaps info --json``."""
        return dict(self.__dict__)


def energy_ledger(raymap: RayMap) -> Ledger:
    """Add up where the light of all rays of a map went.

    Light that is recorded as killed did not end by physics: ``depth`` is the limit of events a ray,
    ``numerical`` a ray that lost its way; ``medium_mismatch``, in maps of older versions only, a ray that met the
    boundary of another medium than the one it travelled in.
    """
    names, watts = raymap.names, raymap.ray_flux_w
    entries = [entry for portion in raymap.portions for entry in portion.summary.ledger]

    def sums(what: str, labels: Iterable[tuple[int, str]]) -> dict[str, float]:
        return {label: _flux(entries, watts, what, index) for index, label in labels}

    by_body = sums("body", enumerate(names.bodies))
    by_medium = sums("medium", enumerate(names.media))
    by_reason = sums("killed", ((int(kind), reason) for kind, reason in KILL_REASONS.items()))
    present = raymap.rays_of_source > 0
    return Ledger(
        emitted_w=math.fsum(raymap.source_flux_w[present]),
        absorbed_w=math.fsum([*by_body.values(), *by_medium.values()]),
        escaped_w=_flux(entries, watts, "escaped", 0),
        killed_w=math.fsum(by_reason.values()),
        absorbed_by_body_w=by_body,
        absorbed_by_medium_w=by_medium,
        killed_by_reason_w=by_reason,
    )


def _flux(entries: list[LedgerEntry], watts: Any, what: str, index: int) -> float:
    return math.fsum(
        entry.light * watts[entry.source] for entry in entries if (entry.what, entry.index) == (what, index)
    )
