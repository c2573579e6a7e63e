# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an effect may look at to make the arrays that its kernel reads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raymaps.bands import Bands
from raymaps.effects.usage import surfaces_in_use, used_media
from raymaps.errors import SceneError
from raymaps.frame import Frame
from raymaps.materials import Medium
from raymaps.names import Names
from raymaps.scene import Scene

__all__ = ["Lowering", "index_in_bands"]


@dataclass(frozen=True)
class Lowering:
    """A scene on its way to arrays.

    Attributes
    ----------
    scene : Scene
        Without the effects that are switched off.
    names : Names
        What indices count in the order of.
    bands : Bands
    media : tuple of Medium, in the order of ``names.media``
    frame : Frame
    """

    scene: Scene
    names: Names
    bands: Bands
    media: tuple[Medium, ...]
    frame: Frame

    @property
    def is_conductor(self) -> NDArray[np.bool_]:
        """Which media are metals that a body is of, (n_media,): light can't go into them."""
        used = used_media(self.scene)
        pairs = zip(self.names.media, self.media, strict=True)
        return np.array([medium.is_conductor and name in used for name, medium in pairs], bool)

    def by_medium(self, value_of: Callable[[Medium], Any], what: str) -> NDArray[np.float64]:
        """A spectral value of the media that light can travel in, by band, (n_media, n_bands); 0 for the others."""
        values = np.zeros((len(self.media), self.bands.n))
        used = used_media(self.scene)
        for index, (name, medium) in enumerate(zip(self.names.media, self.media, strict=True)):
            if name in used and not medium.is_conductor:
                values[index] = self.bands.average(value_of(medium), f"Medium '{name}', {what}")
        return values

    def by_surface(self, kind: str, field: str) -> NDArray[np.float64]:
        """A spectral value of the properties of one kind that are in use, by band, (n_surfaces, n_bands); else 0."""
        values = np.zeros((len(self.names.surfaces), self.bands.n))
        used = surfaces_in_use(self.scene)
        for index, (name, prop) in enumerate(self.scene.surfaces.items()):
            if prop.kind == kind and name in used:
                values[index] = self.bands.average(getattr(prop, field), f"Surface '{name}', {field}")
        return values


def index_in_bands(
    name: str, medium: Medium, bands: Bands, wavelength_nm: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Refractive index of a medium in the middle of each band, or at wavelengths.

    Raises
    ------
    SceneError
        If the medium's data do not reach there.
    """
    at = np.asarray(bands.center_nm if wavelength_nm is None else wavelength_nm, np.float64)
    if not isinstance(medium.refractive_index, float | int):
        first, last = medium.refractive_index.range_nm
        if at.min() < first - 1e-9 or at.max() > last + 1e-9:
            raise SceneError(
                f"Medium '{name}': its refractive index is known from {first:g} to {last:g} nm, but light from "
                f"{at.min():g} to {at.max():g} nm is simulated: narrow settings.spectrum, or give the medium data that "
                "reach further."
            )
    return medium.index_at(at)
