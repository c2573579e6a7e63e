# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of absorption and scattering inside media."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import raymaps
from docs.drawing.look import COLOURS, size
from docs.drawing.scenes import beam, block, far_field, trace
from raymaps.effects.medium_scattering import phase_density
from raymaps.kinds import EventKind
from raymaps.materials import HenyeyGreenstein, SpectrumTable, TabulatedPhase

__all__ = ["draw_absorption", "draw_phase", "draw_slab"]

_ABSORPTION = {
    "wavelength_nm": [400, 430, 460, 490, 520, 550, 580, 610, 640, 670, 700],
    "value": [0.9, 0.55, 0.16, 0.03, 0.01, 0.04, 0.17, 0.42, 0.6, 0.5, 0.35],
}


def draw_absorption(folder: Path) -> Figure:
    """Light through a green glass: what is left, and where the rest ended."""
    figure = size(9.6, 4.0)
    left, right = figure.subplots(1, 2)
    table = SpectrumTable(**_ABSORPTION)
    nm = np.linspace(400, 700, 300)
    for thickness, colour in zip((1.0, 4.0, 12.0), COLOURS, strict=False):
        rays = trace(
            folder, f"{thickness}", {
                "Plate": {"shape": block((-10, -10, -thickness), (10, 10, 0)), "medium": "green", "surface": "polished"}
            }, rays=60_000,
            media={
                "around": {"refractive_index": 1.5},
                "green": {"refractive_index": 1.5, "absorption_per_mm": _ABSORPTION},
            },
            ambient="around", surfaces={"polished": {"kind": "fresnel"}}, detectors={"All": far_field()},
            sources={"Beam": beam(0, spectrum={"kind": "table", "wavelength_nm": [400, 700], "value": [1, 1]})},
            settings={"store": "spectral", "spectrum": {"from_nm": 400, "to_nm": 700, "bands": 30}},
        )  # fmt: skip
        spectrum = raymaps.evaluate_detector(rays.raymap, "All").spectrum
        left.plot(nm, np.exp(-table.at(nm) * thickness), color=colour, label=f"{thickness:g} mm")
        left.errorbar(
            (spectrum.low_nm + spectrum.high_nm) / 2, 30 * spectrum.flux_w, 30 * spectrum.stderr_w, fmt="o", ms=4.5,
            mfc="white", mew=1.4, color=colour,
        )  # fmt: skip
    last = rays.first[1:] - 1
    depth = -rays.place_mm[last[rays.kind[last] == EventKind.MEDIUM_ABSORPTION], 2]
    edges = np.linspace(0, 12, 25)
    counts = np.histogram(depth, edges)[0]
    rate = counts / len(last) / np.diff(edges)
    right.errorbar(
        (edges[1:] + edges[:-1]) / 2, rate, np.sqrt(counts) / len(last) / np.diff(edges), fmt="o", ms=4.5,
        mfc="white", mew=1.4, color=COLOURS[2], label="simulated",
    )  # fmt: skip
    z = np.linspace(0, 12, 200)
    a = table.at(np.linspace(400, 700, 601))
    right.plot(z, (a * np.exp(-a * z[:, None])).mean(axis=1), color="#202428", lw=1.2, label="Beer and Lambert")
    left.set(title="Transmitted by a green glass", xlabel="wavelength in nm", ylabel="share", ylim=(0, 1.04))
    right.set(title="Where light is absorbed", xlabel="depth in mm", ylabel="share per mm", ylim=(0, None))
    left.legend(loc="upper right")
    right.legend(loc="upper right")
    return figure


_FORWARD = TabulatedPhase(
    kind="table", angle_deg=(0, 10, 20, 30, 45, 60, 90, 120, 140, 150, 160, 180),
    value=(30, 16, 7, 3.4, 1.5, 0.75, 0.3, 0.22, 0.55, 0.4, 0.3, 0.35),
)  # fmt: skip


def draw_phase(folder: Path) -> Figure:
    """Phase functions: first angles of scattering, simulated and by formula."""
    figure = size(9.6, 4.2)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1))
    for g, colour in zip((-0.4, 0.0, 0.5, 0.85), COLOURS, strict=False):
        _draw_phase(left, folder, HenyeyGreenstein(g=g), f"g = {g:g}", colour)
    left.set(title="Henyey and Greenstein", ylabel="per sr")
    _draw_phase(right, folder, _FORWARD, "fog-like table", COLOURS[0])
    rayleigh = np.linspace(0, 180, 37)
    table = TabulatedPhase(angle_deg=tuple(rayleigh), value=tuple(1 + np.cos(np.radians(rayleigh)) ** 2))
    _draw_phase(right, folder, table, "Rayleigh, 1 + cos²", COLOURS[1])
    right.set(title="Tables")
    for axes in (left, right):
        axes.set(xlabel="angle of scattering in degrees", yscale="log", xlim=(0, 180), xticks=range(0, 181, 30))
        axes.legend(loc="upper right")
    return figure


def _draw_phase(axes: Any, folder: Path, phase: Any, words: str, colour: str) -> None:
    rays = trace(
        folder, words.split()[0] + words[-3:].replace("²", ""),
        {"Fog": {"shape": block((-60, -60, -60), (60, 60, 60)), "medium": "fog", "surface": "edge"}},
        rays=150_000, surfaces={"edge": {"kind": "fresnel"}},
        media={"fog": {"refractive_index": 1.0, "scattering": [
            {"coefficient_per_mm": 0.1, "phase": phase.model_dump(mode="json")}]}},
        sources={"Lamp": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}}, settings={"max_events": 4},
    )  # fmt: skip
    rows = rays.first[:-1] + 1
    rows = rows[rays.kind[rows] == EventKind.MEDIUM_SCATTERING]
    cosine = np.einsum("ij,ij->i", rays.direction_after(rows), rays.direction_after(rows - 1))
    edges = np.linspace(0, np.pi, 25)
    counts = np.histogram(np.arccos(np.clip(cosine, -1, 1)), edges)[0]
    measure = 2 * np.pi * -np.diff(np.cos(edges)) * len(rows)
    middle = np.arccos((np.cos(edges[1:]) + np.cos(edges[:-1])) / 2)
    axes.errorbar(
        np.degrees(middle),
        counts / measure,
        np.sqrt(counts) / measure,
        fmt="o",
        ms=4.5,
        mfc="white",
        mew=1.4,
        color=colour,
    )
    angle = np.linspace(0, np.pi, 400)
    axes.plot(np.degrees(angle), phase_density(phase, np.cos(angle)), color=colour, label=words)


#: Total reflection and transmission of a slab of optical thickness 2, albedo 0.9, g = 0.75, no step of the index:
#: H. van de Hulst: Multiple Light Scattering (1980), as quoted by L. Wang et al.: MCML (1995), table 1.
_VAN_DE_HULST = 2.0, 0.09739, 0.66096


def draw_slab(folder: Path) -> Figure:
    """A beam in milky plastic, and what slabs reflect and transmit."""
    figure = size(9.6, 4.2)
    left, right = figure.subplots(1, 2)
    fog = [{"coefficient_per_mm": 0.9, "phase": {"kind": "henyey_greenstein", "g": 0.75}}]
    milky = {"refractive_index": 1.5, "absorption_per_mm": 0.01, "scattering": fog}
    rays = trace(
        folder, "rays",
        {"Slab": {"shape": block((-30, -30, -6), (30, 30, 0)), "medium": "milk", "surface": "polished"}}, rays=70,
         media={"milk": milky}, surfaces={"polished": {"kind": "fresnel"}},
        sources={"Beam": beam(35, radius_mm=0.05)},
    )  # fmt: skip
    left.axhspan(-6, 0, color="#dfe7ee", lw=0)
    for way in rays.ways_mm(range(70)):
        left.plot(way[:, 0], way[:, 2], color=COLOURS[0], lw=0.7, alpha=0.5)
    left.plot([-12 * np.tan(np.radians(35)), 0], [12, 0], color="#202428", lw=2)
    left.set(title="Milky plastic, 6 mm thick", xlim=(-12, 16), ylim=(-13, 9), aspect="equal", xticks=[], yticks=[])
    left.grid(False)
    for spine in left.spines.values():
        spine.set_visible(False)
    depths = np.array([0.25, 0.5, 1, 2, 3, 4, 6, 8])
    shares = np.array([_slab(folder, depth) for depth in depths])
    names = ("reflected", "transmitted", "absorbed")
    for column, (name, colour) in enumerate(zip(names, COLOURS, strict=False)):
        right.errorbar(
            depths, shares[:, column], 1e-3, fmt="o-", ms=5, mfc="white", mew=1.4, lw=1, color=colour, label=name
        )
    depth, reflected, transmitted = _VAN_DE_HULST
    right.plot([depth] * 2, [reflected, transmitted], "+", ms=17, mew=2, color="#202428", label="van de Hulst")
    right.set(
        title="Slabs of albedo 0.9, g = 0.75, no step of the index",
        xlabel="optical thickness",
        ylabel="share",
        ylim=(0, 1),
        xlim=(0, 8.3),
    )
    right.legend(loc="upper right")
    return figure


def _slab(folder: Path, depth: float) -> tuple[float, float, float]:
    rays = trace(
        folder, f"slab{depth}",
        {"Slab": {"shape": block((-5000, -5000, -depth), (5000, 5000, 0)), "medium": "fog", "surface": "edge"}},
        rays=100_000, surfaces={"edge": {"kind": "fresnel"}},
        media={"fog": {"refractive_index": 1.0, "absorption_per_mm": 0.1, "scattering": [
            {"coefficient_per_mm": 0.9, "phase": {"kind": "henyey_greenstein", "g": 0.75}}]}},
        sources={"Beam": beam(0, distance_mm=1)},
    )  # fmt: skip
    last = rays.first[1:] - 1
    left = rays.kind[last] == EventKind.LEFT
    up = rays.place_mm[last, 2] > rays.place_mm[last - 1, 2]
    return float((left & up).mean()), float((left & ~up).mean()), float((~left).mean())
