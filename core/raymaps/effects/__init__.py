# SPDX-License-Identifier: LGPL-2.1-or-later
"""The effects: every piece of physics that costs time, and which scene calls for which.

One file each. A file says in words when a scene calls for the effect (`needed_by`) and holds a slow, readable
reference of its physics that tests compare the kernel with. The kernel is `raymaps.kernels.<name of the effect>`;
`raymaps.trace` imports, compiles and runs it only when the effect is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from raymaps.effects import absorber, crossings, fresnel, lambertian, medium_absorption, mirror, mixture
from raymaps.scene import Scene

__all__ = ["EFFECTS", "Effect", "needed_effects"]


@dataclass(frozen=True)
class Effect:
    """A piece of physics.

    Attributes
    ----------
    name : str
        Also the name of its kernel's module.
    summary : str
        What is simulated, in one line.
    needed_by : function of a Scene
        Why the scene calls for the effect, a sentence for each reason; empty if it does not.
    """

    name: str
    summary: str
    needed_by: Callable[[Scene], tuple[str, ...]]


#: In the order in which a segment meets them: its way through a medium and past detectors, then the surface it hits.
EFFECTS: tuple[Effect, ...] = (
    Effect("medium_absorption", "absorption inside media (Beer-Lambert)", medium_absorption.needed_by),
    Effect("crossings", "virtual detectors crossed by a segment", crossings.needed_by),
    Effect("mixture", "several surface properties side by side on a face", mixture.needed_by),
    Effect("absorber", "absorption on a surface", absorber.needed_by),
    Effect("mirror", "specular reflection", mirror.needed_by),
    Effect("lambertian", "diffuse reflection and transmission", lambertian.needed_by),
    Effect("fresnel", "reflection and refraction at a smooth interface", fresnel.needed_by),
)


def needed_effects(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Names of the effects that a scene calls for, each with its reasons, in the order of `EFFECTS`."""
    reasons = {effect.name: effect.needed_by(scene) for effect in EFFECTS}
    return {name: because for name, because in reasons.items() if because}
