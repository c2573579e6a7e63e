# SPDX-License-Identifier: LGPL-2.1-or-later
"""Smooth interfaces and metals with a stack of thin layers: reflectance and transmittance by the characteristic matrix.

Each layer is a medium of the scene with its dispersion and absorption, metals too. Both polarisations are averaged:
rays carry none. What is neither reflected nor transmitted is absorbed in the layers. Within a band of the spectrum
several wavelengths are averaged; at a single wavelength the result is exact, and red, green and blue stand for one
wavelength each. What passes is refracted by Snell's law. Not modelled: the shift of beams along the layers, and layers
too thick to interfere.

While a scene is prepared, the share of the light that is reflected and transmitted is tabulated over the angle for each
pair of media in which the surface may stand, from both sides, with steps so fine that linear interpolation is right to
2e-4 at every angle; where resonances are narrower than about 0.01 degrees, to 1e-3 on the mean over the angle.

References
----------
F. Abelès: Recherches sur la propagation des ondes électromagnétiques sinusoïdales dans les milieux stratifiés, Ann. de
Physique 12 no. 5 (1950); H. A. Macleod: Thin-Film Optical Filters, 4th ed. (2010), section 2.7.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import Bands
from raymaps.effects.lowering import Lowering, index_in_bands
from raymaps.effects.usage import faces_of_kind
from raymaps.errors import SceneError
from raymaps.materials import Medium, Mixture, SpectrumTable, ThinFilm
from raymaps.scene import Scene

__all__ = ["Data", "lower", "needed_by", "sines_of", "stack_shares"]

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Linear interpolation between a table's places is right to this, or the steps are halved; right on the mean to the
#: second figure once there are no more steps.
TOLERANCE, _ON_AVERAGE = 2e-4, 1e-3
#: Medium around all bodies where a scene names none.
_VACUUM = "vacuum"
#: Fewest and most steps of a table.
_FEWEST, _MOST = 64, 8192
#: Places times wavelengths that are worked on at once, so that memory stays small.
_AT_ONCE = 2**18
#: Phase that a layer may turn within a band for each wavelength that is averaged, and most wavelengths a band.
_PHASE_RAD, _MOST_WAVELENGTHS = 1.0, 64


class Data(NamedTuple):
    """What the kernel reads; a row is a surface, from one side, between two media."""

    row: NDArray[np.int32]  # (n_surfaces, front or back, n_media before, n_media beyond), -1 none
    share: Float  # (n_rows, below or beyond the critical angle, n_places, reflected or transmitted, n_bands)
    is_conductor: NDArray[np.bool_]  # (n_media,)


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for thin films if a face has one."""
    return faces_of_kind(scene, "thin_film")


def lower(lowering: Lowering) -> Data:
    """Tables of all films between all pairs of media in which they can stand."""
    scene, names = lowering.scene, lowering.names
    n_media = len(names.media)
    is_conductor = lowering.is_conductor
    row = np.full((len(names.surfaces), 2, n_media, n_media), -1, np.int32)
    tables: list[Float] = []
    for surface, (name, film) in enumerate(scene.surfaces.items()):
        if not isinstance(film, ThinFilm):
            continue
        sampling = _Sampling.of(lowering, film)
        for near, far, from_back in _places(lowering, name):
            if is_conductor[near]:
                continue
            row[surface, from_back, near, far] = len(tables)
            tables.append(
                sampling.table(f"Surface '{name}'", lowering, near, far, from_back == 1, bool(is_conductor[far]))
            )
    most = max((table.shape[1] for table in tables), default=2)
    finest = [_refined(table, most) for table in tables]
    share = np.stack(finest) if finest else np.zeros((0, 2, 2, 2, lowering.bands.n))
    return Data(row, share, is_conductor)


def _places(lowering: Lowering, surface: str) -> tuple[tuple[int, int, int], ...]:
    """Media before and beyond a surface property, and whether light comes from its back, wherever it may stand."""
    scene, names = lowering.scene, lowering.names
    of_body = {name: body.medium for name, body in scene.bodies.items() if body.medium is not None}
    around = scene.ambient or _VACUUM
    places: dict[tuple[int, int, int], None] = {}
    for name, medium in of_body.items():
        body = scene.bodies[name]
        props = [scene.surfaces[prop] for prop in (body.surface, *body.face_surfaces.values())]
        parts = [part.surface for prop in props if isinstance(prop, Mixture) for part in prop.parts]
        if surface in (body.surface, *body.face_surfaces.values(), *parts):
            others = (around, *(other for owner, other in of_body.items() if owner != name))
            for outside, inside in ((names.media.index(other), names.media.index(medium)) for other in others):
                places |= {(outside, inside, 0): None, (inside, outside, 1): None}
    return tuple(places)


def _refined(table: Float, n_places: int) -> Float:
    """The same table (2, n, ...) on a finer grid of places, whose steps are a power of two finer."""
    while table.shape[1] < n_places:
        finer = np.empty((table.shape[0], 2 * table.shape[1] - 1, *table.shape[2:]))
        finer[:, ::2] = table
        finer[:, 1::2] = (table[:, 1:] + table[:, :-1]) / 2
        table = finer
    return table


class _Sampling(NamedTuple):
    """Wavelengths at which a film is looked at, and its layers there."""

    wavelength_nm: Float  # (n_wavelengths,)
    weight: Float  # (n_wavelengths,) of each in its band
    band: NDArray[np.int64]  # (n_wavelengths,)
    layers: Complex  # (n_layers, n_wavelengths) n + ik
    thickness_nm: Float  # (n_layers,)

    @classmethod
    def of(cls, lowering: Lowering, film: ThinFilm) -> _Sampling:
        bands, thickness_nm = lowering.bands, np.array([layer.thickness_nm for layer in film.layers])
        media = [layer.medium for layer in film.layers]
        middle = np.array([np.atleast_1d(lowering.scene.media[m].index_at(bands.center_nm)) for m in media])
        optical_nm = np.max(thickness_nm[:, None] * np.nan_to_num(middle, nan=1.0), axis=0)
        nm, weight, band = [], [], []
        for b, (low, high) in enumerate(zip(bands.low_nm, bands.high_nm, strict=True)):
            phase = 4 * np.pi * optical_nm[b] * (high - low) / bands.center_nm[b] ** 2
            count = 1 if high == low else min(4 + int(phase / _PHASE_RAD), _MOST_WAVELENGTHS)
            node, share = np.polynomial.legendre.leggauss(count)
            nm.append((low + high) / 2 + (high - low) / 2 * node)
            weight.append(share / 2)
            band.append(np.full(count, b))
        at, of_band = np.concatenate(nm), np.concatenate(band)
        index = np.array([_complex_index(name, lowering.scene.media[name], bands, at, of_band) for name in media])
        return cls(at, np.concatenate(weight), of_band, index, thickness_nm)

    def table(self, where: str, lowering: Lowering, near: int, far: int, from_back: bool, is_conductor: bool) -> Float:
        """Shares that are reflected and transmitted, (below or beyond the critical angle, n_places, 2, n_bands)."""
        names, media, bands = lowering.names.media, lowering.media, lowering.bands
        n_i = index_in_bands(names[near], media[near], bands, self.wavelength_nm)
        n_t: Float | Complex = index_in_bands(names[far], media[far], bands, self.wavelength_nm)
        if is_conductor:
            n_t = _complex_index(names[far], media[far], bands, self.wavelength_nm, self.band)
        order = slice(None, None, -1 if from_back else 1)
        layers, thickness_nm = self.layers[order], self.thickness_nm[order]

        def shares(places: Float, beyond: bool) -> Float:
            parts = np.array_split(places, math.ceil(len(places) * len(self.band) / _AT_ONCE))
            return np.concatenate([shares_of_few(part, beyond) for part in parts])

        def shares_of_few(places: Float, beyond: bool) -> Float:
            sine = sines_of(places[:, None], n_i, None if is_conductor else n_t.real, beyond)
            reflected, transmitted = stack_shares(sine, n_i, layers, thickness_nm, n_t, self.wavelength_nm)
            both = np.stack([reflected, np.zeros_like(reflected) if is_conductor else transmitted], axis=1)
            starts = np.searchsorted(self.band, np.arange(bands.n))
            return np.add.reduceat(both * self.weight, starts, axis=2)

        # nothing happens beyond the critical angle where there is none, or where no layer absorbs
        trivial = is_conductor or bool((n_i <= n_t.real).all()) or not layers.imag.any()
        zones = [True] if trivial else [True, False]
        n_steps = _FEWEST
        places = np.linspace(0, 1, n_steps + 1)
        known = np.stack([shares(places, not zone) for zone in zones])
        while True:
            between = np.stack([shares((places[1:] + places[:-1]) / 2, not zone) for zone in zones])
            error = np.abs((known[:, 1:] + known[:, :-1]) / 2 - between)
            finer = np.empty((len(zones), 2 * n_steps + 1, *known.shape[2:]))
            finer[:, ::2], finer[:, 1::2] = known, between
            # steps of half the width have a quarter of the error
            if error.max() / 4 <= TOLERANCE or (n_steps == _MOST and error.mean() / 4 <= _ON_AVERAGE):
                return finer if len(zones) == 2 else np.concatenate([finer, _all_reflected(finer)])
            if n_steps == _MOST:
                raise SceneError(
                    f"{where}: its layers, {self.thickness_nm.sum():g} nm in all, change what they reflect within less "
                    f"than {90 / _MOST:.2g} degrees: make thick layers bodies of their own."
                )
            n_steps, known, places = 2 * n_steps, finer, np.linspace(0, 1, 2 * n_steps + 1)


def _all_reflected(table: Float) -> Float:
    """A table of the same shape under total reflection."""
    result = np.zeros_like(table)
    result[:, :, 0] = 1.0
    return result


def _complex_index(name: str, medium: Medium, bands: Bands, wavelength_nm: Float, band: NDArray[np.int64]) -> Complex:
    """Index n + ik of a medium at wavelengths in given bands; absorption a stands for k = a lambda / (4 pi)."""

    def at(value: tuple[float, float, float] | SpectrumTable, what: str) -> Float:
        averages = bands.average(value, f"Medium '{name}', {what}")  # also tells where a table ends too early
        return value.at(wavelength_nm) if isinstance(value, SpectrumTable) else averages[band]

    per_nm = at(medium.absorption_per_mm, "absorption_per_mm") * 1e-6
    k = at(medium.extinction, "extinction") + per_nm * wavelength_nm / (4 * np.pi)
    return index_in_bands(name, medium, bands, wavelength_nm) + 1j * k


def sines_of(place: Float, n_i: Float, n_t: Float | None, beyond: bool) -> Float:
    """Sines of the angles of incidence at places of a table, 0 to 1.

    Places are even where shares are smooth, so they bend nowhere at the critical angle. Up to it they are the cosine of
    the angle in the rarer medium; beyond it 2/pi arctan(sqrt(sin² - sin²_critical) / cos); in front of a metal the
    cosine of incidence.

    Parameters
    ----------
    place : float64
    n_i : float64
        Refractive index before the surface.
    n_t : float64 or None
        Refractive index beyond; None for a metal.
    beyond : bool
        Whether beyond the critical angle.
    """
    if n_t is None:
        return np.sqrt(1 - place**2) * np.ones_like(n_i)
    if beyond:
        return np.sqrt(1 - np.maximum(0, 1 - (n_t / n_i) ** 2) * np.cos(np.pi / 2 * place) ** 2)
    return np.minimum(n_t / n_i, 1) * np.sqrt(1 - place**2)


def stack_shares(
    sine: Float, n_i: Float, layers: Complex, thickness_nm: Float, n_t: Float | Complex, wavelength_nm: Float
) -> tuple[Float, Float]:
    """Shares of unpolarised light that a stack of layers reflects and transmits.

    Parameters
    ----------
    sine : (...) float64, 0 to 1
        Of the angle of incidence.
    n_i : (...) float64
        Refractive index before the stack.
    layers : (n_layers, ...) complex128
        Indices n + ik in the order in which light meets them.
    thickness_nm : (n_layers,) float64
    n_t : (...) float64 or complex128
        Refractive index beyond.
    wavelength_nm : (...) float64
        In vacuum.

    Returns
    -------
    reflected, transmitted : (...) float64, together at most 1

    References
    ----------
    Macleod, eq. 2.130 (characteristic matrix), 2.128 and 2.129 (reflectance, transmittance), with n + ik and waves
    exp(-i omega t) in place of his n - ik; admittances in units of that of vacuum: n cos for s, n / cos for p.
    """
    along2 = (n_i * sine) ** 2
    indices = [np.asarray(n, np.complex128) for n in (n_i, *layers, n_t)]
    through = [_root(n**2 - along2) for n in indices]
    # rows are the polarisations: admittances of the media, and the fields E and H behind the layers that are done
    admittances = [np.stack(np.broadcast_arrays(q, n**2 / q)) for n, q in zip(indices, through, strict=True)]
    first, *inner, last = admittances
    electric, magnetic = np.ones_like(last * first), last + 0 * first
    log_scale = np.zeros(electric.shape)
    for admittance, q, d in zip(inner[::-1], through[-2:0:-1], thickness_nm[::-1], strict=True):
        phase = 2 * np.pi * d * q / wavelength_nm
        # cos and -i sin, both times exp(-Im phase), and what that takes off is kept as a logarithm
        there, back = np.exp(1j * phase.real - 2 * phase.imag), np.exp(-1j * phase.real)
        cos, sin = (there + back) / 2, (back - there) / 2
        electric, magnetic = cos * electric + sin / admittance * magnetic, admittance * sin * electric + cos * magnetic
        size = np.abs(electric) + np.abs(magnetic)
        electric, magnetic = electric / size, magnetic / size
        log_scale += phase.imag + np.log(size)
    amplitude = first * electric + magnetic
    reflected = (np.abs((first * electric - magnetic) / amplitude) ** 2).mean(axis=0)
    with np.errstate(under="ignore"):
        entering = 4 * first.real * last.real * np.exp(-2 * log_scale) / np.abs(amplitude) ** 2
    reflected = np.clip(reflected, 0, 1)
    return reflected, np.clip(entering.mean(axis=0), 0, 1 - reflected)


def _root(squared: Complex) -> Complex:
    """Square root with both parts >= 0, and never quite 0."""
    root = np.sqrt(squared)
    return np.where(np.abs(root) < 1e-12, 1e-12, root)
