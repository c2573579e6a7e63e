# SPDX-License-Identifier: LGPL-2.1-or-later
"""Where rays of a map got lost, with links that show them."""

from html import escape

from raymaps_wb.compat import QtCore, QtWidgets
from raymaps_wb.gui.figures import count, watts

MAX_PLACES = 3
SHOWS_ALL = {"numerical": "event(killed_numerical)", "medium_mismatch": "event(killed_medium_mismatch)"}


class LostRays(QtWidgets.QLabel):
    """Takes no room while no ray is lost. ``asked(str)`` brings the criterion of what is to be shown."""

    asked = QtCore.Signal(str)

    def __init__(self, colour):
        super().__init__()
        self._criteria: list[str] = []
        self.setWordWrap(True)
        self.setTextFormat(QtCore.Qt.RichText)
        self.setStyleSheet(f"color: {colour}")
        self.linkActivated.connect(lambda number: self.asked.emit(self._criteria[int(number)]))
        self.show_places([])

    def show_places(self, places):
        """Show what ``info`` tells under ``lost``: places with the most rays first."""
        reasons = dict.fromkeys(place.get("reason", "numerical") for place in places)
        everything = " | ".join(SHOWS_ALL[reason] for reason in reasons if reason in SHOWS_ALL) or "ended(killed)"
        self._criteria = [everything, *(place.get("criterion", everything) for place in places[:MAX_PLACES])]
        self.setText(_html(places) if places else "")
        self.setVisible(bool(places))


def _html(places):
    rays, flux_w = sum(place["rays"] for place in places), sum(place["flux_w"] for place in places)
    head = f"&#9888; {_rays(rays)} with {watts(flux_w)} got lost: {_link(0, 'show them')}"
    lines = [
        f"{_link(number, _rays(place['rays']))} {_where(place)}" for number, place in enumerate(places[:MAX_PLACES], 1)
    ]
    more = len(places) - MAX_PLACES
    if more > 0:
        lines.append(f"and at {more} more place{'s' if more > 1 else ''}")
    return "<br>".join([head, *("&nbsp;&nbsp;" + line for line in lines)])


def _rays(n):
    return "1 ray" if n == 1 else f"{count(n)} rays"


def _where(place):
    on = f"at {place['body']}.{place['face']}" if place.get("body") else "off all faces"
    return escape(f"{on}, the first at ({', '.join(f'{x:.6g}' for x in place['point_mm'])}) mm")


def _link(number, text):
    return f"<a href='{number}'>{text}</a>"
