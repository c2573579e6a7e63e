# SPDX-License-Identifier: LGPL-2.1-or-later
"""What pictures of detectors have in common: ink, figures with errors, false colours and their bar."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.results.colours import FALSE_COLOURS
from raymaps.results.figures import Statistic
from raymaps.units import format_with_error, prefix_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FRAME", "INK", "LOOK", "PALE", "colour_bar", "false_colour_scale", "with_error"]

INK, PALE, FRAME = "#30343b", "#6b7280", "#9aa0a8"
#: Settings of matplotlib.
LOOK: dict[Any, Any] = {"font.family": "DejaVu Sans", "font.size": 9, "text.color": INK, "axes.edgecolor": FRAME}
#: Colours are logarithmic, over so many decades, where the brightest cell exceeds the middle one so many times.
_LOGARITHMIC_FROM, _DECADES = 300.0, 4


def false_colour_scale(values: NDArray[np.floating]) -> tuple[Any, Any, float, bool]:
    """Colour map, norm, darkest shown value (0 on a linear scale), and whether it is logarithmic; NaN don't count."""
    from matplotlib import colormaps
    from matplotlib.colors import LogNorm, Normalize

    finite = values[np.isfinite(values)]
    brightest = float(finite.max()) if len(finite) else 0.0
    lit = finite[finite > 0]
    logarithmic = len(lit) > 0 and brightest > _LOGARITHMIC_FROM * float(np.median(lit))
    darkest = brightest * 10.0**-_DECADES if logarithmic else 0.0
    colours = colormaps[FALSE_COLOURS].with_extremes(bad="#e4e6e9", under=colormaps[FALSE_COLOURS](0.0))
    return (
        colours,
        LogNorm(darkest, brightest) if logarithmic else Normalize(0.0, brightest or 1.0),
        darkest,
        logarithmic,
    )


def colour_bar(figure: Figure, drawn: Any, place: tuple[float, float, float, float], label: str, unit: str) -> None:
    """A bar of the colours of something drawn; ``label`` says of what, the unit gets an SI prefix."""
    from matplotlib.ticker import FuncFormatter

    scale, letter = prefix_of(float(drawn.norm.vmax))
    logarithmic = drawn.norm.vmin > 0
    bar = figure.colorbar(
        drawn, cax=figure.add_axes(place), format=FuncFormatter(lambda value, _: f"{value / scale:.4g}")
    )
    bar.ax.minorticks_off()
    bar.set_label(f"{label} in {letter}{unit}{', logarithmic' if logarithmic else ''}", color=INK)
    bar.ax.tick_params(colors=INK, labelsize=8)
    bar.outline.set_edgecolor(FRAME)


def with_error(figure: Statistic, unit: str) -> str:
    """A figure and its error in the same unit, the error with two digits: ``27.15 ± 0.16 mW``."""
    return format_with_error(figure.value, figure.stderr, unit)
