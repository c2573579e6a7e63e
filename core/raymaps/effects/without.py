# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a scene becomes when an effect is switched off.

What takes an effect's place may be switched off too: then light is absorbed. So the order in which effects are named
does not matter.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from raymaps.materials import (
    Absorber,
    Coefficients,
    FresnelInterface,
    Medium,
    SurfaceProperty,
)
from raymaps.scene import Scene

__all__ = [
    "all_absorbed",
    "clear_metals",
    "dominant_part",
    "nothing_absorbed_inside",
    "nothing_scattered_inside",
    "one_index",
    "smooth",
    "specular_only",
]

Change = Callable[[Scene], Scene]


def _with_surfaces(scene: Scene, kind: str, change: Callable[[Any], SurfaceProperty]) -> Scene:
    surfaces = {name: change(prop) if prop.kind == kind else prop for name, prop in scene.surfaces.items()}
    return scene.model_copy(update={"surfaces": surfaces})


def _with_media(scene: Scene, change: Callable[[Medium], dict[str, Any]]) -> Scene:
    media = {name: medium.model_copy(update=change(medium)) for name, medium in scene.media.items()}
    return scene.model_copy(update={"media": media})


def all_absorbed(kind: str) -> Change:
    """Surfaces of a kind absorb all light."""
    return lambda scene: _with_surfaces(scene, kind, lambda _: Absorber())


def smooth(kind: str) -> Change:
    """Surfaces of a kind are smooth interfaces."""
    return lambda scene: _with_surfaces(
        scene, kind, lambda _: Absorber() if "fresnel" in scene.settings.without else FresnelInterface()
    )


def specular_only(kind: str) -> Change:
    """Surfaces of a kind reflect and transmit all of it specularly."""

    def change(scene: Scene, prop: Any) -> SurfaceProperty:
        if "coefficients" in scene.settings.without:
            return Absorber()
        return Coefficients(specular_reflectance=prop.reflectance, specular_transmittance=prop.transmittance)

    return lambda scene: _with_surfaces(scene, kind, lambda prop: change(scene, prop))


def dominant_part(scene: Scene) -> Scene:
    """In place of each mixture stands its largest part."""

    def largest(mixture: Any) -> SurfaceProperty:
        return scene.surfaces[max(mixture.parts, key=lambda part: part.weight).surface]

    return _with_surfaces(scene, "mixture", largest)


def nothing_absorbed_inside(scene: Scene) -> Scene:
    """Media do not absorb."""
    return _with_media(scene, lambda medium: {"absorption_per_mm": (0.0, 0.0, 0.0)})


def nothing_scattered_inside(scene: Scene) -> Scene:
    """Media do not scatter."""
    return _with_media(scene, lambda medium: {"scattering": ()})


def clear_metals(scene: Scene) -> Scene:
    """Metals are clear media of their index n."""
    return _with_media(scene, lambda medium: {"extinction": (0.0, 0.0, 0.0)})


def one_index(scene: Scene) -> Scene:
    """Media have their index at the d line at all wavelengths; metals only where they are clear media."""
    kept = "conductor" not in scene.settings.without
    return _with_media(
        scene,
        lambda medium: {} if medium.is_conductor and kept else {"refractive_index": medium.index_at_d_line},
    )
