# SPDX-License-Identifier: LGPL-2.1-or-later
"""The effects: every piece of physics that costs time, and which scene calls for which.

One file each. A file says in words when a scene calls for the effect (`needed_by`), lowers what its kernel reads to
arrays (`lower`), and holds a slow, readable reference of its physics that tests compare the kernel with. The kernel is
`raymaps.kernels.<name of the effect>`; `raymaps.trace` imports, compiles and runs it only when the effect is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from raymaps.effects import (
    abg,
    absorber,
    bsdf,
    coefficients,
    conductor,
    crossings,
    dispersion,
    fresnel,
    gaussian,
    lambertian,
    medium_absorption,
    medium_scattering,
    mirror,
    mixture,
    rough,
    spectral,
    thin_film,
    without,
)
from raymaps.effects.lowering import Lowering
from raymaps.errors import SceneError, unknown_name
from raymaps.scene import Scene

__all__ = ["EFFECTS", "Effect", "Lowering", "needed_effects", "scene_without"]


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
    lower : function of a Lowering
        The arrays that the kernel reads, a NamedTuple; () if it reads none.
    stage : str
        When the kernel runs: on the "way" to the next event, or at the "surface"; "none" without a kernel. A kernel on
        the way may have a second function, ``scatter``, which runs at the surface and turns rays that end on the way.
    if_off, without : str, function of a Scene to a Scene
        What takes the effect's place where it is switched off, in words and done.
    acts_on : function of the arrays to (n_media,) bool, optional
        The media that the kernel acts in, or at whose borders; without it, it acts on surfaces of the effect's name.
    """

    name: str
    summary: str
    needed_by: Callable[[Scene], tuple[str, ...]]
    lower: Callable[[Lowering], Any]
    stage: Literal["way", "surface", "none"]
    if_off: str
    without: Callable[[Scene], Scene]
    acts_on: Callable[[Any], NDArray[np.bool_]] | None = None


def _nothing(lowering: Lowering) -> tuple[()]:
    return ()


def _unchanged(scene: Scene) -> Scene:
    return scene


#: In the order in which a segment meets them: its way through a medium and past detectors, then the surface it hits.
EFFECTS: tuple[Effect, ...] = (
    Effect(
        "spectral", "spectra in place of red, green and blue", spectral.needed_by, _nothing, "none",
        "light is red, green and blue", _unchanged,
    ),
    Effect(
        "medium_scattering", "scattering inside media by phase functions", medium_scattering.needed_by,
        medium_scattering.lower, "way", "media do not scatter", without.nothing_scattered_inside,
        medium_scattering.acts_on,
    ),
    Effect(
        "medium_absorption", "absorption inside media (Beer-Lambert)", medium_absorption.needed_by,
        medium_absorption.lower, "way", "media do not absorb", without.nothing_absorbed_inside,
        medium_absorption.acts_on,
    ),
    Effect(
        "crossings", "virtual detectors crossed by a segment", crossings.needed_by, crossings.lower, "way",
        "rectangles register nothing", _unchanged,
    ),
    Effect(
        "mixture", "several surface properties side by side on a face", mixture.needed_by, mixture.lower, "surface",
        "of each mixture only the largest part acts", without.dominant_part,
    ),
    Effect(
        "dispersion", "refractive index that depends on wavelength", dispersion.needed_by, dispersion.lower, "surface",
        "indices are those at the d line, 587.6 nm", without.one_index, dispersion.acts_on,
    ),
    Effect(
        "absorber", "absorption on a surface", absorber.needed_by, _nothing, "surface", "it can't be switched off",
        _unchanged,
    ),
    Effect(
        "mirror", "specular reflection", mirror.needed_by, mirror.lower, "surface", "mirrors absorb all light",
        without.all_absorbed("mirror"),
    ),
    Effect(
        "lambertian", "diffuse reflection and transmission", lambertian.needed_by, lambertian.lower, "surface",
        "these surfaces absorb all light", without.all_absorbed("lambertian"),
    ),
    Effect(
        "coefficients", "specular and diffuse shares over angle and wavelength", coefficients.needed_by,
        coefficients.lower, "surface", "these surfaces absorb all light", without.all_absorbed("coefficients"),
    ),
    Effect(
        "conductor", "reflection off smooth metals (n + ik)", conductor.needed_by, conductor.lower, "surface",
        "metals are clear media of their index n", without.clear_metals, conductor.acts_on,
    ),
    Effect(
        "thin_film", "interference in thin layers on smooth interfaces", thin_film.needed_by, thin_film.lower,
        "surface", "these interfaces have no layers", without.smooth("thin_film"),
    ),
    Effect(
        "rough", "reflection and refraction by microfacets (GGX)", rough.needed_by, rough.lower, "surface",
        "these interfaces are smooth", without.smooth("rough"),
    ),
    Effect(
        "gaussian", "scatter about the specular direction, Gaussian", gaussian.needed_by, gaussian.lower, "surface",
        "what would scatter goes on specularly", without.specular_only("gaussian"),
    ),
    Effect(
        "abg", "scatter about the specular direction, ABg model", abg.needed_by, abg.lower, "surface",
        "what would scatter goes on specularly", without.specular_only("abg"),
    ),
    Effect(
        "fresnel", "reflection and refraction at a smooth interface", fresnel.needed_by, _nothing, "surface",
        "these surfaces absorb all light", without.all_absorbed("fresnel"),
    ),
    Effect(
        "bsdf", "scattering by a table of measured BRDF and BTDF", bsdf.needed_by, bsdf.lower, "surface",
        "these surfaces absorb all light", without.all_absorbed("bsdf"),
    ),
)  # fmt: skip


def scene_without(scene: Scene) -> Scene:
    """The scene without the effects that its settings switch off.

    Raises
    ------
    SceneError
        If an effect is unknown, or can't be switched off.
    """
    known = {effect.name: effect for effect in EFFECTS if effect.name != "absorber"}
    for name in scene.settings.without:
        if name not in known:
            raise SceneError(f"Settings, without: {unknown_name('effect', name, known)}")
        scene = known[name].without(scene)
    return scene


def needed_effects(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Names of the effects that a scene calls for and does not switch off, each with its reasons, in order."""
    reduced = scene_without(scene)
    reasons = {
        effect.name: effect.needed_by(reduced) for effect in EFFECTS if effect.name not in scene.settings.without
    }
    return {name: because for name, because in reasons.items() if because}
