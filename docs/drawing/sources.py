# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of how sources emit."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import raymaps
from docs.drawing.look import COLOURS, mark, size
from docs.drawing.scenes import Rays, far_field, sheet, trace
from raymaps.results.beam import plane_profile

__all__ = ["draw_luminaire", "draw_sources"]

Float = NDArray[np.float64]

WINGS = {"kind": "table", "angle_deg": [0, 20, 40, 55, 65, 80, 90], "value": [0.45, 0.55, 0.85, 1.0, 0.8, 0.15, 0]}
BLACK = {"black": {"kind": "absorber"}}


def _emitted(folder: Path, name: str, source: dict[str, Any], rays: int = 200_000) -> Rays:
    """Rays of one source beside a small black sheet, which may emit."""
    return trace(
        folder, name, {"Sheet": {"shape": sheet(0.01), "surface": "black"}}, rays=rays, surfaces=BLACK,
        sources={"Source": {"flux_w": 1.0, **source}}, settings={"max_events": 3},
    )  # fmt: skip


def draw_sources(folder: Path) -> Figure:
    """Intensity over the angle, and irradiance over the radius: drawn rays and what they are drawn from."""
    figure = size(9.6, 4.2)
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.25, 1, 1))
    faces = {"kind": "faces", "body": "Sheet"}
    table = (np.radians(WINGS["angle_deg"]), np.array(WINGS["value"]))
    shapes: dict[str, tuple[dict[str, Any], Callable[[Float], Float]]] = {
        "Lambertian": (faces, np.cos),
        "cosine power 5": ({**faces, "emission": {"kind": "cosine_power", "exponent": 5}}, lambda t: np.cos(t) ** 5),
        "table": ({**faces, "emission": WINGS}, lambda t: np.interp(t, *table)),
        "cone of 30°": (
            {"kind": "cone", "position_mm": [0, 0, 1], "direction": [0, 0, 1], "half_angle_deg": 30},
            lambda t: (t < math.radians(30)).astype(float),
        ),
    }
    for (words, (source, intensity)), colour in zip(shapes.items(), COLOURS, strict=False):
        rays = _emitted(folder, words[:4], source)
        _draw_intensity(left, rays, intensity, 90, 30, colour, words)
    left.set(title="Intensity over the angle", xlabel="angle in degrees", ylabel="per sr", xlim=(0, 90), ylim=(0, 1.85))
    left.legend(loc="upper right")
    axis = {"position_mm": [0, 0, 1], "direction": [0, 0, 1]}
    sun = {"kind": "sun", "radius_mm": 0.01, **axis}
    laser = {"kind": "gaussian_beam", "waist_radius_mm": 0.01, "divergence_deg": 0.2665, **axis}
    sun_rad = math.radians(0.2665)
    for words, source, intensity, colour in (
        ("sun", sun, lambda t: (t < sun_rad).astype(float), COLOURS[0]),
        ("Gaussian beam", laser, lambda t: np.exp(-2 * (t / sun_rad) ** 2), COLOURS[1]),
    ):
        _draw_intensity(middle, _emitted(folder, words[:3], source), intensity, 0.6, 24, colour, words, scale=1e-4)
    middle.set(title="Narrow beams", xlabel="angle in degrees", ylabel="10⁴ per sr", xlim=(0, 0.6), ylim=(0, 3.6))
    middle.legend(loc="upper right")
    for words, source, irradiance, colour in (
        ("disc, radius 2", {"kind": "disc", "radius_mm": 2.0, **axis}, lambda r: (r < 2) / (4 * math.pi), COLOURS[0]),
        ("Gaussian, waist 2", {"kind": "gaussian_beam", "waist_radius_mm": 2.0, **axis},
         lambda r: np.exp(-2 * (r / 2) ** 2) * 2 / (4 * math.pi), COLOURS[1]),
    ):  # fmt: skip
        rays = _emitted(folder, words[:4] + "r", source)
        radius = np.hypot(*rays.place_mm[rays.first[:-1], :2].T)
        edges = np.linspace(0, 4, 21)
        counts = np.histogram(radius, edges)[0]
        area = math.pi * np.diff(edges**2) * len(radius)
        mark(right, (edges[1:] + edges[:-1]) / 2, counts / area, np.sqrt(counts) / area, colour)
        r = np.linspace(0, 4, 401)
        right.plot(r, irradiance(r), color=colour, label=words)
    right.set(title="Where beams start", xlabel="radius in mm", ylabel="per mm²", xlim=(0, 4), ylim=(0, 0.235))
    right.legend(loc="upper right")
    return figure


def _draw_intensity(
    axes: Axes, rays: Rays, intensity: Callable[[Float], Float], most_deg: float, n: int, colour: str, words: str,
    scale: float = 1.0,
) -> None:  # fmt: skip
    """Share of the rays per solid angle, and the intensity whose integral is 1."""
    direction = rays.direction_after(rays.first[:-1])
    angle = np.arctan2(np.hypot(direction[:, 0], direction[:, 1]), direction[:, 2])
    edges = np.radians(np.linspace(0, most_deg, n + 1))
    counts = np.histogram(angle, edges)[0]
    measure = 4 * math.pi * np.sin((edges[1:] + edges[:-1]) / 2) * np.sin(np.diff(edges) / 2) * len(angle) / scale
    mark(axes, np.degrees((edges[1:] + edges[:-1]) / 2), counts / measure, np.sqrt(counts) / measure, colour)
    t = np.radians(np.linspace(0, most_deg, 6001))
    step = t[1]
    whole = 2 * math.pi * (intensity(t) * np.sin(t)).sum() * step
    axes.plot(np.degrees(t), scale * intensity(t) / whole, color=colour, label=words)


# ----------------------------------------------------------------------------------------------------------- luminaire


def _ies() -> tuple[str, Float, Float, Float]:
    """An LM-63 file of a luminaire with wings along C 0 - 180, with its angles and candela."""
    gamma, c = np.arange(0, 91, 5.0), np.arange(0, 91, 15.0)
    g = np.radians(gamma)
    along = 620 * np.cos(g) ** 0.7 * (1 + 0.9 * np.exp(-(((gamma - 48) / 15) ** 2)))
    across = 620 * np.cos(g) ** 1.6
    share = np.cos(np.radians(c))[:, None] ** 2
    candela = np.round(share * along + (1 - share) * across, 1)
    rows = "\n".join(" ".join(f"{x:g}" for x in row) for row in candela)
    angles = "\n".join(" ".join(f"{x:g}" for x in row) for row in (gamma, c))
    return (
        "IESNA:LM-63-2002\n[LUMINAIRE] wings\nTILT=NONE\n"
        f"1 -1 1 {len(gamma)} {len(c)} 1 2 0 0 0\n1 1 0\n{angles}\n{rows}\n",
        gamma, c, candela,
    )  # fmt: skip


def _flux_lm(gamma_deg: Float, candela: Float) -> float:
    """Luminous flux of a quarter of the half planes, at equal steps of C from 0 to 90 degrees, times four."""
    g = np.radians(np.linspace(gamma_deg[0], gamma_deg[-1], 9001))
    weight = np.array([0.5, *[1.0] * (len(candela) - 2), 0.5])
    mean = (weight / weight.sum()) @ np.array([np.interp(np.degrees(g), gamma_deg, row) for row in candela])
    return float(2 * math.pi * (mean * np.sin(g)).sum() * (g[1] - g[0]))


def draw_luminaire(folder: Path) -> Figure:
    """A luminaire's file as a source, and the far field of what was traced: polar diagram."""
    figure = size(9.6, 4.6)
    left, right = figure.subplots(1, 2, subplot_kw={"projection": "polar"})
    text, gamma, _, candela = _ies()
    (folder / "wings.ies").write_text(text)
    lamp = {
        "kind": "luminaire", "flux_w": 1.0, "position_mm": [0, 0, 100], "intensity": {"file": "wings.ies"},
        "spectrum": {"kind": "illuminant", "name": "LED-B3"},
    }  # fmt: skip
    bare = trace(
        folder, "bare", {"Post": {"shape": sheet(0.01, z=120), "surface": "black"}}, rays=400_000, surfaces=BLACK,
        sources={"Lamp": lamp}, detectors={"All": far_field(axis=[0, 0, -1])},
    )  # fmt: skip
    found = raymaps.evaluate_detector(bare.raymap, "All")
    scale = found.flux_lm.value / _flux_lm(gamma, candela)
    for c, colour, words in ((0, COLOURS[0], "C 0 - 180"), (90, COLOURS[1], "C 90 - 270")):
        angle, intensity = plane_profile(found.intensity_cd, c)
        left.plot(np.radians(angle), intensity, "o", ms=5, mfc="white", mew=1.4, color=colour)
        row = candela[0 if c == 0 else -1] * scale
        around = np.radians(np.concatenate([-gamma[::-1], gamma]))
        left.plot(around, np.concatenate([row[::-1], row]), color=colour, label=words)
    left.set_title("The file (lines) and the far field of\nits rays (points), cd")
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.02), ncols=2)
    n_c, n_gamma = found.intensity_cd.shape
    c_edges = np.radians((np.arange(n_c + 1) - 0.5) * 360 / n_c)
    g_edges = np.concatenate([[0], (np.arange(1, n_gamma) - 0.5) * 180 / (n_gamma - 1)])
    keep = g_edges <= 92.6
    right.grid(False)
    image = right.pcolormesh(
        c_edges, g_edges[keep], found.intensity_cd.T[: keep.sum() - 1], cmap="inferno", vmin=0, rasterized=True
    )
    right.set(
        title="All directions: gamma outwards,\nC around",
        ylim=(0, 92.5),
        yticks=[30, 60, 90],
        yticklabels=["30°", "60°", ""],
    )
    right.tick_params(axis="y", labelcolor="white")
    figure.colorbar(image, ax=right, label="cd", shrink=0.75, pad=0.1)
    left.set_theta_zero_location("S")
    left.set_rlabel_position(150)
    left.set(yticks=[50, 100], yticklabels=["50", "100"])
    left.set_thetagrids(range(0, 360, 30), [f"{min(a, 360 - a)}°" for a in range(0, 360, 30)])
    return figure
