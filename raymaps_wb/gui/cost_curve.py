# SPDX-License-Identifier: LGPL-2.1-or-later
"""Time against error on logarithmic axes, a curve for each choice, drawn with Qt."""

import math

from raymaps_wb.compat import QtCore, QtGui, QtWidgets, flags_as_int, translate
from raymaps_wb.tracer.outlook import FEWEST_RAYS

COLOURS = ("#2f7fd1", "#d9622b", "#159a78", "#b45fb0", "#c79a00", "#6b7684", "#d14b6a", "#7a5be0")
#: Times that an axis can bear, in seconds, with their words.
TIMES = (
    *((10.0**power, f"{10.0**power:g} s") for power in range(-3, 2)),
    (60.0, "1 min"),
    (600.0, "10 min"),
    (3600.0, "1 h"),
    (36_000.0, "10 h"),
    (4 * 86_400.0, "4 d"),
    (40 * 86_400.0, "40 d"),
    (365.25 * 86_400, "1 a"),
)
POINTS = 160  # of a curve
HEIGHT = 270  # without the names of the choices
LARGEST_ERROR, SMALLEST_ERROR = 1.0, 1e-6
LONGEST = 10  # how many times longer than a final run of the study as it is the axis goes


class CostCurve(QtWidgets.QWidget):
    """Curves, and two points on them: a ring where the study is now, a dot where the slider is.

    Signal: ``picked(time_s)`` where the user clicks or drags.
    """

    picked = QtCore.Signal(float)

    def __init__(self):
        super().__init__()
        self.setMinimumWidth(180)
        self.setFixedHeight(HEIGHT)
        self._outlooks, self._chosen, self._now, self._rays = [], 0, 0, 0

    def show_outlooks(self, outlooks, now_rays):
        """Show choices, the study's own first, with its number of rays."""
        self._outlooks, self._chosen, self._now, self._rays = list(outlooks), 0, now_rays, now_rays
        self._fit()
        self.update()

    def resizeEvent(self, event):
        super().resizeEvent(event)
        self._fit()

    def _fit(self):
        """As high as the names of the choices need at this width."""
        height = HEIGHT + self._legend_height()
        if height != self.height():
            self.setFixedHeight(height)

    def show_point(self, chosen, rays):
        """Move the dot to a choice, by its number, and a number of rays."""
        self._chosen, self._rays = chosen, rays
        self.update()

    def mousePressEvent(self, event):
        self._pick(event)

    def mouseMoveEvent(self, event):
        self._pick(event)

    def _pick(self, event):
        axes = self._axes()
        if axes is not None:
            self.picked.emit(axes.time_s(event.pos().x()))

    def paintEvent(self, event):
        painter = QtGui.QPainter(self)
        painter.setRenderHint(QtGui.QPainter.Antialiasing)
        axes = self._axes()
        if axes is None:
            painter.setPen(_mixed(self.palette(), 0.5))
            words = translate("Time against error: not tried yet") if not self._outlooks else translate("No light")
            painter.drawText(self.rect(), flags_as_int(QtCore.Qt.AlignCenter), words)
            painter.end()
            return
        axes.draw(painter, self.palette())
        painter.setClipRect(axes.place.adjusted(-1, -1, 1, 1))
        order = [i for i in range(len(self._outlooks)) if i != self._chosen] + [self._chosen]
        for i in order:
            self._draw_curve(painter, axes, i)
        painter.setClipping(False)
        self._draw_points(painter, axes)
        self._draw_legend(painter)
        painter.end()

    def _axes(self):
        """Axes that hold the curves from draft to final; None without a curve."""
        known = [outlook for outlook in self._outlooks if outlook.is_known]
        if not known:
            return None
        own, chosen = self._outlooks[0], self._outlooks[self._chosen]
        ends = [(one, rays) for one in known for rays in (FEWEST_RAYS, one.final_rays())]
        first = own if own.is_known else known[0]
        latest_s = LONGEST * first.time_s(first.final_rays())  # a hopeless choice would squeeze all others
        ends = [(one, rays if one.time_s(rays) <= latest_s else one.rays(latest_s)) for one, rays in ends]
        ends += [(one, rays) for one, rays in ((own, self._now), (chosen, self._rays)) if one.is_known]
        times = [one.time_s(rays) for one, rays in ends]
        errors = [one.error(max(rays, 1)) for one, rays in ends]
        line = self.fontMetrics().height()
        left = self.fontMetrics().boundingRect("0.001 %").width() + 10
        place = QtCore.QRect(
            left, line + 12, self.width() - left - 12, self.height() - 3 * line - 22 - self._legend_height()
        )
        return _Axes(
            place,
            (min(times) / 1.15, max(times) * 1.25),
            (max(SMALLEST_ERROR, min(errors) / 1.3), min(LARGEST_ERROR, max(errors) * 1.3)),
        )

    def _draw_curve(self, painter, axes, i):
        outlook = self._outlooks[i]
        if not outlook.is_known:
            return
        path, first, last = QtGui.QPainterPath(), math.log(FEWEST_RAYS), math.log(1e13)
        for k in range(POINTS + 1):
            rays = math.exp(first + (last - first) * k / POINTS)
            point = axes.point(outlook.time_s(rays), outlook.error(rays))
            path.moveTo(point) if k == 0 else path.lineTo(point)
        colour = QtGui.QColor(COLOURS[i % len(COLOURS)])
        colour.setAlpha(255 if i == self._chosen else 150)
        pen = QtGui.QPen(colour, 2.6 if i == self._chosen else 1.3)
        if i >= len(COLOURS):
            pen.setStyle(QtCore.Qt.DashLine)
        painter.setPen(pen)
        painter.setBrush(QtCore.Qt.NoBrush)
        painter.drawPath(path)

    def _draw_points(self, painter, axes):
        base, text = _ground(self.palette()), _mixed(self.palette(), 1.0)
        own, chosen, dot = self._outlooks[0], self._outlooks[self._chosen], QtCore.QRectF()
        if chosen.is_known:
            at = axes.inside(chosen.time_s(self._rays), chosen.error(self._rays))
            painter.setPen(QtGui.QPen(_mixed(self.palette(), 0.45), 1, QtCore.Qt.DashLine))
            painter.drawLine(QtCore.QPointF(axes.place.left(), at.y()), at)
            painter.drawLine(QtCore.QPointF(at.x(), axes.place.bottom()), at)
            painter.setPen(QtGui.QPen(base, 1.5))
            painter.setBrush(QtGui.QColor(COLOURS[self._chosen % len(COLOURS)]))
            painter.drawEllipse(at, 6.0, 6.0)
            dot = QtCore.QRectF(at.x() - 8, at.y() - 8, 16, 16)
        if own.is_known:
            at = axes.inside(own.time_s(self._now), own.error(self._now))
            painter.setPen(QtGui.QPen(text, 1.6))
            painter.setBrush(QtCore.Qt.NoBrush)
            painter.drawEllipse(at, 9.0, 9.0)
            self._draw_now(painter, at, axes.place, dot)

    def _draw_now(self, painter, at, place, dot):
        """The word beside the ring: within the axes and off the dot."""
        words, metrics = translate("now"), self.fontMetrics()
        width, height = metrics.boundingRect(words).width() + 6, metrics.height()
        boxes = [
            QtCore.QRectF(at.x() + (9 if right else -9 - width), at.y() + (6 if below else -6 - height), width, height)
            for right, below in ((True, False), (False, True), (True, True), (False, False))
        ]
        free = [box for box in boxes if QtCore.QRectF(place).contains(box) and not box.intersects(dot)]
        box = (free or boxes)[0]
        painter.fillRect(box, _faded(_ground(self.palette()), 200))
        painter.drawText(box, flags_as_int(QtCore.Qt.AlignCenter), words)

    def _legend_places(self):
        """(left, line) of each choice's name, wrapped at the width."""
        metrics, places, x, line = self.fontMetrics(), [], 0, 0
        for outlook in self._outlooks:
            width = metrics.boundingRect(outlook.words).width() + 36
            if x and x + width > self.width() - 4:
                x, line = 0, line + 1
            places.append((x, line))
            x += width
        return places

    def _legend_height(self):
        places = self._legend_places()
        return (places[-1][1] + 1) * (self.fontMetrics().height() + 2) if places else 0

    def _draw_legend(self, painter):
        height = self.fontMetrics().height() + 2
        top = self.height() - self._legend_height()
        for i, (x, line) in enumerate(self._legend_places()):
            y = top + line * height
            colour = QtGui.QColor(COLOURS[i % len(COLOURS)])
            is_dashed = QtCore.Qt.DashLine if i >= len(COLOURS) else QtCore.Qt.SolidLine
            painter.setPen(QtGui.QPen(colour, 3 if i == self._chosen else 1.5, is_dashed))
            painter.drawLine(x + 4, y + height // 2, x + 20, y + height // 2)
            painter.setPen(self.palette().color(QtGui.QPalette.WindowText))
            words = self._outlooks[i].words
            painter.drawText(x + 25, y, self.width(), height, flags_as_int(QtCore.Qt.AlignVCenter), words)


class _Axes:
    """Places on logarithmic axes: time across, error up."""

    def __init__(self, place, times_s, errors):
        self.place, self._times, self._errors = place, times_s, errors

    def point(self, time_s, error):
        across = math.log(time_s / self._times[0]) / math.log(self._times[1] / self._times[0])
        up = math.log(max(error, 1e-12) / self._errors[0]) / math.log(self._errors[1] / self._errors[0])
        return QtCore.QPointF(
            self.place.left() + across * self.place.width(), self.place.bottom() - up * self.place.height()
        )

    def inside(self, time_s, error):
        """The point, or the nearest one within the axes."""
        at, place = self.point(time_s, error), self.place
        return QtCore.QPointF(
            min(max(at.x(), place.left()), place.right()), min(max(at.y(), place.top()), place.bottom())
        )

    def time_s(self, x):
        """Time at a place across."""
        share = min(1.0, max(0.0, (x - self.place.left()) / max(1, self.place.width())))
        return self._times[0] * (self._times[1] / self._times[0]) ** share

    def draw(self, painter, palette):
        """Ground, grid with figures, and what the axes are."""
        painter.fillRect(self.place, _ground(palette))
        metrics, place = painter.fontMetrics(), self.place
        grid, text = QtGui.QPen(_mixed(palette, 0.14), 1), _mixed(palette, 0.75)
        line = metrics.height()
        end = place.left() - 30  # of the last figure
        for time_s, words in self._time_figures():
            x = self.point(time_s, self._errors[0]).x()
            painter.setPen(grid)
            painter.drawLine(QtCore.QPointF(x, place.top()), QtCore.QPointF(x, place.bottom()))
            width = metrics.boundingRect(words).width() + 6
            left = min(x - width / 2, place.right() + 12 - width)
            if left > end:
                end = left + width
                painter.setPen(text)
                box = QtCore.QRectF(left, place.bottom() + 3, width, line)
                painter.drawText(box, flags_as_int(QtCore.Qt.AlignCenter), words)
        end = place.bottom() + 2 * line
        for error in self._error_figures():
            y = self.point(self._times[0], error).y()
            painter.setPen(grid)
            painter.drawLine(QtCore.QPointF(place.left(), y), QtCore.QPointF(place.right(), y))
            if y + line / 2 < end:
                end = y - line / 2
                painter.setPen(text)
                box = QtCore.QRectF(0, y - line / 2, place.left() - 5, line)
                right = flags_as_int(QtCore.Qt.AlignRight | QtCore.Qt.AlignVCenter)
                painter.drawText(box, right, f"{100 * error:g} %")
        painter.setPen(QtGui.QPen(_mixed(palette, 0.4), 1))
        painter.setBrush(QtCore.Qt.NoBrush)
        painter.drawRect(place)
        painter.setPen(text)
        painter.drawText(QtCore.QRect(0, 2, place.right(), line), 0, translate("Standard error"))
        below = QtCore.QRect(place.left(), place.bottom() + 4 + line, place.width(), line)
        painter.drawText(below, flags_as_int(QtCore.Qt.AlignHCenter), translate("Time of a run"))

    def _time_figures(self):
        """Few figures over a short range come in finer steps."""
        inside = [pair for pair in TIMES if self._times[0] <= pair[0] <= self._times[1]]
        if len(inside) >= 3:
            return inside
        fine = [
            (step * unit_s, f"{step:g} {unit}")
            for unit_s, unit, steps in (
                (1.0, "s", (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30)),
                (60.0, "min", (1, 2, 5, 10, 20, 30)),
                (3600.0, "h", (1, 2, 5, 10, 20)),
            )
            for step in steps
        ]
        return [pair for pair in fine if self._times[0] <= pair[0] <= self._times[1]] or inside

    def _error_figures(self):
        """From the lowest up."""
        first, last = math.floor(math.log10(self._errors[0])), math.ceil(math.log10(self._errors[1]))
        steps = (1,) if last - first > 3 else (1, 2, 5)
        found = (step * 10.0**decade for decade in range(first, last + 1) for step in steps)
        return [error for error in found if self._errors[0] <= error <= self._errors[1]]


def _ground(palette):
    """White under dark text, nearly black under light text: a theme need not tell more than the colour of text."""
    is_dark = palette.color(QtGui.QPalette.WindowText).lightness() > 127
    return QtGui.QColor("#1e1e1e" if is_dark else "#ffffff")


def _mixed(palette, share):
    """A colour between ground and text of a theme, light or dark."""
    ground, text = _ground(palette), palette.color(QtGui.QPalette.WindowText)
    pairs = zip(ground.getRgb()[:3], text.getRgb()[:3], strict=True)
    return QtGui.QColor(*(round(a + (b - a) * share) for a, b in pairs))


def _faded(colour, alpha):
    faded = QtGui.QColor(colour)
    faded.setAlpha(alpha)
    return faded
