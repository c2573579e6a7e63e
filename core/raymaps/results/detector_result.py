# SPDX-License-Identifier: LGPL-2.1-or-later
"""What evaluations of detectors of every kind have in common: their figures by name, as JSON and for people."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raymaps.results.cells import Sums
from raymaps.results.figures import Asked, Figures, Spectrum, Statistic, named, spectrum_of
from raymaps.units import format_estimate, format_with_error

if TYPE_CHECKING:
    from raymaps.store import RayMap

__all__ = ["OVER_AREA", "OVER_SOLID_ANGLE", "AreaResult", "DetectorResult", "Units", "cell_rgb_w", "common_fields"]

Float = NDArray[np.float64]


class Units(NamedTuple):
    """In what means and extremes of a detector are told.

    ``radiant`` and ``luminous`` end the names of its figures and the keys of JSON; ``unit`` and ``per`` stand around a
    radiant figure for people; ``scale`` is the luminous unit in lumens over what cells measure.
    """

    radiant: str
    luminous: str
    unit: str
    per: str
    scale: float


#: Irradiance and illuminance; lx are lm/m², areas are in mm².
OVER_AREA = Units("w_per_mm2", "lx", "W", " per mm²", 1e6)
#: Intensity.
OVER_SOLID_ANGLE = Units("w_per_sr", "cd", "W/sr", "", 1.0)

#: Figures over what cells measure: their names, and those of `Figures`.
_DENSITIES = {"mean": "mean", "min": "least", "max": "most"}


@dataclass(frozen=True, kw_only=True)
class DetectorResult:
    """What was asked of a detector, and how much light counted.

    Attributes
    ----------
    detector : str
    max_angle_deg : float
        Largest angle that counts: acceptance angle of a rectangle, angle of incidence on faces, gamma of a far field.
    source, criterion : str or None
        Which rays count.
    rays, crossings : int
        Rays that count, and how often.
    flux_w : Statistic
    interval_w : (low, high)
        Limits that contain the true flux with 95 % confidence; see `raymaps.criterion.interval`.
    flux_lm : Statistic or None
        None of an RGB simulation, which knows no lumens.
    interval_lm : (low, high) or None
    spectrum : Spectrum or None
        The light by band, where spectra were stored.
    without : tuple of str
        Effects that were switched off.
    """

    units: ClassVar[Units]

    detector: str
    max_angle_deg: float
    source: str | None
    criterion: str | None
    rays: int
    crossings: int
    flux_w: Statistic
    interval_w: tuple[float, float]
    flux_lm: Statistic | None = None
    interval_lm: tuple[float, float] | None = None
    spectrum: Spectrum | None = field(default=None, repr=False)
    without: tuple[str, ...] = ()

    def densities(self, unit: str) -> dict[str, Statistic]:
        """Mean, min and max in a unit such as ``w_per_mm2`` or ``lx``."""
        return {name: getattr(self, f"{name}_{unit}") for name in _DENSITIES}

    def asked_keys(self) -> dict[str, Any]:
        """Which light was asked for, for JSON."""
        return {"max_angle_deg": self.max_angle_deg, "source": self.source, "criterion": self.criterion}

    def radiant_keys(self) -> dict[str, Any]:
        """Rays and figures in W, for JSON."""
        data = {"rays": self.rays, "crossings": self.crossings, **named(self.flux_w, "flux", "w")}
        data["interval_w"] = list(self.interval_w)
        for name, figure in self.densities(self.units.radiant).items():
            data |= named(figure, name, self.units.radiant)
        return data

    def further_keys(self) -> dict[str, Any]:
        """Figures in lm, spectrum, and what was switched off, for JSON; each only if there is one."""
        data: dict[str, Any] = {}
        if self.flux_lm is not None:
            data |= named(self.flux_lm, "flux", "lm")
            data["interval_lm"] = None if self.interval_lm is None else list(self.interval_lm)
            for name, figure in self.densities(self.units.luminous).items():
                data |= named(figure, name, self.units.luminous)
        if self.spectrum is not None:
            data["spectrum"] = self.spectrum.to_dict()
        if self.without:
            data["without"] = list(self.without)
        return data

    def conditions(self) -> list[str]:
        """Which rays count, in words."""
        told = [f"from {self.source}"] if self.source is not None else []
        return told + ([f"where {self.criterion}"] if self.criterion is not None else [])

    def flux_row(self) -> tuple[str, str]:
        """The flux, for people."""
        text = format_estimate(self.flux_w.value, self.flux_w.stderr, self.interval_w)
        if self.flux_lm is None or self.interval_lm is None:
            return "flux", text
        return "flux", f"{text}, {format_estimate(self.flux_lm.value, self.flux_lm.stderr, self.interval_lm, 'lm')}"

    def density_rows(self) -> list[tuple[str, str]]:
        """Mean and extremes, for people."""
        units, radiant = self.units, self.densities(self.units.radiant)
        luminous = self.densities(units.luminous)
        return [
            (name, _with_lumens(figure, units.unit, units.per, luminous[name], units.luminous))
            for name, figure in radiant.items()
        ]

    def as_text(self, title: list[str], rows: list[tuple[str, str]]) -> str:
        """The parts of a title, and rows, a line each; then what was switched off."""
        rows = rows + ([("without", ", ".join(self.without))] if self.without else [])
        return "\n".join([", ".join(title), *(f"  {name:<12}{text}" for name, text in rows)])


@dataclass(frozen=True, kw_only=True)
class AreaResult(DetectorResult):
    """Light on an area that is divided into cells.

    Attributes
    ----------
    area_mm2 : float
        Area that counts.
    mean_w_per_mm2, min_w_per_mm2, max_w_per_mm2 : Statistic
        Irradiance: flux over the area, and in its darkest and brightest part.
    uniformity : Statistic or None
        Minimum over mean; None where no light arrived.
    cell_flux_w, cell_stderr_w : (cells) float64
        Flux in each cell and its standard error.
    cell_flux_rgb_w : (cells, 3) float64
        Red, green and blue; of a spectral simulation linear sRGB, whose luminance is in units of 683 lm.
    mean_lx, min_lx, max_lx : Statistic or None
        Illuminance, as of the radiant ones; None of an RGB simulation.
    cell_flux_lm, cell_stderr_lm : (cells) float64 or None
    """

    units = OVER_AREA

    area_mm2: float
    mean_w_per_mm2: Statistic
    min_w_per_mm2: Statistic
    max_w_per_mm2: Statistic
    uniformity: Statistic | None
    cell_flux_w: Float = field(repr=False)
    cell_stderr_w: Float = field(repr=False)
    cell_flux_rgb_w: Float = field(repr=False)
    mean_lx: Statistic | None = None
    min_lx: Statistic | None = None
    max_lx: Statistic | None = None
    cell_flux_lm: Float | None = field(default=None, repr=False)
    cell_stderr_lm: Float | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        self.cell_flux_rgb_w.setflags(write=False)

    def radiant_keys(self) -> dict[str, Any]:
        """Area, rays and figures in W with the uniformity, for JSON."""
        value, stderr = (self.uniformity.value, self.uniformity.stderr) if self.uniformity else (None, None)
        figures = super().radiant_keys()
        return {"area_mm2": self.area_mm2, **figures, "uniformity": value, "uniformity_stderr": stderr}

    def density_rows(self) -> list[tuple[str, str]]:
        """Mean, extremes and uniformity, for people."""
        rows, least = super().density_rows(), self.uniformity
        return rows + ([("uniformity", f"{least.value:.4g} ± {least.stderr:.2g} (min / mean)")] if least else [])


def common_fields(
    units: Units, raymap: RayMap, asked: Asked, sums: Sums, watts: Figures, lumens: Figures | None
) -> dict[str, Any]:
    """Fields of a result that follow alike for every kind of detector: conditions, counts and figures."""
    fields: dict[str, Any] = {
        "source": asked.source,
        "criterion": asked.criterion,
        "rays": sums.n_rays,
        "crossings": sums.n_samples,
        "flux_w": watts.flux,
        "interval_w": watts.interval,
        "spectrum": spectrum_of(raymap, asked, sums),
        "without": raymap.scene.settings.without,
    }
    fields |= {f"{name}_{units.radiant}": getattr(watts, of) for name, of in _DENSITIES.items()}
    if lumens is not None:
        fields["flux_lm"], fields["interval_lm"] = lumens.flux, lumens.interval
        for name, of in _DENSITIES.items():
            fields[f"{name}_{units.luminous}"] = getattr(lumens, of).scaled(units.scale)
    return fields


def cell_rgb_w(raymap: RayMap, sums: Sums, division: int) -> Float:
    """Red, green and blue in each cell, (n_cells, 3)."""
    ray_flux_w = raymap.source_flux_w / np.maximum(raymap.rays_of_source, 1)
    return np.asarray(np.einsum("s,scb->cb", ray_flux_w, sums.cells[division].cell_light[:, :, 2:]))


def _with_lumens(figure: Statistic, unit: str, per: str, other: Statistic | None, other_unit: str) -> str:
    """A radiometric figure for people, and behind it the photometric one if there is one."""
    text = f"{format_with_error(figure.value, figure.stderr, unit)}{per}"
    return text if other is None else f"{text}, {format_with_error(other.value, other.stderr, other_unit)}"
