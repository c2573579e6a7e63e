# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays at their emission, straight from the kernels: what the tests of sources share."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.compile import compile_scene
from raymaps.scene import load_scene
from raymaps.sources import emitters, quantised
from raymaps.wave import RunKey, Wave
from tests.physics.scenes import chi_square_agrees, unit, write_scene


class Emitted(NamedTuple):
    """Rays of a scene as they start."""

    position: NDArray[np.float64]  # (n, 3) in mm
    direction: NDArray[np.float64]
    light: NDArray[np.float32]
    triangle: NDArray[np.int32]
    wavelength_nm: NDArray[np.float64]


def emitted(folder: Path, bodies: dict[str, Any], n: int, *, seed: int = 1, **sections: Any) -> Emitted:
    """The first rays of a scene of one source, as its kernel makes them."""
    compiled = compile_scene(load_scene(write_scene(folder, bodies, **sections)))
    (emitter,) = emitters(compiled)
    kernel = importlib.import_module(f"raymaps.kernels.emission.{emitter.kernel}")
    wave = Wave.allocate(n, compiled.bands.n)
    wave.light[:] = quantised(compiled.source_light)[0]
    kernel.run(np.arange(n, dtype=np.int32), wave, RunKey(np.uint64(seed), np.uint64(0), 0.1), *emitter.arguments)
    return Emitted(compiled.frame.to_mm(wave.position), wave.direction, wave.light, wave.triangle, wave.wavelength_nm)


def frame_around(axis: Any) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Two unit vectors at right angles to an axis and to each other, and its own."""
    axis = unit(np.array(axis, float))
    x = unit(np.cross(axis, [0.6, 0.64, 0.48]))
    return x, np.cross(axis, x), axis


def one_minus_cos(direction: NDArray[np.float64], axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """1 - cos of the angle between unit vectors and an axis, (n,), which keeps its digits where they are near."""
    return ((direction - axis) ** 2).sum(axis=1) / 2


def independent(what: str, u: NDArray[np.float64], v: NDArray[np.float64], bins: int = 12) -> None:
    """Assert that two numbers that are even over 0 to 1 are so together."""
    counts = np.histogram2d(u, v, (bins, bins), ((0, 1), (0, 1)))[0]
    chi_square_agrees(what, counts, np.full((bins, bins), len(u) / bins**2))
