# SPDX-License-Identifier: LGPL-2.1-or-later
"""The energy ledger: where all emitted light went, each account with its standard error."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import confidence_interval, effective_squares, estimate_flux
from raymaps.kinds import KILL_REASONS
from raymaps.store import LedgerEntry, RayMap, ledger_of

__all__ = ["ROUNDING", "Account", "Ledger", "energy_ledger"]

Float = NDArray[np.float64]

#: Share of the light below which a figure is rounding, and shown as 0.
ROUNDING = 1e-9
#: Share of a ray's light that is rounding of float32, if all such light is rounding too.
_OF_A_RAY = 1e-5


@dataclass(frozen=True)
class Account:
    """A row of the ledger: its light with its standard error and 95 % confidence interval, in W."""

    flux_w: float
    stderr_w: float
    interval_w: tuple[float, float]


@dataclass(frozen=True)
class Ledger:
    """Radiant fluxes in W; emitted = absorbed + escaped + killed, but for rounding.

    ``absorbed`` is the sum over bodies and media, ``killed`` that over the reasons; their errors are less than those of
    the parts suggest, as a ray that loses less here loses more there.
    """

    emitted_w: float
    absorbed: Account
    escaped: Account
    killed: Account
    absorbed_by_body: dict[str, Account]
    absorbed_by_medium: dict[str, Account]
    killed_by_reason: dict[str, Account]

    @property
    def absorbed_w(self) -> float:
        """Light that bodies and media took."""
        return self.absorbed.flux_w

    @property
    def escaped_w(self) -> float:
        """Light that left the scene."""
        return self.escaped.flux_w

    @property
    def killed_w(self) -> float:
        """Light that did not end by physics."""
        return self.killed.flux_w

    @property
    def absorbed_by_body_w(self) -> dict[str, float]:
        """Light that each body took."""
        return {name: account.flux_w for name, account in self.absorbed_by_body.items()}

    @property
    def absorbed_by_medium_w(self) -> dict[str, float]:
        """Light that each medium took."""
        return {name: account.flux_w for name, account in self.absorbed_by_medium.items()}

    @property
    def killed_by_reason_w(self) -> dict[str, float]:
        """Light that was killed, by reason."""
        return {name: account.flux_w for name, account in self.killed_by_reason.items()}

    def to_dict(self) -> dict[str, Any]:
        """As in ``raymaps info --json``: of each account ``..._w``, ``..._stderr_w`` and ``..._interval_w``."""
        data: dict[str, Any] = {"emitted_w": self.emitted_w, "emitted_stderr_w": 0.0}
        for name in ("absorbed", "escaped", "killed"):
            account: Account = getattr(self, name)
            data |= {f"{name}_w": account.flux_w, f"{name}_stderr_w": account.stderr_w}
            data[f"{name}_interval_w"] = list(account.interval_w)
        for name in ("absorbed_by_body", "absorbed_by_medium", "killed_by_reason"):
            accounts: dict[str, Account] = getattr(self, name)
            data[f"{name}_w"] = {label: account.flux_w for label, account in accounts.items()}
            data[f"{name}_stderr_w"] = {label: account.stderr_w for label, account in accounts.items()}
            data[f"{name}_interval_w"] = {label: list(account.interval_w) for label, account in accounts.items()}
        return data


def energy_ledger(raymap: RayMap) -> Ledger:
    """Add up where the light of all rays of a map went.

    Light that is recorded as killed did not end by physics: ``depth`` is the limit of events a ray,
    ``numerical`` a ray that lost its way; ``medium_mismatch``, in maps of older versions only, a ray that met the
    boundary of another medium than the one it travelled in.

    Maps of times before squares were stored are read event by event for the errors.
    """
    names = raymap.names
    sums = _Sums([entry for portion in raymap.portions for entry in ledger_of(portion)], raymap.rays_of_replicate.shape)
    bodies = {name: sums.of("body", index) for index, name in enumerate(names.bodies)}
    media = {name: sums.of("medium", index) for index, name in enumerate(names.media)}
    reasons = {reason: sums.of("killed", int(kind)) for kind, reason in KILL_REASONS.items()}
    escaped = sums.of("escaped", 0)
    killed = np.sum(list(reasons.values()), axis=0)  # squares too: a ray ends in one way
    absorbed = sums.of_absorbed(raymap.rays_of_source, escaped + killed)
    rows = np.array([absorbed, escaped, killed, *bodies.values(), *media.values(), *reasons.values()])
    accounts = iter(_accounts(raymap, rows))
    return Ledger(
        emitted_w=math.fsum(raymap.source_flux_w[raymap.rays_of_source > 0]),
        absorbed=next(accounts),
        escaped=next(accounts),
        killed=next(accounts),
        absorbed_by_body={name: next(accounts) for name in bodies},
        absorbed_by_medium={name: next(accounts) for name in media},
        killed_by_reason={reason: next(accounts) for reason in reasons},
    )


class _Sums:
    """Sums over all portions, added up so that their order makes no difference."""

    def __init__(self, entries: list[LedgerEntry], shape: tuple[int, ...]):
        self._n_sources, self._n_replicates = shape
        self._of: defaultdict[tuple[str, int, int], list[tuple[float, ...]]] = defaultdict(list)
        absorbed: list[list[tuple[float, ...]]] = [[] for _ in range(self._n_sources)]
        emitted: list[list[float]] = [[] for _ in range(self._n_sources)]
        for entry in entries:
            lights = (entry.light, entry.squares or 0.0, *(entry.replicates or (entry.light,)))
            self._of[entry.what, entry.index, entry.source].append(lights)
            emitted[entry.source].append(entry.light)
            if entry.what in ("body", "medium"):
                absorbed[entry.source].append(lights)
        self.emitted = np.array([math.fsum(lights) for lights in emitted])
        self.absorbed = np.array([self._added(lights) for lights in absorbed]).T

    def _added(self, lights: list[tuple[float, ...]]) -> list[float]:
        """Sums of light, squares, and light by replicate, (2 + R,)."""
        return [math.fsum(column) for column in zip(*lights, strict=True)] or [0.0] * (2 + self._n_replicates)

    def of(self, what: str, index: int) -> Float:
        """Light, squares, and light by replicate of an account, by source: (2 + R, n_sources)."""
        return np.array([self._added(self._of.get((what, index, source), [])) for source in range(self._n_sources)]).T

    def of_absorbed(self, n_rays: NDArray[np.int64], ended: Float) -> Float:
        """The same of all that was absorbed, which is what a ray's end left of it: ``X = E - Z``, E alike for all."""
        each = self.emitted / np.maximum(n_rays, 1)
        squares = each * self.emitted - 2 * each * ended[0] + ended[1]
        return np.array([self.absorbed[0], np.maximum(squares, 0.0), *self.absorbed[2:]])


def _accounts(raymap: RayMap, rows: Float) -> list[Account]:
    """Accounts of sums, (n_rows, 2 + R, n_sources)."""
    n_rays = raymap.rays_of_source
    flux_w = np.array([math.fsum(row) for row in rows[:, 0] * raymap.ray_flux_w])
    light, squares = np.abs(rows[:, 0]), rows[:, 1]
    is_rounding = (light <= ROUNDING * n_rays) & (squares <= _OF_A_RAY * light)
    total, squares, *replicates = np.moveaxis(np.where(is_rounding[:, None], 0.0, rows), (1, 2), (0, 1))
    squares = effective_squares(raymap.rays_of_replicate, np.stack(replicates, axis=1), squares)
    _, stderr_w = estimate_flux(raymap.source_flux_w, n_rays, total, squares)
    low_w, high_w = confidence_interval(raymap.source_flux_w, n_rays, total, squares)
    columns = (values.tolist() for values in (flux_w, stderr_w, low_w, high_w))
    return [Account(flux, stderr, (low, high)) for flux, stderr, low, high in zip(*columns, strict=True)]
