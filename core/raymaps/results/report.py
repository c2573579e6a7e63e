# SPDX-License-Identifier: LGPL-2.1-or-later
"""The histories of rays, event by event (paper, section 2: Ray Tracing Report).

Only the rays that are asked for are read, whatever the number of matching ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.criterion import Criterion, QueryResult, query
from raymaps.errors import CriterionError
from raymaps.kinds import ENDINGS, OFF_SURFACE, EventKind
from raymaps.results.incidence import incidence_angles_rad
from raymaps.results.lost import Lost, lost_rays
from raymaps.results.words import describe_event
from raymaps.store.signatures import NONE

if TYPE_CHECKING:
    from raymaps.store import Portion, RayMap

__all__ = ["DetectorCrossing", "RayEvent", "RayHistory", "Report", "ray_histories", "report"]


@dataclass(frozen=True)
class DetectorCrossing:
    """A detector that the segment after an event crosses.

    ``angle_deg`` is the angle between light and normal, 0 head-on, 90 grazing; ``side`` is the side that light came to.
    """

    detector: str
    x_mm: float
    y_mm: float
    angle_deg: float
    side: str
    registered: bool


@dataclass(frozen=True)
class RayEvent:
    """What happened at a point of a ray.

    Attributes
    ----------
    kind, text : str
        The kind's name as in criteria, and in words.
    body, face, surface : str or None
        Where, and with which surface property.
    medium : str or None
        Along the segment that starts here; None where the ray ends.
    position_mm : (x, y, z)
    rgb : (red, green, blue)
        Light after the event as it is drawn, adding up to what is left of the ray's emission.
    flux_left_w : float
        Light after the event in W; of a ray that leaves or is killed, what it takes with it.
    flux_left_lm : float or None
        The same in lm; None of an RGB simulation.
    incidence_deg : float or None
        Angle between the arriving ray and the normal of the surface, 0 to 90; None off a surface.
    detectors : tuple of DetectorCrossing
        On the segment that starts here, in their order.
    """

    kind: str
    text: str
    body: str | None
    face: str | None
    surface: str | None
    medium: str | None
    position_mm: tuple[float, float, float]
    rgb: tuple[float, float, float]
    flux_left_w: float
    flux_left_lm: float | None
    incidence_deg: float | None
    detectors: tuple[DetectorCrossing, ...]

    @property
    def place(self) -> str:
        """``Body.Face``, or nothing."""
        return "" if self.body is None else f"{self.body}.{self.face}"


@dataclass(frozen=True)
class RayHistory:
    """A ray from emission to its end.

    ``flux_w`` is what it was emitted with, ``ended`` is ``absorbed``, ``left`` or ``killed``. ``wavelength_nm`` is the
    one wavelength that it was narrowed to by dispersion, None if it was not.
    """

    ray: int
    source: str
    flux_w: float
    ended: str
    events: tuple[RayEvent, ...]
    wavelength_nm: float | None = None


@dataclass(frozen=True)
class Report:
    """Histories of rays that match a criterion.

    Attributes
    ----------
    map_name : str
    found : QueryResult
        What was asked and how many rays match; ``found.ids`` are the rays that are told.
    rays : tuple of RayHistory
    without : tuple of str
        Effects that were switched off.
    lost : tuple of Lost
        Where the map, whatever was asked, lost rays.
    """

    map_name: str
    found: QueryResult
    rays: tuple[RayHistory, ...]
    without: tuple[str, ...] = ()
    lost: tuple[Lost, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """As the command line and the server print it."""
        return {
            "map": self.map_name,
            "criterion": self.found.criterion,
            "matching": self.found.rays,
            "scanned": self.found.scanned,
            "flux_w": self.found.flux_w,
            "flux_stderr_w": self.found.flux_stderr_w,
            "interval_w": None if self.found.interval_w is None else list(self.found.interval_w),
            "without": list(self.without),
            "lost": [one.to_dict() for one in self.lost],
            "rays": [asdict(ray) for ray in self.rays],
        }

    def to_text(self) -> str:
        """As plain text."""
        from raymaps.results.report_text import report_to_text

        return report_to_text(self)

    def to_csv(self) -> str:
        """As a table with a line an event."""
        from raymaps.results.report_text import report_to_csv

        return report_to_csv(self)

    def to_html(self) -> str:
        """As one HTML page without anything outside it, in the plain HTML that Qt's text browser shows too."""
        from raymaps.results.report_html import report_to_html

        return report_to_html(self)

    def write(self, path: str | Path) -> Path:
        """Write to a ``.html``, ``.csv`` or ``.txt`` file; raises `OutputError`."""
        from raymaps.results.files import check_suffix, write_text

        suffix = check_suffix(path, (".html", ".csv", ".txt"), "A report")
        text = {".html": self.to_html, ".csv": self.to_csv, ".txt": self.to_text}[suffix]()
        return write_text(path, text)


def report(raymap: RayMap, where: Criterion | str | None = None, limit: int = 20) -> Report:
    """Histories of the first rays that match a criterion.

    Parameters
    ----------
    raymap : RayMap
    where : Criterion or str, optional
    limit : int
        How many rays to tell of at most.

    Raises
    ------
    CriterionError
        If the criterion can't be read or names something that the map does not hold.
    """
    if limit < 0:
        raise CriterionError(f"The limit must be 0 or more rays, got {limit}.")
    found = query(raymap, where)  # all of them, for their number and flux
    found = replace(found, ids=found.ids[:limit])
    histories = ray_histories(raymap, found.ids.tolist())
    return Report(Path(raymap.path).name, found, histories, raymap.scene.settings.without, lost_rays(raymap))


def ray_histories(raymap: RayMap, rays: Sequence[int]) -> tuple[RayHistory, ...]:
    """Histories of rays given by their numbers, in that order; raises `CriterionError` for one that is not there."""
    histories: dict[int, RayHistory] = {}
    wanted = sorted(set(rays))
    for portion in raymap.portions:
        first, end = np.searchsorted(wanted, (portion.first_ray, portion.first_ray + portion.n_rays))
        if first < end:
            histories.update(_of_portion(raymap, portion, np.array(wanted[first:end]) - portion.first_ray))
    for ray in rays:
        if ray not in histories:
            raise CriterionError(f"Ray {ray} is not in the map, which holds {raymap.n_rays} rays.")
    return tuple(histories[ray] for ray in rays)


def _of_portion(raymap: RayMap, portion: Portion, rays: NDArray[np.int64]) -> dict[int, RayHistory]:
    crossing_start = np.searchsorted(portion.crossing_ray, rays)
    crossing_end = np.searchsorted(portion.crossing_ray, rays, side="right")
    histories = {}
    for ray, *crossings in zip(rays.tolist(), crossing_start.tolist(), crossing_end.tolist(), strict=True):
        history = _history(raymap, portion, ray, range(*crossings))
        histories[history.ray] = history
    return histories


def _history(raymap: RayMap, portion: Portion, ray: int, crossings: range) -> RayHistory:
    table, names = portion.signatures, raymap.names
    signature = int(portion.ray_signature[ray])
    steps = np.arange(table.offsets[signature], table.offsets[signature + 1])
    steps = steps[table.kind[steps] != EventKind.CROSSING]
    rows = slice(int(portion.event_offsets[ray]), int(portion.event_offsets[ray + 1]))
    source = int(table.source[steps[0]])
    flux_w = float(raymap.ray_flux_w[source])
    positions_mm, light = portion.position_mm[rows].astype(np.float64), portion.shown_light[rows].astype(np.float64)
    power = portion.power[rows]
    lumen_per_w = portion.lights.lumen_per_w
    lumens = None if lumen_per_w is None else flux_w * lumen_per_w[portion.event_light[rows]]
    wavelength_nm = float(portion.ray_wavelength_nm[ray])
    angles_rad = incidence_angles_rad(raymap, positions_mm, portion.triangle[rows])
    crossed = [_crossings(raymap, portion, crossings, row) for row in range(rows.start, rows.stop)]
    events = []
    for i, step in enumerate(steps):
        kind = EventKind(table.kind[step])
        face = NONE if kind in OFF_SURFACE else int(table.face[step])
        before = _name(names.media, int(table.medium[steps[i - 1]])) if i else None
        after = _name(names.media, int(table.medium[step])) if i + 1 < len(steps) else None
        on_surface = face != NONE and kind is not EventKind.EMISSION
        events.append(
            RayEvent(
                kind=kind.label,
                text=describe_event(kind, before, after) + (f" by {names.sources[source]}" if not i else ""),
                body=names.bodies[names.faces[face][0]] if face != NONE else None,
                face=names.faces[face][1] if face != NONE else None,
                surface=_name(names.surfaces, int(table.surface[step])) if face != NONE else None,
                medium=after,
                position_mm=_three(positions_mm[i]),
                rgb=_three(light[i]),
                flux_left_w=flux_w * float(power[i]),
                flux_left_lm=None if lumens is None else float(lumens[i]),
                incidence_deg=_degrees(angles_rad[i]) if on_surface else None,
                detectors=crossed[i],
            )
        )
    ended = next(word for word, kinds in ENDINGS.items() if EventKind(table.kind[steps[-1]]) in kinds)
    narrowed_nm = wavelength_nm if wavelength_nm > 0 else None
    return RayHistory(portion.first_ray + ray, names.sources[source], flux_w, ended, tuple(events), narrowed_nm)


def _crossings(raymap: RayMap, portion: Portion, crossings: range, row: int) -> tuple[DetectorCrossing, ...]:
    """Crossings of the segment that starts at the event in a row."""
    found = []
    for crossing in crossings:
        if portion.crossing_row[crossing] != row:
            continue
        angle_deg = math.degrees(float(portion.crossing_angle_rad[crossing]))
        front = angle_deg < 90
        x_mm, y_mm = portion.crossing_xy_mm[crossing].tolist()
        found.append(
            DetectorCrossing(
                raymap.names.detectors[portion.crossing_detector[crossing]],
                x_mm,
                y_mm,
                angle_deg if front else 180 - angle_deg,
                "front" if front else "back",
                bool(portion.crossing_registered[crossing]),
            )
        )
    return tuple(found)


def _name(names: tuple[str, ...], index: int) -> str | None:
    return names[index] if index != NONE else None


def _three(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def _degrees(angle_rad: float) -> float | None:
    return None if math.isnan(angle_rad) else math.degrees(angle_rad)
