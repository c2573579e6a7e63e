# SPDX-License-Identifier: LGPL-2.1-or-later
"""A portion of a map that is being asked: read column by column, as asked for."""

from __future__ import annotations

import hashlib
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import Bands
from raymaps.errors import MapError
from raymaps.kinds import EventKind
from raymaps.names import Names
from raymaps.store.codes import bits, step_code
from raymaps.store.columns import REMEDY, read_columns
from raymaps.store.identities import Identities
from raymaps.store.lights import Lights
from raymaps.store.signatures import NONE, SignatureTable
from raymaps.store.summary import SUMMARY_FILE, PortionSummary, folder_name

__all__ = ["Portion"]


class Portion:
    """A portion of a map; columns are read when first asked for, kept, and read-only.

    Parameters
    ----------
    folder : Path
    names : Names
    bands : Bands
    summary : PortionSummary
    """

    def __init__(self, folder: Path, names: Names, bands: Bands, summary: PortionSummary):
        self.folder = folder
        self.names = names
        self.bands = bands
        self.summary = summary
        self.first_ray = summary.first_ray
        self.n_rays = summary.n_rays
        self.n_events = summary.n_events
        self.n_crossings = summary.n_crossings

    @classmethod
    def open(cls, folder: Path, names: Names, bands: Bands) -> Portion:
        """Read a portion's summary and see that its files have their sizes; raises `MapError`."""
        try:
            summary = PortionSummary.from_json((folder / SUMMARY_FILE).read_text(encoding="utf-8"))
        except (OSError, ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
            raise MapError(f"Ray Map portion '{folder}' has no sound {SUMMARY_FILE}; {REMEDY}.") from error
        if folder.name != folder_name(summary.first_ray):
            raise MapError(f"Ray Map portion '{folder}' holds the rays from {summary.first_ray} on; {REMEDY}.")
        for name, size in summary.file_bytes.items():
            try:
                found = (folder / name).stat().st_size
            except OSError:
                raise MapError(f"Ray Map file '{folder / name}' is missing; {REMEDY}.") from None
            if found != size:
                raise MapError(f"Ray Map file '{folder / name}' has {found} bytes in place of {size}; {REMEDY}.")
        return cls(folder, names, bands, summary)

    def _read(self, table: str, *names: str) -> dict[str, NDArray[Any]]:
        return read_columns(self.folder / f"{table}.parquet", names or None)

    @cached_property
    def signatures(self) -> SignatureTable:
        """Signatures of this portion."""
        columns = self._read("signatures")
        counts = np.bincount(columns.pop("signature"), minlength=self.summary.n_signatures)
        return SignatureTable(offsets=np.concatenate([[0], np.cumsum(counts)]), **columns)

    @cached_property
    def ray_signature(self) -> NDArray[np.uint32]:
        """Signature of each ray, (n_rays,)."""
        return self._read("rays", "signature")["signature"]

    @cached_property
    def event_offsets(self) -> NDArray[np.int64]:
        """Ray i's events are the rows ``event_offsets[i]`` to ``event_offsets[i + 1] - 1``, (n_rays + 1,)."""
        return np.concatenate([[0], np.cumsum(self.signatures.n_events[self.ray_signature])])

    @cached_property
    def event_step(self) -> NDArray[np.int64]:
        """Row in `signatures` of each event, (n_events,): its kind, face, medium and so on."""
        table = self.signatures
        steps = np.flatnonzero(table.kind != EventKind.CROSSING)  # of all signatures, one after the other
        first = np.concatenate([[0], np.cumsum(table.n_events)])[self.ray_signature]
        within = np.arange(self.n_events) - np.repeat(self.event_offsets[:-1], np.diff(self.event_offsets))
        return steps[np.repeat(first, np.diff(self.event_offsets)) + within]

    @cached_property
    def triangle(self) -> NDArray[np.int32]:
        """Triangle of each event among those of all bodies, (n_events,); -1 none."""
        return self._read("events", "triangle")["triangle"]

    @cached_property
    def position_mm(self) -> NDArray[np.floating]:
        """Place of each event, (n_events, 3)."""
        columns = self._read("events", "x_mm", "y_mm", "z_mm")
        return _read_only(np.stack(list(columns.values()), axis=1))

    @cached_property
    def lights(self) -> Lights:
        """The distinct lights of this portion."""
        if "lights.parquet" not in self.summary.file_bytes:  # version 1: a light for each event
            return Lights.from_columns(self._read("events", "r", "g", "b"), self.bands)
        try:
            return Lights.from_columns(self._read("lights"), self.bands)
        except ValueError as error:
            raise MapError(
                f"Ray Map file '{self.folder / 'lights.parquet'}' is damaged ({error}); {REMEDY}."
            ) from error

    @cached_property
    def event_light(self) -> NDArray[np.uint32]:
        """Row in `lights` of the light after each event, (n_events,)."""
        if "lights.parquet" not in self.summary.file_bytes:
            return _read_only(np.arange(self.n_events, dtype=np.uint32))
        rows = self._read("events", "light")["light"]
        if len(rows) and int(rows.max()) >= len(self.lights.values):
            file = self.folder / "lights.parquet"
            raise MapError(f"Ray Map file '{file}' lacks light that events have; {REMEDY}.")
        return rows

    @cached_property
    def power(self) -> NDArray[np.float64]:
        """Light after each event, all bands together, relative to the ray's emission, (n_events,)."""
        return _read_only(self.lights.power[self.event_light])

    @cached_property
    def light(self) -> NDArray[np.float32]:
        """Light by band after each event relative to the ray's emission, (n_events, n_bands).

        Raises
        ------
        MapError
            If colours were stored in place of spectra.
        """
        spectra = self.lights.spectra
        if spectra is None:
            raise MapError(f"Ray Map portion '{self.folder}' holds colours, not spectra: trace with --store spectral.")
        return _read_only(spectra[self.event_light])

    @cached_property
    def shown_light(self) -> NDArray[np.float32]:
        """Light after each event as it is drawn, (n_events, 3); see `Lights.shown`."""
        return _read_only(self.lights.shown[self.event_light])

    @cached_property
    def ray_wavelength_nm(self) -> NDArray[np.float32]:
        """Wavelength that dispersion narrowed each ray to, (n_rays,); 0 if none."""
        if not self.bands.is_spectral and not self.summary.has_wavelengths:
            return _read_only(np.zeros(self.n_rays, np.float32))
        return self._read("rays", "wavelength_nm")["wavelength_nm"]

    @cached_property
    def _crossings(self) -> dict[str, NDArray[Any]]:
        return self._read("crossings")

    @cached_property
    def crossing_ray(self) -> NDArray[np.int64]:
        """Ray of each crossing, counted within the portion, (n_crossings,)."""
        return _read_only(self._crossings["ray"] - self.first_ray)

    @cached_property
    def crossing_row(self) -> NDArray[np.int64]:
        """Row of the event that starts each crossing segment, (n_crossings,)."""
        return _read_only(self.event_offsets[self.crossing_ray] + self._crossings["event"])

    @property
    def crossing_detector(self) -> NDArray[np.int16]:
        """Detector of each crossing, (n_crossings,)."""
        return self._crossings["detector"]

    @cached_property
    def crossing_xy_mm(self) -> NDArray[np.float32]:
        """Place of each crossing in the detector's axes, (n_crossings, 2)."""
        return _read_only(np.stack([self._crossings["x_mm"], self._crossings["y_mm"]], axis=1))

    @property
    def crossing_angle_rad(self) -> NDArray[np.float32]:
        """Angle of each crossing, 0 head-on at the front to pi head-on from behind, (n_crossings,)."""
        return self._crossings["angle_rad"]

    @cached_property
    def crossing_registered(self) -> NDArray[np.bool_]:
        """Whether the detector's own side and angle accept each crossing, (n_crossings,)."""
        table = self.signatures
        is_crossing = table.kind == EventKind.CROSSING
        per_signature = np.add.reduceat(is_crossing.astype(np.int64), table.offsets[:-1])
        steps = np.flatnonzero(is_crossing)
        first = np.concatenate([[0], np.cumsum(per_signature)])[self.ray_signature]
        start = np.concatenate([[0], np.cumsum(per_signature[self.ray_signature])])[:-1]
        within = np.arange(self.n_crossings) - start[self.crossing_ray]
        return _read_only(table.registered[steps[first[self.crossing_ray] + within]] == 1)

    def damaged_files(self) -> tuple[str, ...]:
        """Names of files whose bytes are not those that were written; all of them are read."""
        return tuple(
            name
            for name, digest in self.summary.file_sha256.items()
            if hashlib.sha256((self.folder / name).read_bytes()).hexdigest() != digest
        )

    def forget(self) -> None:
        """Let go of the columns read so far; they are read again when asked for."""
        for name in [name for name in self.__dict__ if isinstance(getattr(type(self), name, None), cached_property)]:
            del self.__dict__[name]

    def content(self) -> tuple[int, int]:
        """Hash of the portion's rays, computed from what is stored now; compare with ``summary.content``."""
        from raymaps.store.numbering import hash_rays

        table = self.signatures
        step = self.event_step
        kind, face, medium = table.kind[step], table.face[step], table.medium[step]
        source, detector = table.ray_source[self.ray_signature], self.crossing_detector
        if "lights.parquet" in self.summary.file_bytes:
            identities = Identities(self.names)
            sources: NDArray[Any] = identities.of_sources(source)
            events = identities.of_events(kind, face, medium)
            crossings = identities.of_crossings(detector, self.crossing_registered)
        else:  # version 1 hashed indices
            sources = source
            events = step_code(kind, face, medium, np.zeros(self.n_events))
            crossings = step_code(
                np.full(self.n_crossings, EventKind.CROSSING), detector,
                np.full(self.n_crossings, NONE), self.crossing_registered,
            )  # fmt: skip
        low, high = hash_rays(
            self.first_ray, sources, self.event_offsets, events, self.triangle,
            bits(self.position_mm), self.event_light, bits(self.lights.values), bits(self.ray_wavelength_nm),
            self.crossing_row, crossings,
            bits(np.column_stack([self.crossing_xy_mm, self.crossing_angle_rad])),
        )  # fmt: skip
        return int(low), int(high)


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    array.setflags(write=False)
    return array
