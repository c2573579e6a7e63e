# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as one HTML page: tables with plain attributes, which a browser, a printer and Qt's text browser show."""

from __future__ import annotations

from html import escape

import numpy as np

from raymaps.results.colours import hex_colour, light_colours
from raymaps.results.report import RayEvent, RayHistory, Report
from raymaps.results.report_text import format_crossing, summary_lines, wavelength_words
from raymaps.units import format_quantity

__all__ = ["report_to_html"]

_INK, _PALE, _LINE, _HEAD, _BAND = "#22262c", "#6b7280", "#d9dce1", "#2f4a6d", "#f3f5f8"

_STYLE = f"""
body {{ font-family: "DejaVu Sans", "Segoe UI", Helvetica, Arial, sans-serif; font-size: 10pt; color: {_INK};
        background-color: #ffffff; margin: 18px; }}
h1 {{ font-size: 17pt; margin-bottom: 6px; }}
table {{ border-collapse: collapse; page-break-inside: avoid; }}
td, th {{ padding: 3px 8px 3px 8px; vertical-align: top; text-align: left; }}
.n {{ text-align: right; white-space: nowrap; }}
.pale {{ color: {_PALE}; }}
"""

_HEADINGS = (
    ("", ""), ("what happened", ""), ("where", ""), ("property", ""), ("medium after", ""), ("x / mm", "n"),
    ("y / mm", "n"), ("z / mm", "n"), ("incidence", "n"), ("light left", "n"), ("of emitted", "n"),
)  # fmt: skip


def report_to_html(report: Report) -> str:
    """One page; a coloured swatch an event shows the light after it."""
    facts = "\n".join(
        f'<tr><td class="pale">{escape(word)}</td><td>{f"<b>{escape(value)}</b>" if word == "flux" else escape(value)}'
        "</td></tr>"
        for word, value in summary_lines(report)
    )
    rays = "\n".join(_ray(ray) for ray in report.rays) or "<p>No ray matches.</p>"
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>Rays of {escape(report.map_name)}</title>
<style type="text/css">{_STYLE}</style>
</head>
<body>
<h1>Ray report</h1>
<table cellspacing="0">
{facts}
</table>
{rays}
</body>
</html>
"""


#: Heading before the last one where lumens are known.
_LUMENS = ("in lumens", "n")


def _ray(ray: RayHistory) -> str:
    shown = (*_HEADINGS[:-1], _LUMENS, _HEADINGS[-1]) if ray.events[0].flux_left_lm is not None else _HEADINGS
    columns = len(shown)
    narrowed = f"&nbsp; {wavelength_words(ray)} " if ray.wavelength_nm is not None else ""
    title = (
        f"<b>Ray {ray.ray}</b> &nbsp; from {escape(ray.source)} &nbsp; {format_quantity(ray.flux_w, 'W')} "
        f"{narrowed}&nbsp; {len(ray.events)} events &nbsp; {escape(ray.ended)}"
    )
    headings = "".join(
        f'<th class="{name}" align="{"right" if name else "left"}"><font color="{_PALE}">{text}</font></th>'
        for text, name in shown
    )
    rows = "\n".join(_event(ray, event, "#ffffff" if number % 2 else _BAND) for number, event in enumerate(ray.events))
    return f"""<br>
<table width="100%" cellspacing="0" cellpadding="3" border="0">
<tr bgcolor="{_HEAD}"><td colspan="{columns}" bgcolor="{_HEAD}"><font color="#ffffff">{title}</font></td></tr>
<tr>{headings}</tr>
{rows}
</table>"""


def _event(ray: RayHistory, event: RayEvent, background: str) -> str:
    lit = event.flux_left_w > 0
    colour = hex_colour(light_colours(np.array([event.rgb]))[0]) if lit else "#ffffff"
    share = event.flux_left_w / ray.flux_w if ray.flux_w > 0 else 0.0
    x, y, z = (f"{value:.4f}" for value in event.position_mm)
    angle = f"{event.incidence_deg:.1f}°" if event.incidence_deg is not None else ""
    cells = [
        (escape(event.text), ""),
        (_breakable(event.place), ""),
        (_breakable(event.surface or ""), ""),
        (_breakable(event.medium or ""), ""),
        (x, "n"),
        (y, "n"),
        (z, "n"),
        (angle, "n"),
        (format_quantity(event.flux_left_w, "W"), "n"),
        *([(format_quantity(event.flux_left_lm, "lm"), "n")] if event.flux_left_lm is not None else []),
        (f"{100 * share:.1f} %", "n"),
    ]
    columns = "".join(
        f'<td class="{name}" align="{"right" if name else "left"}" bgcolor="{background}">{text}</td>'
        for text, name in cells
    )
    swatch = f'<td width="14" bgcolor="{colour}">&nbsp;</td>'
    rows = f'<tr bgcolor="{background}">{swatch}{columns}</tr>'
    for crossing in event.detectors:
        rows += (
            f'\n<tr><td width="14" bgcolor="{colour}">&nbsp;</td><td colspan="{len(cells)}" bgcolor="{background}">'
            f'<font color="{_PALE}">&nbsp;&nbsp;through {escape(format_crossing(crossing))}</font></td></tr>'
        )
    return rows


def _breakable(text: str) -> str:
    """Escaped text in which a long name may be broken."""
    return escape(text).replace("_", "_<wbr>")
