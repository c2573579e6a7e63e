# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sources: the light that their rays start with, and how each kind emits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.compile import CompiledScene
from raymaps.scene import (
    ConeSource,
    CosinePower,
    CrossingsSource,
    DiscSource,
    FacesSource,
    GaussianBeamSource,
    LuminaireSource,
    PointSource,
    RaysSource,
    SunSource,
    TabulatedEmission,
)

__all__ = ["SOURCES", "Emitter", "emitters", "quantised"]

#: Light that is less than half a step of 2^-24 may be rounded away.
_STEPS = 2.0**24


def quantised(light: NDArray[np.float64]) -> NDArray[np.float32]:
    """Light by band in steps of 2^-24, so that it is exact in float32 and each row adds up to exactly 1.

    A band keeps at least one step unless it has less than half of one.

    Parameters
    ----------
    light : (n, n_bands) float64, >= 0, each row adding up to 1

    Returns
    -------
    (n, n_bands) float32
    """
    borders = np.round(np.cumsum(light, axis=1) * _STEPS)
    borders[:, -1] = _STEPS
    steps = np.diff(borders, axis=1, prepend=0.0)
    lost = (steps == 0) & (light >= 0.5 / _STEPS)
    if lost.any():  # the brightest band gives them
        steps[lost] = 1
        steps[np.arange(len(steps)), np.argmax(steps, axis=1)] -= lost.sum(axis=1)
    return (steps / _STEPS).astype(np.float32)


@dataclass(frozen=True)
class Emitter:
    """A source ready to emit: the module of `raymaps.kernels.emission` whose ``run`` it is for, and its arguments."""

    kernel: str
    arguments: tuple[Any, ...]


def _axis(direction: tuple[float, float, float]) -> NDArray[np.float64]:
    return np.array(direction) / math.hypot(*direction)


def _opening(half_angle_deg: float) -> float:
    """1 - cos of an angle."""
    return 2 * math.sin(math.radians(half_angle_deg) / 2) ** 2


def _cumulated(weights: NDArray[np.floating]) -> NDArray[np.float64]:
    """Weights summed up to shares of their sum; 1 from the last weight above 0 on, so that no other is ever drawn."""
    sums = np.cumsum(weights.reshape(-1), dtype=np.float64)
    sums /= sums[-1]
    sums[np.flatnonzero(weights.reshape(-1))[-1] :] = 1.0
    return sums


def _angular_weights(angle_rad: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Weights of the values at both ends of each cell between angles in the integral of a linear function times sine.

    By Gauss-Legendre quadrature, exact to rounding for cells up to 180 degrees.
    """
    node, weight = np.polynomial.legendre.leggauss(10)
    t, width = (node + 1) / 2, np.diff(angle_rad)[:, None]
    light = np.sin(angle_rad[:-1, None] + t * width) * width * weight / 2
    return (light * (1 - t)).sum(axis=1), (light * t).sum(axis=1)


def _point(source: PointSource, compiled: CompiledScene, name: str) -> Emitter:
    position = compiled.frame.to_units(np.array(source.position_mm))
    return Emitter("point", (position, np.array([0.0, 0.0, 1.0]), 2.0))


def _cone(source: ConeSource, compiled: CompiledScene, name: str) -> Emitter:
    position = compiled.frame.to_units(np.array(source.position_mm))
    return Emitter("point", (position, _axis(source.direction), _opening(source.half_angle_deg)))


def _disc(source: DiscSource, compiled: CompiledScene, name: str) -> Emitter:
    position = compiled.frame.to_units(np.array(source.position_mm))
    return Emitter("disc", (position, _axis(source.direction), source.radius_mm / compiled.frame.unit_mm))


def _gaussian_beam(source: GaussianBeamSource, compiled: CompiledScene, name: str) -> Emitter:
    position = compiled.frame.to_units(np.array(source.position_mm))
    waist = source.waist_radius_mm / compiled.frame.unit_mm
    return Emitter("gaussian_beam", (position, _axis(source.direction), waist, _opening(source.divergence_deg)))


def _sun(source: SunSource, compiled: CompiledScene, name: str) -> Emitter:
    position = compiled.frame.to_units(np.array(source.position_mm))
    radius, sine = source.radius_mm / compiled.frame.unit_mm, math.sin(math.radians(source.angular_radius_deg))
    return Emitter("sun", (position, _axis(source.direction), radius, sine))


def _faces(source: FacesSource, compiled: CompiledScene, name: str) -> Emitter:
    body = compiled.names.bodies.index(source.body)
    mesh = compiled.meshes[body]
    chosen = np.isin(mesh.triangle_face, mesh.face_indices(source.faces, f"body '{source.body}'")) & ~mesh.degenerate
    first = sum(len(other.triangles) for other in compiled.meshes[:body])
    triangles = np.flatnonzero(chosen).astype(np.int32)
    area = np.linalg.norm(mesh.area_vectors_mm2[triangles], axis=1)
    corners = compiled.frame.to_units(mesh.corners_mm[triangles])
    cumulated = np.cumsum(area) / area.sum()
    places = (compiled.tables, compiled.boundary.tables.exact, (triangles + first).astype(np.int32), cumulated, corners)
    if isinstance(source.emission, CosinePower):
        return Emitter("faces_cosine_power", (*places, source.emission.exponent))
    if isinstance(source.emission, TabulatedEmission):
        angle, value = np.radians(source.emission.angle_deg), np.array(source.emission.value)
        low, high = _angular_weights(angle)
        return Emitter("faces_table", (*places, angle, value, _cumulated(low * value[:-1] + high * value[1:])))
    return Emitter("faces", places)


def _luminaire(source: LuminaireSource, compiled: CompiledScene, name: str) -> Emitter:
    position = compiled.frame.to_units(np.array(source.position_mm))
    c, gamma = np.radians(source.intensity.c_deg), np.radians(source.intensity.gamma_deg)
    candela = np.array(source.intensity.candela)
    low, high = _angular_weights(gamma)
    both = candela[:-1] + candela[1:]  # the mean over C of a cell, twice
    light = np.diff(c)[:, None] * (both[:, :-1] * low + both[:, 1:] * high)
    return Emitter("luminaire", (position, source.axes, c, gamma, candela, _cumulated(light)))


def _rays(source: RaysSource | CrossingsSource, compiled: CompiledScene, name: str) -> Emitter:
    rays, light = compiled.ray_sets[name], compiled.ray_light[name]
    origin = compiled.frame.to_units(np.array(source.position_mm))
    return Emitter(
        "rays",
        (
            rays.position_mm, rays.direction, _cumulated(rays.power), light.of_ray, quantised(light.light),
            light.wavelength_nm, source.axes, origin, compiled.frame.unit_mm,
        ),
    )  # fmt: skip


#: How each kind of source is made ready.
SOURCES: dict[str, Callable[[Any, CompiledScene, str], Emitter]] = {
    "point": _point,
    "cone": _cone,
    "disc": _disc,
    "gaussian_beam": _gaussian_beam,
    "sun": _sun,
    "faces": _faces,
    "luminaire": _luminaire,
    "rays": _rays,
    "crossings": _rays,
}


def emitters(compiled: CompiledScene) -> tuple[Emitter, ...]:
    """All sources of a scene, ready to emit, in its order."""
    return tuple(SOURCES[source.kind](source, compiled, name) for name, source in compiled.scene.sources.items())
