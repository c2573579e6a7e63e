# SPDX-License-Identifier: LGPL-2.1-or-later
"""The ray report as rich text that Qt shows."""

from html import escape

from raymaps_wb.gui.figures import watts

GREY = "#7a7a7a"


def html(answer):
    """Rich text of the answer to the method ``report``: a small table for each ray."""
    rays = answer.get("rays", [])
    if not rays:
        return "<p><i>No ray matches.</i></p>"
    return "".join(_ray(ray) for ray in rays)


def _ray(ray):
    source, ended = escape(str(ray["source"])), escape(str(ray["ended"]))
    head = f"<b>Ray {ray['ray']}</b> from {source}, {watts(ray['flux_w'])}, {ended}"
    rows = "".join(_event(i, event) for i, event in enumerate(ray["events"]))
    return (
        f"<p style='margin:10px 0 3px 0'>{head}</p><table width='100%' cellspacing='0' cellpadding='2'>{rows}</table>"
    )


def _event(i, event):
    """What happened, with the light left; below in grey where, and the detectors crossed from there on."""
    small = [_place(event), *(_crossing(crossing) for crossing in event.get("detectors") or [])]
    below = "<br>".join(line for line in small if line)
    text = escape(str(event.get("text") or event.get("kind")))
    left = event.get("flux_left_w")
    return (
        f"<tr><td width='22' style='color:{GREY}'>{i}</td>"
        f"<td width='14' style='color:{_colour(event.get('rgb'))}'>&#9632;</td>"
        f"<td>{text}<br><span style='color:{GREY};font-size:small'>{below}</span></td>"
        f"<td width='88' align='right' style='white-space:pre'>{'' if left is None else watts(left, 3)}</td></tr>"
    )


def _place(event):
    position = ", ".join(f"{value:.2f}" for value in event.get("position_mm") or ())
    on = ".".join(str(event[key]) for key in ("body", "face") if event.get(key))
    prop = f" ({event['surface']})" if event.get("surface") else ""
    return escape(f"{on}{prop} at {position} mm" if on else f"at {position} mm") if position else ""


def _crossing(crossing):
    return escape(
        f"\u2192 crosses {crossing['detector']} at {crossing['x_mm']:.2f}, {crossing['y_mm']:.2f} mm, "
        f"{crossing['angle_deg']:.1f}\u00b0" + ("" if crossing["registered"] else ", not registered")
    )


def _colour(rgb):
    """Colour of the light at full brightness; grey for none."""
    largest = max(rgb, default=0) if rgb else 0
    if not largest:
        return "#bbbbbb"
    return "#" + "".join(f"{int(255 * max(0.0, value) / largest):02x}" for value in rgb)
