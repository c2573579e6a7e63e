# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of what surfaces do."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import raymaps
from docs.drawing.look import COLOURS, mark, size
from docs.drawing.scatter import glossy_table
from docs.drawing.scenes import Rays, beam, block, far_field, sheet, trace
from raymaps.effects.conductor import metal_reflectance
from raymaps.effects.fresnel import fresnel_reflectance
from raymaps.effects.thin_film import stack_shares
from raymaps.kinds import EventKind

__all__ = ["draw_interfaces", "draw_rough", "draw_surfaces", "draw_thin_film"]

GLASS = {"glass": {"refractive_index": 1.5}}
DOWN, UP = (-40.0, -40.0, -40.0), (40.0, 40.0, 0.0)

# ------------------------------------------------------------------------------------------- all surfaces at a glance

#: Kind, what it is, the medium behind (None: a sheet), and the property.
_KINDS: tuple[tuple[str, str, str | None, dict[str, Any]], ...] = (
    ("absorber", "", None, {}),
    ("mirror", "reflectance 0.8", None, {"reflectance": 0.8}),
    ("lambertian", "reflects 0.6, transmits 0.3", None, {"reflectance": 0.6, "transmittance": 0.3}),
    ("mixture", "half mirror, half Lambertian", None,
     {"parts": [{"weight": 0.5, "surface": "a"}, {"weight": 0.5, "surface": "b"}]}),
    ("fresnel", "glass, n = 1.5", "glass", {}),
    ("fresnel", "metal: gold", "gold", {}),
    ("thin_film", "quarter-wave mirror on glass", "glass", {"layers": [
        {"medium": "high" if i % 2 == 0 else "low", "thickness_nm": 58.5 if i % 2 == 0 else 94.2} for i in range(9)]}),
    ("rough", "glass, roughness 0.15", "glass", {"roughness": 0.15}),
    ("coefficients", "0.3 specular and 0.3 diffuse back,\n0.3 specular through", None,
     {"specular_reflectance": 0.3, "diffuse_reflectance": 0.3, "specular_transmittance": 0.3}),
    ("gaussian", "sigma 0.1", None, {"reflectance": 0.4, "transmittance": 0.5, "sigma": 0.1}),
    ("abg", "a tenth scatters", None, {"reflectance": 0.95, "a": 0.0075, "b": 0.015, "g": 2}),
    ("bsdf", "table with a lobe of gloss", None, {"data": None}),
)  # fmt: skip


def draw_surfaces(folder: Path) -> Figure:
    """A beam on each kind of surface."""
    figure = size(9.6, 8.5)
    for number, (axes, (kind, words, medium, fields)) in enumerate(
        zip(figure.subplots(3, 4).flat, _KINDS, strict=True)
    ):
        if kind == "bsdf":
            fields = {"data": glossy_table().model_dump(mode="json")}
        body = {"shape": block(DOWN, UP) if medium else sheet(40), "medium": medium, "surface": "tested"}
        rays = trace(
            folder, f"{number}", {"Plate": body}, rays=140,
            media={
                **GLASS, "gold": {"catalogue": "gold"}, "high": {"refractive_index": 2.35},
                "low": {"refractive_index": 1.46},
            },
            surfaces={
                "tested": {"kind": kind, **fields}, "a": {"kind": "mirror"},
                "b": {"kind": "lambertian", "reflectance": 1.0},
            },
            sources={"Beam": beam(40, radius_mm=0.2)},
            settings={"roulette_threshold": 1.0, "spectrum": {"from_nm": 545, "to_nm": 555, "bands": 1}},
        )  # fmt: skip
        _draw_fan(axes, rays, solid=medium is not None)
        axes.set_title(f'"{kind}"', fontfamily="DejaVu Sans Mono", pad=18 if "\n" not in words else 32)
        axes.text(0.5, 1.02, words, transform=axes.transAxes, ha="center", va="bottom", fontsize=10.5)
    return figure


def _draw_fan(axes: Axes, rays: Rays, *, solid: bool) -> None:
    """The segments to the surface and away from it, seen from the side."""
    reach = 10.0
    axes.axhspan(-reach if solid else -0.25, 0, color="#dfe7ee", lw=0)
    axes.plot([-reach, reach], [0, 0], color="#5f6670", lw=1.2)
    axes.plot([-0.62 * reach, 0], [0.739 * reach, 0], color="#202428", lw=2.2)
    absorbed = 0
    for ray in range(len(rays.first) - 1):
        at = rays.first[ray] + 1
        if rays.kind[at] == EventKind.ABSORPTION:
            absorbed += 1
            continue
        x, _, z = rays.direction_after(np.array([at]))[0] * reach * 0.93
        axes.plot([0, x], [0, z], color=COLOURS[0] if z > 0 else COLOURS[1], lw=0.8, alpha=0.55)
    if absorbed:
        axes.text(
            0.5, -0.02, f"absorbed: {100 * absorbed / (len(rays.first) - 1):.0f} %",
            transform=axes.transAxes, fontsize=10.5, ha="center", va="top",
        )  # fmt: skip
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xticks=[], yticks=[])
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)


# ------------------------------------------------------------------------------------------------ smooth interfaces


def draw_interfaces(folder: Path) -> Figure:
    """Reflectance of glass over the angle, of metals over the wavelength: simulated and by formula."""
    figure = size(9.6, 4.3)
    left, right = figure.subplots(1, 2)
    angles = np.array([0, 10, 20, 30, 35, 39, 41, 43, 50, 60, 70, 78, 84, 88.0])
    smooth = np.linspace(0, 89.9, 400)
    for inside, words, colour in ((False, "air to glass", COLOURS[0]), (True, "glass to air", COLOURS[1])):
        shape = block((-40, -40, 0), (40, 40, 40)) if inside else block(DOWN, UP)
        rays = trace(
            folder, words, {"Plate": {"shape": shape, "medium": "glass", "surface": "polished"}}, rays=60_000,
            media=GLASS, surfaces={"polished": {"kind": "fresnel"}},
            sources={f"{a:g}": beam(a, distance_mm=10, radius_mm=1e-4) for a in angles}, settings={"max_events": 3},
        )  # fmt: skip
        reflected = rays.kind[rays.first[:-1] + 1] == EventKind.FRESNEL_REFLECTION
        mark(left, angles, *_shares(reflected, rays.source, len(angles)), colour)
        n_i, n_t = (1.5, 1.0) if inside else (1.0, 1.5)
        cosine = np.cos(np.radians(smooth))
        left.plot(smooth, fresnel_reflectance(cosine, np.float64(n_i), np.float64(n_t)), color=colour, label=words)
    left.set(title="Smooth glass, n = 1.5", xlabel="angle of incidence in degrees", ylabel="reflectance", xlim=(0, 90))
    left.legend(loc="upper left")
    for metal, colour in zip(("silver", "aluminium", "gold", "copper"), COLOURS, strict=False):
        low, high, reflectance, error, known = _over_wavelength(
            folder, metal, metal, {"kind": "fresnel"}, {metal: {"catalogue": metal}}, bands=20
        )
        nm = np.linspace(400, 780, 300)
        medium = known.media[metal]
        formula = metal_reflectance(1.0, 1.0, medium.index_at(nm), medium.extinction.at(nm))
        right.plot(nm, formula, color=colour, label=metal)
        mark(right, (low + high) / 2, reflectance, error, colour)
    right.set(title="Polished metals, light at 0°", xlabel="wavelength in nm", ylim=(0, 1.02), xlim=(395, 785))
    right.legend(loc="lower right")
    return figure


def _shares(chosen: NDArray[np.bool_], group: NDArray[np.integer], n: int) -> tuple[NDArray, NDArray]:
    """Share of the rays of each group that are chosen, and its standard error."""
    counts = np.bincount(group, minlength=n)
    share = np.bincount(group, chosen, n) / counts
    return share, np.sqrt(share * (1 - share) / counts)


def _over_wavelength(
    folder: Path, name: str, medium: str, surface: dict[str, Any], media: dict[str, Any],
    *, bands: int, angle_deg: float = 0.0, rays: int = 40_000,
) -> tuple[NDArray, NDArray, NDArray, NDArray, Any]:  # fmt: skip
    """Reflectance of a surface in bands of the spectrum, and the scene."""
    traced = trace(
        folder, name, {"Plate": {"shape": block(DOWN, UP), "medium": medium, "surface": "tested"}}, rays=rays,
        media=media, surfaces={"tested": surface}, detectors={"All": far_field()},
        sources={"Beam": beam(angle_deg, spectrum={"kind": "table", "wavelength_nm": [380, 780], "value": [1, 1]})},
        settings={"store": "spectral", "spectrum": {"from_nm": 400, "to_nm": 780, "bands": bands}, "max_events": 4},
    )  # fmt: skip
    found = raymaps.evaluate_detector(
        traced.raymap, "All", where="event(fresnel_reflection) & ~event(fresnel_refraction)"
    )
    spectrum = found.spectrum
    share = traced.raymap.bands.light_of(traced.raymap.scene.sources["Beam"])
    return spectrum.low_nm, spectrum.high_nm, spectrum.flux_w / share, spectrum.stderr_w / share, traced.raymap.scene


def draw_thin_film(folder: Path) -> Figure:
    """Coatings over the wavelength: simulated and by the characteristic matrix."""
    figure = size(9.6, 4.3)
    left, right = figure.subplots(1, 2)
    media = {
        "N-BK7": {"catalogue": "N-BK7"}, "MgF2": {"catalogue": "MgF2"},
        "high": {"refractive_index": 2.35}, "low": {"refractive_index": 1.46}, "middle": {"refractive_index": 1.7},
    }  # fmt: skip
    coats = {
        "bare N-BK7": [],
        "one layer of MgF2, 100 nm": [("MgF2", 99.6)],
        "three layers": [("MgF2", 99.6), ("high", 117.0), ("middle", 80.9)],
    }
    mirror = [("high", 58.5) if i % 2 == 0 else ("low", 94.2) for i in range(13)]
    panels = [(left, words, layers, 0.0) for words, layers in coats.items()]
    panels += [(right, f"light at {angle:g}°", mirror, angle) for angle in (0.0, 50.0)]
    for number, (axes, words, layers, angle_deg) in enumerate(panels):
        colour = COLOURS[number % 3]
        film = [{"medium": medium, "thickness_nm": nm} for medium, nm in layers]
        surface = {"kind": "thin_film", "layers": film} if film else {"kind": "fresnel"}
        low, high, share, error, scene = _over_wavelength(
            folder,
            f"film{number}",
            "N-BK7",
            surface,
            media,
            bands=38,
            angle_deg=angle_deg,
            rays=600_000 if axes is left else 100_000,
        )
        nm = np.linspace(400, 780, 400)
        indices = np.array([scene.media[m].index_at(nm) for m, _ in layers], complex).reshape(len(layers), 400)
        thickness = np.array([nm_ for _, nm_ in layers])
        sine = np.full(400, math.sin(math.radians(angle_deg)))
        formula, _ = stack_shares(sine, np.ones(400), indices, thickness, scene.media["N-BK7"].index_at(nm), nm)
        axes.plot(nm, 100 * formula, color=colour, label=words)
        mark(axes, (low + high) / 2, 100 * share, 100 * error, colour)
    left.set(title="Against reflections, light at 0°", ylabel="reflectance in %", ylim=(0, 8.2))
    right.set(title="Mirror of 13 quarter-wave layers", ylim=(0, 122), yticks=range(0, 101, 20))
    for axes in (left, right):
        axes.set(xlabel="wavelength in nm", xlim=(395, 785))
    left.legend(loc="upper right")
    right.legend(loc="upper left", ncols=2)
    return figure


# ------------------------------------------------------------------------------------------------------ rough surfaces


def draw_rough(folder: Path) -> Figure:
    """Where light goes from rough glass and rough gold."""
    figure = size(9.6, 4.6)
    panels = figure.subplots(1, 2, subplot_kw={"projection": "polar"})
    for axes, medium, words in zip(panels, ("glass", "gold"), ("Rough glass, n = 1.5", "Rough gold"), strict=True):
        for alpha, colour in zip((0.05, 0.15, 0.4, 0.9), COLOURS, strict=False):
            rays = trace(
                folder, f"{medium}{alpha}", {"Plate": {"shape": block(DOWN, UP), "medium": medium, "surface": "rough"}},
                rays=800_000, media={**GLASS, "gold": {"catalogue": "gold"}},
                surfaces={"rough": {"kind": "rough", "roughness": alpha}}, sources={"Beam": beam(50)},
                settings={
                    "max_events": 3, "roulette_threshold": 1, "spectrum": {"from_nm": 545, "to_nm": 555, "bands": 1}
                },
            )  # fmt: skip
            rows = rays.first[:-1] + 1
            rows = rows[rays.kind[rows] != EventKind.ABSORPTION]
            angle, intensity = _in_plane(rays.direction_after(rows))
            axes.plot(angle, intensity / intensity.max(), color=colour, label=f"{alpha:g}")
        axes.annotate(
            "", (math.radians(-50), 0.02), (math.radians(-50), 0.98),
            arrowprops={"arrowstyle": "-|>", "color": "#202428", "lw": 1.8},
        )  # fmt: skip
        axes.set_theta_zero_location("N")
        axes.set_theta_direction(-1)
        axes.set(title=words, ylim=(0, 1), yticks=[0.25, 0.5, 0.75, 1.0], yticklabels=[])
        axes.set_thetagrids(range(0, 360, 30), [f"{min(a, 360 - a)}°" for a in range(0, 360, 30)])
        axes.plot([math.radians(-90), math.radians(90)], [1, 1], color="#5f6670", lw=1.4)
    panels[1].legend(title="roughness", loc="center left", bbox_to_anchor=(1.08, 0.5))
    return figure


def _in_plane(direction: NDArray, half_width: float = 0.1) -> tuple[NDArray, NDArray]:
    """Intensity over the angle in the plane of incidence, from directions next to it."""
    near = np.abs(direction[:, 1]) < half_width
    angle = np.arctan2(direction[near, 0], direction[near, 2])
    edges = np.radians(np.linspace(-180, 180, 91))
    counts = np.histogram(angle, edges)[0].astype(float)
    return (edges[1:] + edges[:-1]) / 2 % (2 * math.pi), counts
