# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which effects a scene calls for and why, and how its surfaces are simulated; of a map also each effect's time."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from raymaps.effects import EFFECTS, needed_effects
from raymaps.results.faces_met import FacesMet, faces_met, faces_met_by
from raymaps.scene import Scene, load_scene
from raymaps.store import RayMap

__all__ = ["EffectNote", "Explanation", "explain"]

#: What a run does besides the effects, by the name of its account.
OTHER_WORK = {"emission": "emission", "intersection": "search for the next triangle", "recording": "keeping events"}


@dataclass(frozen=True)
class EffectNote:
    """What a scene has to do with an effect.

    Attributes
    ----------
    name, summary : str
    needed : bool
        Whether it is simulated.
    because : tuple of str
        Why the scene calls for it.
    off : str or None
        What takes its place, if the scene switches it off.
    share : float or None
        Of the time that tracing a map took.
    """

    name: str
    summary: str
    needed: bool
    because: tuple[str, ...]
    off: str | None
    share: float | None


@dataclass(frozen=True)
class Explanation:
    """All effects, in the order in which light meets them; ``other`` is the share of time of what is no effect."""

    effects: tuple[EffectNote, ...]
    surfaces: FacesMet
    other: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """As in ``raymaps explain --json``."""
        return {
            "effects": [{**note.__dict__, "because": list(note.because)} for note in self.effects],
            "surfaces": self.surfaces.to_dict(),
            "other_share": self.other,
        }

    def to_text(self) -> str:
        """For people."""
        lines = []
        for note in self.effects:
            state = "off" if note.off else "simulated" if note.needed else "not needed"
            share = "" if note.share is None or not note.needed else f"   {100 * note.share:.1f} % of the time"
            lines.append(f"{state:<12}{note.name:<20}{note.summary}{share}")
            lines += [f"{'':<14}because of {reason}" for reason in note.because]
            lines += [f"{'':<14}instead: {note.off}"] if note.off else []
        lines += self.surfaces.lines()
        lines += [
            f"{'besides':<12}{name:<20}{OTHER_WORK[name]}   {100 * s:.1f} % of the time"
            for name, s in self.other.items()
        ]
        return "\n".join(lines)


def explain(what: Path) -> Explanation:
    """Explain a scene file or a Ray Map.

    Raises
    ------
    SceneError, MapError
        If it can't be read.
    """
    if what.is_dir():
        raymap = RayMap.open(what)
        return _explained(raymap.scene, faces_met_by(raymap), _typical_seconds(raymap))
    scene = load_scene(what)
    return _explained(scene, faces_met(scene), {})


def _typical_seconds(raymap: RayMap) -> dict[str, float]:
    """Time that each stage takes an event: the median over the portions, of which the first few also load kernels."""
    taken: dict[str, list[float]] = {}
    for portion in raymap.portions:
        for stage, seconds in portion.summary.seconds.items():
            taken.setdefault(stage, []).append(seconds / max(portion.n_events, 1))
    return {stage: statistics.median(values) for stage, values in taken.items()}


def _explained(scene: Scene, surfaces: FacesMet, seconds: dict[str, float]) -> Explanation:
    needed = needed_effects(scene)
    in_all = sum(seconds.values())
    notes = []
    for effect in EFFECTS:
        is_off = effect.name in scene.settings.without
        has_share = in_all > 0 and effect.stage != "none" and effect.name in needed
        notes.append(
            EffectNote(
                name=effect.name,
                summary=effect.summary,
                needed=effect.name in needed,
                because=tuple(effect.needed_by(scene)) if is_off else needed.get(effect.name, ()),
                off=effect.if_off if is_off else None,
                share=seconds.get(effect.name, 0.0) / in_all if has_share else None,
            )
        )
    other = {name: seconds[name] / in_all for name in OTHER_WORK if name in seconds} if in_all else {}
    return Explanation(tuple(notes), surfaces, other)
