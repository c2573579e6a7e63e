# SPDX-License-Identifier: LGPL-2.1-or-later
"""What happens to a ray, in words for people."""

from __future__ import annotations

from raymaps.kinds import EventKind

__all__ = ["describe_event"]

_WORDS: dict[EventKind, str] = {
    EventKind.EMISSION: "emitted",
    EventKind.DIFFUSE_REFLECTION: "reflected diffusely",
    EventKind.DIFFUSE_REFRACTION: "passed on diffusely",
    EventKind.SPECULAR_REFLECTION: "mirrored",
    EventKind.SPECULAR_REFRACTION: "passed on straight",
    EventKind.FRESNEL_REFLECTION: "reflected at the interface",
    EventKind.FRESNEL_REFRACTION: "refracted",
    EventKind.BSDF_DIFFUSE_REFLECTION: "reflected diffusely (BSDF)",
    EventKind.BSDF_DIFFUSE_REFRACTION: "passed on diffusely (BSDF)",
    EventKind.BSDF_SPECULAR_REFLECTION: "mirrored (BSDF)",
    EventKind.BSDF_SPECULAR_REFRACTION: "passed on straight (BSDF)",
    EventKind.ABSORPTION: "absorbed",
    EventKind.MEDIUM_ABSORPTION: "absorbed on the way",
    EventKind.MEDIUM_SCATTERING: "scattered on the way",
    EventKind.LEFT: "left the scene",
    EventKind.KILLED_DEPTH: "given up: too many events",
    EventKind.KILLED_NUMERICAL: "lost to rounding",
    EventKind.KILLED_MEDIUM_MISMATCH: "lost where bodies overlap or touch",
}


def describe_event(kind: EventKind, medium_before: str | None, medium_after: str | None) -> str:
    """What happened at an event, for instance ``refracted into PMMA``.

    Parameters
    ----------
    kind : EventKind
    medium_before, medium_after : str or None
        Media along the segments that end and start at the event.
    """
    words = _WORDS[kind]
    if kind in (EventKind.MEDIUM_ABSORPTION, EventKind.MEDIUM_SCATTERING) and medium_before is not None:
        return f"{words.removesuffix(' on the way')} inside {medium_before}"
    if kind is EventKind.FRESNEL_REFRACTION and medium_after is not None:
        return f"{words} into {medium_after}"
    return words
