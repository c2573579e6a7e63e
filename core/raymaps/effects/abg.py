# SPDX-License-Identifier: LGPL-2.1-or-later
"""Specular reflection and transmission of which a part scatters by the ABg model of polished surfaces.

The BSDF A / (B + |b - b0|^g) depends on the distance of the projections b and b0 of the scattered and the specular
direction on the surface (for transmission of the refracted direction). Its integral over all directions of a side, the
total integrated scatter (TIS), is the share of the light that scatters there; it falls a little towards grazing
incidence, and the specular part is what is left of the reflectance or transmittance. A side with a reflectance (or
transmittance) of zero has no lobe. Under total reflection what would be transmitted is reflected.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.effects.lowering import Lowering
from raymaps.effects.usage import faces_of_kind
from raymaps.materials import AbgScatter
from raymaps.materials.scatter import abg_total_scatter
from raymaps.scene import Scene

__all__ = ["Data", "abg_bsdf", "lower", "needed_by", "ring_edges", "ring_shares", "scatter_nodes"]

#: Rings in which points of a lobe are drawn.
N_RINGS = 512
#: Even and logarithmic steps of the table of the TIS.
_N_STEPS = 512


class Data(NamedTuple):
    """What the kernel reads; rows are the ABg surfaces."""

    row: NDArray[np.int32]  # (n_surfaces,) -1 for others
    reflectance: NDArray[np.float64]  # (n_surfaces, n_bands)
    transmittance: NDArray[np.float64]  # (n_surfaces, n_bands)
    b: NDArray[np.float64]  # (n_rows,)
    g: NDArray[np.float64]  # (n_rows,)
    start: NDArray[np.int32]  # (n_rows + 1,) a row's part of the next two
    specular: NDArray[np.float64]  # projections of the specular direction
    scattered: NDArray[np.float64]  # TIS there
    ring_edge: NDArray[np.float64]  # (n_rows, n_rings + 1)
    ring_share: NDArray[np.float64]  # (n_rows, n_rings)
    is_conductor: NDArray[np.bool_]  # (n_media,)


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for the ABg model if a face scatters so."""
    return faces_of_kind(scene, "abg")


def lower(lowering: Lowering) -> Data:
    """Shares by band; the TIS over the angle, and rings to draw from, for each surface."""
    row: list[int] = []
    props: list[AbgScatter] = []
    for prop in lowering.scene.surfaces.values():
        row.append(len(props) if isinstance(prop, AbgScatter) else -1)
        if isinstance(prop, AbgScatter):
            props.append(prop)
    nodes = [scatter_nodes(prop.b, prop.g) for prop in props]
    edges = np.array([ring_edges(prop.b, prop.g) for prop in props]).reshape(-1, N_RINGS + 1)
    return Data(
        np.array(row, np.int32),
        lowering.by_surface("abg", "reflectance"),
        lowering.by_surface("abg", "transmittance"),
        np.array([prop.b for prop in props], np.float64),
        np.array([prop.g for prop in props], np.float64),
        np.cumsum([0, *map(len, nodes)]).astype(np.int32),
        np.concatenate([np.zeros(0), *nodes]),
        np.concatenate(
            [np.zeros(0), *(abg_total_scatter(s, p.a, p.b, p.g) for s, p in zip(nodes, props, strict=True))]
        ),
        edges,
        np.array([ring_shares(e, p.b, p.g) for e, p in zip(edges, props, strict=True)]).reshape(-1, N_RINGS),
        lowering.is_conductor,
    )


def abg_bsdf(distance: NDArray[np.float64], a: float, b: float, g: float) -> NDArray[np.float64]:
    """BSDF of the ABg model in 1/sr at a distance |b - b0| of projections.

    References
    ----------
    J. C. Stover: Optical Scattering, 3rd ed., SPIE (2012), section 4.4 (the ABC or K-correlation model, of which this
    is the form that optical design programs use); R. N. Pfisterer: Approximated Scatter Models for Stray Light
    Analysis, Optics and Photonics News 22 no. 10 (2011), p. 16.
    """
    return a / (b + distance**g)


def _width(b: float, g: float) -> float:
    """Distance at which the lobe has fallen to half of its height; at most the disc's diameter."""
    return 2.0 if g == 0 else float(np.clip(b ** (1 / g), 1e-29, 2.0))


def scatter_nodes(b: float, g: float) -> NDArray[np.float64]:
    """Projections of the specular direction, 0 to 1, between which the TIS is linear to 1e-4 of its largest value."""
    below_edge = np.geomspace(max(1e-3 * _width(b, g), 1e-9), 1.0, _N_STEPS)
    return np.unique(np.concatenate([np.linspace(0, 1, _N_STEPS + 1), 1 - below_edge]))


def ring_edges(b: float, g: float) -> NDArray[np.float64]:
    """Radii of the edges of rings in which the lobe hardly falls, from 0 to 2, (n_rings + 1,)."""
    return np.concatenate([[0.0], np.geomspace(0.25 * _width(b, g), 2.0, N_RINGS)])


def ring_shares(edges: NDArray[np.float64], b: float, g: float) -> NDArray[np.float64]:
    """Cumulated share of the rings by their area and the lobe's height at their inner edge, (n_rings,)."""
    weight = np.diff(edges**2) / (b + edges[:-1] ** g)
    return np.cumsum(weight) / weight.sum()
