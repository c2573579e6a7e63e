# SPDX-License-Identifier: LGPL-2.1-or-later
"""A map of numbers in false colours with its scale, drawn with Qt."""

import csv
import math
import os
from collections import namedtuple

from raymaps_wb.compat import QtCore, QtGui, flags_as_int
from raymaps_wb.gui.figures import quantity

#: values: rows from the lowest y up. x, y: (first, last) border. x_name, y_name, name: what they are, with unit.
FalseColourMap = namedtuple("FalseColourMap", "values x y x_name y_name name")

#: Colours from nothing to the most, dark to light, so that they also tell in grey.
PALETTE = ((0, 0, 10), (70, 15, 110), (160, 40, 100), (225, 85, 50), (250, 165, 30), (250, 250, 180))
#: Columns of a file: across, up, what is drawn; first that is there.
KINDS = (
    ("x_mm", "y_mm", ("illuminance_lx", "irradiance_w_per_mm2")),
    ("c_deg", "gamma_deg", ("intensity_cd", "intensity_w_per_sr")),
)
#: Columns of a standard error and of what it belongs to; first that are there.
ERRORS = (
    ("flux_stderr_lm", "flux_lm"),
    ("flux_stderr_w", "flux_w"),
    ("intensity_stderr_cd", "intensity_cd"),
    ("intensity_stderr_w_per_sr", "intensity_w_per_sr"),
)
LIGHT, ERROR = "light", "error"
PERCENT = "%"
LARGEST_ERROR_PERCENT = 100.0  # beyond it nothing is known of a cell
NAMES = {
    "x_mm": "x (mm)",
    "y_mm": "y (mm)",
    "c_deg": "C (\u00b0)",
    "gamma_deg": "\u03b3 (\u00b0)",
    "illuminance_lx": "lx",
    "irradiance_w_per_mm2": "W/mm\u00b2",
    "intensity_cd": "cd",
    "intensity_w_per_sr": "W/sr",
}
MARGIN = 78  # for the scale
LARGEST_BYTES = 16 * 2**20


def read_map(path):
    """The light in a file that ``raymaps detector -o FILE.csv`` wrote; None if it can't be drawn."""
    return read_maps(path).get(LIGHT)


def read_maps(path):
    """What can be drawn of a file that ``raymaps detector -o FILE.csv`` wrote.

    Returns
    -------
    dict of FalseColourMap: LIGHT, and ERROR, the standard error of each cell over its light; empty if the file holds
    no map, or one that is too large to draw.
    """
    if not os.path.isfile(path) or os.path.getsize(path) > LARGEST_BYTES:
        return {}
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    columns = set(rows[0]) if rows else set()
    if "z_mm" in columns:
        return {}  # faces have no two coordinates
    kind = next((kind for kind in KINDS if set(kind[:2]) <= columns and columns & set(kind[2])), None)
    if kind is None:
        return {}
    across, up, names = kind
    name = next(name for name in names if name in columns)
    found = {LIGHT: _map(rows, across, up, lambda row: _number(row[name]), NAMES[name])}
    pair = next((pair for pair in ERRORS if set(pair) <= columns), None)
    if pair is not None:
        found[ERROR] = _map(rows, across, up, lambda row: _error_percent(row, *pair), PERCENT)
    return found


def _number(text):
    return float(text or "nan")


def _error_percent(row, stderr, value):
    """Of a cell without light nothing is known."""
    stderr, value = _number(row[stderr]), _number(row[value])
    return 100 * stderr / value if value > 0 else math.nan


def _map(rows, across, up, value_of, name):
    xs, ys = (sorted({float(row[key]) for row in rows}) for key in (across, up))
    places = [{value: i for i, value in enumerate(values)} for values in (xs, ys)]
    values = [[math.nan] * len(xs) for _ in ys]
    for row in rows:
        values[places[1][float(row[up])]][places[0][float(row[across])]] = value_of(row)
    ends = _borders if across == "x_mm" else lambda directions: (directions[0], directions[-1])
    return FalseColourMap(values, ends(xs), ends(ys), NAMES[across], NAMES[up], name)


def _borders(centres):
    half = (centres[-1] - centres[0]) / (len(centres) - 1) / 2 if len(centres) > 1 else 0.5
    return centres[0] - half, centres[-1] + half


def colour(share):
    """Colour of a share from 0 to 1, as (red, green, blue) from 0 to 255; grey for none."""
    if not math.isfinite(share):
        return 128, 128, 128
    at = min(max(share, 0.0), 1.0) * (len(PALETTE) - 1)
    i = min(int(at), len(PALETTE) - 2)
    return tuple(round(a + (b - a) * (at - i)) for a, b in zip(PALETTE[i], PALETTE[i + 1], strict=True))


def picture(shown, width):
    """A pixmap of a map, as wide as given, with axes and scale."""
    line = 16
    plot_width = max(60, width - MARGIN)
    across, up = (shown.x[1] - shown.x[0]) or 1.0, (shown.y[1] - shown.y[0]) or 1.0
    plot_height = round(plot_width * min(1.4, max(0.25, up / across)))
    pixmap = QtGui.QPixmap(width, plot_height + 3 * line)
    pixmap.fill(QtCore.Qt.transparent)
    painter = QtGui.QPainter(pixmap)
    painter.setPen(QtGui.QColor("#7a7a7a"))
    image, largest = _image(shown.values, LARGEST_ERROR_PERCENT if shown.name == PERCENT else math.inf)
    place = QtCore.QRect(1, line, plot_width, plot_height)
    painter.drawImage(place, image)
    painter.drawRect(place)
    right, below = flags_as_int(QtCore.Qt.AlignRight), line + plot_height
    painter.drawText(QtCore.QRect(0, 0, plot_width, line), right, f"{shown.y_name} to {shown.y[1]:.4g}")
    painter.drawText(QtCore.QRect(0, below, plot_width, line), 0, f"{shown.x[0]:.4g}, {shown.y[0]:.4g}")
    painter.drawText(QtCore.QRect(0, below, plot_width, line), right, f"{shown.x_name} to {shown.x[1]:.4g}")
    _draw_scale(painter, QtCore.QRect(plot_width + 8, line, 10, plot_height), largest, shown.name)
    painter.end()
    return pixmap


def _image(values, limit):
    """An image with a pixel a cell, the lowest row at the bottom; and the largest value, at most the limit."""
    largest = min(limit, max((value for row in values for value in row if math.isfinite(value)), default=0.0))
    image = QtGui.QImage(len(values[0]), len(values), QtGui.QImage.Format_RGB32)
    for j, row in enumerate(reversed(values)):
        for i, value in enumerate(row):
            image.setPixel(i, j, QtGui.qRgb(*colour(value / largest if largest > 0 else 0.0)))
    return image, largest


def _draw_scale(painter, place, largest, unit):
    gradient = QtGui.QLinearGradient(0, place.bottom(), 0, place.top())
    for i, rgb in enumerate(PALETTE):
        gradient.setColorAt(i / (len(PALETTE) - 1), QtGui.QColor(*rgb))
    painter.fillRect(place, gradient)
    left = place.right() + 4
    told = (f"{largest:.3g}", unit) if unit == PERCENT else quantity(largest, unit)
    for text, y in zip(told, (place.top(), place.top() + 16), strict=True):
        painter.drawText(QtCore.QRect(left, y, MARGIN, 16), 0, text)
    painter.drawText(QtCore.QRect(left, place.bottom() - 15, MARGIN, 16), 0, "0")
