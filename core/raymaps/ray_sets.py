# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays of files and of other Ray Maps that sources of a scene emit: read, placed, and lit by band."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import Bands
from raymaps.errors import RayMapsError, SceneError, decapitalised, unknown_name
from raymaps.formats.ray_file import read_rays
from raymaps.formats.ray_set import RaySet
from raymaps.on_the_way import light_on_the_way
from raymaps.scene import CrossingsSource, EmissionTable, RaysSource, RectangleDetector, Scene, Source
from raymaps.spectral_data import srgb_of_wavelengths
from raymaps.store import RayMap

__all__ = [
    "RayLight",
    "crossing_rays",
    "light_of_rays",
    "lines_of_rays",
    "load_ray_sets",
    "placed_box_mm",
    "placed_sample_mm",
]

#: Rays of more single wavelengths than these stand for a spectrum.
MOST_LINES = 100
#: Step in nm in which wavelengths become colours of an RGB simulation.
_STEP_NM = 1.0


def load_ray_sets(scene: Scene) -> dict[str, RaySet]:
    """Read the rays that sources of a scene emit.

    Returns
    -------
    dict of source name to RaySet, for sources of rays and of crossings, in the set's own axes

    Raises
    ------
    SceneError
        If a file or a map can't be used.
    """
    sets = {}
    for name, source in scene.sources.items():
        try:
            if isinstance(source, RaysSource):
                sets[name] = read_rays(scene.folder / source.file)
            elif isinstance(source, CrossingsSource):
                sets[name] = _crossings_of(scene.folder / source.map, source.detector)
        except RayMapsError as error:
            raise SceneError(f"Source '{name}': {decapitalised(str(error))}.") from error
    return sets


def _crossings_of(path: Path, detector: str) -> RaySet:
    return crossing_rays(RayMap.open(path), detector)


def crossing_rays(raymap: RayMap, detector: str) -> RaySet:
    """The rays that a detector of a map registered, each from where it crossed and with the light it had there.

    A ray's direction is that from the event before the crossing to the event after it.

    Raises
    ------
    SceneError
        If the map has no such detector, or that has registered no ray.
    """
    if detector not in raymap.names.detectors:
        raise SceneError(
            f"Ray Map '{raymap.path}': {decapitalised(unknown_name('detector', detector, raymap.names.detectors))}."
        )
    described = raymap.scene.detectors[detector]
    if not isinstance(described, RectangleDetector):
        raise SceneError(
            f"Ray Map '{raymap.path}': detector '{detector}' is no rectangle; only crossings of a rectangle can be "
            "emitted."
        )
    index = raymap.names.detectors.index(detector)
    x_axis, y_axis, _ = described.axes
    parts: list[tuple[NDArray[Any], ...]] = []
    with_spectra = all(portion.lights.has_spectra for portion in raymap.portions)
    for portion in raymap.portions:
        mine = np.flatnonzero((portion.crossing_detector == index) & portion.crossing_registered)
        row = portion.crossing_row[mine]
        xy = portion.crossing_xy_mm[mine].astype(np.float64)
        way = portion.position_mm[row + 1].astype(np.float64) - portion.position_mm[row]
        length = np.linalg.norm(way, axis=1)
        source = portion.signatures.ray_source[portion.ray_signature[portion.crossing_ray[mine]]]
        power = raymap.ray_flux_w[source] * portion.power[row]
        place_mm = np.array(described.center_mm) + xy[:, :1] * x_axis + xy[:, 1:] * y_axis
        lights, light_row = light_on_the_way(raymap, portion, row, place_mm.__getitem__)
        values = np.asarray(lights.values if with_spectra else lights.shown, np.float32)
        sound = (length > 0) & (power > 0)
        parts.append((place_mm[sound], way[sound] / length[sound, None], power[sound], values[light_row[sound]]))
        portion.forget()
    if not sum(len(part[0]) for part in parts):
        raise SceneError(f"Ray Map '{raymap.path}': detector '{detector}' has registered no ray.")
    position, direction, power, light = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    bands = np.column_stack([raymap.bands.low_nm, raymap.bands.high_nm]) if with_spectra else None
    return RaySet(position, direction, power, light=light, bands_nm=bands, where=f"Ray Map '{raymap.path}'")


def placed_box_mm(source: RaysSource | CrossingsSource, rays: RaySet) -> NDArray[np.float64]:
    """Corners in the scene of a box around the places that rays of a source start from, (8, 3)."""
    corners = np.array([[x, y, z] for x in rays.box_mm[:, 0] for y in rays.box_mm[:, 1] for z in rays.box_mm[:, 2]])
    return np.array(source.position_mm) + corners @ source.axes


def placed_sample_mm(source: RaysSource | CrossingsSource, rays: RaySet, n: int) -> NDArray[np.float64]:
    """Places in the scene that some rays with flux start from, at most (n, 3)."""
    shining = np.flatnonzero(rays.power)
    some = shining[np.linspace(0, len(shining) - 1, min(len(shining), n)).astype(np.int64)]
    return np.array(source.position_mm) + rays.position_mm[some].astype(np.float64) @ source.axes


class RayLight(NamedTuple):
    """Light of the rays of a set."""

    light: NDArray[np.float64]  # (n_lights, n_bands) shares, adding up to 1
    of_ray: NDArray[np.int32]  # (n_rays,) which of them each ray has
    wavelength_nm: NDArray[np.float64]  # (n_rays,) to which rays are narrowed, or empty


def lines_of_rays(scene: Scene, ray_sets: dict[str, RaySet]) -> tuple[float, ...]:
    """Single wavelengths of rays, in nm, ascending; none of sets with so many that they stand for a spectrum."""
    lines: set[float] = set()
    for name, rays in ray_sets.items():
        if _has_own_colours(scene.sources[name], rays) and rays.wavelength_nm is not None:
            distinct = np.unique(rays.wavelength_nm[rays.power > 0].astype(np.float64))
            lines |= set(distinct.tolist()) if len(distinct) <= MOST_LINES else set()
    return tuple(sorted(lines))


def _has_own_colours(source: Source, rays: RaySet) -> bool:
    """Whether the colours of rays count: not if the source has a spectrum, or an rgb other than its default."""
    return source.spectrum is None and source.rgb == (1.0, 1.0, 1.0) and rays.is_coloured


def light_of_rays(source: Source, rays: RaySet, bands: Bands, where: str = "source") -> RayLight:
    """Light by band of the rays of a source.

    Colours that the rays have count unless the source has a spectrum, or an rgb other than its default.

    Raises
    ------
    SceneError
        If rays have wavelengths that are not simulated.
    """
    n, none = len(rays), np.zeros(0)
    if not _has_own_colours(source, rays):
        return RayLight(bands.light_of(source, where)[None], np.zeros(n, np.int32), none)
    if rays.wavelength_nm is not None:
        return _of_wavelengths(rays.wavelength_nm, rays.power > 0, bands, where)
    if rays.spectrum is not None:
        tables = [EmissionTable(wavelength_nm=nm, value=value) for nm, value in rays.spectra]
        used = np.bincount(rays.spectrum, minlength=len(tables)) > 0
        light = np.zeros((len(tables), bands.n))
        for i in np.flatnonzero(used):
            of_rays = source.model_copy(update={"spectrum": tables[i]})
            light[i] = bands.light_of(of_rays, f"{where}, spectrum {i + 1} of its rays")
        light[~used, 0] = 1.0
        return RayLight(light, rays.spectrum, none)
    assert rays.light is not None
    distinct, index = np.unique(rays.light, axis=0, return_inverse=True)
    return RayLight(_of_bands(distinct, rays.bands_nm, bands, where), index.reshape(-1).astype(np.int32), none)


def _of_wavelengths(
    wavelength_nm: NDArray[np.floating], shining: NDArray[np.bool_], bands: Bands, where: str
) -> RayLight:
    """Rays of single wavelengths: all their light in one band, or as the colour that the wavelength has."""
    nm = wavelength_nm.astype(np.float64)
    if not bands.is_spectral:
        first = np.floor(nm.min() / _STEP_NM)
        steps = np.arange(first, np.ceil(nm.max() / _STEP_NM) + 1) * _STEP_NM
        index = np.round(nm / _STEP_NM - first).astype(np.int32)
        return RayLight(_in_gamut(srgb_of_wavelengths(steps, bands.observer)), index, np.zeros(0))
    index = _band_of(nm, bands)
    if (index[shining] < 0).any():
        outside = nm[shining & (index < 0)]
        raise SceneError(
            f"{where}: {len(outside)} of its rays have wavelengths that are not simulated, such as {outside[0]:g} nm: "
            "widen settings.spectrum, or give the source a spectrum in place of that of its rays."
        )
    return RayLight(np.eye(bands.n), np.maximum(index, 0), nm)


def _band_of(nm: NDArray[np.float64], bands: Bands) -> NDArray[np.int32]:
    """Band of each wavelength, (n,), that without a width before others; -1 where none is."""
    index = np.full(len(nm), -1, np.int32)
    for band in np.argsort(bands.low_nm - bands.high_nm, kind="stable"):  # those without a width last
        index[(nm >= bands.low_nm[band]) & (nm <= bands.high_nm[band])] = band
    return index


def _of_bands(
    light: NDArray[np.float32], bands_nm: NDArray[np.float64] | None, bands: Bands, where: str
) -> NDArray[np.float64]:
    """Light in other bands, (n, n_others), to light in ours; shares of rays without light are anything."""
    amounts = light.astype(np.float64)
    if bands_nm is None and not bands.is_spectral:
        shares = amounts
    elif bands_nm is None:  # a spectrum that has the colour, as that of a source with the same rgb
        of_one = np.array([bands.average(one, where) for one in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
        shares = amounts @ (of_one * (bands.high_nm - bands.low_nm))
    elif not bands.is_spectral:
        shares = amounts.sum(axis=1, keepdims=True) * _in_gamut(
            amounts @ srgb_of_wavelengths(bands_nm.mean(axis=1), bands.observer)
        )
    else:
        shares = amounts @ _overlap(bands_nm, bands)
        lost = 1 - shares.sum(axis=1) / np.maximum(amounts.sum(axis=1), 1e-300)
        if (lost[amounts.any(axis=1)] > 1e-6).any():
            raise SceneError(
                f"{where}: up to {100 * float(lost.max()):.3g} % of the light of its rays lies in wavelengths that are "
                "not simulated: widen settings.spectrum, or give the source a spectrum in place of that of its rays."
            )
    shares[shares.sum(axis=1) <= 0] = 1.0
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))


def _overlap(bands_nm: NDArray[np.float64], bands: Bands) -> NDArray[np.float64]:
    """Share of each of other bands, evenly filled, that lies in each of ours, (n_others, n_bands)."""
    low, high = bands_nm[:, :1], bands_nm[:, 1:]
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.clip((np.minimum(high, bands.high_nm) - np.maximum(low, bands.low_nm)) / (high - low), 0.0, 1.0)
    for line in np.flatnonzero(bands_nm[:, 0] == bands_nm[:, 1]):
        share[line] = np.eye(bands.n + 1)[_band_of(bands_nm[line, :1], bands)[0]][: bands.n]
    return share


def _in_gamut(rgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares of red, green and blue nearest to colours, (n, 3); light that no eye sees is white."""
    seen = np.maximum(rgb, 0.0)
    seen[seen.sum(axis=1) <= 1e-12] = 1.0
    return np.asarray(seen / seen.sum(axis=1, keepdims=True))
