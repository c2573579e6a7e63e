# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a map holds: counts, names, hashes and the energy ledger."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from raymaps.results.ledger import ROUNDING, Account, Ledger, energy_ledger
from raymaps.results.lost import Lost, lost_lines, lost_rays, lost_words
from raymaps.store import RayMap
from raymaps.units import format_bytes, format_estimate, format_quantity, format_with_error

__all__ = ["MapInfo", "map_info", "target_line"]


@dataclass(frozen=True)
class MapInfo:
    """Facts about a map; ``content_hash`` depends on the stored rays alone."""

    path: str
    rays: int
    rays_asked: int
    events: int
    crossings: int
    portions: int
    bytes: int
    seed: int
    scene_hash: str
    content_hash: str
    program: str
    names: dict[str, Any]
    rays_of_source: dict[str, int]
    target: dict[str, Any] | None
    without: list[str]
    ledger: Ledger
    lost: tuple[Lost, ...]

    def to_dict(self) -> dict[str, Any]:
        """As in ``raymaps info --json``."""
        return {**self.__dict__, "ledger": self.ledger.to_dict(), "lost": [one.to_dict() for one in self.lost]}

    def to_text(self) -> str:
        """For people."""
        names = {what: values for what, values in self.names.items() if what != "faces"}
        per_segment = self.bytes / max(self.events, 1)
        lines = [
            f"{self.path}: {self.rays} of {self.rays_asked} rays, {self.events} events, {self.crossings} crossings",
            f"{self.portions} portions, {format_bytes(self.bytes)}, {per_segment:.1f} B an event, seed {self.seed}",
            f"scene    {self.scene_hash}",
            f"content  {self.content_hash}",
            *(f"{what:<10}{', '.join(values) or '-'}" for what, values in names.items()),
            *([f"{'without':<10}{', '.join(self.without)} (switched off)"] if self.without else []),
            *([target_line(self.target)] if self.target else []),
            "",
            *self._ledger_lines(),
            *(["", f"lost      {lost_words(self.lost)}", *lost_lines(self.lost)] if self.lost else []),
        ]
        return "\n".join(lines)

    def _ledger_lines(self) -> list[str]:
        ledger = self.ledger
        rows: list[tuple[str, Account]] = [("absorbed", ledger.absorbed)]
        rows += [(f"  by body {name}", account) for name, account in ledger.absorbed_by_body.items()]
        rows += [(f"  by medium {name}", account) for name, account in ledger.absorbed_by_medium.items()]
        rows += [("left the scene", ledger.escaped), ("killed", ledger.killed)]
        rows += [(f"  {reason}", account) for reason, account in ledger.killed_by_reason.items()]
        width = max(len(label) for label, _ in rows) + 2
        share = 100 / ledger.emitted_w if ledger.emitted_w else 0.0
        told = [("emitted", format_quantity(ledger.emitted_w, "W"), ledger.emitted_w)]
        for label, account in rows:
            flux_w = account.flux_w if abs(account.flux_w) > ROUNDING * ledger.emitted_w else 0.0
            told.append((label, format_estimate(flux_w, account.stderr_w, account.interval_w), flux_w))
        column = max(len(text) for _, text, _ in told)
        return [f"{label:<{width}}{text:>{column}}{flux_w * share:>10.4f} %" for label, text, flux_w in told]


def map_info(raymap: RayMap) -> MapInfo:
    """Facts about a map, from its manifest and its portions' summaries; only where rays were lost more is read."""
    manifest = raymap.manifest
    return MapInfo(
        path=str(raymap.path),
        rays=raymap.n_rays,
        rays_asked=manifest.rays_asked,
        events=raymap.n_events,
        crossings=sum(portion.n_crossings for portion in raymap.portions),
        portions=len(raymap.portions),
        bytes=raymap.n_bytes,
        seed=manifest.seed,
        scene_hash=manifest.scene_hash,
        content_hash=raymap.content_hash,
        program=manifest.program,
        names={
            **manifest.names.to_dict(),
            "faces": [manifest.names.face_label(i) for i in range(len(manifest.names.faces))],
        },
        rays_of_source=dict(zip(raymap.names.sources, (int(n) for n in raymap.rays_of_source), strict=True)),
        target=manifest.target,
        without=list(raymap.scene.settings.without),
        ledger=energy_ledger(raymap),
        lost=lost_rays(raymap),
    )


def target_line(target: dict[str, Any]) -> str:
    """What error a run was to reach, what it reached, and how its number of rays was chosen."""
    told = f"{'target':<10}{target['percent']:g} % of {target['quantity'] or 'what is least certain'}: "
    if not target["stages"]:
        return f"{told}stopped in the pilot"
    reached = target["reached_percent"]
    if reached is not None:
        told += format_with_error(target["flux_w"], target["flux_stderr_w"]) + f" is {reached:.3g} %"
    else:
        told += "nothing arrived" if target["ended"] else "not reached yet"
    extended = f", extended to {', '.join(map(str, target['stages'][1:]))}" if target["stages"][1:] else ""
    told += f"; {target['stages'][0]} rays traced{extended}"
    needed = target["needed_rays"]
    if needed and needed > target["stages"][-1]:
        told += f", needs about {needed}"
    return f"{told} (pilot of {target['pilot_rays']} with {target['pilot_hits']} hits)"
