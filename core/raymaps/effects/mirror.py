# SPDX-License-Identifier: LGPL-2.1-or-later
"""Specular reflection."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import faces_of_kind
from raymaps.scene import Scene

__all__ = ["Data", "lower", "needed_by", "reflected_direction"]


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for mirrors if a face has one."""
    return faces_of_kind(scene, "mirror")


class Data(NamedTuple):
    """What the kernel reads."""

    reflectance: NDArray[np.float64]  # (n_surfaces, n_bands)


def lower(lowering: Lowering) -> Data:
    """Reflectances by band."""
    return Data(lowering.by_surface("mirror", "reflectance"))


def reflected_direction(direction: NDArray[np.float64], normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Direction after specular reflection: d - 2 (d·n) n.

    Parameters
    ----------
    direction, normal : (n_rays, 3) float64, unit vectors; the normal's sign does not matter

    Returns
    -------
    (n_rays, 3) float64, unit vectors
    """
    return direction - 2 * np.einsum("ij,ij->i", direction, normal)[:, None] * normal
