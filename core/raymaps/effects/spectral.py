# SPDX-License-Identifier: LGPL-2.1-or-later
"""Spectral light: rays carry a spectrum in place of red, green and blue.

It has no kernel of its own: every kernel works on as many bands as light has.
"""

from __future__ import annotations

from typing import Any

from raymaps.effects import dispersion
from raymaps.effects.usage import used_media, used_surfaces
from raymaps.errors import RayMapsError
from raymaps.formats.ray_file import keeps_spectra
from raymaps.materials import Mixture, is_spectral
from raymaps.materials.bsdf import BsdfTable
from raymaps.scene import CrossingsSource, RaysSource, Scene, Source
from raymaps.store import RayMap

__all__ = ["needed_by"]


def _depends_on_wavelength(value: Any) -> bool:
    if isinstance(value, BsdfTable):
        return value.is_spectral
    return is_spectral(value)


def _rays_have_spectra(scene: Scene, source: Source) -> bool:
    """Whether a source emits rays that a Ray Map kept with their spectra.

    A map or file that can't be read has none here; whoever reads its rays says what is wrong with it.
    """
    if source.rgb != (1.0, 1.0, 1.0):
        return False
    if isinstance(source, CrossingsSource):
        try:
            portions = RayMap.open(scene.folder / source.map).portions
            return bool(portions) and all(portion.lights.has_spectra for portion in portions)
        except RayMapsError:
            return False
    return isinstance(source, RaysSource) and keeps_spectra(scene.folder / source.file)


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for spectra if a source has one, or if something that light can meet depends on wavelength."""
    reasons = [f"spectrum of source '{name}'" for name, source in scene.sources.items() if source.spectrum is not None]
    for name, source in scene.sources.items():
        if source.spectrum is None and _rays_have_spectra(scene, source):
            reasons.append(f"spectra of the rays of source '{name}'")
    for surface, places in used_surfaces(scene).items():
        prop = scene.surfaces[surface]
        parts = [prop]
        if isinstance(prop, Mixture):
            parts = [scene.surfaces[part.surface] for part in prop.parts if part.weight > 0]
        if any(_depends_on_wavelength(getattr(part, field)) for part in parts for field in type(part).model_fields):
            reasons.append(f"surface '{surface}' of {places[0]} depends on wavelength")
    for name, where in used_media(scene).items():
        medium = scene.media[name]
        tables = (medium.absorption_per_mm, medium.extinction, *(s.coefficient_per_mm for s in medium.scattering))
        if any(is_spectral(table) for table in tables) or (medium.is_conductor and medium.is_dispersive):
            reasons.append(f"medium '{name}' of {where} depends on wavelength")
    return (*reasons, *(f"dispersion: {reason}" for reason in dispersion.needed_by(scene)))
