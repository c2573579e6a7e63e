# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of lobes and tables of scattering."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import raymaps
from docs.drawing.look import COLOURS, mark, size
from docs.drawing.scenes import Rays, beam, far_field, sheet, trace
from raymaps.effects.abg import abg_bsdf
from raymaps.effects.bsdf import bsdf_per_sr
from raymaps.effects.gaussian import lobe_density
from raymaps.kinds import EventKind
from raymaps.materials import AngularTable, BsdfTable

__all__ = ["draw_bsdf", "draw_coefficients", "draw_lobes", "glossy_table"]


# ---------------------------------------------------------------------------------------------------------------- lobes


_FILTER = {
    "angle_deg": [0, 45, 70, 90],
    "wavelength_nm": [400, 440, 460, 480, 500, 540, 560, 580, 700],
    "value": [
        [0.02, 0.02, 0.02, 0.03, 0.86, 0.9, 0.9, 0.04, 0.02], [0.02, 0.02, 0.03, 0.84, 0.86, 0.86, 0.05, 0.03, 0.02],
        [0.02, 0.02, 0.5, 0.5, 0.48, 0.06, 0.03, 0.03, 0.02], [0] * 9,
    ],
}  # fmt: skip


def draw_coefficients(folder: Path) -> Figure:
    """A filter by its table over angle and wavelength, and what it does at one wavelength."""
    figure = size(9.6, 4.1)
    left, right = figure.subplots(1, 2)
    angles = np.array([0.0, 30.0, 45.0, 60.0, 70.0, 80.0])
    surface = {
        "kind": "coefficients", "specular_transmittance": _FILTER, "diffuse_reflectance": 0.05,
        "specular_reflectance": {"angle_deg": [0, 60, 90], "value": [[0.04], [0.08], [0.95]]},
    }  # fmt: skip
    table = AngularTable.model_validate(_FILTER)
    white = {"kind": "table", "wavelength_nm": [400, 700], "value": [1, 1]}
    rays = trace(
        folder, "filter", {"Plate": {"shape": sheet(60), "surface": "filter"}}, rays=480_000,
        surfaces={"filter": surface}, detectors={"All": far_field()},
        sources={f"{a:g}": beam(a, radius_mm=1e-4, spectrum=white) for a in angles},
        settings={"store": "spectral", "spectrum": {"from_nm": 400, "to_nm": 700, "bands": 30}, "max_events": 3},
    )  # fmt: skip
    nm = np.linspace(400, 700, 301)
    for angle, colour in zip((0.0, 45.0, 60.0), COLOURS, strict=False):
        found = raymaps.evaluate_detector(
            rays.raymap, "All", source=f"{angle:g}", where="event(specular_refraction)"
        ).spectrum
        left.plot(nm, table.at_angles([angle])[0].at(nm), color=colour, label=f"{angle:g}°")
        mark(left, (found.low_nm + found.high_nm) / 2, 30 * found.flux_w, 30 * found.stderr_w, colour)
    kinds = {
        "through": (EventKind.SPECULAR_REFRACTION,), "specular back": (EventKind.SPECULAR_REFLECTION,),
        "diffuse back": (EventKind.DIFFUSE_REFLECTION,), "absorbed": (),
    }  # fmt: skip
    rows = rays.first[:-1] + 1
    n = np.bincount(rays.source, minlength=len(angles))
    known = np.zeros(len(angles))
    smooth = np.linspace(0, 89.9, 180)
    lines = {
        "through": [row.at(nm).mean() for row in table.at_angles(smooth)],
        "specular back": np.interp(smooth, [0, 60, 90], [0.04, 0.08, 0.95]), "diffuse back": np.full(180, 0.05),
    }  # fmt: skip
    for (words, kind), colour in zip(kinds.items(), COLOURS, strict=False):
        light = np.where(np.isin(rays.kind[rows], kind), rays.power[rows], 0.0)
        share = np.bincount(rays.source, light, len(angles)) / n if kind else 1 - known
        known += share
        error = np.sqrt(np.maximum(share * (1 - share), 0) / n)
        mark(right, angles, share, error, colour)
        line = lines.get(words, 1 - sum(np.asarray(each) for each in lines.values()))
        right.plot(smooth, line, color=colour, label=words)
    left.set(title="Specular transmittance of a filter", xlabel="wavelength in nm", ylabel="share", ylim=(0, 1))
    right.set(title="Light from 400 to 700 nm", xlabel="angle of incidence in degrees", xlim=(-1, 90), ylim=(0, 1))
    left.legend(loc="upper right")
    right.legend(loc="upper left", ncols=2)
    return figure


def draw_lobes(folder: Path) -> Figure:
    """Gaussian and ABg: BSDF over the distance from the specular direction."""
    figure = size(9.6, 4.3)
    left, right = figure.subplots(1, 2, sharey=False)
    for sigma, colour in zip((0.02, 0.05, 0.15), COLOURS, strict=False):
        rays = _scattered(folder, f"g{sigma}", {"kind": "gaussian", "reflectance": 1.0, "sigma": sigma})
        _draw_lobe(left, rays, 5 * sigma, 24, colour)
        distance = np.linspace(0, min(5 * sigma, 0.49), 200)
        sine = math.sin(math.radians(30))
        density = lobe_density(sine + distance, np.zeros(200), sine, sigma)
        left.plot(distance, density, color=colour, label=f"sigma {sigma:g}")
    left.set(title='"gaussian"', yscale="log", xlim=(0, 0.5), ylim=(1e-2, 1e3), ylabel="BRDF in 1/sr")
    for (a, b, g), colour in zip(((2e-3, 1e-4, 2.0), (1e-2, 1e-3, 1.5), (1e-2, 1e-2, 3.0)), COLOURS, strict=False):
        rays = _scattered(folder, f"a{b}", {"kind": "abg", "reflectance": 1.0, "a": a, "b": b, "g": g})
        _draw_lobe(right, rays, 0.5, 24, colour, logarithmic=True)
        distance = np.geomspace(1e-3, 0.5, 200)
        right.plot(distance, abg_bsdf(distance, a, b, g), color=colour, label=f"A {a:.2g}, B {b:g}, g {g:g}")
    right.set(title='"abg"', xscale="log", yscale="log", xlim=(1e-3, 0.6), ylabel="BRDF in 1/sr")
    for axes in (left, right):
        axes.set_xlabel("distance |b − b₀| of direction cosines")
        axes.legend(loc="upper right" if axes is left else "lower left")
    return figure


def _scattered(folder: Path, name: str, surface: dict[str, Any]) -> Rays:
    return trace(
        folder, name, {"Plate": {"shape": sheet(40), "surface": "tested"}}, rays=400_000,
        surfaces={"tested": surface}, sources={"Beam": beam(30, radius_mm=1e-4)}, settings={"max_events": 3},
    )  # fmt: skip


def _draw_lobe(axes: Axes, rays: Rays, reach: float, n: int, colour: str, *, logarithmic: bool = False) -> None:
    """Share of all light in rings about the specular direction, over their area in direction cosines."""
    rows = rays.first[:-1] + 1
    scattered = rows[rays.kind[rows] == EventKind.BSDF_DIFFUSE_REFLECTION]
    direction = rays.direction_after(scattered)
    distance = np.hypot(direction[:, 0] - math.sin(math.radians(30)), direction[:, 1])
    edges = np.geomspace(1e-3, reach, n + 1) if logarithmic else np.linspace(0, reach, n + 1)
    counts = np.histogram(distance, edges)[0]
    area = math.pi * np.diff(edges**2) * len(rows)
    enough = counts > 5
    middle = np.sqrt(edges[1:] * edges[:-1]) if logarithmic else np.sqrt((edges[1:] ** 2 + edges[:-1] ** 2) / 2)
    mark(axes, middle[enough], (counts / area)[enough], (np.sqrt(counts) / area)[enough], colour)


# ------------------------------------------------------------------------------------------------------------- tables


def glossy_table() -> BsdfTable:
    """A painted surface: dull, with a lobe of gloss that grows towards grazing."""
    rings = (0, 5, *range(10, 91, 10))
    middle = [(low + high) / 2 for low, high in zip(rings, rings[1:], strict=False)]
    azimuths = tuple((0.0, 360.0) if ring == 0 else tuple(float(a) for a in range(-5, 360, 10)) for ring in rings[:-1])
    incoming = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
    value = []
    for angle in incoming:
        row = []
        for polar, borders in zip(middle, azimuths, strict=True):
            for start, end in zip(borders, borders[1:], strict=False):
                azimuth, s, i = math.radians((start + end) / 2), math.radians(polar), math.radians(angle)
                b2 = (math.sin(s) * math.cos(azimuth) - math.sin(i)) ** 2 + (math.sin(s) * math.sin(azimuth)) ** 2
                row.append(0.08 + 0.35 * (1 + angle / 45) * math.exp(-b2 / (2 * 0.14**2)))
        value.append(tuple(row))
    return BsdfTable.model_validate(
        {
            "lobes": [
                {
                    "comes_from": "front", "goes_to": "reflection", "incoming": {"polar_deg": incoming},
                    "outgoing": [{"ring_deg": rings, "azimuth_deg": azimuths}], "value": [value],
                }
            ]
        }
    )  # fmt: skip


def draw_bsdf(folder: Path) -> Figure:
    """A table of a BRDF, and what was simulated with it."""
    figure = size(9.6, 4.4)
    panels = figure.subplots(1, 2, subplot_kw={"projection": "polar"})
    table = glossy_table()
    rays = trace(
        folder, "table", {"Plate": {"shape": sheet(40), "surface": "tested"}}, rays=1_000_000,
        surfaces={"tested": {"kind": "bsdf", "data": table.model_dump(mode="json")}},
        sources={"Beam": beam(45, radius_mm=1e-4)}, settings={"max_events": 3, "roulette_threshold": 1},
    )  # fmt: skip
    rows = rays.first[:-1] + 1
    direction = rays.direction_after(rows[rays.kind[rows] == EventKind.BSDF_DIFFUSE_REFLECTION])
    polar, azimuth = np.array([0, 5, *range(10, 91, 10)]), np.linspace(-185, 175, 37)  # the table's own cells
    sine, turn = np.sin(np.radians(polar)), np.radians(azimuth)
    counts = np.histogram2d(
        np.hypot(direction[:, 0], direction[:, 1]),
        (np.arctan2(direction[:, 1], direction[:, 0]) - turn[0]) % (2 * math.pi) + turn[0], (sine, turn),
    )[0]  # fmt: skip
    simulated = counts / len(rows) / (np.diff(sine**2)[:, None] / 2 * np.diff(turn))
    given = np.array(
        [
            [bsdf_per_sr(table, "front", "reflection", (45, 0), (p, a)) for a in (azimuth[1:] + azimuth[:-1]) / 2]
            for p in (polar[1:] + polar[:-1]) / 2
        ]
    )
    for axes, values, words in zip(panels, (given, simulated), ("Table", "Simulated, a million rays"), strict=True):
        axes.grid(False)
        image = axes.pcolormesh(turn, polar, values, cmap="viridis", vmin=0, vmax=given.max(), rasterized=True)
        axes.set(title=words, yticks=[30, 60, 90], yticklabels=["30°", "60°", ""], ylim=(0, 90))
        axes.tick_params(axis="y", labelcolor="white", labelsize=11)
        axes.set_rlabel_position(135)
    figure.colorbar(image, ax=list(panels), label="BRDF in 1/sr", shrink=0.85, pad=0.06)
    return figure
