# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which surface properties of a scene light can meet, and where."""

from __future__ import annotations

from raymaps.materials import Mixture
from raymaps.scene import Body, Scene

__all__ = ["faces_of_kind", "surfaces_in_use", "surfaces_of", "used_media", "used_surfaces"]


def _is_overridden(body: Body) -> bool:
    """Whether each face has a surface property of its own."""
    faces = body.geometry.faces
    return faces is not None and all(face.name in body.face_surfaces for face in faces)


def surfaces_of(body: Body) -> tuple[str, ...]:
    """Surface properties that some face of a body has; parts of mixtures not counted."""
    return tuple(dict.fromkeys([*([] if _is_overridden(body) else [body.surface]), *body.face_surfaces.values()]))


def used_surfaces(scene: Scene) -> dict[str, list[str]]:
    """Surface properties that some face has, each with the bodies and faces in words; parts of mixtures not counted."""
    used: dict[str, list[str]] = {}
    for name, body in scene.bodies.items():
        if not _is_overridden(body):
            used.setdefault(body.surface, []).append(f"body '{name}'")
        for face, surface in body.face_surfaces.items():
            used.setdefault(surface, []).append(f"face '{name}.{face}'")
    return used


def surfaces_in_use(scene: Scene) -> set[str]:
    """Surface properties that light can meet, parts of mixtures too."""
    used = set(used_surfaces(scene))
    for name in list(used):
        prop = scene.surfaces[name]
        if isinstance(prop, Mixture):
            used |= {part.surface for part in prop.parts if part.weight > 0}
    return used


def used_media(scene: Scene) -> dict[str, str]:
    """Media that stand in a body or around all, each with the first place in words."""
    used = {} if scene.ambient is None else {scene.ambient: "the space around the bodies"}
    for name, body in scene.bodies.items():
        if body.medium is not None:
            used.setdefault(body.medium, f"body '{name}'")
    return used


def faces_of_kind(scene: Scene, kind: str) -> tuple[str, ...]:
    """Why a scene calls for a kind of surface property: a sentence for each property of that kind in use."""
    reasons = []
    for surface, places in used_surfaces(scene).items():
        prop = scene.surfaces[surface]
        where = ", ".join(places[:3]) + (f" and {len(places) - 3} more" if len(places) > 3 else "")
        if prop.kind == kind:
            reasons.append(f"surface '{surface}' of {where}")
        elif isinstance(prop, Mixture):
            reasons += [
                f"part '{part.surface}' of surface '{surface}' of {where}"
                for part in prop.parts
                if scene.surfaces[part.surface].kind == kind and part.weight > 0
            ]
    return tuple(reasons)
