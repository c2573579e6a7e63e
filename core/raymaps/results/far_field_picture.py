# SPDX-License-Identifier: LGPL-2.1-or-later
"""A far field as a polar diagram of two planes and as a map in false colours over C and gamma, by matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import MissingPackageError, shortened
from raymaps.results.beam import plane_profile
from raymaps.results.far_field import BEAM_LEVELS, FarFieldMap
from raymaps.results.picture_parts import INK, LOOK, PALE, colour_bar, false_colour_scale, with_error
from raymaps.units import prefix_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_far_field"]

Float = NDArray[np.float64]

_WIDTH, _HEIGHT = 11.0, 5.9
#: Planes of the diagram: half plane, label, colour, dashes.
_PLANES = ((0.0, "C 0 – 180", "#c2410c", "-"), (90.0, "C 90 – 270", "#1d5fa8", (0, (4.5, 2.5))))
#: Largest gamma of a diagram, and how far its lines of gamma are apart.
_REACHES = ((15.0, 5.0), (30.0, 10.0), (60.0, 15.0), (90.0, 30.0), (180.0, 30.0))
#: Light below this share of the largest intensity sets no reach.
_FAINT = 0.01


def draw_far_field(far_field: FarFieldMap) -> Figure:
    """A figure of the intensity, in cd where lumens are known and else in W/sr.

    Raises
    ------
    MissingPackageError
        If matplotlib is not installed.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackageError("matplotlib", "pictures", "The picture of a far field") from None

    candela = far_field.intensity_cd
    values, unit = (candela, "cd") if candela is not None else (far_field.intensity_w_per_sr, "W/sr")
    intensity = np.maximum(np.nan_to_num(values), 0.0)
    reach, step = _reach(intensity)
    with rc_context(LOOK):
        figure = Figure(figsize=(_WIDTH, _HEIGHT), facecolor="white")
        _draw_polar(figure, intensity, unit, reach, step)
        _draw_map(figure, far_field, values, unit, reach, step)
        _write_title(figure, far_field)
    return figure


def _reach(intensity: Float) -> tuple[float, float]:
    """Largest gamma that the picture shows, and the step of its lines."""
    lit = np.flatnonzero((intensity > _FAINT * intensity.max()).any(axis=0))
    farthest = 180.0 * (lit[-1] if len(lit) else 0) / (intensity.shape[1] - 1)
    return next((reach, step) for reach, step in _REACHES if farthest <= reach or reach == 180)


def _draw_polar(figure: Figure, intensity: Float, unit: str, reach: float, step: float) -> None:
    axes: Any = figure.add_axes((0.035, 0.115, 0.40, 0.665), projection="polar")
    axes.set_theta_zero_location("S")
    axes.set_axisbelow(True)
    largest = 0.0
    for c_deg, label, colour, dashes in _PLANES:
        angle_deg, profile = plane_profile(intensity, c_deg)
        signed = np.where(angle_deg > 180, angle_deg - 360, angle_deg)
        order = np.argsort(signed)
        at, shown = np.radians(signed[order]), profile[order]
        if reach == 180:  # all around
            at, shown = np.append(at, at[0] + 2 * np.pi), np.append(shown, shown[0])
        else:
            inside = np.abs(at) <= np.radians(reach) + 1e-9
            at, shown = at[inside], shown[inside]
        axes.plot(at, shown, color=colour, linewidth=1.8, linestyle=dashes, label=label)
        axes.fill(np.concatenate([[at[0]], at, [at[-1]]]), np.concatenate([[0], shown, [0]]), color=colour, alpha=0.10,
                  linewidth=0)  # fmt: skip
        largest = max(largest, float(shown.max()))
    if reach < 180:
        axes.set_thetamin(-reach)
        axes.set_thetamax(reach)
    lines = np.arange(-reach, reach + 1e-9, step) if reach < 180 else np.arange(-150.0, 180.1, step)
    axes.set_thetagrids(lines % 360 if reach == 180 else lines, [f"{abs(line):g}°" for line in lines])
    scale, letter = prefix_of(largest)
    rings = _rings(largest / scale)
    axes.set_ylim(0, rings[-1] * scale if len(rings) else 1.0)
    words = [f"{ring:g}" for ring in rings]
    axes.set_rgrids(rings * scale, words, angle=reach if reach < 90 else 75, color=PALE, fontsize=7.5)
    axes.tick_params(colors=INK, labelsize=8)
    axes.grid(color="#dfe2e6", linewidth=0.8)
    axes.spines["polar"].set_color("#c9cdd3")
    figure.text(0.05, 0.79, f"intensity in {letter}{unit}", fontsize=8.5, color=PALE)
    figure.legend(
        *axes.get_legend_handles_labels(), loc="lower left", bbox_to_anchor=(0.035, -0.005), ncols=2, frameon=False,
        fontsize=8.5, handlelength=2.2, labelcolor=INK,
    )  # fmt: skip


def _rings(largest: float) -> Float:
    """Round values for about four rings, the last at least the largest value."""
    if not largest > 0:
        return np.zeros(0)
    power = 10.0 ** np.floor(np.log10(largest / 4))
    step = next(power * nice for nice in (1, 2, 2.5, 5, 10) if power * nice * 5 >= largest * 1.02)
    return np.asarray(np.arange(1, np.ceil(largest * 1.02 / step) + 1) * step)


def _draw_map(figure: Figure, far_field: FarFieldMap, values: Float, unit: str, reach: float, step: float) -> None:
    axes = figure.add_axes((0.525, 0.125, 0.375, 0.655))
    n_c, n_gamma = far_field.resolution
    # cells lie around their directions: the first half plane is halved between both borders
    borders_c = np.concatenate([[0.0], (np.arange(n_c) + 0.5) * (360.0 / n_c), [360.0]])
    borders_gamma = np.clip((np.arange(n_gamma + 2) - 0.5) * (180.0 / n_gamma), 0.0, 180.0)
    colours, norm, darkest, _ = false_colour_scale(values)
    shown = np.ma.masked_invalid(np.concatenate([values, values[:1]]).T)
    drawn = axes.pcolormesh(borders_c, borders_gamma, np.ma.maximum(shown, 0.5 * darkest), cmap=colours, norm=norm)
    axes.set_xlim(0, 360)
    axes.set_ylim(reach, 0)
    axes.set_xticks(np.arange(0, 361, 45))
    axes.set_yticks(np.arange(0, reach + 1e-9, step))
    axes.set_xlabel("C in degrees", color=INK)
    axes.set_ylabel("gamma in degrees", color=INK)
    axes.tick_params(colors=INK, labelsize=8)
    place = axes.get_position()
    colour_bar(figure, drawn, (place.x1 + 0.015, place.y0, 0.015, place.height), "intensity", unit)


def _write_title(figure: Figure, far_field: FarFieldMap) -> None:
    inch = 1.0 / _HEIGHT
    figure.text(0.05, 1 - 0.36 * inch, far_field.detector, fontsize=14, fontweight="bold")
    line = with_error(far_field.flux_w, "W")
    line += f"   {with_error(far_field.flux_lm, 'lm')}" if far_field.flux_lm is not None else ""
    line += f"   {far_field.rays:,} rays left the scene".replace(",", "\u2009")
    figure.text(0.05, 1 - 0.62 * inch, line, fontsize=9.5)
    highest = with_error(far_field.max_w_per_sr, "W/sr")
    highest += f" or {with_error(far_field.max_cd, 'cd')}" if far_field.max_cd is not None else ""
    told = [f"max {highest}"]
    for level in BEAM_LEVELS:
        widths = [far_field.beam_deg[level, plane] for plane in ("c0", "c90")]
        words = " and ".join("–" if width is None else f"{width:.1f}°" for width in widths)
        told.append(f"beam at {100 * level:.0f} %: {words}")
    conditions = [f"without {', '.join(far_field.without)}"] if far_field.without else []
    conditions += far_field.conditions()
    figure.text(0.05, 1 - 0.84 * inch, shortened(",  ".join(told), 150), fontsize=8, color=PALE)
    figure.text(0.05, 1 - 1.02 * inch, shortened(",  ".join(conditions), 150), fontsize=8, color=PALE)
