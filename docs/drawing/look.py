# SPDX-License-Identifier: LGPL-2.1-or-later
"""How all pictures look, and how they are saved."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from raymaps.results.colours import paper_colours
from raymaps.spectral_data import srgb_of_wavelengths

__all__ = ["COLOURS", "FOLDER", "LOOK", "colours_of", "mark", "save", "size"]

FOLDER = Path(__file__).resolve().parents[1] / "pictures"
#: Blue, orange, green, red, violet, grey: told apart by those who do not see all colours.
COLOURS = ("#0b62a4", "#d9730d", "#2d8a4e", "#b3261e", "#7a4fa3", "#5f6670")
LOOK = {
    "font.family": "DejaVu Sans", "font.size": 12, "axes.titlesize": 12.5, "axes.labelsize": 12, "legend.fontsize": 11,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#e3e6ea",
    "axes.edgecolor": "#5f6670", "axes.axisbelow": True, "legend.frameon": False, "lines.linewidth": 1.8,
}  # fmt: skip
_DPI, _LARGEST_BYTES = 100, 150_000


def size(width: float, height: float) -> Figure:
    """A white figure of so many inches."""
    return Figure(figsize=(width, height), facecolor="white", layout="constrained")


def save(figure: Figure | Image.Image, name: str, page: str = "optics") -> None:
    """Save a figure or an image of a page with as many colours as a small file has room for."""
    drawn = io.BytesIO()
    if isinstance(figure, Image.Image):
        figure.save(drawn, format="png")
    else:
        with rc_context(LOOK):
            figure.savefig(drawn, format="png", dpi=_DPI, metadata={"Software": None})
    for colours in (256, 128, 64, 32, 16):
        packed = io.BytesIO()
        image = Image.open(drawn).convert("RGB").quantize(colours, dither=Image.Dither.NONE)
        image.save(packed, format="png", optimize=True)
        if packed.tell() < _LARGEST_BYTES:
            break
    (FOLDER / f"{page}_{name}.png").write_bytes(packed.getvalue())
    print(f"{page}_{name}.png: {packed.tell() / 1000:.0f} kB, {colours} colours")


def colours_of(wavelength_nm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Colours of wavelengths on white paper, (n, 4)."""
    rgb = np.maximum(srgb_of_wavelengths(np.asarray(wavelength_nm, np.float64), "cie_1931_2deg"), 0.0)
    rgb /= np.maximum(rgb.sum(axis=1, keepdims=True), 1e-6)
    colours = paper_colours(rgb) / 255.0
    colours[:, 3] = 1.0
    return colours


def mark(axes: Axes, x: Any, y: Any, error: Any, colour: str) -> None:
    """Simulated figures with their standard errors."""
    axes.errorbar(x, y, error, fmt="o", ms=4.5, color=colour, mfc="white", mew=1.4, elinewidth=1.2)
