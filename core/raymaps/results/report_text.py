# SPDX-License-Identifier: LGPL-2.1-or-later
"""A report as plain text and as a table."""

from __future__ import annotations

import csv
import io

from raymaps.results.lost import lost_words
from raymaps.results.report import DetectorCrossing, RayEvent, RayHistory, Report
from raymaps.units import format_estimate, format_quantity

__all__ = ["format_crossing", "report_to_csv", "report_to_text", "summary_lines", "wavelength_words"]


def summary_lines(report: Report) -> list[tuple[str, str]]:
    """What was asked and found, as pairs of a word and a value."""
    found = report.found
    shown = len(report.rays)
    told = "all of them" if shown == found.rays else f"the first {shown}"
    lines = [
        ("map", report.map_name),
        ("criterion", found.criterion),
        ("matching", f"{found.rays} of {found.scanned} rays, told here: {told}"),
    ]
    if found.flux_w is not None and found.flux_stderr_w is not None and found.interval_w is not None:
        lines.append(("flux", format_estimate(found.flux_w, found.flux_stderr_w, found.interval_w)))
    if report.without:
        lines.append(("without", f"{', '.join(report.without)} (switched off)"))
    if report.lost:
        most = report.lost[0]
        lines.append(("lost", f"{lost_words(report.lost)} in the map; most rays at {most.place}: {most.criterion}"))
    return lines


def wavelength_words(ray: RayHistory) -> str:
    """The wavelength of a ray that was narrowed to one, for people; nothing of others."""
    return "" if ray.wavelength_nm is None else f"{ray.wavelength_nm:.5g} nm"


def format_crossing(crossing: DetectorCrossing) -> str:
    """A detector crossing for people."""
    text = f"{crossing.detector} at ({crossing.x_mm:.4g}, {crossing.y_mm:.4g}) mm, {crossing.angle_deg:.1f}°"
    return text if crossing.registered else f"{text} from the {crossing.side}, not registered"


def report_to_text(report: Report) -> str:
    """Plain text, a line an event."""
    lines = [f"{word:<10} {value}" for word, value in summary_lines(report)]
    for ray in report.rays:
        told = [f"Ray {ray.ray} of {ray.source}", format_quantity(ray.flux_w, "W"), wavelength_words(ray), ray.ended]
        lines += ["", ", ".join(filter(None, told))]
        width = max(len(event.text) for event in ray.events)
        place_width = max(len(_where(event)) for event in ray.events)
        for event in ray.events:
            position = "".join(f"{value:>11.4f}" for value in event.position_mm)
            angle = f"{event.incidence_deg:6.1f}°" if event.incidence_deg is not None else " " * 7
            lines.append(
                f"  {event.text:<{width}}  {_where(event):<{place_width}} {position} mm {angle}"
                f"  {format_quantity(event.flux_left_w, 'W'):>10}{_lumens(event)}"
                f"{'  in ' + event.medium if event.medium else ''}"
            )
            lines += [f"    through {format_crossing(crossing)}" for crossing in event.detectors]
    return "\n".join(lines) + "\n"


def _lumens(event: RayEvent) -> str:
    return "" if event.flux_left_lm is None else f" {format_quantity(event.flux_left_lm, 'lm'):>11}"


def _where(event: RayEvent) -> str:
    return f"{event.place} ({event.surface})" if event.body is not None else ""


_COLUMNS = (
    "ray", "source", "event", "kind", "text", "body", "face", "surface", "medium", "x_mm", "y_mm", "z_mm",
    "incidence_deg", "red_w", "green_w", "blue_w", "flux_left_w", "detectors",
)  # fmt: skip
#: Columns of a spectral simulation besides.
_SPECTRAL_COLUMNS = ("flux_left_lm", "wavelength_nm")


def report_to_csv(report: Report) -> str:
    """A table with a line an event; what was asked and found stands above it as comments (``# word: value``)."""
    text = io.StringIO()
    for word, value in summary_lines(report):
        text.write(f"# {word}: {value}\r\n")
    table = csv.writer(text)
    spectral = any(event.flux_left_lm is not None for ray in report.rays for event in ray.events)
    table.writerow((*_COLUMNS, *(_SPECTRAL_COLUMNS if spectral else ())))
    for ray in report.rays:
        for number, event in enumerate(ray.events):
            more = [event.flux_left_lm, ray.wavelength_nm] if spectral else []
            table.writerow([*_csv_row(ray, number, event), *more])
    return text.getvalue()


def _csv_row(ray: RayHistory, number: int, event: RayEvent) -> list[object]:
    return [
        ray.ray, ray.source, number, event.kind, event.text, event.body, event.face, event.surface, event.medium,
        *event.position_mm, event.incidence_deg, *(ray.flux_w * band for band in event.rgb), event.flux_left_w,
        "; ".join(format_crossing(crossing) for crossing in event.detectors),
    ]  # fmt: skip
