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
    """The map in a file that ``raymaps detector -o FILE.csv`` wrote; None if it holds none, or is too large to draw."""
    if not os.path.isfile(path) or os.path.getsize(path) > LARGEST_BYTES:
        return None
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    columns = set(rows[0]) if rows else set()
    if "z_mm" in columns:
        return None  # faces have no two coordinates
    for across, up, names in KINDS:
        name = next((name for name in names if name in columns), None)
        if {across, up} <= columns and name is not None:
            return _map(rows, across, up, name)
    return None


def _map(rows, across, up, name):
    xs, ys = (sorted({float(row[key]) for row in rows}) for key in (across, up))
    places = [{value: i for i, value in enumerate(values)} for values in (xs, ys)]
    values = [[math.nan] * len(xs) for _ in ys]
    for row in rows:
        values[places[1][float(row[up])]][places[0][float(row[across])]] = float(row[name] or "nan")
    ends = _borders if across == "x_mm" else lambda directions: (directions[0], directions[-1])
    return FalseColourMap(values, ends(xs), ends(ys), NAMES[across], NAMES[up], NAMES[name])


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
    image, largest = _image(shown.values)
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


def _image(values):
    """An image with a pixel a cell, the lowest row at the bottom; and the largest value."""
    largest = max((value for row in values for value in row if math.isfinite(value)), default=0.0)
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
    for text, y in zip(quantity(largest, unit), (place.top(), place.top() + 16), strict=True):
        painter.drawText(QtCore.QRect(left, y, MARGIN, 16), 0, text)
    painter.drawText(QtCore.QRect(left, place.bottom() - 15, MARGIN, 16), 0, "0")
