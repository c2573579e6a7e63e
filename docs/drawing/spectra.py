# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of spectra, bands and dispersion."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

import raymaps
from docs.drawing.look import COLOURS, colours_of, size
from docs.drawing.scenes import beam, far_field, sheet, trace
from raymaps.bands import spectral_density
from raymaps.materials.catalogue import catalogue_medium
from raymaps.materials.medium import Medium
from raymaps.scene import Scene

__all__ = ["draw_bands", "draw_prism"]

LED = {"kind": "illuminant", "name": "LED-B3"}


def _emitted(folder: Path, name: str, spectrum: dict[str, Any], **settings: Any) -> tuple[Any, Scene]:
    """Spectrum of a source as a far field sees it, and the scene."""
    rays = trace(
        folder, name, {"Plate": {"shape": sheet(1, z=-30), "surface": "black"}}, rays=2000,
        surfaces={"black": {"kind": "absorber"}}, sources={"Lamp": beam(180, spectrum=spectrum)},
        detectors={"All": far_field()}, settings={"store": "spectral", "spectrum": settings},
    )  # fmt: skip
    return raymaps.evaluate_detector(rays.raymap, "All").spectrum, rays.raymap.scene


def draw_bands(folder: Path) -> Figure:
    """Spectra of sources, and the bands in which they are carried."""
    figure = size(9.6, 4.2)
    left, right = figure.subplots(1, 2)
    nm = np.linspace(380, 780, 801)
    for number, (words, spectrum) in enumerate(
        {
            "black body, 2856 K": {"kind": "black_body", "temperature_k": 2856},
            "illuminant D65": {"kind": "illuminant", "name": "D65"},
            "illuminant LED-B3": LED,
            "black body, 6504 K": {"kind": "black_body", "temperature_k": 6504},
        }.items()
    ):
        _, scene = _emitted(folder, f"s{number}", spectrum, from_nm=380, to_nm=780, bands=80)
        density = spectral_density(scene.sources["Lamp"], nm)
        left.plot(nm, density / (density.mean() * 400) * 1e3, color=COLOURS[number], label=words)
    left.set(title="Sources of 1 W", ylabel="mW per nm", xlim=(375, 785), ylim=(0, 10.5))
    left.legend(loc="upper left", ncols=1)
    for bands, colour in ((32, COLOURS[0]), (8, COLOURS[1])):
        spectrum, scene = _emitted(folder, f"b{bands}", LED, from_nm=380, to_nm=780, bands=bands)
        edges = np.append(spectrum.low_nm, spectrum.high_nm[-1])
        height = 1e3 * np.array(spectrum.flux_w) / (spectrum.high_nm - spectrum.low_nm)
        right.stairs(height, edges, color=colour, lw=1.8, label=f"{bands} bands", fill=False)
    density = spectral_density(scene.sources["Lamp"], nm)
    right.plot(nm, density / (density.mean() * 400) * 1e3, color="#202428", lw=1.2, label="its spectrum")
    right.set(title="LED-B3 as it is carried", xlim=(375, 785), ylim=(0, 9.5))
    right.vlines(532, 0, 8.6, color=COLOURS[2], lw=1.8, label="a laser line: a band\nwithout a width")
    right.legend(loc="upper right")
    for axes in (left, right):
        axes.set_xlabel("wavelength in nm")
    return figure


# --------------------------------------------------------------------------------------------------------------- prism


def _prism(side: float, length: float) -> Any:
    """Equilateral prism along y, its edge up, centred."""
    import trimesh

    half, height = side / 2, side * math.sqrt(3) / 2
    section = np.array([[-half, -height / 3], [half, -height / 3], [0, 2 * height / 3]])
    corners = np.array([[x, y, z] for y in (-length / 2, length / 2) for x, z in section])
    quads = ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
    triangles = [t for a, b, c, d in quads for t in ((a, c, b), (a, d, c))] + [(0, 1, 2), (3, 5, 4)]
    mesh = trimesh.Trimesh(corners, triangles, process=False)
    trimesh.repair.fix_normals(mesh)
    return mesh


def draw_prism(folder: Path) -> Figure:
    """White light through a prism of dense flint."""
    figure = size(9.6, 4.4)
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
    index = Medium.model_validate(catalogue_medium("N-SF11"))
    incidence = math.asin(float(index.index_at(550.0)) / 2)  # minimum deviation at 550 nm: sin i = n sin 30°
    down = incidence - math.radians(30)  # the left face looks 30° above the horizontal
    way = np.array([math.cos(down), 0.0, math.sin(down)])
    start = np.array([-5.0, 0.0, 0.0]) - 38 * way
    rays = trace(
        folder, "prism", {"Prism": {"shape": _prism(20, 20), "medium": "N-SF11", "surface": "polished"}}, rays=30_000,
        media={"N-SF11": {"catalogue": "N-SF11"}}, surfaces={"polished": {"kind": "fresnel"}},
        sources={"Slit": {
            "kind": "disc", "flux_w": 1, "radius_mm": 0.05, "position_mm": start.tolist(), "direction": way.tolist(),
            "spectrum": {"kind": "illuminant", "name": "D65"},
        }},
        settings={"spectrum": {"from_nm": 400, "to_nm": 700, "bands": 30}},
    )  # fmt: skip
    refracted = np.flatnonzero(np.diff(rays.first) == 4)
    refracted = refracted[(rays.kind[rays.first[refracted] + 1] == 6) & (rays.kind[rays.first[refracted] + 2] == 6)]
    _draw_rays(left, rays, refracted[:700], way)
    rows = rays.first[refracted] + 2
    direction = rays.direction_after(rows)
    turned = np.degrees(np.arccos(np.clip(direction @ way, -1, 1)))
    nm = rays.wavelength_nm[refracted]
    smooth = np.linspace(400, 700, 200)
    right.plot(smooth, _deviation_deg(index.index_at(smooth), incidence), color="#5f6670", lw=1.4, label="Snell's law")
    right.scatter(nm[:90], turned[:90], s=34, color=colours_of(nm[:90]), lw=0, zorder=3, label="rays")
    right.set(title="Deviation", xlabel="wavelength in nm", ylabel="degrees", xlim=(395, 705))
    right.legend(loc="upper right")
    return figure


def _deviation_deg(n: NDArray[np.float64], incidence: float) -> NDArray[np.float64]:
    """Deviation by a prism of 60°: M. Born, E. Wolf: Principles of Optics, 7th ed., section 4.7.2."""
    inside = np.arcsin(np.sin(incidence) / n)
    out = np.arcsin(n * np.sin(math.radians(60) - inside))
    return np.asarray(np.degrees(incidence + out) - 60)


def _draw_rays(axes: Axes, rays: Any, chosen: NDArray[np.int64], way: NDArray[np.float64]) -> None:
    """Paths from the side, in the colours of their wavelengths."""
    height = 20 * math.sqrt(3) / 2
    axes.fill([-10, 10, 0], [-height / 3, -height / 3, 2 * height / 3], color="#e9eff5", ec="#5f6670", lw=1.2)
    colours = colours_of(rays.wavelength_nm[chosen])
    lines, shades = [], []
    for ray, colour in zip(chosen, colours, strict=True):
        place = rays.place_mm[rays.first[ray] : rays.first[ray + 1]][:, [0, 2]]
        onward = place[2] + 45 * (place[3] - place[2]) / np.linalg.norm(place[3] - place[2])
        lines += [place[1:3], np.array([place[2], onward])]
        shades += [colour, colour]
    shades = np.array(shades)
    shades[:, 3] = 0.35
    axes.add_collection(LineCollection(lines, colors=shades, lw=0.9, rasterized=True))
    first = rays.place_mm[rays.first[chosen[0]]][[0, 2]]
    second = rays.place_mm[rays.first[chosen[0]] + 1][[0, 2]]
    axes.plot([first[0], second[0]], [first[1], second[1]], color="#202428", lw=2)
    axes.set(title="White light through N-SF11", xlim=(-24, 38), ylim=(-26, 15), aspect="equal", xticks=[], yticks=[])
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
