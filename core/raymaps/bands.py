# SPDX-License-Identifier: LGPL-2.1-or-later
"""The bands of light that rays carry: red, green and blue, or a spectrum.

A spectral simulation carries bands of equal width, and a band without width for each single wavelength that a source
shines in. Coefficients are averages over a band; in a band without width they are exact.

What is given as red, green and blue becomes a spectrum by three basis functions that add up to one at every wavelength,
so shares of light stay shares: I. Mallett, C. Yuksel: Spectral Primary Decomposition for Rendering with sRGB
Reflectance, EGSR 2019.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import SceneError
from raymaps.materials import D_LINE_NM, SpectrumTable
from raymaps.scene import BlackBody, EmissionTable, Illuminant, Scene, Source, SpectralBands, SpectralLines
from raymaps.spectral_data import (
    basis_functions,
    black_body,
    check_illuminant,
    illuminant,
    illuminant_wavelengths,
    luminous_efficacy,
    srgb_of_wavelengths,
)

__all__ = ["RGB_BANDS", "Bands", "spectral_bands"]

Float = NDArray[np.float64]

#: Dominant wavelengths of the sRGB primaries (IEC 61966-2-1): what stands for a band where a wavelength is asked for.
_PRIMARIES_NM = (611.4, 549.1, 464.2)
#: Most bands that a simulation can have, single wavelengths among them.
MOST_BANDS = 2000
#: Step in nm at which smooth spectra are looked at.
_STEP_NM = 0.5
#: Share of a source's light below which a band has none: what rounding leaves.
_NO_LIGHT = 1e-12


@dataclass(frozen=True)
class Bands:
    """The bands of a simulation.

    Attributes
    ----------
    low_nm, high_nm : (n_bands,) float64
        Borders; equal for a single wavelength. In an RGB simulation both are a wavelength that stands for the band.
    is_spectral : bool
    observer : str
        Standard observer behind the colours.
    rgb_per_w : (n_bands, 3) float64
        Linear sRGB of 1 W in each band, scaled so that the luminance 0.2126 r + 0.7152 g + 0.0722 b is in units of
        683 lm; in an RGB simulation the bands themselves.
    lumen_per_w : (n_bands,) float64 or None
        Luminous efficacy of each band; None in an RGB simulation, which knows no lumens.
    """

    low_nm: Float
    high_nm: Float
    is_spectral: bool
    observer: str
    rgb_per_w: Float = field(repr=False)
    lumen_per_w: Float | None = field(repr=False)

    def __post_init__(self) -> None:
        for array in (self.low_nm, self.high_nm, self.rgb_per_w, self.lumen_per_w):
            if array is not None:
                array.setflags(write=False)

    @property
    def n(self) -> int:
        """Number of bands."""
        return len(self.low_nm)

    @property
    def center_nm(self) -> Float:
        """Middle of each band, (n_bands,)."""
        return (self.low_nm + self.high_nm) / 2

    @property
    def index_nm(self) -> Float:
        """Wavelength of each band at which a refractive index stands for it, (n_bands,): the yellow d line in RGB."""
        return self.center_nm if self.is_spectral else np.full(self.n, D_LINE_NM)

    def average(self, value: tuple[float, float, float] | SpectrumTable, where: str) -> Float:
        """Mean of a spectral value over each band, (n_bands,).

        Parameters
        ----------
        value : three numbers for red, green and blue, or a table
        where : str
            What it is the value of, for the error.

        Raises
        ------
        SceneError
            If a table says nothing of wavelengths that are simulated.
        """
        if isinstance(value, tuple):
            if not self.is_spectral or value[0] == value[1] == value[2]:
                return np.resize(np.array(value, np.float64), self.n)
            return np.array(value) @ self._over_bands(lambda nm: basis_functions(nm))
        lowest, highest = value.range_nm
        if self.is_spectral and (self.low_nm.min() < lowest - 1e-9 or self.high_nm.max() > highest + 1e-9):
            raise SceneError(
                f"{where}: the table holds from {lowest:g} to {highest:g} nm, but light from {self.low_nm.min():g} to "
                f'{self.high_nm.max():g} nm is simulated: extend it, set its "outside" to "clamp", or narrow '
                "settings.spectrum."
            )
        if self.is_spectral:
            return self._means_of(value)
        nm = np.arange(380.0, 780.5, 5.0)
        weights = basis_functions(nm)
        return (weights * value.at(nm)).sum(axis=1) / weights.sum(axis=1)

    def _means_of(self, table: SpectrumTable) -> Float:
        """Mean of a table over each band, (n_bands,), exact."""
        nm = np.unique(np.concatenate([table.wavelength_nm, self.low_nm, self.high_nm]))
        area = _cumulated(nm, table.at(nm))
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = (np.interp(self.high_nm, nm, area) - np.interp(self.low_nm, nm, area)) / (self.high_nm - self.low_nm)
        mean = np.where(self.high_nm > self.low_nm, mean, table.at(self.low_nm))
        return np.clip(mean, min(table.value), max(table.value))

    def _over_bands(self, values_at: Any) -> Float:
        """Mean over each band of functions of wavelength: (n,) nm to (n_functions, n); gives (n_functions, n_bands)."""
        means = []
        for low, high in zip(self.low_nm, self.high_nm, strict=True):
            count = max(1, math.ceil((high - low) / _STEP_NM))
            nm = low + (np.arange(count) + 0.5) * (high - low) / count
            means.append(values_at(nm).mean(axis=1))
        return np.stack(means, axis=1)

    def light_of(self, source: Source, where: str = "source") -> Float:
        """Share of a source's light in each band, (n_bands,), adding up to 1; raises `SceneError` if there is none."""
        if not self.is_spectral:
            return _rgb_of(source)
        light = np.zeros(self.n)
        if isinstance(source.spectrum, SpectralLines):
            shares = source.spectrum.share or (1.0,) * len(source.spectrum.wavelength_nm)
            for line_nm, share in zip(source.spectrum.wavelength_nm, shares, strict=True):
                light[np.flatnonzero((self.low_nm == line_nm) & (self.high_nm == line_nm))[0]] += share
        else:
            nm, cumulated = self.spread((source,))
            light[:] = np.interp(self.high_nm, nm, cumulated[0]) - np.interp(self.low_nm, nm, cumulated[0])
        if not light.sum() > 0:
            raise SceneError(
                f"{where}: it shines in none of the wavelengths that are simulated, {self.low_nm.min():g} to "
                f"{self.high_nm.max():g} nm: change its spectrum or settings.spectrum."
            )
        light[light < _NO_LIGHT * light.sum()] = 0.0
        return light / light.sum()

    def spread(self, sources: Iterable[Source]) -> tuple[Float, Float]:
        """How the light of sources is spread over wavelengths.

        Returns
        -------
        nm : (n_nm,) float64, ascending
            The borders of all bands are among them.
        cumulated : (n_sources, n_nm) float64
            Relative light below each wavelength; 0 throughout for sources of single wavelengths, and in an RGB
            simulation.
        """
        sources = tuple(sources)
        known = [_told_at_nm(source) for source in sources if self.is_spectral]
        nm = np.concatenate(
            [
                np.linspace(a, b, math.ceil((b - a) / _STEP_NM) + 1)
                for a, b in zip(self.low_nm, self.high_nm, strict=True)
            ]
            + known
        )
        nm = np.unique(np.clip(nm, self.low_nm.min(), self.high_nm.max()))
        cumulated = np.zeros((len(sources), len(nm)))
        for row, source in zip(cumulated, sources, strict=True):
            if self.is_spectral and not isinstance(source.spectrum, SpectralLines):
                density = spectral_density(source, nm)
                row[:] = _cumulated(nm, density / (density.max() or 1.0))
        return nm, cumulated

    def to_dict(self) -> dict[str, Any]:
        """As stored in a map's manifest."""
        return {
            "low_nm": self.low_nm.tolist(),
            "high_nm": self.high_nm.tolist(),
            "is_spectral": self.is_spectral,
            "observer": self.observer,
            "rgb_per_w": self.rgb_per_w.tolist(),
            "lumen_per_w": None if self.lumen_per_w is None else self.lumen_per_w.tolist(),
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Bands:
        """From a manifest; raises `KeyError`, `TypeError` or `ValueError` if it is damaged."""
        n = len(data["low_nm"])
        lumen = data["lumen_per_w"]
        return cls(
            np.array(data["low_nm"], np.float64).reshape(n),
            np.array(data["high_nm"], np.float64).reshape(n),
            bool(data["is_spectral"]),
            str(data["observer"]),
            np.array(data["rgb_per_w"], np.float64).reshape(n, 3),
            None if lumen is None else np.array(lumen, np.float64).reshape(n),
        )


#: Red, green and blue.
RGB_BANDS = Bands(np.array(_PRIMARIES_NM), np.array(_PRIMARIES_NM), False, "cie_1931_2deg", np.eye(3), None)


def spectral_density(source: Source, nm: Float) -> Float:
    """Relative spectral flux per nm of a source that shines in more than single wavelengths, (n,)."""
    spectrum = source.spectrum
    if isinstance(spectrum, EmissionTable):
        return np.interp(nm, spectrum.wavelength_nm, spectrum.value, left=0.0, right=0.0)
    if isinstance(spectrum, BlackBody):
        return black_body(nm, spectrum.temperature_k)
    if isinstance(spectrum, Illuminant):
        return illuminant(nm, spectrum.name)
    return np.array(source.rgb) @ basis_functions(nm)


def _told_at_nm(source: Source) -> Float:
    """Wavelengths between which a source's spectrum is linear, with those at which it jumps to zero; or none."""
    spectrum = source.spectrum
    if isinstance(spectrum, EmissionTable):
        nm = np.array(spectrum.wavelength_nm)
    elif isinstance(spectrum, Illuminant):
        nm = illuminant_wavelengths(spectrum.name)
    else:
        return np.zeros(0)
    return np.concatenate([[np.nextafter(nm[0], 0.0)], nm, [np.nextafter(nm[-1], np.inf)]])


def _cumulated(nm: Float, value: Float) -> Float:
    """Integral of a value that is linear between wavelengths up to each of them, (n,)."""
    return np.concatenate([[0.0], np.cumsum((value[1:] + value[:-1]) / 2 * np.diff(nm))])


def spectral_bands(scene: Scene, more_lines_nm: Iterable[float] = ()) -> Bands:
    """The bands of a spectral simulation: those of ``settings.spectrum`` in which a source shines, then single lines.

    Parameters
    ----------
    scene : Scene
    more_lines_nm : iterable of float
        Single wavelengths besides those of the sources' own spectra.

    Raises
    ------
    SceneError
        If a source shines in no band, its illuminant is unknown, or there are too many single wavelengths.
    """
    settings: SpectralBands = scene.settings.spectrum
    edges = np.linspace(settings.from_nm, settings.to_nm, settings.bands + 1)
    own = (s.spectrum.wavelength_nm for s in scene.sources.values() if isinstance(s.spectrum, SpectralLines))
    lines = sorted({*more_lines_nm, *(nm for wavelengths in own for nm in wavelengths)})
    continuous = {n: s for n, s in scene.sources.items() if not isinstance(s.spectrum, SpectralLines)}
    for name, source in continuous.items():
        if isinstance(source.spectrum, Illuminant):
            check_illuminant(source.spectrum.name, f"Source '{name}'")
    low, high = edges[:-1], edges[1:]
    if continuous:
        whole = Bands(low, high, True, settings.observer, np.zeros((len(low), 3)), None)
        shining = np.any([whole.light_of(s, f"Source '{n}'") > 0 for n, s in continuous.items()], axis=0)
    else:
        shining = np.zeros(len(low), bool)
    if shining.sum() + len(lines) > MOST_BANDS:
        raise SceneError(
            f"Spectra of the sources need {shining.sum()} bands and {len(lines)} single wavelengths, more than "
            f"{MOST_BANDS}: set settings.spectrum.bands lower, or give spectra of many lines as tables."
        )
    low = np.concatenate([low[shining], lines])
    high = np.concatenate([high[shining], lines])
    bare = Bands(low, high, True, settings.observer, np.zeros((len(low), 3)), None)
    rgb = bare._over_bands(lambda nm: srgb_of_wavelengths(nm, settings.observer).T).T
    lumen = bare._over_bands(lambda nm: luminous_efficacy(nm)[None])[0]
    return Bands(low, high, True, settings.observer, rgb, lumen)


def _rgb_of(source: Source) -> Float:
    """Share of a source's light in red, green and blue."""
    if source.spectrum is None:
        rgb = np.array(source.rgb)
    else:  # the spectral effect is switched off
        if isinstance(source.spectrum, SpectralLines):
            nm = np.array(source.spectrum.wavelength_nm)
            weight = np.array(source.spectrum.share or np.ones(len(nm)))
        else:
            nm = np.unique(np.clip(np.concatenate([np.arange(380.0, 780.5), _told_at_nm(source)]), 380.0, 780.0))
            weight = spectral_density(source, nm) * (np.diff(nm, prepend=nm[0]) + np.diff(nm, append=nm[-1])) / 2
        rgb = np.maximum(weight @ srgb_of_wavelengths(nm, "cie_1931_2deg"), 0.0)
        if not rgb.sum() > 0:
            rgb = np.ones(3)  # invisible light
    return rgb / rgb.sum()
