# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scattering inside media, drawn as an event: an exponential free path, then a new direction by a phase function.

A medium holds one or several kinds of scatterers side by side, each with a coefficient over wavelength and a phase
function. A ray stays one ray with all its light: the place is drawn from the mixture of its bands' exponentials and its
light recoloured so that the expectation of each band is right. Absorption acts over the same way, independent of it.

The kernel has two functions: `run` on the way ends the segment where the ray is scattered, and `scatter`, at the stage
of the surfaces, turns the rays that absorption has left.

References
----------
S. Chandrasekhar: Radiative Transfer, Dover (1960), chapter 1. L. Wang, S. Jacques, L. Zheng: MCML - Monte Carlo
modeling of light transport in multi-layered tissues, Comput. Methods Programs Biomed. 47 (1995), p. 131.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import used_media
from raymaps.materials import HenyeyGreenstein, IsotropicPhase, SpectrumTable, TabulatedPhase
from raymaps.scene import Scene

__all__ = ["Data", "FreePath", "acts_on", "drawn_free_path", "lower", "needed_by", "phase_cumulated", "phase_density"]

Float = NDArray[np.float64]
Phase = IsotropicPhase | HenyeyGreenstein | TabulatedPhase


class Data(NamedTuple):
    """What the kernel reads; the components of medium m are component_start[m] : component_start[m + 1]."""

    mode: NDArray[np.uint8]  # (n_media,) 0 does not scatter, 1 with the same coefficient in all bands, 2 coloured
    coefficient: Float  # (n_media, n_bands) of all components together, per frame unit
    component_start: NDArray[np.int32]  # (n_media + 1,)
    component_share: Float  # (n_components, n_bands) of the medium's coefficient
    g: Float  # (n_components,) mean cosine; 0 is isotropic
    table_start: NDArray[np.int32]  # (n_components + 1,) entries of a tabulated phase function; none: by g
    angle_rad: Float  # (n_entries,)
    value: Float  # (n_entries,)
    cumulated: Float  # (n_entries,) 0 to 1 in each table


def _scatters(value: tuple[float, float, float] | SpectrumTable) -> bool:
    return any(value.value if isinstance(value, SpectrumTable) else value)


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for scattering in media if a medium that light can travel in scatters."""
    return tuple(
        f"medium '{name}' of {where}"
        for name, where in used_media(scene).items()
        if not scene.media[name].is_conductor
        and any(_scatters(component.coefficient_per_mm) for component in scene.media[name].scattering)
    )


def acts_on(data: Data) -> NDArray[np.bool_]:
    """Media that scatter, (n_media,)."""
    return data.mode > 0


def lower(lowering: Lowering) -> Data:
    """Coefficients of each medium and its components by band, and their phase functions.

    Raises
    ------
    SceneError
        If a table says nothing of wavelengths that are simulated.
    """
    n_bands = lowering.bands.n
    used = used_media(lowering.scene)
    mode, coefficients, starts = [], [], [0]
    shares: list[Float] = []
    g: list[float] = []
    tables: list[tuple[Float, Float, Float]] = []
    for name, medium in zip(lowering.names.media, lowering.media, strict=True):
        components = medium.scattering if name in used and not medium.is_conductor else ()
        parts = [
            lowering.bands.average(component.coefficient_per_mm, f"Medium '{name}', scattering {number}")
            for number, component in enumerate(components, 1)
        ]
        total = np.sum(parts, axis=0) if parts else np.zeros(n_bands)
        coefficients.append(total * lowering.frame.unit_mm)
        mode.append(0 if not total.any() else 1 if (total == total[0]).all() else 2)
        for part, component in zip(parts, components, strict=True):
            shares.append(np.divide(part, total, out=np.zeros(n_bands), where=total > 0))
            phase = component.phase
            g.append(phase.g if isinstance(phase, HenyeyGreenstein) else 0.0)
            tables.append(_table(phase) if isinstance(phase, TabulatedPhase) else (np.zeros(0),) * 3)
        starts.append(len(shares))
    angle_rad, value, cumulated = (np.concatenate([np.zeros(0), *(table[k] for table in tables)]) for k in range(3))
    return Data(
        np.array(mode, np.uint8), np.array(coefficients).reshape(-1, n_bands), np.array(starts, np.int32),
        np.array(shares).reshape(-1, n_bands), np.array(g, np.float64),
        np.cumsum([0, *(len(table[0]) for table in tables)]).astype(np.int32), angle_rad, value, cumulated,
    )  # fmt: skip


def _table(phase: TabulatedPhase) -> tuple[Float, Float, Float]:
    """Angles in radians, values and cumulated density of a tabulated phase function."""
    angle_rad, value = np.radians(phase.angle_deg), np.array(phase.value) / max(phase.value)
    integral = np.concatenate([[0.0], np.cumsum(_cell_integrals(angle_rad, value, np.diff(angle_rad)))])
    return angle_rad, value, integral / integral[-1]


def _cell_integrals(angle_rad: Float, value: Float, x: Float) -> Float:
    """Integral of p(theta) sin(theta) from the start of each cell of a table to x beyond it, (n_angles - 1,).

    By parts: the integral of (p + s t) sin(a + t) is p (cos(a) - cos(a + x)) + s (sin(a + x) - sin(a) - x cos(a + x)).
    """
    start, slope = angle_rad[:-1], np.diff(value) / np.diff(angle_rad)
    difference = 2 * np.sin(start + x / 2) * np.sin(x / 2)  # cos(a) - cos(a + x)
    return value[:-1] * difference + slope * (2 * np.cos(start + x / 2) * np.sin(x / 2) - x * np.cos(start + x))


def phase_density(phase: Phase, cos_theta: ArrayLike) -> Float:
    """Phase function as a density over solid angle, 1/sr; its integral over all directions is 1.

    Parameters
    ----------
    phase : IsotropicPhase, HenyeyGreenstein or TabulatedPhase
    cos_theta : any shape, -1 to 1
        Cosine of the angle between the directions before and after: 1 is straight on.

    References
    ----------
    L. Henyey, J. Greenstein: Diffuse radiation in the galaxy, Astrophys. J. 93 (1941), p. 70.
    """
    cosine = np.asarray(cos_theta, np.float64)
    if isinstance(phase, TabulatedPhase):
        angle_rad, value = np.radians(phase.angle_deg), np.array(phase.value) / max(phase.value)
        integral = 2 * math.pi * _cell_integrals(angle_rad, value, np.diff(angle_rad)).sum()
        return np.interp(np.arccos(cosine), angle_rad, value) / integral
    g = phase.g if isinstance(phase, HenyeyGreenstein) else 0.0
    return (1 - g * g) / (4 * math.pi * (1 + g * g - 2 * g * cosine) ** 1.5)


def phase_cumulated(phase: Phase, cos_theta: ArrayLike) -> Float:
    """Share of the light that is scattered to larger angles, so to cosines below ``cos_theta``; any shape."""
    cosine = np.asarray(cos_theta, np.float64)
    if isinstance(phase, TabulatedPhase):
        angle_rad, value, cumulated = _table(phase)
        angle = np.arccos(cosine)
        cell = np.clip(np.searchsorted(angle_rad, angle, side="right") - 1, 0, len(angle_rad) - 2)
        whole = _cell_integrals(angle_rad, value, np.diff(angle_rad)).sum()
        slope = (np.diff(value) / np.diff(angle_rad))[cell]
        start, x = angle_rad[cell], angle - angle_rad[cell]
        within = value[cell] * (np.cos(start) - np.cos(angle)) + slope * (
            np.sin(angle) - np.sin(start) - x * np.cos(angle)
        )
        return 1 - cumulated[cell] - within / whole
    g = phase.g if isinstance(phase, HenyeyGreenstein) else 0.0
    root = np.sqrt(1 + g * g - 2 * g * cosine)
    return (1 - g) * (1 + cosine) / (root * (1 + g + root))


class FreePath(NamedTuple):
    """How far a ray gets in a scattering medium, and its light there."""

    is_scattered: bool
    distance_mm: float
    light: Float  # (n_bands,) its sum is that of the light before


def drawn_free_path(light: Float, coefficient_per_mm: Float, distance_mm: float, u: float, v: float) -> FreePath:
    """Draw whether and where a ray is scattered on a way through a medium.

    The expectation of band b behind the way is l_b exp(-m_b d), and that of what is scattered within dt at t is
    l_b m_b exp(-m_b t) dt, though each ray keeps all its light.

    Parameters
    ----------
    light : (n_bands,) float64, >= 0
    coefficient_per_mm : (n_bands,) float64, >= 0
    distance_mm : float
    u, v : float, uniform in (0, 1)
        Whether, and in which band; where.
    """
    scattered = light * -np.expm1(-coefficient_per_mm * distance_mm)
    u *= light.sum()
    if u >= scattered.sum():
        through = light * np.exp(-coefficient_per_mm * distance_mm)
        return FreePath(False, distance_mm, through * (light.sum() / through.sum()))
    drawn = coefficient_per_mm[np.searchsorted(np.cumsum(scattered), u, side="right")]
    way = min(-math.log1p(v * math.expm1(-drawn * distance_mm)) / drawn, distance_mm)
    there = light * coefficient_per_mm * np.exp(-coefficient_per_mm * way)
    return FreePath(True, way, there * (light.sum() / there.sum()))
