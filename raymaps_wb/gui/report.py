# SPDX-License-Identifier: LGPL-2.1-or-later
"""The ray report as rich text that Qt shows."""

from html import escape

CELL = "padding:1px 6px 1px 0"


def html(answer):
    """Rich text of the answer to the method ``report``: a small table for each ray."""
    rays = answer.get("rays", [])
    if not rays:
        return "<p><i>No ray matches.</i></p>"
    return "".join(_ray(ray) for ray in rays)


def _ray(ray):
    flux = f", {ray['flux_w']:.3g} W" if ray.get("flux_w") is not None else ""
    head = f"<p style='margin:8px 0 2px 0'><b>Ray {ray['ray']}</b> from {escape(str(ray['source']))}{flux}; {escape(str(ray['ended']))}</p>"
    return head + "<table cellspacing='0'>" + "".join(_event(i, event) for i, event in enumerate(ray["events"])) + "</table>"


def _event(i, event):
    place = event.get("position_mm")
    where = ", ".join(f"{value:.2f}" for value in place) if place else ""
    left = event.get("flux_left_w")
    colour = _colour(event.get("rgb"))
    detectors = "".join(f"<br><i>{escape(_detector(crossing))}</i>" for crossing in event.get("detectors") or [])
    return (
        f"<tr><td style='{CELL};color:#888'>{i}</td><td style='{CELL};color:{colour}'>&#9632;</td>"
        f"<td style='{CELL}'>{escape(str(event.get('text') or event.get('kind')))}{detectors}</td>"
        f"<td style='{CELL};color:#666'>{where}</td><td style='{CELL}' align='right'>{'' if left is None else f'{left:.3g} W'}</td></tr>"
    )


def _detector(crossing):
    return f"crosses {crossing['name'] if isinstance(crossing, dict) and 'name' in crossing else crossing}"


def _colour(rgb):
    largest = max(rgb, default=0) if rgb else 0
    if not largest:
        return "#bbbbbb"
    return "#" + "".join(f"{int(255 * max(0.0, value) / largest):02x}" for value in rgb)
