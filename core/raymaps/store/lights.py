# SPDX-License-Identifier: LGPL-2.1-or-later
"""The distinct lights of a portion: events share them, so each is stored once.

A light is stored as red, green and blue of an RGB simulation; as a colour of a spectral one (power, lumens and linear
sRGB); or as a whole spectrum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import Bands

__all__ = ["Lights", "Stored", "distinct_lights"]

#: How the light of a spectral simulation is stored.
Stored = Literal["rgb", "spectral"]

_RGB = ("r", "g", "b")
_COLOUR = ("power", "lumen_per_w", *_RGB)


@dataclass(frozen=True)
class Lights:
    """Distinct lights, relative to the emission of a ray.

    Attributes
    ----------
    values : (n_lights, n_values) float32, as stored
    names : tuple of str
        Columns of the values.
    bands : Bands
    """

    values: NDArray[np.float32]
    names: tuple[str, ...]
    bands: Bands

    @property
    def has_spectra(self) -> bool:
        """Whether the values are spectra, band by band."""
        return self.bands.is_spectral and self.names[0].startswith("band_")

    @property
    def power(self) -> NDArray[np.float64]:
        """All bands together, (n_lights,); 1 at an emission."""
        if self.names[0] == "power":
            return self.values[:, 0].astype(np.float64)
        return np.cumsum(self.values, axis=1, dtype=np.float64)[:, -1]  # in the order of the bands

    @property
    def rgb(self) -> NDArray[np.float64]:
        """Red, green and blue, (n_lights, 3): shares of the emission, or linear sRGB of a spectral simulation."""
        if self.has_spectra:
            return np.asarray(self.values.astype(np.float64) @ self.bands.rgb_per_w)
        return self.values[:, -3:].astype(np.float64)

    @property
    def lumen_per_w(self) -> NDArray[np.float64] | None:
        """Luminous flux in lm per W of the emission, (n_lights,); None in an RGB simulation."""
        if self.bands.lumen_per_w is None:
            return None
        if self.has_spectra:
            return np.asarray(self.values.astype(np.float64) @ self.bands.lumen_per_w)
        return self.values[:, 1].astype(np.float64)

    @property
    def shown(self) -> NDArray[np.float32]:
        """What to draw, (n_lights, 3): the hue of the light within sRGB, its bands adding up to the power.

        Light that no eye sees is drawn white.
        """
        if not self.bands.is_spectral:
            return self.values
        hue = np.maximum(self.rgb, 0.0)
        power = self.power
        visible = hue.sum(axis=1) > 1e-9 * power
        hue[~visible] = 1.0
        return np.asarray(hue * (power / hue.sum(axis=1))[:, None], np.float32)

    @property
    def spectra(self) -> NDArray[np.float32] | None:
        """Light by band, (n_lights, n_bands); None where colours were stored in place of spectra."""
        return None if self.names == _COLOUR else self.values

    def as_stored(self, stored: Stored) -> Lights:
        """The same lights as colours if these shall be stored of a spectral simulation."""
        if not self.bands.is_spectral or stored == "spectral":
            return self
        lumen = self.lumen_per_w
        assert lumen is not None
        columns = np.column_stack([self.power, lumen, self.rgb]).astype(np.float32)
        return Lights(columns, _COLOUR, self.bands)

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """As columns of a file."""
        return {"light": np.arange(len(self.values)), **dict(zip(self.names, self.values.T, strict=True))}

    @classmethod
    def from_columns(cls, columns: dict[str, NDArray[Any]], bands: Bands) -> Lights:
        """From columns of a file; raises `ValueError` if they are not those of lights."""
        names = tuple(name for name in columns if name != "light")
        expected = (_COLOUR, _band_names(bands)) if bands.is_spectral else (_RGB,)
        if names not in expected:
            raise ValueError("other columns than those of light")
        return cls(np.stack([columns[name] for name in names], axis=1), names, bands)


def _band_names(bands: Bands) -> tuple[str, ...]:
    return tuple(f"band_{band}" for band in range(bands.n)) if bands.is_spectral else _RGB


def distinct_lights(light: NDArray[np.float32], bands: Bands) -> tuple[Lights, NDArray[np.uint32]]:
    """The distinct rows of the light of events, (n_events, n_bands), and which of them each event has, (n_events,)."""
    from raymaps.store.numbering import number_rows

    light = np.ascontiguousarray(light)
    index, first = number_rows(light.view(np.uint32))
    return Lights(light[first], _band_names(bands), bands), index
