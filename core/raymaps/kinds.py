# SPDX-License-Identifier: LGPL-2.1-or-later
"""The kinds of events, what can happen to a ray, and of surface properties, what can make it happen.

The codes of events are stored in Ray Maps: once released, a code never changes its meaning, so old maps stay readable.
"""

from __future__ import annotations

from enum import IntEnum

__all__ = [
    "ANGLE_STEP_RAD",
    "CONTACT",
    "CRITERION_KINDS",
    "ENDINGS",
    "IN_MEDIUM",
    "KILL_REASONS",
    "OFF_SURFACE",
    "EventKind",
    "ExactKind",
    "SurfaceKind",
]


#: Step to which crossing angles are rounded: 0.0002 degrees, far below what a detector tells apart.
ANGLE_STEP_RAD = 2.0**-18
#: Crossings closer than this along the normal are one interface, in frame units: a few steps of float32, a fifth of a
#: millionth of a scene.
CONTACT = 2.0**-21


class EventKind(IntEnum):
    """What happened at an event (paper, section 2, items 8 and 9), or a detector crossing between two events."""

    EMISSION = 0
    DIFFUSE_REFLECTION = 1
    DIFFUSE_REFRACTION = 2
    SPECULAR_REFLECTION = 3
    SPECULAR_REFRACTION = 4
    FRESNEL_REFLECTION = 5
    FRESNEL_REFRACTION = 6
    BSDF_DIFFUSE_REFLECTION = 7
    BSDF_DIFFUSE_REFRACTION = 8
    BSDF_SPECULAR_REFLECTION = 9
    BSDF_SPECULAR_REFRACTION = 10
    ABSORPTION = 11
    MEDIUM_ABSORPTION = 12
    MEDIUM_SCATTERING = 13
    LEFT = 14
    KILLED_DEPTH = 15
    KILLED_NUMERICAL = 16
    KILLED_MEDIUM_MISMATCH = 17
    CROSSING = 32  # a step of a signature only: the segment passes a virtual detector

    @property
    def label(self) -> str:
        """The kind's name in criteria, reports and files, for instance ``fresnel_refraction``."""
        return self.name.lower()


KILL_REASONS: dict[EventKind, str] = {
    EventKind.KILLED_DEPTH: "depth",
    EventKind.KILLED_NUMERICAL: "numerical",
    EventKind.KILLED_MEDIUM_MISMATCH: "medium_mismatch",
}

ENDINGS: dict[str, tuple[EventKind, ...]] = {
    "absorbed": (EventKind.ABSORPTION, EventKind.MEDIUM_ABSORPTION),
    "left": (EventKind.LEFT,),
    "killed": tuple(KILL_REASONS),
}

#: Kinds of events inside a medium, and of those that take place on no surface.
IN_MEDIUM: tuple[EventKind, ...] = (EventKind.MEDIUM_ABSORPTION, EventKind.MEDIUM_SCATTERING)
OFF_SURFACE: tuple[EventKind, ...] = (*IN_MEDIUM, EventKind.LEFT)

#: What may stand for KIND in a criterion, and the event kinds that it stands for.
CRITERION_KINDS: dict[str, tuple[EventKind, ...]] = {
    **{kind.label: (kind,) for kind in EventKind if kind is not EventKind.CROSSING},
    "killed": tuple(KILL_REASONS),
}


class SurfaceKind(IntEnum):
    """How a surface property acts; used while tracing only, never stored."""

    ABSORBER = 0
    MIRROR = 1
    LAMBERTIAN = 2
    FRESNEL = 3
    MIXTURE = 4
    COEFFICIENTS = 5
    THIN_FILM = 6
    ROUGH = 7
    GAUSSIAN = 8
    ABG = 9
    BSDF = 10


class ExactKind(IntEnum):
    """Forms of exact surfaces; used while tracing only, never stored."""

    PLANE = 1
    SPHERE = 2
    CYLINDER = 3
    CONE = 4
    TORUS = 5
    PATCHES = 6  # a B-spline surface as polynomial patches
    REVOLUTION = 7  # a B-spline surface that is a profile turned around an axis
